//! Points of the material, which stay where they are in the rest shape whatever is cut.

use glam::DVec3;

use super::Body;
use crate::def::SurfacePoint;

/// A point of the surface, with its positions in the rest shape and now.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MaterialPoint {
    triangle: u32,
    rest: DVec3,
    now: DVec3,
    /// The outward direction in the rest shape.
    normal: DVec3,
}

impl Body {
    /// The position of a point in the material; `None` if the body cannot be cut.
    pub(crate) fn material_point(&self, point: &SurfacePoint) -> Option<MaterialPoint> {
        let corners = self.cut_state.as_ref()?.material.corners_at_rest(point.triangle);
        let sum: f64 = point.weights.iter().map(|&weight| f64::from(weight)).sum();
        let parts = corners.into_iter().zip(point.weights);
        let rest = parts.map(|(corner, weight)| corner * (f64::from(weight) / sum)).sum();
        let weights = point.weights.map(|weight| f64::from(weight) / sum);
        Some(MaterialPoint {
            triangle: point.triangle,
            rest,
            now: self.current_position(point.triangle, weights),
            normal: normal(corners),
        })
    }

    /// The current position of a point of the surface, computed from the nodes that move it. Published positions may be
    /// older.
    fn current_position(&self, triangle: u32, weights: [f64; 3]) -> DVec3 {
        let corners = self.system.surface[triangle as usize].into_iter().zip(weights);
        let parts = corners.flat_map(|(corner, weight)| {
            let parts = self.system.weighted_nodes_of(corner);
            parts.map(move |(node, fraction)| (node, weight * f64::from(fraction)))
        });
        let positions = self.system.state.positions();
        parts
            .map(|(node, fraction)| fraction * positions.get(node as usize).as_dvec3())
            .sum()
    }

    /// The point of the surface that corresponds to a material point after the cuts since a version of the topology.
    ///
    /// The two sides of a wound coincide in the rest shape. The point stays on the side with the same outward
    /// direction. No cut moves anything, so it also keeps its current position.
    pub(crate) fn surface_point(&self, point: &MaterialPoint, since: u64) -> Option<SurfacePoint> {
        let cut_state = self.cut_state.as_ref()?;
        let changed = cut_state.log.since(since).ok()?.triangles;
        let mut nearest: Option<(f64, SurfacePoint)> = None;
        for triangle in std::iter::once(point.triangle).chain(changed.iter().copied()) {
            let corners = cut_state.material.corners_at_rest(triangle);
            if normal(corners).dot(point.normal) < 0.0 {
                continue;
            }
            let weights = closest_point_weights(point.rest, corners);
            let rest_position: DVec3 = corners
                .iter()
                .zip(weights)
                .map(|(&corner, weight)| corner * weight)
                .sum();
            let now = self.current_position(triangle, weights);
            let distance_squared = rest_position.distance_squared(point.rest) + now.distance_squared(point.now);
            if distance_squared.is_finite() && nearest.is_none_or(|(smallest, _)| distance_squared < smallest) {
                let weights = weights.map(|weight| weight.max(0.0) as f32);
                nearest = Some((distance_squared, SurfacePoint { triangle, weights }));
            }
        }
        nearest.map(|(_, point)| point)
    }
}

fn normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}

/// The barycentric weights of the point of a triangle that is closest to another point (Ericson 2005, section 5.1.5).
fn closest_point_weights(point: DVec3, [a, b, c]: [DVec3; 3]) -> [f64; 3] {
    let (ab, ac) = (b - a, c - a);
    let projections = |from: DVec3| (ab.dot(point - from), ac.dot(point - from));
    let ((a1, a2), (b1, b2), (c1, c2)) = (projections(a), projections(b), projections(c));
    if a1 <= 0.0 && a2 <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    if b1 >= 0.0 && b2 <= b1 {
        return [0.0, 1.0, 0.0];
    }
    if c2 >= 0.0 && c1 <= c2 {
        return [0.0, 0.0, 1.0];
    }
    let (area_a, area_b, area_c) = (b1 * c2 - c1 * b2, c1 * a2 - a1 * c2, a1 * b2 - b1 * a2);
    if area_c <= 0.0 && a1 >= 0.0 && b1 <= 0.0 {
        let fraction = a1 / (a1 - b1);
        return [1.0 - fraction, fraction, 0.0];
    }
    if area_b <= 0.0 && a2 >= 0.0 && c2 <= 0.0 {
        let fraction = a2 / (a2 - c2);
        return [1.0 - fraction, 0.0, fraction];
    }
    if area_a <= 0.0 && b2 - b1 >= 0.0 && c1 - c2 >= 0.0 {
        let fraction = (b2 - b1) / ((b2 - b1) + (c1 - c2));
        return [0.0, 1.0 - fraction, fraction];
    }
    let sum = area_a + area_b + area_c;
    [area_a / sum, area_b / sum, area_c / sum]
}
