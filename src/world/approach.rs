//! A proxy of a blade before its true edge.

use glam::{DVec3, Vec3};

use super::blade::{MOST_HOLDS, Stand};
use crate::cutting::Met;

/// A proxy as a step ends, and the true edge ahead of it.
pub(super) struct Approach {
    /// The points where it stands in the tissue.
    pub stands: [Stand; MOST_HOLDS],
    pub count: usize,
    /// The proxy, which is the true edge before the step where it stands nowhere, and the true edge.
    pub from: [Vec3; 2],
    pub end: [Vec3; 2],
    /// From the one to the other across the edge, in the mean, m, and how far.
    pub lag: DVec3,
    pub way: f64,
    /// How far beyond tissue is looked for.
    pub probe: DVec3,
}

impl Approach {
    /// Of an edge that stands nowhere, before a step and after it.
    pub fn of([from, end]: [[Vec3; 2]; 2]) -> Self {
        Self {
            stands: [Stand::next_to(DVec3::ZERO, end); MOST_HOLDS],
            count: 0,
            from,
            end,
            lag: DVec3::ZERO,
            way: 0.0,
            probe: DVec3::ZERO,
        }
    }

    /// The points where it stands in the tissue, if it does.
    pub fn stands(&self) -> Option<&[Stand]> {
        (self.count > 0).then(|| &self.stands[..self.count])
    }

    /// Sees how far an edge that stood nowhere has to go across itself, from where it first met something.
    pub fn enter(&mut self, met: &[Met]) {
        let Some(first) = met.iter().min_by(|a, b| a.times[0].total_cmp(&b.times[0])) else {
            return;
        };
        let [from, to] = [self.from, self.end].map(|edge| edge.map(|end| end.as_dvec3()));
        let met_by = [0, 1].map(|k| from[k].lerp(to[k], first.times[0]));
        let edge = met_by[1] - met_by[0];
        let along = ((first.places[0] - met_by[0]).dot(edge) / edge.length_squared()).clamp(0.0, 1.0);
        let gone = (to[0] - from[0]).lerp(to[1] - from[1], along);
        let edge = (to[1] - to[0]).normalize_or_zero();
        let across = gone - edge * gone.dot(edge);
        // What rounding makes of an edge that goes along itself is no way.
        let ends = self.from.into_iter().chain(self.end);
        let furthest = ends.fold(0.0, |furthest: f32, end| furthest.max(end.abs().max_element()));
        if across.length() > f64::from(2.0 * f32::EPSILON * furthest) {
            self.lag = across;
            self.way = across.length();
        }
    }
}
