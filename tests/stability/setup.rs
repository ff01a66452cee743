//! The parameters of a case, and its possible outcomes.

use sinew::{Solver, Storage};

pub use crate::support::scene::{SOLVERS, STORAGES};

/// s; a frame of a second is a legal request.
pub const STEPS: [f32; 6] = [1e-5, 1e-4, 1e-3, 1.0 / 60.0, 0.1, 1.0];

/// The extent of a run.
#[allow(dead_code, reason = "each program takes one")]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tier {
    /// In `cargo test`: fewer steps, and one storage for each step.
    Quick,
    /// Everything, in the bench.
    Full,
}

/// The parameters of a case. Each case runs with one thread and with two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setup {
    pub solver: Solver,
    pub storage: Storage,
    /// s
    pub step: f32,
    pub tier: Tier,
}

impl Setup {
    /// Returns the number of steps in `duration` seconds, within bounds.
    pub fn steps(&self, duration: f64, least: usize, most: usize) -> usize {
        ((duration / f64::from(self.step)).ceil() as usize).clamp(least, most)
    }

    /// Returns one of two numbers, by tier.
    pub fn pick(&self, quick: usize, full: usize) -> usize {
        match self.tier {
            Tier::Quick => quick,
            Tier::Full => full,
        }
    }
}

/// The reason why a case stopped early.
#[derive(Clone, Debug, PartialEq)]
pub enum Stop {
    /// The solver is not available yet.
    Unsupported(String),
    /// A step was refused, without changes and with a reason.
    Refused(String),
    /// A value exceeds its bound.
    Exceeds { what: String, figure: f64, bound: f64 },
    /// Another check failed.
    Fault(String),
}

/// The measurements of a passed case, or the reason for its failure.
pub type Outcome = Result<String, Stop>;

/// A line of the table.
#[derive(Clone, Copy)]
pub struct Case {
    pub name: &'static str,
    pub run: fn(&Setup) -> Outcome,
}

pub fn fault<T>(what: impl Into<String>) -> Result<T, Stop> {
    Err(Stop::Fault(what.into()))
}

/// Checks that a value is at most its bound; NaN fails.
pub fn at_most(what: &str, figure: f64, bound: f64) -> Result<(), Stop> {
    if figure <= bound {
        return Ok(());
    }
    Err(Stop::Exceeds {
        what: what.into(),
        figure,
        bound,
    })
}
