//! Finds the material that a blade would pass through, without cutting it.

use glam::{DVec3, Vec3};

use super::cell_complex::SNAP;
use super::crossing::{SegmentEnd, intersect_triangles};
use super::cut::Sweep;
use super::surface::{CutSurface, SurfaceTriangle};
use crate::base::{Result, memory};
use crate::codec::saved;

/// The part of a blade's sweep that lies in one triangle of a surface, or in one tetrahedron of a solid's material.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BladeContact {
    /// The triangle of the render mesh, or the cell of a solid.
    pub item: u32,
    /// The fractions of the sweep at which the blade enters and leaves, 0 to 1.
    pub times: [f64; 2],
    /// The entry and exit points, by weights of the triangle's corners or the cell's nodes, and in space, m.
    pub weights: [[f64; 4]; 2],
    pub positions: [DVec3; 2],
    /// The amount that is cut in the rest shape: the length between both points, m, for solids the swept area, m².
    pub amount: f64,
    /// The amount per time at entry and exit, relative to its mean. It varies linearly between them.
    pub profile: [f64; 2],
    /// The shortest edge of the cell in the rest shape, m.
    pub size: f64,
    /// True for solids.
    pub is_area: bool,
}

saved! { BladeContact { item, times, weights, positions, amount, profile, size, is_area } }

impl BladeContact {
    /// The amount of a cut along that edge, m; for solids that of its square, m².
    pub fn unit(&self) -> f64 {
        if self.is_area { self.size * self.size } else { self.size }
    }
}

impl CutSurface {
    /// Finds the triangles of `candidates` that a blade passes through with nodes at `positions`. Intersections along
    /// an existing cut boundary are omitted: within the snapping distance nothing would be cut.
    pub(crate) fn query_blade(
        &self,
        sweep: &Sweep,
        positions: &[Vec3],
        candidates: &[u32],
        contacts: &mut Vec<BladeContact>,
    ) -> Result<()> {
        contacts.clear();
        for (is_last, swept) in [false, true].into_iter().zip(sweep.triangles()) {
            let swept = swept.map(|corner| corner.as_dvec3());
            for &triangle in candidates {
                let SurfaceTriangle { corners, cell, .. } = self.triangles[triangle];
                let corner_places = corners.map(|corner| self.place(corner, positions).as_dvec3());
                let Some(ends) = intersect_triangles(swept, corner_places, corners) else {
                    continue;
                };
                let weights = ends.map(|end| weights_of(end, corners));
                let rest_corners = corners.map(|corner| self.rest_place(corner));
                let at_rest = weights.map(|weights| weighted_sum(weights, rest_corners));
                if self.is_along_cut(triangle, rest_corners, at_rest) {
                    continue;
                }
                let positions = weights.map(|weights| weighted_sum(weights, corner_places));
                let size = self.cells[cell].snap / SNAP;
                let mut contact = BladeContact {
                    item: triangle,
                    times: positions.map(|position| time_of(swept, is_last, position)),
                    weights: weights.map(|[a, b, c]| [a, b, c, 0.0]),
                    positions,
                    amount: at_rest[0].distance(at_rest[1]),
                    size,
                    is_area: false,
                    profile: [1.0; 2],
                };
                if contact.times[0] > contact.times[1] {
                    contact.times.reverse();
                    contact.weights.reverse();
                    contact.positions.reverse();
                }
                memory::push(contacts, contact)?;
            }
        }
        Ok(())
    }

    /// True if a segment in a triangle lies along a side that was cut.
    fn is_along_cut(&self, triangle: u32, corners: [DVec3; 3], ends: [DVec3; 2]) -> bool {
        let SurfaceTriangle { rim, cell, .. } = self.triangles[triangle];
        let snap = self.cells[cell].snap;
        (0..3).filter(|&side| rim[side]).any(|side| {
            let (from, direction) = (corners[side], corners[(side + 1) % 3] - corners[side]);
            let distance_to_side = |end: DVec3| direction.cross(end - from).length() / direction.length();
            ends.into_iter().all(|end| distance_to_side(end) <= snap)
        })
    }
}

/// The weights of the corners, with these indices, at the end of a segment.
fn weights_of(end: SegmentEnd, numbers: [u32; 3]) -> [f64; 3] {
    match end {
        SegmentEnd::Inside(_, weights) => weights,
        SegmentEnd::Side(side, along) => {
            let (mut low, mut high) = (side, (side + 1) % 3);
            if numbers[low] > numbers[high] {
                (low, high) = (high, low);
            }
            let mut weights = [0.0; 3];
            weights[low] = 1.0 - along;
            weights[high] = along;
            weights
        }
    }
}

/// The weighted mean of positions.
pub(crate) fn weighted_sum<const N: usize>(weights: [f64; N], positions: [DVec3; N]) -> DVec3 {
    (0..N).map(|k| weights[k] * positions[k]).sum()
}

/// The fraction of the sweep at which the blade passes a position, in the first or the last swept triangle.
fn time_of(swept: [DVec3; 3], is_last: bool, position: DVec3) -> f64 {
    let (side, other) = (swept[1] - swept[0], swept[2] - swept[0]);
    let normal = side.cross(other);
    let weight = side.cross(position - swept[0]).dot(normal) / normal.length_squared();
    let weight = if weight.is_finite() {
        weight.clamp(0.0, 1.0)
    } else {
        0.0
    };
    if is_last { 1.0 - weight } else { weight }
}
