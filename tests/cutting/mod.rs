//! Cuts: surfaces fall apart where the blade went.
#![allow(clippy::unwrap_used)]

mod sheet;

mod bounds;
mod curved;
mod enclosed;
mod motion;
mod organs;
mod random;
mod refused;
mod shapes;
mod springs_alone;
mod tearing;
mod terms;
mod touch;
mod wild;
mod wounds;
