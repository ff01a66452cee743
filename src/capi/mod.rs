//! The C interface: a thin room in front of the Rust one, where a caller's pointers are checked.
//!
//! The headers of `include/` are generated from here. Every function checks its pointers, catches what might panic, and writes
//! its outputs only when it answers [`SINEW_STATUS_OK`](status::SINEW_STATUS_OK).
//!
//! # Safety
//!
//! The contract of every function: a pointer is NULL or as its comment says, a struct has the size and arrays that it
//! states, and a callback keeps its word. Until the call returns nobody changes what is behind `*const`, and nobody
//! else uses what is behind `*mut`. What a call writes overlaps nothing else that it is given. What has been destroyed
//! is not used any more.
//!
#![doc = include_str!("functions.md")]
#![allow(unsafe_code)]
#![allow(non_camel_case_types)]
// One contract for all, above: a body that hands its pointers on relies on that, and would say so in each function.
#![allow(clippy::missing_safety_doc, unsafe_op_in_unsafe_fn)]

mod body_definition;
mod id;
mod memory;
mod overlaps;

// The order of functions.md. Units in brackets are no links.
#[allow(rustdoc::broken_intra_doc_links)]
pub mod status;

#[allow(rustdoc::broken_intra_doc_links)]
mod guard;

#[allow(rustdoc::broken_intra_doc_links)]
pub mod world;

#[allow(rustdoc::broken_intra_doc_links)]
pub mod definition;

#[allow(rustdoc::broken_intra_doc_links)]
pub mod body;

#[allow(rustdoc::broken_intra_doc_links)]
pub mod springs;

#[allow(rustdoc::broken_intra_doc_links)]
pub mod cut;

#[allow(rustdoc::broken_intra_doc_links)]
pub mod tear;

#[allow(rustdoc::broken_intra_doc_links)]
pub mod strain;

#[allow(rustdoc::broken_intra_doc_links)]
pub mod sleep;

#[allow(rustdoc::broken_intra_doc_links)]
pub mod report;

#[allow(rustdoc::broken_intra_doc_links)]
pub mod limit;

#[allow(rustdoc::broken_intra_doc_links)]
pub mod material;

#[allow(rustdoc::broken_intra_doc_links)]
pub mod rest_state;

#[allow(rustdoc::broken_intra_doc_links)]
pub mod tool;

#[allow(rustdoc::broken_intra_doc_links)]
pub mod dynamic;

#[allow(rustdoc::broken_intra_doc_links)]
pub mod contact;

#[allow(rustdoc::broken_intra_doc_links)]
pub mod attachment;

#[allow(rustdoc::broken_intra_doc_links)]
pub mod suture;

#[allow(rustdoc::broken_intra_doc_links)]
pub mod blade;

#[allow(rustdoc::broken_intra_doc_links)]
pub mod haptic;

#[allow(rustdoc::broken_intra_doc_links)]
pub mod mesh;

#[allow(rustdoc::broken_intra_doc_links)]
pub mod picture;

#[allow(rustdoc::broken_intra_doc_links)]
pub mod query;

#[allow(rustdoc::broken_intra_doc_links)]
pub mod reader;

#[allow(rustdoc::broken_intra_doc_links)]
pub mod detector;

#[allow(rustdoc::broken_intra_doc_links)]
pub mod embedding;

#[allow(rustdoc::broken_intra_doc_links)]
pub mod snapshot;

mod placed;

#[allow(rustdoc::broken_intra_doc_links)]
pub mod whole;

#[allow(rustdoc::broken_intra_doc_links)]
pub mod several;

#[allow(rustdoc::broken_intra_doc_links)]
pub mod getters;

#[allow(rustdoc::broken_intra_doc_links)]
pub mod profile;

#[allow(rustdoc::broken_intra_doc_links)]
pub mod debug_draw;

#[allow(rustdoc::broken_intra_doc_links)]
pub mod recording;

#[allow(rustdoc::broken_intra_doc_links)]
pub mod log;

#[allow(rustdoc::broken_intra_doc_links)]
pub mod allocator;

#[allow(rustdoc::broken_intra_doc_links)]
pub mod settings;

#[allow(rustdoc::broken_intra_doc_links)]
pub mod budget;
