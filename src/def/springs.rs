//! The springs of a definition, with their rest lengths.

use glam::Vec3;

use super::BodyDefinition;
use crate::base::{Result, ensure, memory};

/// A validated spring between two nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Spring {
    pub nodes: [u32; 2],
    pub stiffness: f32,
    pub rest_length: f32,
    pub damping: f32,
}

/// The largest relative difference of computed rest lengths that are merged, however coarse the positions are.
const MAX_MERGE_TOLERANCE: f32 = 1e-3;

/// The tolerance for equal rest lengths.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rounding {
    /// The largest coordinate that rest lengths were computed from, m; 0 if they were given.
    pub reach: f32,
}

impl Rounding {
    /// The range within which rest lengths near this length are equal, m.
    pub fn width(self, length: f32) -> f32 {
        // Along each axis both ends, their difference and the length are rounded by up to half a unit in the last
        // place.
        let rounded = 4.0 * f32::EPSILON * self.reach;
        (4.0 * f32::EPSILON * length).max(rounded.min(MAX_MERGE_TOLERANCE * length))
    }
}

impl BodyDefinition<'_> {
    /// The tolerance for equal rest lengths.
    pub(crate) fn rounding(&self) -> Rounding {
        let rest = self.rest_positions.unwrap_or(self.positions);
        let reach = |reach: f32, position: &Vec3| reach.max(position.abs().max_element());
        Rounding {
            reach: match self.rest_lengths {
                Some(_) => 0.0,
                None => rest.iter().fold(0.0, reach),
            },
        }
    }

    /// The springs with their rest lengths, from the definition or from the edges of its elements.
    pub(crate) fn resolved_springs(&self) -> Result<Vec<Spring>> {
        let edges;
        let pairs = match self.springs {
            Some(springs) => springs,
            None => {
                edges = crate::mesh::element_edges(self.triangles, self.tetrahedra, self.cells)?;
                &edges
            }
        };
        let rest = self.rest_positions.unwrap_or(self.positions);
        let mut springs = memory::reserved(pairs.len())?;
        for (index, &nodes) in pairs.iter().enumerate() {
            let rest_length = match self.rest_lengths {
                Some(lengths) => lengths[index],
                None => distance(rest[nodes[0] as usize], rest[nodes[1] as usize]),
            };
            ensure!(
                rest_length.is_finite(),
                "springs[{index}] would be {rest_length} m long: positions lie too far apart"
            );
            springs.push(Spring {
                nodes,
                stiffness: self.stiffnesses.get(index),
                rest_length,
                damping: self.spring_dampings.get(index) + self.viscosity.dashpot() * self.stiffnesses.get(index),
            });
        }
        Ok(springs)
    }
}

/// The distance between two points (m), without overflow or cancellation.
pub(crate) fn distance(a: Vec3, b: Vec3) -> f32 {
    (b.as_dvec3() - a.as_dvec3()).length() as f32
}
