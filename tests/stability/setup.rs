//! What a case is tried with, and how it can end.

use sinew::{Solver, Storage};

pub use crate::support::scene::{SOLVERS, STORAGES};

/// s; a frame of a second is a legal request.
pub const STEPS: [f32; 6] = [1e-5, 1e-4, 1e-3, 1.0 / 60.0, 0.1, 1.0];

/// How much of a case is tried.
#[allow(dead_code, reason = "each program takes one")]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tier {
    /// In `cargo test`: fewer steps, and of the storages one for each step.
    Quick,
    /// All of it, in the bench.
    Full,
}

/// What a case is tried with. Whatever it does is done with one thread and with two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setup {
    pub solver: Solver,
    pub storage: Storage,
    /// s
    pub step: f32,
    pub tier: Tier,
}

impl Setup {
    /// So many steps as `duration` seconds take, within bounds.
    pub fn steps(&self, duration: f64, least: usize, most: usize) -> usize {
        ((duration / f64::from(self.step)).ceil() as usize).clamp(least, most)
    }

    /// One of two numbers, by the tier.
    pub fn pick(&self, quick: usize, full: usize) -> usize {
        match self.tier {
            Tier::Quick => quick,
            Tier::Full => full,
        }
    }
}

/// Why a case ended before its end.
#[derive(Clone, Debug, PartialEq)]
pub enum Stop {
    /// The solver is not there yet.
    Unsupported(String),
    /// A step was refused, with nothing changed and for a reason.
    Refused(String),
    /// A figure is larger than it may be.
    Exceeds { what: String, figure: f64, bound: f64 },
    /// Something else is not as it should be.
    Fault(String),
}

/// What a passed case measured, or why it ended.
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

/// Whether a figure is at most what it may be; what is not a number is not.
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
