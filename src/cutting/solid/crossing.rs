//! Where a triangle that the blade swept is crossed by an edge of the material.
//!
//! All of the material is taken as shifted by next to nothing in one direction (Edelsbrunner, Muecke 1990), and signs are exact: an edge crosses
//! a triangle or does not, and of two triangles that share a side it crosses one where it passes by that side.

use glam::DVec3;

use crate::base::symbolic_perturbation::{is_above, triple};

/// A triangle that the blade swept.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Swept {
    corners: [DVec3; 3],
    sides: [DVec3; 2],
    pub(crate) normal: DVec3,
}

impl Swept {
    /// Of corners whose differences are exact.
    pub(crate) fn new(corners: [DVec3; 3]) -> Self {
        let sides = [1, 2].map(|k| corners[k] - corners[0]);
        Self {
            corners,
            sides,
            normal: sides[0].cross(sides[1]),
        }
    }

    /// How high a place lies above its plane, in lengths of `normal`.
    pub(crate) fn height(&self, place: DVec3) -> f64 {
        triple(place - self.corners[0], self.sides[0], self.sides[1])
    }

    /// Whether a place at this height counts as above the plane.
    pub(crate) fn is_above(&self, height: f64) -> bool {
        is_above(height, self.normal)
    }

    /// Whether the straight way from a place to one on the plane's other side leads through the triangle. The same two places have to be given in
    /// the same order each time.
    pub(crate) fn is_crossed(&self, from: DVec3, to: DVec3) -> bool {
        let way = to - from;
        let passes = [0, 1, 2].map(|k| {
            let (start, end) = (self.corners[k], self.corners[(k + 1) % 3]);
            is_above(triple(way, start - from, end - from), way.cross(end - start))
        });
        passes[0] == passes[1] && passes[1] == passes[2]
    }
}
