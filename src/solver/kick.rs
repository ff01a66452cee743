//! What forces do to a velocity: the half kicks of leapfrog, with the damping of nodes solved exactly.

use glam::Vec3A;

use crate::body::{NodeDamping, Vectors};

/// The kicks of one substep.
///
/// A full kick is two half kicks with the same force, so that a step cut into several, or followed by another, moves
/// as one long one would.
pub(super) struct Kick<'a> {
    pub substep: f32,
    pub gravity: Vec3A,
    /// What gravity gives to a node without damping in this kick, whole or half, m/s.
    pub fall: Vec3A,
    pub inverse_masses: &'a [f32],
    pub applied: Option<&'a Vectors>,
    pub damping: Option<&'a NodeDamping>,
}

impl Kick<'_> {
    #[inline(always)]
    pub fn half(&self, node: usize, velocity: Vec3A, force: Vec3A) -> Vec3A {
        let acceleration = self.acceleration(node, force);
        match self.damping {
            None => velocity + (acceleration * (0.5 * self.substep) + self.fall),
            Some(damping) => velocity * damping.decay[node] + (acceleration + self.gravity) * damping.gain[node],
        }
    }

    #[inline(always)]
    pub fn full(&self, node: usize, velocity: Vec3A, force: Vec3A) -> Vec3A {
        let acceleration = self.acceleration(node, force);
        match self.damping {
            None => velocity + (acceleration * self.substep + self.fall),
            Some(damping) => {
                let (decay, gain) = (damping.decay[node], damping.gain[node]);
                velocity * (decay * decay) + (acceleration + self.gravity) * (gain * (1.0 + decay))
            }
        }
    }

    #[inline(always)]
    fn acceleration(&self, node: usize, force: Vec3A) -> Vec3A {
        let force = match self.applied {
            None => force,
            Some(applied) => force + applied.lanes(node),
        };
        force * self.inverse_masses[node]
    }
}
