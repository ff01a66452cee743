//! A row is run, and watched at the end of its steps.

use std::fmt;

use glam::Vec3;
use sinew::{Body, BodyId, Solver, World, WorldDefinition};

use super::account::Copy;
use super::clock;
use super::subject::Subject;
use super::table::Row;
use crate::support::bodies::FREE;

/// Of the energy put in, how much more there may be.
const ENERGY: f64 = 1e-3;

#[derive(Clone, Debug)]
pub enum Outcome {
    /// A file is missing.
    Skipped,
    Ran(Figures),
}

/// What a run showed.
#[derive(Clone, Debug, Default)]
pub struct Figures {
    /// The energy put in, J.
    put_in: f64,
    /// The most energy above what was put in, as a part of it, and when, s.
    excess: f64,
    at: f64,
    substeps: u32,
    /// Processor time of a frame, s.
    frame: f64,
    /// How long it ran, s.
    time: f64,
    faults: Vec<String>,
}

impl Outcome {
    pub fn has_failed(&self) -> bool {
        matches!(self, Outcome::Ran(figures) if !figures.faults.is_empty())
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Outcome::Ran(figures) = self else {
            return f.write_str("SKIPPED");
        };
        let verdict = if self.has_failed() { "FAILED" } else { "ok" };
        write!(
            f,
            "{verdict}: energy {:+.1e} of {:.2e} J at {:.1} s; {} substeps, {:.2} ms a frame, {:.1} s",
            figures.excess,
            figures.put_in,
            figures.at,
            figures.substeps,
            1e3 * figures.frame,
            figures.time
        )?;
        figures.faults.iter().try_for_each(|fault| write!(f, "; {fault}"))
    }
}

struct Run {
    world: World,
    id: BodyId,
    copy: Copy,
    gravity: Vec3,
    first: f64,
    figures: Figures,
}

/// Runs a row for so many seconds.
pub fn run(row: &Row, seconds: f64) -> Outcome {
    let Some(subject) = Subject::new(row.shape, row.law) else {
        return Outcome::Skipped;
    };
    let gravity = Vec3::new(0.0, -9.81, 0.0);
    let definition = subject.definition(row.solver, row.damping);
    let mut world = World::new(WorldDefinition { gravity, ..FREE }).expect("a world");
    let id = world.create_body(&definition).expect("a body");
    for &node in &subject.end {
        world.body_mut(id).expect("the body").pin(node).expect("a pin");
    }
    let mut copy = Copy::new(&definition, gravity, &subject.end);
    let rest = copy.energy_at_rest();
    let mut run = Run {
        world,
        id,
        copy,
        gravity,
        first: 0.0,
        figures: Figures {
            excess: f64::NEG_INFINITY,
            ..Figures::default()
        },
    };
    run.first = run.energy();
    run.figures.put_in = run.first - rest;
    let frames = (seconds / f64::from(row.step)).round() as usize;
    for frame in 1..=frames {
        let mut outcome = None;
        let elapsed = clock::time(|| outcome = Some(run.world.step(row.step)));
        run.figures.frame += elapsed.processor;
        run.figures.time = frame as f64 * f64::from(row.step);
        match outcome.expect("a step") {
            Err(error) => run.figures.faults.push(format!("step {frame}: {error}")),
            Ok(report) if report.bodies_restored > 0 => run.figures.faults.push(format!("step {frame}: restored")),
            Ok(report) => run.check(row, report.substeps),
        }
        if !run.figures.faults.is_empty() {
            break;
        }
    }
    let steps = run.figures.time / f64::from(row.step);
    run.figures.frame /= steps;
    if run.figures.excess > ENERGY {
        run.figures.faults.push("energy".into());
    }
    Outcome::Ran(run.figures)
}

impl Run {
    fn body(&self) -> &Body {
        self.world.body(self.id).expect("the body")
    }

    fn energy(&self) -> f64 {
        let energy = self.body().energy(self.gravity);
        energy.kinetic + energy.elastic + energy.gravitational
    }

    fn check(&mut self, row: &Row, substeps: u32) {
        self.figures.substeps = self.figures.substeps.max(substeps);
        let mut above = self.energy() - self.first;
        if above > 0.0 && row.solver == Solver::Verlet {
            let body = self.world.body(self.id).expect("the body");
            above -= self.copy.oscillation(body, f64::from(row.step) / f64::from(substeps));
        }
        let excess = above / self.figures.put_in;
        if !(excess <= self.figures.excess) {
            self.figures.excess = excess;
            self.figures.at = self.figures.time;
        }
    }
}
