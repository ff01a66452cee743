//! A stroke: a blade continues from where it stopped, in tissue that has moved since.

use glam::Vec3;

use crate::base::{Result, StateHasher, memory};
use crate::codec::saved;
use crate::cutting::{CutEnd, CutMaterial, SolidStroke, Sweep};

/// Points that cover less than this part of an edge do not determine its rotation.
const MIN_SPREAD: f32 = 0.02;

/// A resting blade cuts tissue that moves over it only after a displacement of this part of a cell.
const MIN_CUT: f32 = 0.2;

/// The position where a blade stopped, in space and in the tissue.
#[derive(Debug)]
pub(crate) struct BladeStroke {
    /// The blade's edge.
    edge: Option<[Vec3; 2]>,
    /// Points of the tissue at the blade, and the nearest points of the edge. The two can differ a little.
    ends: Vec<(CutEnd, Vec3)>,
    /// The state of a solid's stroke while another one is in use.
    pub solid_stroke: SolidStroke,
}

saved! { BladeStroke { edge, ends, solid_stroke } }

impl Default for BladeStroke {
    fn default() -> Self {
        Self {
            edge: None,
            ends: Vec::new(),
            solid_stroke: SolidStroke::NONE,
        }
    }
}

impl BladeStroke {
    /// Points of the tissue at the blade, and the nearest points of the edge.
    pub fn ends(&self) -> &[(CutEnd, Vec3)] {
        &self.ends
    }

    /// Hashes the state that the next cut depends on.
    pub fn hash(&self, hasher: &mut StateHasher) {
        for point in self
            .edge
            .iter()
            .flatten()
            .chain(self.ends.iter().map(|(_, point)| point))
        {
            hasher.write_floats(&point.to_array());
        }
        self.solid_stroke.hash(hasher);
        for (end, _) in &self.ends {
            end.nodes.iter().for_each(|&node| hasher.write_u64(u64::from(node)));
            hasher.write_doubles(&end.weights);
        }
    }

    /// The current position in the tissue of the edge at which a sweep begins, if the last sweep ended there. It is
    /// moved back far enough that no uncut tissue lies between it and the cut, whatever the motion of the tissue.
    pub fn carried_edge(&self, sweep: &Sweep, material: &CutMaterial, positions: &[Vec3]) -> Option<[Vec3; 2]> {
        if self.edge != Some(sweep.start) || self.ends.is_empty() {
            return None;
        }
        let [from, to] = sweep.start;
        let length = from.distance(to);
        let along = (to - from).normalize_or_zero();
        let ends = || {
            self.ends.iter().map(|(end, before)| {
                (
                    (before - from).dot(along),
                    material.position_of_end(end, positions) - before,
                )
            })
        };
        let count = self.ends.len() as f32;
        let (mean_coordinate, shift) = ends().fold((0.0, Vec3::ZERO), |(mean_coordinate, shift), end| {
            (mean_coordinate + end.0, shift + end.1)
        });
        let (mean_coordinate, shift) = (mean_coordinate / count, shift / count);
        // The edge is translated and rotated with the tissue. A short part of it does not determine a rotation.
        let (mut spread, mut slope) = (count * (MIN_SPREAD * length).powi(2), Vec3::ZERO);
        for (coordinate, displacement) in ends() {
            spread += (coordinate - mean_coordinate).powi(2);
            slope += (displacement - shift) * (coordinate - mean_coordinate);
        }
        let slope = if spread > 0.0 { slope / spread } else { Vec3::ZERO };
        let sweep_direction = (sweep.end[0] + sweep.end[1] - from - to).normalize_or_zero();
        let lag = |(coordinate, displacement): (f32, Vec3)| {
            (shift + slope * (coordinate - mean_coordinate) - displacement).dot(sweep_direction)
        };
        let slacks = self.ends.iter().map(|(end, _)| end.slack as f32);
        let furthest = ends()
            .zip(slacks)
            .map(|(end, slack)| lag(end) + slack)
            .fold(0.0, f32::max);
        Some([0.0, length].map(|coordinate| {
            from + along * coordinate + shift + slope * (coordinate - mean_coordinate) - sweep_direction * furthest
        }))
    }

    /// True if the tissue at the blade has moved far enough to be cut.
    pub fn has_tissue_moved(&self, material: &CutMaterial, positions: &[Vec3]) -> bool {
        let has_moved = |(end, before): &(CutEnd, Vec3)| {
            // Tissue that moves along the edge is not cut.
            let [from, to] = self.edge.unwrap_or([*before; 2]);
            let displacement = material.position_of_end(end, positions) - before;
            displacement
                .reject_from_normalized((to - from).normalize_or(Vec3::X))
                .length()
                > MIN_CUT * end.size as f32
        };
        self.ends.iter().any(has_moved)
    }

    /// Reserves space for this many ends.
    pub fn reserve(&mut self, count: usize) -> Result<()> {
        memory::reserve(&mut self.ends, count)
    }

    /// Ends a sweep. Returns true if the blade has moved: otherwise its position in the tissue stays.
    pub fn end_sweep(&mut self, sweep: &Sweep) -> bool {
        let has_moved = sweep.start != sweep.end || self.edge != Some(sweep.end);
        if has_moved {
            self.edge = Some(sweep.end);
            self.ends.clear();
        }
        has_moved
    }

    /// Sorts the points of a solid along the edge.
    pub fn sort_ends(&mut self) {
        let Some([from, to]) = self.edge else {
            return;
        };
        let along = |point: Vec3| (point - from).dot(to - from);
        if self.ends.iter().all(|(end, _)| end.vertex.is_none()) {
            self.ends
                .sort_unstable_by(|a, b| along(a.1).total_cmp(&along(b.1)).then(a.0.nodes.cmp(&b.0.nodes)));
        }
    }

    /// Adds a point of the tissue at the blade.
    pub fn add_end(&mut self, end: CutEnd, material: &CutMaterial, positions: &[Vec3]) {
        let Some([from, to]) = self.edge else {
            return;
        };
        let position = material.position_of_end(&end, positions);
        let along = (position - from).dot(to - from) / from.distance_squared(to);
        let nearest = if along.is_finite() {
            from.lerp(to, along.clamp(0.0, 1.0))
        } else {
            from
        };
        self.ends.push((end, nearest));
    }
}
