//! Integration tests of the Rust API: one program for all tests that need neither an allocator nor a process of their
//! own.

mod support;

mod contact;
mod cutting;
mod cutting_contact;
mod cutting_solids;
mod debug;
mod haptics;
mod material;
mod mesh;
mod snapshots;
mod solver;
mod stability;
#[path = "stability/quick.rs"]
mod stability_quick;
mod world;
