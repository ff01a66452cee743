//! A world with one body.

use glam::DVec3;
use sinew::{Body, BodyDefinition, BodyId, RestStateDefinition, Solver, Storage, World, WorldDefinition};

pub const SOLVERS: [Solver; 3] = [Solver::Verlet, Solver::Implicit, Solver::Newton];

pub const STORAGES: [Storage; 4] = [
    Storage::Packed,
    Storage::Efficient,
    Storage::FastLink,
    Storage::DynamicBulk,
];

pub struct Scene {
    pub world: World,
    pub id: BodyId,
}

impl Scene {
    pub fn new(world: WorldDefinition, definition: &BodyDefinition) -> Self {
        let mut world = World::new(world).expect("a world");
        let id = world.create_body(definition).expect("a body");
        Self { world, id }
    }

    pub fn body(&self) -> &Body {
        self.world.body(self.id).expect("the body")
    }

    pub fn body_mut(&mut self) -> &mut Body {
        self.world.body_mut(self.id).expect("the body")
    }

    pub fn positions(&self) -> Vec<DVec3> {
        self.body().positions().iter().map(|p| p.as_dvec3()).collect()
    }

    /// Takes steps that must succeed.
    pub fn run(&mut self, dt: f32, steps: usize) {
        for _ in 0..steps {
            assert_eq!(self.world.step(dt).expect("a step").bodies_restored, 0);
        }
    }

    pub fn step(&mut self, dt: f32) {
        self.run(dt, 1);
    }

    /// All of it.
    pub fn energy(&self) -> f64 {
        let energy = self.body().energy(self.world.gravity());
        energy.kinetic + energy.elastic + energy.gravitational
    }

    /// Goes to the state of rest, which must be found: how many linearised equations that took.
    pub fn rest(&mut self) -> u32 {
        let report = self.world.rest_state(self.id, &RestStateDefinition::default());
        report.expect("a state of rest").iterations
    }
}
