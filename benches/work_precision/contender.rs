//! The common interface of all solvers: restart, advance by a span, read the state.

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
    /// Returns to the initial state.
    fn restart(&mut self);

    /// Advances by one span, or returns the reason of a failure.
    fn advance(&mut self) -> Result<(), String>;

    /// Positions and velocities, synchronized as far as the solver allows.
    fn read(&mut self) -> State;

    /// The number of substeps in the last span, if the solver chose it.
    fn substeps(&self) -> Option<u32> {
        None
    }

    /// The number of iterations in the last span, if the solver chose it.
    fn iterations(&self) -> Option<u32> {
        None
    }
}

/// Positions and velocities of nodes, in the scene's order.
pub struct State {
    pub positions: Vec<DVec3>,
    pub velocities: Vec<DVec3>,
}

/// Simulation methods.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Method {
    /// sinew with one of its solvers.
    Sinew(Solver),
    /// Verlet as printed in the paper.
    Paper,
    Xpbd,
    Projective,
}

/// The settings of a simulation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setup {
    pub method: Method,
    /// Steps per span.
    pub steps: u32,
    /// VERLET: substeps per step; 0: automatic.
    pub substeps: u32,
    /// Iterations per step, if the method has a fixed number. sinew: the maximum; 0: automatic.
    pub iterations: u32,
    /// VERLET: the fraction of the mass that may be added.
    pub mass_scaling: f32,
    /// IMPLICIT, NEWTON: the order of the formula; 0: automatic.
    pub order: u32,
    /// IMPLICIT, NEWTON: the accuracy of the equation solves; 0: automatic.
    pub accuracy: f32,
    /// Duration of a span [s].
    pub span: f64,
    pub threads: u32,
}

impl Setup {
    /// A span in `steps` steps, everything else at its simplest.
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

    /// Duration of a step [s].
    pub fn step(&self) -> f64 {
        self.span / f64::from(self.steps)
    }

    /// A number proportional to the run time, along a line.
    pub fn work(&self) -> f64 {
        match (self.method, self.substeps) {
            // As many substeps as necessary, independent of the number of steps; fewer with added mass.
            (Method::Sinew(Solver::Verlet), 0) => 1.0,
            (_, substeps) => f64::from(self.steps * substeps.max(1)),
        }
    }

    /// The counted time [s]: processor time for one thread, which excludes other programs, and wall time for more.
    pub fn counted(&self, elapsed: Elapsed) -> f64 {
        if self.threads == 1 {
            elapsed.processor
        } else {
            elapsed.wall
        }
    }

    /// The scene at its start, or the reason that this version does not support it.
    pub fn start(self, scene: &Scene) -> Result<Box<dyn Contender>, String> {
        Ok(match self.method {
            Method::Sinew(solver) => Box::new(Tissue::new(scene, solver, self)?),
            Method::Paper => Box::new(Paper::new(scene, self)),
            Method::Xpbd => Box::new(Xpbd::new(scene, self)),
            Method::Projective => Box::new(Projective::new(scene, self)),
        })
    }
}

/// A vector as a record, with a fourth number.
pub fn record(vector: Vec3, beside: f32) -> Record {
    Record([vector.x, vector.y, vector.z, beside])
}

/// The vector of a record.
pub fn vector(record: &Record) -> DVec3 {
    let [x, y, z, _] = record.0;
    Vec3::new(x, y, z).as_dvec3()
}
