//! sinew through its public interface. Only this module turns a [`Setup`] into a definition.

use sinew::{
    BodyDefinition, BodyId, Error, RestStateDefinition, RestStateReport, Solver, Values, World, WorldDefinition,
};

use crate::contender::{Contender, Setup, State};
use crate::scene::Scene;

pub struct Tissue {
    world: World,
    body: BodyId,
    start: Vec<glam::Vec3>,
    steps: u32,
    /// Duration of a step [s].
    step: f32,
    /// Substeps in the last span.
    substeps: u32,
    /// Iterations in the last span.
    iterations: u32,
    /// Error estimate [m].
    estimate: f32,
}

impl Tissue {
    pub fn new(scene: &Scene, solver: Solver, setup: Setup) -> Result<Self, String> {
        Self::with_tolerance(scene, solver, setup, 0.0)
    }

    /// In a world with a `tolerance` for the error of each step [m]; 0 is off.
    pub fn with_tolerance(scene: &Scene, solver: Solver, setup: Setup, tolerance: f32) -> Result<Self, String> {
        let mut world = offered(World::new(WorldDefinition {
            gravity: scene.gravity,
            thread_count: setup.threads,
            substeps: setup.substeps,
            tolerance,
            max_substeps: 1_000_000,
            ..WorldDefinition::default()
        }))?;
        let dampings: Vec<f32> = scene.masses.iter().map(|mass| mass * scene.damping_rate).collect();
        let definition = BodyDefinition {
            positions: &scene.positions,
            springs: Some(&scene.springs),
            masses: Values::Each(&scene.masses),
            stiffnesses: Values::Each(&scene.stiffnesses),
            rest_lengths: Some(&scene.rest_lengths),
            node_dampings: Values::Each(&dampings),
            solver,
            order: setup.order,
            iterations: setup.iterations,
            accuracy: setup.accuracy,
            mass_scaling: setup.mass_scaling,
            ..BodyDefinition::default()
        };
        let body = offered(world.create_body(&definition))?;
        Ok(Self {
            world,
            body,
            start: scene.positions.clone(),
            steps: setup.steps,
            step: setup.step() as f32,
            substeps: 0,
            iterations: 0,
            estimate: 0.0,
        })
    }

    /// The largest error estimate of the last span's steps [m]; 0 without a tolerance.
    pub fn estimate(&self) -> f32 {
        self.estimate
    }

    /// Solves for static equilibrium, or returns the reason of a failure.
    pub fn rest(&mut self) -> Result<RestStateReport, String> {
        self.world
            .rest_state(self.body, &RestStateDefinition::default())
            .map_err(|error| error.to_string())
    }
}

impl Contender for Tissue {
    fn restart(&mut self) {
        let body = self.world.body_mut(self.body).expect("the world's body");
        body.set_positions(&self.start).expect("the body's positions");
        let still = vec![glam::Vec3::ZERO; self.start.len()];
        body.set_velocities(&still).expect("a velocity for each node");
    }

    fn advance(&mut self) -> Result<(), String> {
        self.substeps = 0;
        self.iterations = 0;
        self.estimate = 0.0;
        for _ in 0..self.steps {
            let report = self.world.step(self.step).map_err(|error| match error {
                Error::Unstable { .. } => "refused: unstable".to_owned(),
                error => error.to_string(),
            })?;
            if report.bodies_restored > 0 {
                return Err("not finite, restored".into());
            }
            self.substeps += report.substeps;
            self.estimate = self.estimate.max(report.error_estimate);
            let body = self.world.body(self.body).expect("the world's body");
            self.iterations += body.solver_report().iterations;
        }
        Ok(())
    }

    fn substeps(&self) -> Option<u32> {
        Some(self.substeps)
    }

    fn iterations(&self) -> Option<u32> {
        Some(self.iterations).filter(|&iterations| iterations > 0)
    }

    fn read(&mut self) -> State {
        let body = self.world.body(self.body).expect("the world's body");
        let exact = |vectors: &[glam::Vec3]| vectors.iter().map(|vector| vector.as_dvec3()).collect();
        State {
            positions: exact(body.positions()),
            velocities: exact(body.velocities()),
        }
    }
}

/// An unsupported feature is a valid result; any other failure is a bug of this bench or of the library.
fn offered<T>(result: sinew::Result<T>) -> Result<T, String> {
    match result {
        Ok(value) => Ok(value),
        Err(Error::Unsupported(message)) => Err(message),
        Err(error) => panic!("{error}"),
    }
}
