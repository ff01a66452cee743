//! What is cut meets itself and other tissue.
#![allow(clippy::unwrap_used)]

mod blade;
mod blade_meets;
mod meetings;
mod scene;
mod wounds;
