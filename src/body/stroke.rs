//! A stroke: a blade that goes on where it stopped, in tissue that has moved since.

use glam::Vec3;

use crate::cutting::{CutEnd, Sweep};
use crate::error::Result;
use crate::memory;

/// Where a blade stopped.
#[derive(Debug, Default)]
pub(super) struct Stroke {
    /// The blade's edge.
    edge: Option<[Vec3; 2]>,
    /// Points of the tissue where it stood, which may lie a little beside it, and its points next to them.
    ends: Vec<(CutEnd, Vec3)>,
}

impl Stroke {
    /// Where the edge that a sweep begins with is in the tissue now, if the sweep begins just where the last ended.
    pub fn carried(&self, sweep: &Sweep, positions: &[Vec3]) -> Option<[Vec3; 2]> {
        if self.edge != Some(sweep.start) || self.ends.is_empty() {
            return None;
        }
        let gone: Vec3 = self
            .ends
            .iter()
            .map(|(end, before)| end.place(positions) - before)
            .sum();
        let gone = gone / self.ends.len() as f32;
        Some(sweep.start.map(|end| end + gone))
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

    /// It stands in the tissue at this point.
    pub fn stands_at(&mut self, end: CutEnd, positions: &[Vec3]) {
        let Some([from, to]) = self.edge else {
            return;
        };
        let place = end.place(positions);
        let along = (place - from).dot(to - from) / from.distance_squared(to);
        let nearest = if along.is_finite() {
            from.lerp(to, along.clamp(0.0, 1.0))
        } else {
            from
        };
        self.ends.push((end, nearest));
    }
}
