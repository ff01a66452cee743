//! The cloth in Rapier: one substep, and the default of 4 sweeps over the constraints of its soft bodies.

use std::f32::consts::TAU;

use rapier3d::prelude::*;

use crate::child::Contender;
use crate::cloth::Cloth;

pub struct RapierCloth {
    world: PhysicsWorld,
    body: SoftBodyHandle,
}

impl Contender for RapierCloth {
    fn build(cloth: &Cloth, threads: usize) -> Result<Self, String> {
        let mut world = PhysicsWorld::new();
        world
            .configure_thread_pool(threads)
            .map_err(|error| error.to_string())?;
        world.gravity = Vector::new(0.0, -cloth.gravity, 0.0);
        let parameters = &mut world.integration_parameters;
        parameters.dt = cloth.step;
        parameters.num_solver_iterations = 1;
        parameters.soft_bodies.max_extra_substeps = 0;
        // A spring is an undamped implicit one, set by a frequency for the masses at its ends: half a node's mass, or a
        // whole one if the other end is pinned.
        let softness = |mass: f32| SpringCoefficients::new((cloth.stiffness / mass).sqrt() / TAU, 0.0);
        let edges: Vec<[u32; 2]> = cloth.springs().collect();
        let pinned = cloth.pinned();
        let at_a_pin = edges
            .iter()
            .enumerate()
            .filter(|(_, edge)| edge.iter().any(|node| pinned.contains(node)));
        let edge_softness = at_a_pin
            .map(|(edge, _)| (edge as u32, softness(cloth.node_mass)))
            .collect();
        let mut builder = SoftBodyBuilder::new(cloth.positions().map(Vector::from).collect())
            .particle_mass(cloth.node_mass)
            .pinned_particles(pinned)
            .edges(edges)
            .softness(softness(cloth.node_mass / 2.0))
            .no_surface_collider()
            .can_sleep(false);
        builder.edge_softness = edge_softness;
        let body = world.insert_soft_body(builder);
        Ok(Self { world, body })
    }

    fn version() -> String {
        format!("rapier3d {}", rapier3d::VERSION)
    }

    fn step(&mut self) {
        self.world.step();
    }

    fn position(&self, node: u32) -> [f32; 3] {
        let body = self.world.soft_bodies.get(self.body).expect("still there");
        body.particle_position(node as usize).into()
    }
}
