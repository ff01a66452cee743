//! How near features of a surface may come to other bodies.
//!
//! Bodies may be made closer to each other than their thicknesses allow. Parting them would take work, so there the thickness is reduced: a feature
//! may stay as near as it was made. It gets its thickness back as it moves away, and loses none otherwise.

use crate::base::{Result, memory};
use crate::codec::saved;

/// Of a corner or an edge.
#[derive(Clone, Copy, Debug)]
struct FeatureClearance {
    /// So near it may come, m; infinity: it is not reduced.
    allowed: f32,
    /// What is nearest in the search in progress, m.
    nearest: f32,
}

saved! { FeatureClearance { allowed, nearest } }

const WHOLE: FeatureClearance = FeatureClearance {
    allowed: f32::INFINITY,
    nearest: f32::INFINITY,
};

impl FeatureClearance {
    fn settle(&mut self) {
        *self = Self {
            allowed: if self.nearest == f32::INFINITY || self.allowed == f32::INFINITY {
                f32::INFINITY
            } else {
                self.allowed.max(self.nearest)
            },
            nearest: f32::INFINITY,
        };
    }
}

/// The clearances of one surface.
#[derive(Debug)]
pub(super) struct Clearances {
    corners: Vec<FeatureClearance>,
    edges: Vec<FeatureClearance>,
    /// Whether the surface has been compared with no other yet.
    pub is_new: bool,
}

saved! { Clearances { corners, edges, is_new } }

/// A corner or an edge of a surface.
#[derive(Clone, Copy, Debug)]
pub(super) enum SurfaceFeature {
    Corner(usize),
    Edge(usize),
}

impl Clearances {
    /// For a surface with so many corners and edges.
    pub fn new(corners: usize, edges: usize) -> Result<Self> {
        Ok(Self {
            corners: memory::filled(WHOLE, corners)?,
            edges: memory::filled(WHOLE, edges)?,
            is_new: true,
        })
    }

    fn get_mut(&mut self, part: SurfaceFeature) -> Option<&mut FeatureClearance> {
        match part {
            SurfaceFeature::Corner(corner) => self.corners.get_mut(corner),
            SurfaceFeature::Edge(edge) => self.edges.get_mut(edge),
        }
    }

    /// How near a part may come, m; infinity: it is not reduced.
    pub fn allowed(&self, part: SurfaceFeature) -> f32 {
        let known = match part {
            SurfaceFeature::Corner(corner) => self.corners.get(corner),
            SurfaceFeature::Edge(edge) => self.edges.get(edge),
        };
        known.map_or(f32::INFINITY, |known| known.allowed)
    }

    /// Reduces the clearance of a part to this distance, m.
    pub fn reduce(&mut self, part: SurfaceFeature, distance: f32) {
        if let Some(known) = self.get_mut(part) {
            known.allowed = known.allowed.min(distance);
        }
    }

    /// Takes into account how far from a part something is, m.
    pub fn see(&mut self, part: SurfaceFeature, distance: f32) {
        if let Some(known) = self.get_mut(part) {
            known.nearest = known.nearest.min(distance);
        }
    }

    /// Gives back what a part has moved away since it was reduced, once all that is near has been seen. Edges that pass through tissue are near
    /// whatever was seen: those that were made so touch it, others keep what they have.
    pub fn settle(&mut self, pierces: &[bool]) {
        self.corners.iter_mut().for_each(FeatureClearance::settle);
        for (number, edge) in self.edges.iter_mut().enumerate() {
            if pierces.get(number).copied().unwrap_or(false) {
                edge.nearest = f32::INFINITY;
                if self.is_new {
                    edge.allowed = 0.0;
                }
            } else {
                edge.settle();
            }
        }
        self.is_new = false;
    }
}
