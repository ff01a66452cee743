//! Diagnostics of a world: the time of each stage of a step, and drawings of contacts, springs and pins.

mod draw;
mod profile;
