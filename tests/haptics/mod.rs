//! Haptic handles: what a hand feels of a world that steps beside it.
#![allow(clippy::unwrap_used)]

mod bench;
mod continuity;
mod doors;
mod energy;
mod force;
mod threads;
mod turns;
