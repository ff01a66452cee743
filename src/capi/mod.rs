//! The C interface: a thin room in front of the Rust one, where a caller's pointers are checked.
//!
//! The headers of `include/` are generated from here. Every function checks its pointers, catches what might panic, and
//! writes its outputs only when it answers [`SINEW_STATUS_OK`](status::SINEW_STATUS_OK).
//!
//! # Safety
//!
//! The contract of every function: a pointer is NULL or as its comment says, a struct has the size and arrays that it
//! states, and a callback keeps its word. Until the call returns nobody changes what is behind `*const`, and nobody
//! else uses what is behind `*mut`. What a call writes overlaps nothing else that it is given. What has been destroyed
//! is not used any more.
//!
//! [`functions`] lists every function beside its counterpart in Rust.

#![allow(unsafe_code)]
#![allow(non_camel_case_types)]
// One contract for all, above: a body that hands its pointers on relies on that, and would say so in each function.
#![allow(clippy::missing_safety_doc, unsafe_op_in_unsafe_fn)]
// Units in brackets are no links.
#![allow(rustdoc::broken_intra_doc_links)]

mod body_definition;
mod id;
mod memory;
mod overlaps;

// The links of the list are checked.
#[warn(rustdoc::broken_intra_doc_links)]
#[doc = include_str!("functions.md")]
pub mod functions {}

// The order of functions.md.
pub mod status;

mod guard;

pub mod world;

pub mod definition;

pub mod body;

pub mod springs;

pub mod cut;

pub mod tear;

pub mod strain;

pub mod sleep;

pub mod report;

pub mod limit;

pub mod material;

pub mod rest_state;

pub mod tool;

pub mod dynamic;

pub mod contact;

pub mod attachment;

pub mod suture;

pub mod blade;

pub mod haptic;

pub mod mesh;

pub mod picture;

pub mod query;

pub mod reader;

pub mod detector;

pub mod embedding;

pub mod snapshot;

mod placed;

pub mod whole;

pub mod several;

pub mod getters;

pub mod profile;

pub mod debug_draw;

pub mod recording;

pub mod log;

pub mod allocator;

pub mod settings;

pub mod budget;
