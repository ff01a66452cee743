//! The motion of masses and springs in `f64`, written directly from the equations: VERLET without rounding.

use glam::DVec3;

/// Two nodes, stiffness, rest length.
pub type Spring = ([u32; 2], f64, f64);

/// Masses, springs and node damping, integrated by leapfrog with stored velocities.
#[derive(Clone, Debug)]
pub struct Reference {
    pub positions: Vec<DVec3>,
    pub velocities: Vec<DVec3>,
    pub springs: Vec<Spring>,
    /// Constant forces (N).
    pub applied: Vec<DVec3>,
    /// kg; 0 holds the node.
    pub masses: Vec<f64>,
    pub node_dampings: Vec<f64>,
    pub gravity: DVec3,
}

impl Reference {
    pub fn new(
        positions: Vec<DVec3>,
        masses: Vec<f64>,
        node_dampings: Vec<f64>,
        springs: Vec<Spring>,
        gravity: DVec3,
    ) -> Self {
        let zeros = vec![DVec3::ZERO; positions.len()];
        Self {
            velocities: zeros.clone(),
            applied: zeros,
            positions,
            springs,
            masses,
            node_dampings,
            gravity,
        }
    }

    /// Returns the sum of spring forces and applied forces (N).
    pub fn forces(&self) -> Vec<DVec3> {
        let mut forces = self.applied.clone();
        for &([a, b], stiffness, rest_length) in &self.springs {
            let (a, b) = (a as usize, b as usize);
            let offset = self.positions[b] - self.positions[a];
            let length = offset.length();
            let force = if length > 0.0 {
                offset * (stiffness * (length - rest_length) / length)
            } else {
                // Along x, from the node with the lower index to the other.
                DVec3::X
                    * if a < b {
                        -stiffness * rest_length
                    } else {
                        stiffness * rest_length
                    }
            };
            forces[a] += force;
            forces[b] -= force;
        }
        forces
    }

    /// Returns the elastic energy of the springs (J).
    pub fn elastic(&self) -> f64 {
        let energy = |&([a, b], stiffness, rest_length): &Spring| {
            let length = self.positions[a as usize].distance(self.positions[b as usize]);
            0.5 * stiffness * (length - rest_length).powi(2)
        };
        self.springs.iter().map(energy).sum()
    }

    pub fn accelerations(&self) -> Vec<DVec3> {
        let acceleration_of = |(force, &mass): (DVec3, &f64)| match mass {
            0.0 => DVec3::ZERO,
            mass => force / mass + self.gravity,
        };
        self.forces()
            .into_iter()
            .zip(&self.masses)
            .map(acceleration_of)
            .collect()
    }

    /// Takes a step: half a kick, a drift, half a kick. Damping is solved exactly over each half.
    pub fn step(&mut self, h: f64) {
        self.half_kick(h);
        for (position, velocity) in self.positions.iter_mut().zip(&self.velocities) {
            *position += *velocity * h;
        }
        self.half_kick(h);
    }

    pub fn run(&mut self, h: f64, steps: usize) {
        for _ in 0..steps {
            self.step(h);
        }
    }

    fn half_kick(&mut self, h: f64) {
        let accelerations = self.accelerations();
        for (node, acceleration) in accelerations.into_iter().enumerate() {
            let mass = self.masses[node];
            if mass == 0.0 {
                continue;
            }
            let s = self.node_dampings[node] / mass * h / 2.0;
            let weight = if s > 0.0 { -(-s).exp_m1() / s } else { 1.0 };
            self.velocities[node] = self.velocities[node] * (-s).exp() + acceleration * (h / 2.0 * weight);
        }
    }
}
