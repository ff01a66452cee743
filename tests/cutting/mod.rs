//! Cuts: surfaces separate along the path of the blade.
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
