//! Tessellation of shapes.

use glam::Vec3;
use std::f32::consts::{PI, TAU};

/// The segments around the axis of a sphere or capsule. The image of a sphere misses less than 0.1 % of its area.
const SEGMENTS: u32 = 96;
/// The rings from one pole to the other. The number is even, so that a capsule can be split at the equator.
const RINGS: u32 = 48;
/// The segments around the disc of a plane.
const RIM: u32 = 64;

/// Positions, normals and triangles.
pub(crate) type Tessellation = (Vec<Vec3>, Vec<Vec3>, Vec<[u32; 3]>);

/// A capsule, or a sphere if both ends are equal.
pub(crate) fn capsule(start: Vec3, end: Vec3, radius: f32) -> Tessellation {
    let axis = (end - start).try_normalize().unwrap_or(Vec3::Y);
    let (side, other) = axis.any_orthonormal_pair();
    let (mut positions, mut normals, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
    // The equator occurs twice: once at each end of the segment.
    for ring in 0..=RINGS + 1 {
        let (centre, step) = if ring <= RINGS / 2 {
            (end, ring)
        } else {
            (start, ring - 1)
        };
        let (sine, cosine) = (PI * step as f32 / RINGS as f32).sin_cos();
        for segment in 0..SEGMENTS {
            let (y, x) = (TAU * segment as f32 / SEGMENTS as f32).sin_cos();
            let normal = axis * cosine + (side * x + other * y) * sine;
            positions.push(centre + normal * radius);
            normals.push(normal);
        }
    }
    for ring in 0..=RINGS {
        for segment in 0..SEGMENTS {
            let next = (segment + 1) % SEGMENTS;
            let [a, b] = [segment, next].map(|column| ring * SEGMENTS + column);
            let [c, d] = [segment, next].map(|column| (ring + 1) * SEGMENTS + column);
            triangles.extend([[a, c, d], [a, d, b]]);
        }
    }
    (positions, normals, triangles)
}

/// A disc, visible from the side of the unit vector `normal`.
pub(crate) fn disc(centre: Vec3, normal: Vec3, radius: f32) -> Tessellation {
    let (side, other) = normal.any_orthonormal_pair();
    let mut positions = vec![centre];
    positions.extend((0..RIM).map(|step| {
        let (y, x) = (TAU * step as f32 / RIM as f32).sin_cos();
        centre + (side * x + other * y) * radius
    }));
    let triangles = (0..RIM).map(|step| [0, 1 + step, 1 + (step + 1) % RIM]).collect();
    (positions, vec![normal; RIM as usize + 1], triangles)
}

/// A strip along a segment, facing the eye, with the normals of a thin rod. `None` if the eye is in line with it.
pub(crate) fn ribbon(ends: [Vec3; 2], half_widths: [f32; 2], eye: Vec3) -> Option<Tessellation> {
    let [a, b] = ends;
    let to_eye = (eye - (a + b) / 2.0).try_normalize()?;
    let side = (b - a).cross(to_eye).try_normalize()?;
    let at = |end: usize, sign: f32| ends[end] + side * (sign * half_widths[end]);
    let positions = vec![at(0, 1.0), at(1, 1.0), at(1, -1.0), at(0, -1.0)];
    let rod_normal = |sign: f32| side * (0.8 * sign) + to_eye * 0.6;
    let normals = vec![rod_normal(1.0), rod_normal(1.0), rod_normal(-1.0), rod_normal(-1.0)];
    Some((positions, normals, vec![[0, 1, 2], [0, 2, 3]]))
}

/// The 26 unit vectors from the center of a cube to its faces, edges and corners.
pub(crate) fn directions() -> [Vec3; 26] {
    std::array::from_fn(|index| {
        // 27 positions in a block of 3 x 3 x 3 without the center.
        let cell = if index < 13 { index } else { index + 1 } as i32;
        let coordinate = |divisor: i32| (cell / divisor % 3 - 1) as f32;
        Vec3::new(coordinate(9), coordinate(3), coordinate(1)).normalize_or_zero()
    })
}

/// Adds vertex normals of the deformed surface: the mean of the triangles' normals, weighted by the angle at the
/// vertex (Thürmer and Wüthrich, "Computing vertex normals from polygonal facets", 1998). 0 for a vertex without
/// triangles.
///
/// `normals` has one entry per position, all zero; indices must be valid.
pub(crate) fn add_vertex_normals(positions: &[Vec3], triangles: impl Iterator<Item = [u32; 3]>, normals: &mut [Vec3]) {
    for triangle in triangles {
        let corners = triangle.map(|index| positions[index as usize]);
        let face = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let face = face.normalize_or_zero();
        if !face.is_finite() {
            continue;
        }
        for i in 0..3 {
            let [corner, next, previous] = [0, 1, 2].map(|k| corners[(i + k) % 3]);
            let angle = (next - corner).angle_between(previous - corner);
            if angle.is_finite() {
                normals[triangle[i] as usize] += face * angle;
            }
        }
    }
    for normal in normals {
        *normal = normal.normalize_or_zero();
    }
}
