//! The intersection of a swept triangle with an edge of the material.
//!
//! The material is treated as shifted by an infinitesimal displacement (Edelsbrunner, Muecke 1990), and signs are
//! exact. An edge therefore crosses a triangle or does not, and an edge that passes the shared side of two triangles
//! crosses one of them.

use glam::DVec3;

use crate::base::symbolic_perturbation::{is_above, triple};

/// A triangle that the blade swept.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SweptTriangle {
    corners: [DVec3; 3],
    sides: [DVec3; 2],
    pub(crate) normal: DVec3,
}

impl SweptTriangle {
    /// Creates the triangle. Differences of its corners must be exact.
    pub(crate) fn new(corners: [DVec3; 3]) -> Self {
        let sides = [1, 2].map(|k| corners[k] - corners[0]);
        Self {
            corners,
            sides,
            normal: sides[0].cross(sides[1]),
        }
    }

    /// The height of a position above the plane of the triangle, multiplied by the length of `normal`.
    pub(crate) fn height(&self, position: DVec3) -> f64 {
        triple(position - self.corners[0], self.sides[0], self.sides[1])
    }

    /// True if a position at this height counts as above the plane.
    pub(crate) fn is_above(&self, height: f64) -> bool {
        is_above(height, self.normal)
    }

    /// True if the line between two positions on different sides of the plane passes through the triangle. The same two
    /// positions must always be in the same order.
    pub(crate) fn is_crossed(&self, from: DVec3, to: DVec3) -> bool {
        let direction = to - from;
        let passes = [0, 1, 2].map(|k| {
            let (start, end) = (self.corners[k], self.corners[(k + 1) % 3]);
            is_above(
                triple(direction, start - from, end - from),
                direction.cross(end - start),
            )
        });
        passes[0] == passes[1] && passes[1] == passes[2]
    }
}
