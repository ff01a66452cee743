//! What every solver has in common: it is started, advances by spans of time, and is read.

use glam::{DVec3, Vec3};
use sinew::Solver;

use crate::clock::Elapsed;
use crate::paper::Paper;
use crate::projective::Projective;
use crate::scene::Scene;
use crate::simd::Record;
use crate::tissue::Tissue;
use crate::xpbd::Xpbd;

/// A scene in motion.
pub trait Contender {
    /// Goes back to the start.
    fn restart(&mut self);

    /// Goes on by one span; or why it could not.
    fn advance(&mut self) -> Result<(), String>;

    /// Positions and velocities, as far as they are known at one time.
    fn read(&mut self) -> State;

    /// How many substeps it took in the last span, where that is its own choice.
    fn substeps(&self) -> Option<u32> {
        None
    }

    /// How many iterations it took in the last span, where that is its own choice.
    fn iterations(&self) -> Option<u32> {
        None
    }
}

/// Where nodes are and how fast, in the scene's order.
pub struct State {
    pub positions: Vec<DVec3>,
    pub velocities: Vec<DVec3>,
}

/// Ways to simulate a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Method {
    /// sinew, by one of its solvers.
    Sinew(Solver),
    /// Verlet as the paper prints it.
    Paper,
    Xpbd,
    Projective,
}

/// How a scene is simulated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setup {
    pub method: Method,
    /// Steps in a span.
    pub steps: u32,
    /// VERLET: substeps of a step, 0: as many as it takes.
    pub substeps: u32,
    /// Iterations of a step, where the method has a number of them; sinew: the most it may take, 0: its own choice.
    pub iterations: u32,
    /// VERLET: the part of the mass that may be added.
    pub mass_scaling: f32,
    /// IMPLICIT, NEWTON: the order of the formula, 0: their own choice.
    pub order: u32,
    /// IMPLICIT, NEWTON: how far equations are solved, 0: their own choice.
    pub accuracy: f32,
    /// s
    pub span: f64,
    pub threads: u32,
}

impl Setup {
    /// A span in so many steps, everything else as it is plainest.
    pub fn new(method: Method, steps: u32, span: f64, threads: u32) -> Self {
        Self {
            method,
            steps,
            substeps: 0,
            iterations: 0,
            mass_scaling: 0.0,
            order: 0,
            accuracy: 0.0,
            span,
            threads,
        }
    }

    /// s
    pub fn step(&self) -> f64 {
        self.span / f64::from(self.steps)
    }

    /// In proportion to the time it takes, along a line.
    pub fn work(&self) -> f64 {
        match (self.method, self.substeps) {
            // As many substeps as it takes, however many steps they are in; fewer where mass is added.
            (Method::Sinew(Solver::Verlet), 0) => 1.0,
            (_, substeps) => f64::from(self.steps * substeps.max(1)),
        }
    }

    /// The time that counts, s: what one thread does by its own clock, which stands while other programs run.
    pub fn counted(&self, elapsed: Elapsed) -> f64 {
        if self.threads == 1 {
            elapsed.processor
        } else {
            elapsed.wall
        }
    }

    /// The scene at its start; or why this version does not offer it.
    pub fn start(self, scene: &Scene) -> Result<Box<dyn Contender>, String> {
        Ok(match self.method {
            Method::Sinew(solver) => Box::new(Tissue::new(scene, solver, self)?),
            Method::Paper => Box::new(Paper::new(scene, self)),
            Method::Xpbd => Box::new(Xpbd::new(scene, self)),
            Method::Projective => Box::new(Projective::new(scene, self)),
        })
    }
}

/// A position or a displacement as a record, with a fourth number beside it.
pub fn record(vector: Vec3, beside: f32) -> Record {
    Record([vector.x, vector.y, vector.z, beside])
}

/// The vector in a record.
pub fn vector(record: &Record) -> DVec3 {
    let [x, y, z, _] = record.0;
    Vec3::new(x, y, z).as_dvec3()
}
