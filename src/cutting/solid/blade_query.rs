//! Finds the parts of a solid that a blade would pass through, without cutting it.

use glam::{DMat3, DVec3, Vec3};

use super::body::{CutSolid, FaceState};
use super::opening::SweptStrip;
use crate::base::{Result, memory};
use crate::cutting::blade_query::{BladeContact, weighted_sum};
use crate::cutting::cell_complex::{CellComplex, NONE, SNAP};
use crate::cutting::cut::Sweep;

/// The maximum number of corners of a triangle clipped by the four sides of a tetrahedron.
const MAX_CORNERS: usize = 7;

/// Fractions of a sweep that differ by less are equal.
const EQUAL_TIMES: f64 = 1e-9;

/// A corner of the swept area in a tetrahedron: the weights of the tetrahedron's corners, and the fraction of the
/// sweep.
#[derive(Clone, Copy, Debug, Default)]
struct SweptCorner {
    weights: [f64; 4],
    time: f64,
}

/// The intersection of a swept triangle with a tetrahedron.
#[derive(Clone, Copy, Debug, Default)]
struct ClippedTriangle {
    corners: [SweptCorner; MAX_CORNERS],
    count: usize,
}

impl CutSolid {
    /// Finds the parts of the cells in `candidates` that a blade passes through with nodes at `positions`, in the order
    /// along the blade. Intersections along a cut face are omitted: within the snapping distance nothing would be cut.
    pub(crate) fn query_blade(
        &self,
        sweep: &Sweep,
        positions: &[Vec3],
        candidates: &[u32],
        contacts: &mut Vec<BladeContact>,
    ) -> Result<()> {
        contacts.clear();
        let times = [[0.0, 0.0, 1.0], [1.0, 1.0, 0.0]];
        let strip = SweptStrip::of(sweep);
        for (swept, times) in sweep.triangles().into_iter().zip(times) {
            let swept = swept.map(|corner| corner.as_dvec3());
            for &cell in candidates {
                for tetrahedron in self.simplices_in(cell) {
                    self.query_tetrahedron(tetrahedron, (swept, times, strip.as_ref()), positions, contacts)?;
                }
            }
        }
        let along = (sweep.end[1] - sweep.end[0]).as_dvec3();
        let order_along = |contact: &BladeContact| along.dot(contact.positions[0] + contact.positions[1]);
        contacts.sort_unstable_by(|a, b| order_along(a).total_cmp(&order_along(b)).then(a.item.cmp(&b.item)));
        Ok(())
    }

    /// Adds the intersection of a swept triangle with a tetrahedron. It is divided into slices in which its width
    /// varies linearly.
    fn query_tetrahedron(
        &self,
        tetrahedron: u32,
        (swept, times, strip): ([DVec3; 3], [f64; 3], Option<&SweptStrip>),
        positions: &[Vec3],
        contacts: &mut Vec<BladeContact>,
    ) -> Result<()> {
        let it = self.tetrahedra[tetrahedron];
        let corner_positions = it.corners.map(|corner| self.place(corner, positions).as_dvec3());
        let Some(polygon) = ClippedTriangle::intersection(swept, times, corner_positions) else {
            return Ok(());
        };
        let corners = &polygon.corners[..polygon.count];
        if self.is_along_cut(tetrahedron, corners) {
            return Ok(());
        }
        let opening = strip.map_or(1.0, |strip| strip.opening(corner_positions));
        let rest = it.corners.map(|corner| self.rest_place(corner));
        let of_corners = it.corners.map(|corner| self.weights_in(corner, it.cell));
        let in_cell =
            |weights: [f64; 4]| std::array::from_fn(|node| (0..4).map(|k| weights[k] * of_corners[k][node]).sum());
        let size = self.cells[it.cell].snap / SNAP;
        let mut levels = [0.0; MAX_CORNERS];
        for (level, corner) in levels.iter_mut().zip(corners) {
            *level = corner.time;
        }
        let levels = &mut levels[..polygon.count];
        levels.sort_unstable_by(f64::total_cmp);
        for slice in levels.windows(2).filter(|slice| slice[1] - slice[0] > EQUAL_TIMES) {
            let chords = [slice[0], slice[1]].map(|time| polygon.chord(time));
            let directions = chords.map(|[from, to]| weighted_sum(to.weights, rest) - weighted_sum(from.weights, rest));
            let lengths = directions.map(DVec3::length);
            let middles = chords.map(|[from, to]| from.towards(&to, 0.5));
            // Both chords are parallel.
            let along = if lengths[0] > lengths[1] {
                directions[0]
            } else {
                directions[1]
            }
            .normalize_or_zero();
            let high = along.cross(weighted_sum(middles[1].weights, rest) - weighted_sum(middles[0].weights, rest));
            let sum = lengths[0] + lengths[1];
            let amount = opening * 0.5 * sum * high.length();
            if amount > 0.0 {
                let contact = BladeContact {
                    item: it.cell,
                    times: [slice[0], slice[1]],
                    weights: middles.map(|middle| in_cell(middle.weights)),
                    positions: middles.map(|middle| weighted_sum(middle.weights, corner_positions)),
                    amount,
                    profile: lengths.map(|length| 2.0 * length / sum),
                    size,
                    is_area: true,
                };
                memory::push(contacts, contact)?;
            }
        }
        Ok(())
    }

    /// True if the swept area in a tetrahedron lies along one of its cut faces.
    fn is_along_cut(&self, tetrahedron: u32, corners: &[SweptCorner]) -> bool {
        let it = self.tetrahedra[tetrahedron];
        let snap = self.cells[it.cell].snap;
        (0..4).any(|face| {
            let render_triangle = it.render_triangles[face];
            let is_cut = it.faces[face] == FaceState::Severed
                || render_triangle != NONE && self.triangles[render_triangle].is_inner;
            // The height of the opposite corner is three times the volume divided by the area.
            let reaches =
                |corner: &SweptCorner| corner.weights[face] * 3.0 * it.volume / self.rest_area(tetrahedron, face);
            is_cut && corners.iter().all(|corner| reaches(corner) <= snap)
        })
    }
}

impl ClippedTriangle {
    /// The intersection of a triangle with a tetrahedron, given the times of the triangle's corners. It is clipped by
    /// Sutherland, Hodgman (1974), with weights as heights.
    fn intersection(swept: [DVec3; 3], times: [f64; 3], [a, b, c, d]: [DVec3; 4]) -> Option<Self> {
        let inverse = DMat3::from_cols(b - a, c - a, d - a).inverse();
        let mut polygon = Self {
            count: 3,
            ..Self::default()
        };
        for ((corner, order_along), time) in polygon.corners.iter_mut().zip(swept).zip(times) {
            let DVec3 { x, y, z } = inverse * (order_along - a);
            let weights = [1.0 - x - y - z, x, y, z];
            if !weights.iter().all(|weight| weight.is_finite()) {
                return None;
            }
            *corner = SweptCorner { weights, time };
        }
        for side in 0..4 {
            polygon = polygon.clipped(side);
            if polygon.count < 3 {
                return None;
            }
        }
        Some(polygon)
    }

    /// The blade's chord of the polygon at a time.
    fn chord(&self, time: f64) -> [SweptCorner; 2] {
        let mut ends = [None::<SweptCorner>; 2];
        for index in 0..self.count {
            let (from, to) = (&self.corners[index], &self.corners[(index + 1) % self.count]);
            let end = if from.time == time {
                *from
            } else if (from.time < time) != (to.time < time) && to.time != time {
                from.towards(to, (time - from.time) / (to.time - from.time))
            } else {
                continue;
            };
            ends = [ends[0].or(Some(end)), Some(end)];
        }
        ends.map(Option::unwrap_or_default)
    }

    /// The part of the polygon in which a weight is at least 0.
    fn clipped(&self, side: usize) -> Self {
        let mut clipped = Self::default();
        let mut add_corner = |corner: SweptCorner| {
            if clipped.count < MAX_CORNERS {
                clipped.corners[clipped.count] = corner;
                clipped.count += 1;
            }
        };
        for index in 0..self.count {
            let (from, to) = (&self.corners[index], &self.corners[(index + 1) % self.count]);
            let [start, end] = [from, to].map(|corner| corner.weights[side]);
            if start >= 0.0 {
                add_corner(*from);
            }
            if (start >= 0.0) != (end >= 0.0) {
                add_corner(from.towards(to, start / (start - end)));
            }
        }
        clipped
    }
}

impl SweptCorner {
    fn towards(&self, other: &Self, fraction: f64) -> Self {
        Self {
            weights: std::array::from_fn(|k| self.weights[k] + fraction * (other.weights[k] - self.weights[k])),
            time: self.time + fraction * (other.time - self.time),
        }
    }
}
