//! Triangulated surface of a sphere or capsule, for image-space detection.

use std::f32::consts::{PI, TAU};

use glam::Vec3;

use crate::base::{Result, memory};

/// Segments around the axis, and rings from pole to pole. Corners lie on the surface; the middle of a triangle is 0.2
/// % of the radius inside.
const SEGMENTS: u32 = 64;
const RINGS: u32 = 32;

/// Returns the outward surface of all points within `radius` of a segment along y of length `2 * half_length`.
pub(super) fn surface(radius: f32, half_length: f32) -> Result<(Vec<Vec3>, Vec<[u32; 3]>)> {
    // A capsule has two equators, one at each end of the segment.
    let is_long = half_length > 0.0;
    let rings = if is_long { RINGS } else { RINGS - 1 };
    let mut positions = memory::reserved((rings * SEGMENTS + 2) as usize)?;
    let mut triangles = memory::reserved((2 * rings * SEGMENTS) as usize)?;
    for ring in 0..rings {
        let is_lower = is_long && ring >= RINGS / 2;
        let step = ring + u32::from(!is_lower);
        let (sine, cosine) = libm::sincosf(PI * step as f32 / RINGS as f32);
        let shift = if is_lower { -half_length } else { half_length };
        for segment in 0..SEGMENTS {
            let (x, z) = libm::sincosf(TAU * segment as f32 / SEGMENTS as f32);
            positions.push(radius * Vec3::new(sine * x, cosine, sine * z) + Vec3::Y * shift);
        }
    }
    let poles = [rings * SEGMENTS, rings * SEGMENTS + 1];
    positions.extend([1.0, -1.0].map(|side| Vec3::Y * (side * (radius + half_length))));
    for segment in 0..SEGMENTS {
        let next = (segment + 1) % SEGMENTS;
        let last_ring = (rings - 1) * SEGMENTS;
        triangles.push([poles[0], segment, next]);
        triangles.push([poles[1], last_ring + next, last_ring + segment]);
        for ring in 1..rings {
            let [a, b] = [segment, next].map(|column| (ring - 1) * SEGMENTS + column);
            let [c, d] = [segment, next].map(|column| ring * SEGMENTS + column);
            triangles.extend([[a, c, d], [a, d, b]]);
        }
    }
    Ok((positions, triangles))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::ClosedSurface;

    #[test]
    fn surface_has_the_volume_of_a_sphere_or_capsule() {
        for half_length in [0.0, 0.7_f32] {
            let radius = 0.3_f32;
            let (positions, triangles) = surface(radius, half_length).expect("a surface");
            let closed = ClosedSurface::new(&positions, &triangles).expect("closed");
            let (radius, half_length) = (f64::from(radius), f64::from(half_length));
            let pi = std::f64::consts::PI;
            let exact = pi * radius.powi(2) * (4.0 / 3.0 * radius + 2.0 * half_length);
            let lacks = 1.0 - closed.volume() / exact;
            assert!(lacks > 0.0 && lacks < 0.006, "{half_length}: {lacks}");
        }
    }
}
