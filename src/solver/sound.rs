//! Whether a body that was read from bytes hangs together.

use super::System;
use crate::soa::tile_count;

impl System {
    /// Whether what it has of each node and tile is there for all of them, and what leads to nodes leads to some; all is finite.
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
            && self.early.iter().flatten().all(|early| early.velocities.len() == count)
            && self.surveys.len() == tiles
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
