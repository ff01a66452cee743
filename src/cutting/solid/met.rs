//! What of a solid a blade would pass through, found without cutting it.

use glam::{DMat3, DVec3, Vec3};

use super::body::{CutSolid, Face};
use super::reach::Band;
use crate::base::{Result, memory};
use crate::cutting::cut::Sweep;
use crate::cutting::divided::{Divided, NONE, SNAP};
use crate::cutting::met::{Met, weighed};

/// A triangle that is cut by the four sides of a tetrahedron has no more corners.
const MOST_CORNERS: usize = 7;

/// Parts of a way that are less than this apart are one.
const EVEN: f64 = 1e-9;

/// A corner of what a blade sweeps in a tetrahedron: by weights of its corners, and what part of its way the blade has gone there.
#[derive(Clone, Copy, Debug, Default)]
struct SweptCorner {
    weights: [f64; 4],
    time: f64,
}

/// What a swept triangle and a tetrahedron have in common.
#[derive(Clone, Copy, Debug, Default)]
struct Polygon {
    corners: [SweptCorner; MOST_CORNERS],
    count: usize,
}

impl CutSolid {
    /// What of the cells `candidates` a blade passes through while nodes are at `positions`, but for what it passes along a face that is cut already:
    /// within the snapping distance of that nothing would be cut. In the order along the blade.
    pub(crate) fn meet(&self, sweep: &Sweep, positions: &[Vec3], candidates: &[u32], met: &mut Vec<Met>) -> Result<()> {
        met.clear();
        let times = [[0.0, 0.0, 1.0], [1.0, 1.0, 0.0]];
        let band = Band::of(sweep);
        for (swept, times) in sweep.triangles().into_iter().zip(times) {
            let swept = swept.map(|corner| corner.as_dvec3());
            for &cell in candidates {
                for tetrahedron in self.simplices_in(cell) {
                    self.meet_tetrahedron(tetrahedron, (swept, times, band.as_ref()), positions, met)?;
                }
            }
        }
        let along = (sweep.end[1] - sweep.end[0]).as_dvec3();
        let place = |part: &Met| along.dot(part.places[0] + part.places[1]);
        met.sort_unstable_by(|a, b| place(a).total_cmp(&place(b)).then(a.item.cmp(&b.item)));
        Ok(())
    }

    /// Adds what a swept triangle meets of a tetrahedron, in slices between places at which what is met widens or narrows in another way.
    fn meet_tetrahedron(
        &self,
        tetrahedron: u32,
        (swept, times, band): ([DVec3; 3], [f64; 3], Option<&Band>),
        positions: &[Vec3],
        met: &mut Vec<Met>,
    ) -> Result<()> {
        let it = self.tetrahedra[tetrahedron];
        let places = it.corners.map(|corner| self.place(corner, positions).as_dvec3());
        let Some(polygon) = Polygon::common(swept, times, places) else {
            return Ok(());
        };
        let corners = &polygon.corners[..polygon.count];
        if self.is_along_cut(tetrahedron, corners) {
            return Ok(());
        }
        let opening = band.map_or(1.0, |band| band.opening(places));
        let rest = it.corners.map(|corner| self.rest_place(corner));
        let of_corners = it.corners.map(|corner| self.weights_in(corner, it.cell));
        let in_cell =
            |weights: [f64; 4]| std::array::from_fn(|node| (0..4).map(|k| weights[k] * of_corners[k][node]).sum());
        let size = self.cells[it.cell].snap / SNAP;
        let mut levels = [0.0; MOST_CORNERS];
        for (level, corner) in levels.iter_mut().zip(corners) {
            *level = corner.time;
        }
        let levels = &mut levels[..polygon.count];
        levels.sort_unstable_by(f64::total_cmp);
        for slice in levels.windows(2).filter(|slice| slice[1] - slice[0] > EVEN) {
            let chords = [slice[0], slice[1]].map(|time| polygon.chord(time));
            let ways = chords.map(|[from, to]| weighed(to.weights, rest) - weighed(from.weights, rest));
            let lengths = ways.map(DVec3::length);
            let middles = chords.map(|[from, to]| from.towards(&to, 0.5));
            // The two are parallel.
            let along = if lengths[0] > lengths[1] { ways[0] } else { ways[1] }.normalize_or_zero();
            let high = along.cross(weighed(middles[1].weights, rest) - weighed(middles[0].weights, rest));
            let sum = lengths[0] + lengths[1];
            let amount = opening * 0.5 * sum * high.length();
            if amount > 0.0 {
                let part = Met {
                    item: it.cell,
                    times: [slice[0], slice[1]],
                    weights: middles.map(|middle| in_cell(middle.weights)),
                    places: middles.map(|middle| weighed(middle.weights, places)),
                    amount,
                    profile: lengths.map(|length| 2.0 * length / sum),
                    size,
                    is_area: true,
                };
                memory::push(met, part)?;
            }
        }
        Ok(())
    }

    /// Whether what is swept in a tetrahedron lies along a face of it that is cut.
    fn is_along_cut(&self, tetrahedron: u32, corners: &[SweptCorner]) -> bool {
        let it = self.tetrahedra[tetrahedron];
        let snap = self.cells[it.cell].snap;
        (0..4).any(|face| {
            let drawn = it.drawn[face];
            let is_cut = it.faces[face] == Face::Severed || drawn != NONE && self.triangles[drawn].is_inner;
            // The height of the corner opposite is the volume by the area.
            let reaches =
                |corner: &SweptCorner| corner.weights[face] * 3.0 * it.volume / self.rest_area(tetrahedron, face);
            is_cut && corners.iter().all(|corner| reaches(corner) <= snap)
        })
    }
}

impl Polygon {
    /// What a triangle has in common with a tetrahedron (Sutherland, Hodgman 1974, with its weights as heights), given the times of its corners.
    fn common(swept: [DVec3; 3], times: [f64; 3], [a, b, c, d]: [DVec3; 4]) -> Option<Self> {
        let inverse = DMat3::from_cols(b - a, c - a, d - a).inverse();
        let mut polygon = Self {
            count: 3,
            ..Self::default()
        };
        for ((corner, place), time) in polygon.corners.iter_mut().zip(swept).zip(times) {
            let DVec3 { x, y, z } = inverse * (place - a);
            let weights = [1.0 - x - y - z, x, y, z];
            if !weights.iter().all(|weight| weight.is_finite()) {
                return None;
            }
            *corner = SweptCorner { weights, time };
        }
        for side in 0..4 {
            polygon = polygon.beyond(side);
            if polygon.count < 3 {
                return None;
            }
        }
        Some(polygon)
    }

    /// Where the blade stands in it at a time.
    fn chord(&self, time: f64) -> [SweptCorner; 2] {
        let mut ends = [None::<SweptCorner>; 2];
        for at in 0..self.count {
            let (from, to) = (&self.corners[at], &self.corners[(at + 1) % self.count]);
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

    /// What of it has a weight of at least 0 there.
    fn beyond(&self, side: usize) -> Self {
        let mut kept = Self::default();
        let mut keep = |corner: SweptCorner| {
            if kept.count < MOST_CORNERS {
                kept.corners[kept.count] = corner;
                kept.count += 1;
            }
        };
        for at in 0..self.count {
            let (from, to) = (&self.corners[at], &self.corners[(at + 1) % self.count]);
            let [start, end] = [from, to].map(|corner| corner.weights[side]);
            if start >= 0.0 {
                keep(*from);
            }
            if (start >= 0.0) != (end >= 0.0) {
                keep(from.towards(to, start / (start - end)));
            }
        }
        kept
    }
}

impl SweptCorner {
    fn towards(&self, other: &Self, part: f64) -> Self {
        Self {
            weights: std::array::from_fn(|k| self.weights[k] + part * (other.weights[k] - self.weights[k])),
            time: self.time + part * (other.time - self.time),
        }
    }
}
