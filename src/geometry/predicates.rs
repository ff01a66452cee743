//! Geometric predicates for cases where rounding would decide, in `f64` or exact.

use glam::{DVec3, Vec3};

use crate::base::symbolic_perturbation::{is_above, triple};

/// True if the segment from `p` to `q` passes through the inside of a triangle. Both ends must be further than `depth`
/// from its plane, and the intersection further than `depth` from its border. Touching or coplanar segments do not
/// count.
pub(crate) fn crosses(p: Vec3, q: Vec3, triangle: [Vec3; 3], depth: f64) -> bool {
    let corners = triangle.map(|corner| corner.as_dvec3());
    let (p, q) = (p.as_dvec3(), q.as_dvec3());
    let normal = (corners[1] - corners[0])
        .cross(corners[2] - corners[0])
        .normalize_or_zero();
    let [height_p, height_q] = [p, q].map(|end| normal.dot(end - corners[0]));
    if !(height_p.abs() > depth && height_q.abs() > depth && (height_p < 0.0) != (height_q < 0.0)) {
        return false;
    }
    let point = p.lerp(q, height_p / (height_p - height_q));
    (0..3).all(|side| {
        let (from, to) = (corners[side], corners[(side + 1) % 3]);
        normal.dot((to - from).cross(point - from)) > depth * from.distance(to)
    })
}

/// The fraction of the segment from `p` to `q` at which it intersects a triangle, and whether it enters through the
/// front.
///
/// Degenerate cases are resolved by a symbolic perturbation of the segment, the same for all triangles (Edelsbrunner,
/// Muecke 1990). Among triangles that share an edge or a corner, exactly the right number is intersected. `nodes` are
/// the triangle's node indices.
pub(crate) fn pierce(p: DVec3, q: DVec3, corners: [DVec3; 3], nodes: [u32; 3]) -> Option<(f64, bool)> {
    let [a, b, c] = corners;
    let normal = (b - a).cross(c - a);
    let (height_p, height_q) = (normal.dot(p - a), normal.dot(q - a));
    let (ab, ac) = (b - a, c - a);
    let enters = is_above(triple(p - a, ab, ac), normal);
    if enters == is_above(triple(q - a, ab, ac), normal) {
        return None;
    }
    let direction = q - p;
    // Each edge is evaluated from its lower node, so that both of its triangles get the same result.
    let passes_left = |from: usize, to: usize| {
        let reversed = nodes[from] > nodes[to];
        let (low, high) = if reversed {
            (corners[to], corners[from])
        } else {
            (corners[from], corners[to])
        };
        let (low, high) = (low - p, high - p);
        is_above(triple(direction, low, high), (low - high).cross(direction)) != reversed
    };
    let left = passes_left(0, 1);
    if passes_left(1, 2) != left || passes_left(2, 0) != left {
        return None;
    }
    Some(((height_p / (height_p - height_q)).clamp(0.0, 1.0), enters))
}

/// The signed solid angle of a triangle seen from a point, positive if its back is seen (Van Oosterom, Strackee 1983).
/// The sum over a closed surface is 4 pi inside and 0 outside.
pub(crate) fn solid_angle(point: DVec3, triangle: [DVec3; 3]) -> f64 {
    let [a, b, c] = triangle.map(|corner| corner - point);
    let [length_a, length_b, length_c] = [a, b, c].map(DVec3::length);
    let cosine = length_a * length_b * length_c + a.dot(b) * length_c + b.dot(c) * length_a + c.dot(a) * length_b;
    2.0 * libm::atan2(a.dot(b.cross(c)), cosine)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_segment_crosses_the_inside_of_a_triangle_alone() {
        let triangle = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let through = |x: f32, y: f32, from: f32, to: f32, depth: f64| {
            crosses(Vec3::new(x, y, from), Vec3::new(x, y, to), triangle, depth)
        };
        for depth in [0.0, 0.1] {
            assert!(through(0.2, 0.3, -1.0, 0.5, depth) && through(0.2, 0.3, 0.5, -1.0, depth));
            assert!(!through(0.2, 0.3, 0.1, 0.5, depth), "it lies on one side");
            assert!(!through(0.7, 0.7, -1.0, 1.0, depth) && !through(-0.1, 0.3, -1.0, 1.0, depth));
            assert_eq!(through(0.05, 0.3, -1.0, 1.0, depth), depth == 0.0);
            assert_eq!(through(0.2, 0.3, -1.0, 0.05, depth), depth == 0.0);
        }
    }
}
