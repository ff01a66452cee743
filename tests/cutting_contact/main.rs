//! What is cut meets itself and other tissue.
#![allow(clippy::unwrap_used)]

#[path = "../support/mod.rs"]
mod support;

mod meetings;
mod scene;
mod wounds;
