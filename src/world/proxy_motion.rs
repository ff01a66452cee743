//! The motion of a blade's proxy towards the true edge, within a step.

use glam::{DVec3, Vec3};

use super::blade::{EdgePoint, MAX_HOLDS};
use crate::cutting::BladeContact;

/// A proxy at the end of a step, and the true edge ahead of it.
pub(super) struct Approach {
    /// The points at which tissue holds the proxy.
    pub points: [EdgePoint; MAX_HOLDS],
    pub count: usize,
    /// The proxy and the true edge. Without a hold in tissue the proxy is the true edge before the step.
    pub from: [Vec3; 2],
    pub end: [Vec3; 2],
    /// The mean vector from the proxy to the true edge, perpendicular to the edge, m, and its length.
    pub lag: DVec3,
    pub distance: f64,
    /// How far beyond the true edge tissue is searched, m.
    pub probe: DVec3,
}

impl Approach {
    /// The approach of an edge that tissue does not hold, from its position before a step to that after it.
    pub fn of([from, end]: [[Vec3; 2]; 2]) -> Self {
        Self {
            points: [EdgePoint::next_to(DVec3::ZERO, end); MAX_HOLDS],
            count: 0,
            from,
            end,
            lag: DVec3::ZERO,
            distance: 0.0,
            probe: DVec3::ZERO,
        }
    }

    /// The points at which tissue holds the proxy, if there are any.
    pub fn points(&self) -> Option<&[EdgePoint]> {
        (self.count > 0).then(|| &self.points[..self.count])
    }

    /// Computes the distance that an edge without holds has yet to go, perpendicular to itself, from its first contact.
    pub fn enter(&mut self, met: &[BladeContact]) {
        let Some(first) = met.iter().min_by(|a, b| a.times[0].total_cmp(&b.times[0])) else {
            return;
        };
        let [from, to] = [self.from, self.end].map(|edge| edge.map(|end| end.as_dvec3()));
        let met_by = [0, 1].map(|k| from[k].lerp(to[k], first.times[0]));
        let edge = met_by[1] - met_by[0];
        let along = ((first.positions[0] - met_by[0]).dot(edge) / edge.length_squared()).clamp(0.0, 1.0);
        let gone = (to[0] - from[0]).lerp(to[1] - from[1], along);
        let edge = (to[1] - to[0]).normalize_or_zero();
        let across = gone - edge * gone.dot(edge);
        // An edge that moves along itself has no distance but for rounding.
        let ends = self.from.into_iter().chain(self.end);
        let furthest = ends.fold(0.0, |furthest: f32, end| furthest.max(end.abs().max_element()));
        if across.length() > f64::from(2.0 * f32::EPSILON * furthest) {
            self.lag = across;
            self.distance = across.length();
        }
    }
}
