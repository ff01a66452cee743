//! What a blade would pass through, found without cutting it.

use glam::{DVec3, Vec3};

use super::crossing::{SegmentEnd, meet};
use super::cut::Sweep;
use super::divided::SNAP;
use super::surface::{CutSurface, SurfaceTriangle};
use crate::base::{Result, memory};
use crate::codec::saved;

/// A part of a blade's way that lies in one triangle of a surface, or in one tetrahedron of a solid's material.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Met {
    /// The triangle that is drawn, or the cell of a solid.
    pub item: u32,
    /// Which parts of the way the blade has gone where it comes in and where it goes out, 0 to 1.
    pub times: [f64; 2],
    /// Where that is, by weights of the triangle's corners or the cell's nodes, and in space, m.
    pub weights: [[f64; 4]; 2],
    pub places: [DVec3; 2],
    /// How much is cut on it, in the rest shape: from one to the other, m; of solids the area that is passed over, m².
    pub amount: f64,
    /// How much of it is where the blade comes in and where it goes out, as multiples of the mean; it goes evenly from the one to the other.
    pub profile: [f64; 2],
    /// The shortest edge of the cell in the rest shape, m.
    pub size: f64,
    /// Whether it is of a solid.
    pub is_area: bool,
}

saved! { Met { item, times, weights, places, amount, profile, size, is_area } }

impl Met {
    /// How much is cut over the length of that edge, m; of solids over its square, m².
    pub fn unit(&self) -> f64 {
        if self.is_area { self.size * self.size } else { self.size }
    }
}

impl CutSurface {
    /// What of the triangles `candidates` a blade passes through while nodes are at `positions`, but for what it passes along a rim that is there:
    /// within the snapping distance of that nothing would be cut.
    pub(crate) fn meet(&self, sweep: &Sweep, positions: &[Vec3], candidates: &[u32], met: &mut Vec<Met>) -> Result<()> {
        met.clear();
        for (is_last, swept) in [false, true].into_iter().zip(sweep.triangles()) {
            let swept = swept.map(|corner| corner.as_dvec3());
            for &triangle in candidates {
                let SurfaceTriangle { corners, cell, .. } = self.triangles[triangle];
                let corner_places = corners.map(|corner| self.place(corner, positions).as_dvec3());
                let Some(ends) = meet(swept, corner_places, corners) else {
                    continue;
                };
                let weights = ends.map(|end| weights_of(end, corners));
                let rest_corners = corners.map(|corner| self.rest_place(corner));
                let at_rest = weights.map(|weights| weighed(weights, rest_corners));
                if self.is_along_rim(triangle, rest_corners, at_rest) {
                    continue;
                }
                let places = weights.map(|weights| weighed(weights, corner_places));
                let size = self.cells[cell].snap / SNAP;
                let mut part = Met {
                    item: triangle,
                    times: places.map(|place| time_of(swept, is_last, place)),
                    weights: weights.map(|[a, b, c]| [a, b, c, 0.0]),
                    places,
                    amount: at_rest[0].distance(at_rest[1]),
                    size,
                    is_area: false,
                    profile: [1.0; 2],
                };
                if part.times[0] > part.times[1] {
                    part.times.reverse();
                    part.weights.reverse();
                    part.places.reverse();
                }
                memory::push(met, part)?;
            }
        }
        Ok(())
    }

    /// Whether a segment in a triangle lies along a side that was cut.
    fn is_along_rim(&self, triangle: u32, corners: [DVec3; 3], ends: [DVec3; 2]) -> bool {
        let SurfaceTriangle { rim, cell, .. } = self.triangles[triangle];
        let snap = self.cells[cell].snap;
        (0..3).filter(|&side| rim[side]).any(|side| {
            let (from, way) = (corners[side], corners[(side + 1) % 3] - corners[side]);
            let off = |end: DVec3| way.cross(end - from).length() / way.length();
            ends.into_iter().all(|end| off(end) <= snap)
        })
    }
}

/// Weights of the corners, with these numbers, in the end of a segment.
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

/// The place between others that has these weights of them.
pub(crate) fn weighed<const N: usize>(weights: [f64; N], places: [DVec3; N]) -> DVec3 {
    (0..N).map(|k| weights[k] * places[k]).sum()
}

/// What part of its way the blade has gone where it passes a place, of the first or the last triangle that it sweeps.
fn time_of(swept: [DVec3; 3], is_last: bool, place: DVec3) -> f64 {
    let (side, other) = (swept[1] - swept[0], swept[2] - swept[0]);
    let normal = side.cross(other);
    let weight = side.cross(place - swept[0]).dot(normal) / normal.length_squared();
    let weight = if weight.is_finite() {
        weight.clamp(0.0, 1.0)
    } else {
        0.0
    };
    if is_last { 1.0 - weight } else { weight }
}
