//! A stroke: a blade that goes on where it stopped, in tissue that has moved since.

use glam::Vec3;

use crate::base::{Result, StateHasher, memory};
use crate::codec::saved;
use crate::cutting::{CutEnd, CutMaterial, SolidStroke, Sweep};

/// Points that reach along less than this part of an edge do not tell how it turns.
const LITTLE: f32 = 0.02;

/// Tissue that goes over a blade at rest is cut by no less than this part of a cell at once.
const AT_ONCE: f32 = 0.2;

/// Where a blade stopped.
#[derive(Debug)]
pub(crate) struct Stroke {
    /// The blade's edge.
    edge: Option<[Vec3; 2]>,
    /// Points of the tissue where it stood, which may lie a little beside it, and its points next to them.
    ends: Vec<(CutEnd, Vec3)>,
    /// What a solid knows of it while another is made in it.
    pub of_solid: SolidStroke,
}

saved! { Stroke { edge, ends, of_solid } }

impl Default for Stroke {
    fn default() -> Self {
        Self {
            edge: None,
            ends: Vec::new(),
            of_solid: SolidStroke::NONE,
        }
    }
}

impl Stroke {
    /// Points of the tissue where it stands, and its points next to them.
    pub fn ends(&self) -> &[(CutEnd, Vec3)] {
        &self.ends
    }

    /// Adds the bits that where a cut goes on depends on.
    pub fn hash(&self, hasher: &mut StateHasher) {
        for point in self
            .edge
            .iter()
            .flatten()
            .chain(self.ends.iter().map(|(_, point)| point))
        {
            hasher.write_floats(&point.to_array());
        }
        self.of_solid.hash(hasher);
        for (end, _) in &self.ends {
            end.nodes.iter().for_each(|&node| hasher.write_u64(u64::from(node)));
            hasher.write_doubles(&end.weights);
        }
    }

    /// Where the edge that a sweep begins with is in the tissue now, if the sweep begins just where the last ended: as far back that nothing lies
    /// between it and what was cut, wherever the tissue went.
    pub fn carried(&self, sweep: &Sweep, material: &CutMaterial, positions: &[Vec3]) -> Option<[Vec3; 2]> {
        if self.edge != Some(sweep.start) || self.ends.is_empty() {
            return None;
        }
        let [from, to] = sweep.start;
        let length = from.distance(to);
        let along = (to - from).normalize_or_zero();
        let ends = || {
            self.ends
                .iter()
                .map(|(end, before)| ((before - from).dot(along), material.place_of(end, positions) - before))
        };
        let count = self.ends.len() as f32;
        let (place, gone) = ends().fold((0.0, Vec3::ZERO), |(place, gone), end| (place + end.0, gone + end.1));
        let (place, gone) = (place / count, gone / count);
        // The tissue along the edge goes straight on and turns with it; where little of it tells, it does not turn.
        let (mut spread, mut turn) = (count * (LITTLE * length).powi(2), Vec3::ZERO);
        for (at, of) in ends() {
            spread += (at - place).powi(2);
            turn += (of - gone) * (at - place);
        }
        let turn = if spread > 0.0 { turn / spread } else { Vec3::ZERO };
        let way = (sweep.end[0] + sweep.end[1] - from - to).normalize_or_zero();
        let off = |(at, of): (f32, Vec3)| (gone + turn * (at - place) - of).dot(way);
        let slacks = self.ends.iter().map(|(end, _)| end.slack as f32);
        let furthest = ends()
            .zip(slacks)
            .map(|(end, slack)| off(end) + slack)
            .fold(0.0, f32::max);
        Some([0.0, length].map(|at| from + along * at + gone + turn * (at - place) - way * furthest))
    }

    /// Whether the tissue where it stands has gone on by as much as is to be cut at once.
    pub fn has_tissue_gone(&self, material: &CutMaterial, positions: &[Vec3]) -> bool {
        let gone = |(end, before): &(CutEnd, Vec3)| {
            // An edge that tissue goes along cuts nothing.
            let [from, to] = self.edge.unwrap_or([*before; 2]);
            let way = material.place_of(end, positions) - before;
            way.reject_from_normalized((to - from).normalize_or(Vec3::X)).length() > AT_ONCE * end.size as f32
        };
        self.ends.iter().any(gone)
    }

    /// Makes room for so many ends.
    pub fn reserve(&mut self, count: usize) -> Result<()> {
        memory::reserve(&mut self.ends, count)
    }

    /// The blade has come to its end; answers whether it moved: one that stood still is where it was.
    pub fn stop(&mut self, sweep: &Sweep) -> bool {
        let has_moved = sweep.start != sweep.end || self.edge != Some(sweep.end);
        if has_moved {
            self.edge = Some(sweep.end);
            self.ends.clear();
        }
        has_moved
    }

    /// Has the points of a solid be in their order along the edge.
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

    /// It stands in the tissue at this point.
    pub fn stands_at(&mut self, end: CutEnd, material: &CutMaterial, positions: &[Vec3]) {
        let Some([from, to]) = self.edge else {
            return;
        };
        let place = material.place_of(&end, positions);
        let along = (place - from).dot(to - from) / from.distance_squared(to);
        let nearest = if along.is_finite() {
            from.lerp(to, along.clamp(0.0, 1.0))
        } else {
            from
        };
        self.ends.push((end, nearest));
    }
}
