//! The conserved quantities of bodies in flight.

use glam::{DVec3, Vec3};
use sinew::{Body, BodyId, World};

/// Mass, momentum, angular momentum about the origin and energy, in `f64`.
#[derive(Clone, Copy, Debug, Default)]
pub struct Kept {
    pub mass: f64,
    pub momentum: DVec3,
    pub spin: DVec3,
    pub energy: f64,
    /// The scales of momentum and angular momentum: sums of magnitudes.
    pub sizes: [f64; 2],
}

impl Kept {
    pub fn add(&mut self, body: &Body, gravity: Vec3) {
        let energy = body.energy(gravity);
        self.energy += energy.kinetic + energy.elastic + energy.gravitational;
        for (node, (position, velocity)) in (0..).zip(body.positions().iter().zip(body.velocities())) {
            let mass = f64::from(body.node_mass(node).expect("a node"));
            let (position, velocity) = (position.as_dvec3(), velocity.as_dvec3());
            self.mass += mass;
            self.momentum += mass * velocity;
            self.spin += mass * position.cross(velocity);
            self.sizes[0] += mass * velocity.length();
            self.sizes[1] += mass * position.length() * velocity.length();
        }
    }

    /// Checks that mass, momentum and angular momentum equal those of `before`.
    pub fn check_motion(&self, before: &Self, what: &str) {
        assert!((self.mass / before.mass - 1.0).abs() < 1e-6, "{what}: mass");
        let size = before.momentum.length();
        let off = before.momentum.distance(self.momentum);
        assert!(off < 1e-6 * size, "{what}: momentum {off} of {size}");
        let scale = before.spin.length().max(0.1 * size);
        let off = before.spin.distance(self.spin);
        assert!(off < 1e-6 * scale, "{what}: angular momentum {off} of {scale}");
    }
}

/// Returns the conserved quantities of a body without gravity.
pub fn kept(world: &World, body: BodyId) -> Kept {
    let mut kept = Kept::default();
    kept.add(world.body(body).expect("a body"), Vec3::ZERO);
    kept
}
