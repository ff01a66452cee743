//! A step taken with fewer substeps, kept to be compared with the same step taken with more.

use crate::base::Result;
use crate::codec::saved;
use crate::soa::{Vectors, per_node};

/// Positions within and at the end of a coarser step, and velocities at its end; kept only in worlds with a tolerance.
///
/// The end alone would not do: an oscillation of which both steps have lost the phase may agree there by chance.
#[derive(Debug)]
pub(crate) struct CoarseStep {
    middle: Vectors,
    positions: Vectors,
    velocities: Vectors,
    /// The longest way between a node's last two places within the step, m.
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

    /// Compares the positions within the step with those kept, and keeps them instead.
    pub fn pass_middle(&mut self, positions: &Vectors) {
        self.middle_difference = self.middle.largest_distance(positions);
        self.middle.copy_from(positions);
    }

    /// Compares the end of the step with the end kept, and keeps it instead: how far the two steps lie apart, m, where a
    /// difference of velocities counts as what it becomes in `time` seconds; infinite where one is not finite.
    pub fn pass_end(&mut self, positions: &Vectors, velocities: &Vectors, time: f32) -> f32 {
        let apart = self.positions.largest_distance(positions);
        let drifting = self.velocities.largest_distance(velocities) * time;
        self.positions.copy_from(positions);
        self.velocities.copy_from(velocities);
        self.middle_difference.max(apart).max(drifting)
    }
}
