//! The result of a step with fewer substeps, for step doubling.

use crate::base::Result;
use crate::codec::saved;
use crate::soa::{Vectors, per_node};

/// Positions within and at the end of a coarser step, and velocities at its end. Only worlds with a tolerance keep it.
///
/// The end alone is not enough: an oscillation whose phase both steps have lost may agree there by chance.
#[derive(Debug)]
pub(crate) struct CoarseStep {
    middle: Vectors,
    positions: Vectors,
    velocities: Vectors,
    /// The largest distance between the last two positions of a node within the step, m.
    middle_difference: f32,
}

saved! { CoarseStep { middle, positions, velocities, middle_difference } }

per_node! { CoarseStep { middle, positions, velocities } }

impl CoarseStep {
    pub fn new(node_count: usize) -> Result<Self> {
        Ok(Self {
            middle: Vectors::zeros(node_count)?,
            positions: Vectors::zeros(node_count)?,
            velocities: Vectors::zeros(node_count)?,
            middle_difference: 0.0,
        })
    }

    /// Compares the positions within the step with the stored ones, then stores them.
    pub fn compare_middle(&mut self, positions: &Vectors) {
        self.middle_difference = self.middle.largest_distance(positions);
        self.middle.copy_from(positions);
    }

    /// Compares the end of the step with the stored one, then stores it. Returns the distance between the two steps
    /// (m). A velocity difference counts as its displacement in `time` seconds. The distance is infinite if a value is
    /// not finite.
    pub fn compare_end(&mut self, positions: &Vectors, velocities: &Vectors, time: f32) -> f32 {
        let apart = self.positions.largest_distance(positions);
        let drifting = self.velocities.largest_distance(velocities) * time;
        self.positions.copy_from(positions);
        self.velocities.copy_from(velocities);
        self.middle_difference.max(apart).max(drifting)
    }
}
