//! Cuts through tetrahedral solids.
#![allow(clippy::unwrap_used)]

mod blade;
mod block;
mod hollow;
mod motion;
mod organs;
mod random;
mod refused;
mod rings;
mod shapes;
mod stable;
mod strokes;
mod sutures;
mod tearing;
mod toughness;
