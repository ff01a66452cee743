//! Which side, and whether it crosses: in `f64`, where rounding would decide.

use glam::{DVec3, Vec3};

/// What rounding may make of a volume, as a part of the sum of its products' sizes (Shewchuk 1997, the first of his bounds).
const ROUNDING: f64 = 1e-15;

/// Six times the volume of the tetrahedron: above 0 where `a`, `b`, `c` turn clockwise seen from `d`; 0 where rounding might decide
/// its sign. Of coordinates rounded to `f32` differences are exact.
pub(crate) fn volume(a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> f64 {
    let (b, c, d) = (b - a, c - a, d - a);
    let volume = b.dot(c.cross(d));
    let size = b.abs().dot(DVec3::new(
        (c.y * d.z).abs() + (c.z * d.y).abs(),
        (c.z * d.x).abs() + (c.x * d.z).abs(),
        (c.x * d.y).abs() + (c.y * d.x).abs(),
    ));
    if volume.abs() > ROUNDING * size { volume } else { 0.0 }
}

/// Whether the segment from `p` to `q` passes through the inside of the triangle from one side to the other, beyond doubt; what only
/// touches, or lies in its plane, does not.
pub(crate) fn crosses(p: Vec3, q: Vec3, triangle: [Vec3; 3]) -> bool {
    let [a, b, c] = triangle.map(|corner| corner.as_dvec3());
    let (p, q) = (p.as_dvec3(), q.as_dvec3());
    if !(volume(a, b, c, p) * volume(a, b, c, q) < 0.0) {
        return false;
    }
    let sides = [volume(p, q, a, b), volume(p, q, b, c), volume(p, q, c, a)];
    sides.iter().all(|&side| side > 0.0) || sides.iter().all(|&side| side < 0.0)
}

/// How far along the segment from `p` to `q` it passes through a triangle, 0 to 1, and whether it goes in at its front.
///
/// As if the segment were shifted by next to nothing, in one direction for all triangles (Edelsbrunner, Muecke 1990): of triangles that share an
/// edge or a corner, of which `nodes` are the numbers, it passes through as many as it should.
pub(crate) fn pierce(p: DVec3, q: DVec3, corners: [DVec3; 3], nodes: [u32; 3]) -> Option<(f64, bool)> {
    let [a, b, c] = corners;
    let normal = (b - a).cross(c - a);
    let (height_p, height_q) = (normal.dot(p - a), normal.dot(q - a));
    // The shift goes along x, by far less along y, and by far less again along z.
    let is_above = |height: f64, shifted: DVec3| {
        [height, shifted.x, shifted.y, shifted.z]
            .into_iter()
            .find(|&term| term != 0.0)
            .is_some_and(|term| term > 0.0)
    };
    let enters = is_above(height_p, normal);
    if enters == is_above(height_q, normal) {
        return None;
    }
    let way = q - p;
    // Each side is seen the same by both of its triangles: from the lower node on.
    let passes_left = |from: usize, to: usize| {
        let turned = nodes[from] > nodes[to];
        let (low, high) = if turned {
            (corners[to], corners[from])
        } else {
            (corners[from], corners[to])
        };
        let side = way.dot((low - p).cross(high - p));
        is_above(side, (low - high).cross(way)) != turned
    };
    let left = passes_left(0, 1);
    if passes_left(1, 2) != left || passes_left(2, 0) != left {
        return None;
    }
    Some(((height_p / (height_p - height_q)).clamp(0.0, 1.0), enters))
}

/// The solid angle that a triangle takes of all that is seen from a point, 4 pi in all; above 0 where its back is seen (Van Oosterom,
/// Strackee 1983). Over all triangles of a closed surface this is 4 pi inside and 0 outside.
pub(crate) fn solid_angle(point: DVec3, triangle: [DVec3; 3]) -> f64 {
    let [a, b, c] = triangle.map(|corner| corner - point);
    let [length_a, length_b, length_c] = [a, b, c].map(DVec3::length);
    let cosine = length_a * length_b * length_c + a.dot(b) * length_c + b.dot(c) * length_a + c.dot(a) * length_b;
    2.0 * a.dot(b.cross(c)).atan2(cosine)
}
