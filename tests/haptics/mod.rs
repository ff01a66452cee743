//! Haptic handles: the force on a hand while a world steps concurrently.
#![allow(clippy::unwrap_used)]

mod bench;
mod continuity;
mod doors;
mod energy;
mod force;
mod threads;
mod turns;
