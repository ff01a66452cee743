//! A stroke: a blade that goes on where it stopped, in tissue that has moved since.

use glam::Vec3;

use crate::cutting::{CutSurface, Sweep};
use crate::diagnostics::StateHasher;
use crate::error::Result;
use crate::memory;

/// Where a blade stopped.
#[derive(Debug, Default)]
pub(crate) struct Stroke {
    /// The blade's edge.
    edge: Option<[Vec3; 2]>,
    /// The vertices where it stood in the surface, which may lie a little beside it, and its points next to them.
    ends: Vec<(u32, Vec3)>,
}

impl Stroke {
    /// The vertices where it stands in the surface, and its points next to them.
    pub fn ends(&self) -> &[(u32, Vec3)] {
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
        self.ends
            .iter()
            .for_each(|&(vertex, _)| hasher.write_u64(u64::from(vertex)));
    }

    /// The sweep as it is in the tissue now: where it begins just where the last ended it begins where those vertices are now.
    pub fn carried(&self, sweep: &Sweep, surface: &CutSurface, positions: &[Vec3]) -> Sweep {
        if self.edge != Some(sweep.start) || self.ends.is_empty() {
            return *sweep;
        }
        let place = |vertex: u32| positions[surface.vertices()[vertex as usize].point as usize];
        let gone: Vec3 = self.ends.iter().map(|&(vertex, before)| place(vertex) - before).sum();
        let gone = gone / self.ends.len() as f32;
        Sweep {
            start: sweep.start.map(|end| end + gone),
            ..*sweep
        }
    }

    /// Makes room for so many ends.
    pub fn reserve(&mut self, count: usize) -> Result<()> {
        memory::reserve(&mut self.ends, count)
    }

    /// The blade has come to its end, where it stands in the surface at these vertices, for which there is room; one that stood still is where
    /// it was.
    pub fn stop(&mut self, sweep: &Sweep, ends: &[u32], surface: &CutSurface, positions: &[Vec3]) {
        if sweep.start == sweep.end && self.edge == Some(sweep.end) {
            return;
        }
        self.edge = Some(sweep.end);
        self.ends.clear();
        let place = |vertex: u32| positions[surface.vertices()[vertex as usize].point as usize];
        let [from, to] = sweep.end;
        let nearest = |point: Vec3| {
            let along = (point - from).dot(to - from) / from.distance_squared(to);
            if along.is_finite() {
                from.lerp(to, along.clamp(0.0, 1.0))
            } else {
                from
            }
        };
        self.ends
            .extend(ends.iter().map(|&vertex| (vertex, nearest(place(vertex)))));
    }
}
