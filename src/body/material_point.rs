//! Points of the material, which keep their places in it whatever is cut.

use glam::DVec3;

use super::Body;
use crate::def::SurfacePoint;

/// A point of the surface, where it is in the rest shape and now.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MaterialPoint {
    triangle: u32,
    rest: DVec3,
    now: DVec3,
    /// The way outward in the rest shape.
    normal: DVec3,
}

impl Body {
    /// Where a point is in the material; `None`: the body cannot be cut.
    pub(crate) fn material_point(&self, point: &SurfacePoint) -> Option<MaterialPoint> {
        let corners = self.cuttable.as_ref()?.material.corners_at_rest(point.triangle);
        let sum: f64 = point.weights.iter().map(|&weight| f64::from(weight)).sum();
        let parts = corners.into_iter().zip(point.weights);
        let rest = parts.map(|(corner, weight)| corner * (f64::from(weight) / sum)).sum();
        let weights = point.weights.map(|weight| f64::from(weight) / sum);
        Some(MaterialPoint {
            triangle: point.triangle,
            rest,
            now: self.place_now(point.triangle, weights),
            normal: normal(corners),
        })
    }

    /// Where a point of the surface is, found from the nodes that move it: what is shown may be older.
    fn place_now(&self, triangle: u32, weights: [f64; 3]) -> DVec3 {
        let corners = self.system.surface[triangle as usize].into_iter().zip(weights);
        let parts = corners.flat_map(|(corner, weight)| {
            let parts = self.system.parts_of(corner);
            parts.map(move |(node, part)| (node, weight * f64::from(part)))
        });
        let positions = self.system.state.positions();
        parts
            .map(|(node, part)| part * positions.get(node as usize).as_dvec3())
            .sum()
    }

    /// The point of the surface that it is after cuts since a version of the topology.
    ///
    /// The two sides of a wound lie in one place of the rest shape: it stays on that which faces as it did, and is where it was, as no cut moves
    /// anything.
    pub(crate) fn surface_point(&self, point: &MaterialPoint, since: u64) -> Option<SurfacePoint> {
        let cuttable = self.cuttable.as_ref()?;
        let changed = cuttable.log.since(since).ok()?.triangles;
        let mut nearest: Option<(f64, SurfacePoint)> = None;
        for triangle in std::iter::once(point.triangle).chain(changed.iter().copied()) {
            let corners = cuttable.material.corners_at_rest(triangle);
            if normal(corners).dot(point.normal) < 0.0 {
                continue;
            }
            let weights = weights_of_nearest(point.rest, corners);
            let place: DVec3 = corners
                .iter()
                .zip(weights)
                .map(|(&corner, weight)| corner * weight)
                .sum();
            let now = self.place_now(triangle, weights);
            let off = place.distance_squared(point.rest) + now.distance_squared(point.now);
            if off.is_finite() && nearest.is_none_or(|(least, _)| off < least) {
                let weights = weights.map(|weight| weight.max(0.0) as f32);
                nearest = Some((off, SurfacePoint { triangle, weights }));
            }
        }
        nearest.map(|(_, point)| point)
    }
}

fn normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}

/// The weights of a triangle's corners in its point next to another (Ericson 2005, section 5.1.5).
fn weights_of_nearest(point: DVec3, [a, b, c]: [DVec3; 3]) -> [f64; 3] {
    let (ab, ac) = (b - a, c - a);
    let along = |from: DVec3| (ab.dot(point - from), ac.dot(point - from));
    let ((a1, a2), (b1, b2), (c1, c2)) = (along(a), along(b), along(c));
    if a1 <= 0.0 && a2 <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    if b1 >= 0.0 && b2 <= b1 {
        return [0.0, 1.0, 0.0];
    }
    if c2 >= 0.0 && c1 <= c2 {
        return [0.0, 0.0, 1.0];
    }
    let (of_a, of_b, of_c) = (b1 * c2 - c1 * b2, c1 * a2 - a1 * c2, a1 * b2 - b1 * a2);
    if of_c <= 0.0 && a1 >= 0.0 && b1 <= 0.0 {
        let part = a1 / (a1 - b1);
        return [1.0 - part, part, 0.0];
    }
    if of_b <= 0.0 && a2 >= 0.0 && c2 <= 0.0 {
        let part = a2 / (a2 - c2);
        return [1.0 - part, 0.0, part];
    }
    if of_a <= 0.0 && b2 - b1 >= 0.0 && c1 - c2 >= 0.0 {
        let part = (b2 - b1) / ((b2 - b1) + (c1 - c2));
        return [0.0, 1.0 - part, part];
    }
    let sum = of_a + of_b + of_c;
    [of_a / sum, of_b / sum, of_c / sum]
}
