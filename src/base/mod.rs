//! What every other module stands on: errors, memory that may run out, a hash of state, exact signs, times of stages.

mod error;
mod hash;
pub(crate) mod memory;
mod profile;
mod ranges;
pub(crate) mod symbolic_perturbation;

pub use error::{Error, Result};
pub(crate) use hash::StateHasher;
pub(crate) use profile::{Count, Profile, Stage, Stopwatch, check_clock};
pub(crate) use ranges::{above_zero, finite, not_negative};
