//! What bodies in flight keep.

use glam::{DVec3, Vec3};
use sinew::{Body, BodyId, World};

/// Mass, momentum, angular momentum about the origin and energy, in `f64`.
#[derive(Clone, Copy, Debug, Default)]
pub struct Kept {
    pub mass: f64,
    pub momentum: DVec3,
    pub spin: DVec3,
    pub energy: f64,
    /// What momentum and angular momentum are measured by: sums of sizes.
    pub sizes: [f64; 2],
}

impl Kept {
    pub fn add(&mut self, body: &Body, gravity: Vec3) {
        let energy = body.energy(gravity);
        self.energy += energy.kinetic + energy.elastic + energy.gravitational;
        for (node, (place, velocity)) in (0..).zip(body.positions().iter().zip(body.velocities())) {
            let mass = f64::from(body.node_mass(node).expect("a node"));
            let (place, velocity) = (place.as_dvec3(), velocity.as_dvec3());
            self.mass += mass;
            self.momentum += mass * velocity;
            self.spin += mass * place.cross(velocity);
            self.sizes[0] += mass * velocity.length();
            self.sizes[1] += mass * place.length() * velocity.length();
        }
    }

    /// Mass, momentum and angular momentum are those of `before`.
    pub fn check_motion(&self, before: &Self, what: &str) {
        assert!((self.mass / before.mass - 1.0).abs() < 1e-6, "{what}: mass");
        let size = before.momentum.length();
        let off = before.momentum.distance(self.momentum);
        assert!(off < 1e-6 * size, "{what}: momentum {off} of {size}");
        let most = before.spin.length().max(0.1 * size);
        let off = before.spin.distance(self.spin);
        assert!(off < 1e-6 * most, "{what}: angular momentum {off} of {most}");
    }
}

/// Without gravity.
pub fn kept(world: &World, body: BodyId) -> Kept {
    let mut kept = Kept::default();
    kept.add(world.body(body).expect("a body"), Vec3::ZERO);
    kept
}
