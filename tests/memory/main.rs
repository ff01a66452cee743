//! The library's memory requests, and calls that run out of memory, with an allocator that counts and refuses.
#![allow(unsafe_code)]

#[path = "../support/mod.rs"]
mod support;

mod allocation;
mod allocator;
mod attach_groups;
mod cutting;
mod out_of_memory;
mod solver;

#[global_allocator]
static ALLOCATOR: allocator::Watched = allocator::Watched;
