//! The C interface: a thin room in front of the Rust one, where a caller's pointers are checked.
//!
//! `include/sinew.h` is generated from here. Every function checks its pointers, catches what might panic, and writes
//! its outputs only when it answers [`SINEW_STATUS_OK`](status::SINEW_STATUS_OK).
//!
#![doc = include_str!("functions.md")]
#![allow(unsafe_code)]
#![allow(non_camel_case_types)]

mod memory;

// The order of the header.
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

pub mod material;

pub mod rest_state;

pub mod tool;

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
