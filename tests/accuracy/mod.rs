//! Elastic scenes with known solutions, each with the same mesh in `f64`.

#![allow(dead_code, reason = "the tests and the bench take a part of it each")]

pub mod cantilever;
pub mod envelope;
pub mod hertz;
pub mod press;
pub mod solid;
