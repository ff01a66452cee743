//! A row of the table.

use std::fmt;

use sinew::Solver;

use super::activity::Activity;
use super::figures::{Figures, Outcome};
use super::run::{Length, run};
use super::subject::{Extra, Law, Matter, Shape};

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    pub matter: Matter,
    pub activity: Activity,
    pub solver: Solver,
    /// Node damping, 1/s.
    pub damping: f32,
    /// Step, s.
    pub step: f32,
}

impl Row {
    /// Runs the row for a simulated time, limited by processor time (both in s); `watch` gets the figures after each
    /// check.
    pub fn run(&self, simulated: f64, processor: f64, watch: &mut dyn FnMut(&Figures)) -> Outcome {
        run(self, &Length { simulated, processor }, watch)
    }
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let activity = format!("{:?}", self.activity).to_lowercase();
        let solver = format!("{:?}", self.solver).to_uppercase();
        let damped = if self.damping > 0.0 { "damped" } else { "undamped" };
        let rate = (1.0 / self.step).round();
        write!(f, "{}, {activity}, {solver}, {damped}, 1/{rate} s", self.matter)
    }
}

/// The step of a program at 60 Hz, s.
pub const FRAME: f32 = 1.0 / 60.0;

/// Node damping of damped rows, 1/s.
pub const DAMPING: f32 = 0.3;

/// Shorthand for tables.
pub const fn matter(shape: Shape, law: Law, extra: Extra) -> Matter {
    Matter { shape, law, extra }
}

/// An undamped row.
pub fn row(matter: Matter, activity: Activity, solver: Solver, step: f32) -> Row {
    Row {
        matter,
        activity,
        solver,
        damping: 0.0,
        step,
    }
}
