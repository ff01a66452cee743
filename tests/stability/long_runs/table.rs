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
    /// Of nodes, 1/s.
    pub damping: f32,
    /// s
    pub step: f32,
}

impl Row {
    /// Runs it for so many simulated seconds, and processor time at the most, s; `watch` is shown how it goes.
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

/// s
pub const FRAME: f32 = 1.0 / 60.0;

/// What a body is made of.
pub const fn matter(shape: Shape, law: Law, extra: Extra) -> Matter {
    Matter { shape, law, extra }
}

/// Undamped.
pub fn row(matter: Matter, activity: Activity, solver: Solver, step: f32) -> Row {
    Row {
        matter,
        activity,
        solver,
        damping: 0.0,
        step,
    }
}
