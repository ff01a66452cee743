//! Validates a body that was loaded from bytes.

use super::System;
use crate::soa::tile_count;

impl System {
    /// True if all arrays have one entry per node or tile, all node indices are valid, and all values are finite.
    pub(super) fn is_sound(&self) -> bool {
        let count = self.masses.len();
        let tiles = tile_count(count);
        let of_nodes = [&self.predicted_velocities, &self.applied];
        (1..=u32::MAX as usize / 2).contains(&count)
            && self.inverse_masses.len() == count
            && self.forces.are_sound(count)
            && self.order.is_sound(count)
            && self
                .integrator
                .solution()
                .is_none_or(|solution| solution.is_sound(count))
            && self.state.is_sound(count)
            && self.pins.are_sound(count)
            && self
                .pre_kick_velocities
                .iter()
                .flatten()
                .all(|buffer| buffer.velocities.len() == count)
            && self.tile_stats.len() == tiles
            && self.tile_sums.len() == tiles
            && self.boxes.len() == tiles
            && of_nodes.into_iter().flatten().all(|vectors| vectors.len() == count)
            && self.surface.iter().flatten().all(|&node| (node as usize) < count)
            && self
                .masses
                .iter()
                .chain(&self.inverse_masses)
                .all(|&mass| (0.0..f32::INFINITY).contains(&mass))
            && self.origin.is_finite()
            && self.gravity_scale.is_finite()
            && self.acceleration.is_finite()
    }
}
