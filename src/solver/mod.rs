//! How bodies move: the solvers and what they share.

mod kick;
mod stability;
mod verlet;

pub(crate) use stability::Stability;
pub(crate) use verlet::{Outcome, StepRequest, attempt};
