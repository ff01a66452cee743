//! A world with one body.

use glam::Vec3;
use sinew::{Body, BodyDefinition, BodyId, Error, RestStateDefinition, World, WorldDefinition};

use super::clock;
use super::figures::Figures;
use crate::support::bodies::FREE;

pub struct Scene {
    pub world: World,
    pub id: BodyId,
}

impl Scene {
    pub fn new(definition: &BodyDefinition, gravity: Vec3) -> Self {
        let mut world = World::new(WorldDefinition { gravity, ..FREE }).expect("a world");
        let id = world.create_body(definition).expect("a body");
        Self { world, id }
    }

    pub fn body(&self) -> &Body {
        self.world.body(self.id).expect("the body")
    }

    pub fn body_mut(&mut self) -> &mut Body {
        self.world.body_mut(self.id).expect("the body")
    }

    pub fn pin(&mut self, nodes: &[u32]) {
        for &node in nodes {
            self.body_mut().pin(node).expect("a node");
        }
    }

    /// Takes a step. `false` after a fault, which the figures report.
    pub fn step(&mut self, step: f32, figures: &mut Figures) -> bool {
        let mut result = None;
        figures.processor += clock::time(|| result = Some(self.world.step(step))).processor;
        figures.steps += 1;
        figures.time = figures.steps as f64 * f64::from(step);
        match result.expect("it was taken") {
            Ok(report) if report.bodies_restored == 0 => {
                figures.substeps = figures.substeps.max(report.substeps);
                return true;
            }
            Ok(_) => figures.faults.push(format!("restored in step {}", figures.steps)),
            Err(error) => figures.faults.push(format!("step {}: {error}", figures.steps)),
        }
        false
    }

    /// Total energy, J.
    pub fn energy(&self) -> f64 {
        let energy = self.body().energy(self.world.gravity());
        energy.kinetic + energy.elastic + energy.gravitational
    }

    /// Moves the body to static equilibrium.
    pub fn rest(&mut self) -> Result<(), Error> {
        self.world
            .rest_state(self.id, &RestStateDefinition::default())
            .map(|_| ())
    }
}
