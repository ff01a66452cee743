//! Cuts through tetrahedral solids.
#![allow(clippy::unwrap_used)]

mod blade;
mod block;
mod motion;
mod random;
mod refused;
mod shapes;
