//! The rows of the table.

use std::fmt;

use sinew::Solver;

use super::run::{Outcome, run};
use super::subject::{Law, Shape};

#[derive(Clone, Copy, Debug)]
pub struct Row {
    pub shape: Shape,
    pub law: Law,
    pub solver: Solver,
    /// Of nodes, 1/s.
    pub damping: f32,
    /// s
    pub step: f32,
}

impl Row {
    pub fn run(&self, seconds: f64) -> Outcome {
        run(self, seconds)
    }
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:?}, {:?}, {:?}, damping {}/s, 1/{:.0} s",
            self.shape,
            self.law,
            self.solver,
            self.damping,
            1.0 / self.step
        )
    }
}

const BODIES: [(Shape, Law); 5] = [
    (Shape::Organ, Law::Young),
    (Shape::Organ, Law::Elements(0.3)),
    (Shape::Organ, Law::Elements(0.45)),
    (Shape::Cloth, Law::Springs(20.0)),
    (Shape::Cloth, Law::Young),
];

/// Every row.
pub fn full() -> Vec<Row> {
    let mut rows = Vec::new();
    for (shape, law) in BODIES {
        for solver in [Solver::Verlet, Solver::Implicit] {
            for step in [1.0 / 60.0, 1.0 / 30.0, 1.0 / 120.0, 1e-3] {
                rows.push(Row {
                    shape,
                    law,
                    solver,
                    damping: 0.0,
                    step,
                });
            }
        }
    }
    rows
}

/// Rows that `cargo test` takes, and for how many seconds.
pub fn quick() -> Vec<(Row, f64)> {
    let rows = full().into_iter();
    rows.filter(|row| row.step == 1.0 / 60.0)
        .map(|row| (row, 5.0))
        .collect()
}
