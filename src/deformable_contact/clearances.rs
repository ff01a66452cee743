//! Reduced contact distances of the features of a surface.
//!
//! Bodies can be created closer to each other than their thicknesses allow. Pushing them apart would add energy, so the
//! thickness of such a feature is reduced to its initial distance. It recovers as the feature moves away, and is
//! reduced in no other case.

use crate::base::{Result, memory};
use crate::codec::saved;

/// Clearance of a corner or edge.
#[derive(Clone, Copy, Debug)]
struct FeatureClearance {
    /// Allowed distance, m; infinity without reduction.
    allowed_distance: f32,
    /// Smallest distance in the search in progress, m.
    nearest: f32,
}

saved! { FeatureClearance { allowed_distance, nearest } }

const FULL_CLEARANCE: FeatureClearance = FeatureClearance {
    allowed_distance: f32::INFINITY,
    nearest: f32::INFINITY,
};

impl FeatureClearance {
    fn update(&mut self) {
        *self = Self {
            allowed_distance: if self.nearest == f32::INFINITY || self.allowed_distance == f32::INFINITY {
                f32::INFINITY
            } else {
                self.allowed_distance.max(self.nearest)
            },
            nearest: f32::INFINITY,
        };
    }
}

/// Clearances of a surface.
#[derive(Debug)]
pub(super) struct Clearances {
    corners: Vec<FeatureClearance>,
    edges: Vec<FeatureClearance>,
    /// True until the surface has been compared with others once.
    pub is_new: bool,
}

saved! { Clearances { corners, edges, is_new } }

/// A corner or edge of a surface.
#[derive(Clone, Copy, Debug)]
pub(super) enum SurfaceFeature {
    Corner(usize),
    Edge(usize),
}

impl Clearances {
    /// Creates the clearances of a surface with this number of corners and edges.
    pub fn new(corners: usize, edges: usize) -> Result<Self> {
        Ok(Self {
            corners: memory::filled(FULL_CLEARANCE, corners)?,
            edges: memory::filled(FULL_CLEARANCE, edges)?,
            is_new: true,
        })
    }

    fn get_mut(&mut self, feature: SurfaceFeature) -> Option<&mut FeatureClearance> {
        match feature {
            SurfaceFeature::Corner(corner) => self.corners.get_mut(corner),
            SurfaceFeature::Edge(edge) => self.edges.get_mut(edge),
        }
    }

    /// Returns the allowed distance of a feature, m; infinity without reduction.
    pub fn allowed_distance(&self, feature: SurfaceFeature) -> f32 {
        let clearance = match feature {
            SurfaceFeature::Corner(corner) => self.corners.get(corner),
            SurfaceFeature::Edge(edge) => self.edges.get(edge),
        };
        clearance.map_or(f32::INFINITY, |clearance| clearance.allowed_distance)
    }

    /// Reduces the clearance of a feature to this distance, m.
    pub fn reduce(&mut self, feature: SurfaceFeature, distance: f32) {
        if let Some(clearance) = self.get_mut(feature) {
            clearance.allowed_distance = clearance.allowed_distance.min(distance);
        }
    }

    /// Records the distance of a feature from another, m.
    pub fn observe(&mut self, feature: SurfaceFeature, distance: f32) {
        if let Some(clearance) = self.get_mut(feature) {
            clearance.nearest = clearance.nearest.min(distance);
        }
    }

    /// Updates the clearances after a complete search. Crossing edges touch tissue at any distance. Edges
    /// that cross from the start get a clearance of 0, others keep theirs.
    pub fn update(&mut self, is_crossing: &[bool]) {
        self.corners.iter_mut().for_each(FeatureClearance::update);
        for (index, edge) in self.edges.iter_mut().enumerate() {
            if is_crossing.get(index).copied().unwrap_or(false) {
                edge.nearest = f32::INFINITY;
                if self.is_new {
                    edge.allowed_distance = 0.0;
                }
            } else {
                edge.update();
            }
        }
        self.is_new = false;
    }
}
