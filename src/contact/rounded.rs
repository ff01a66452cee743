//! The surface of a sphere or capsule as triangles, for images, which see nothing else.

use std::f32::consts::{PI, TAU};

use glam::Vec3;

use crate::base::{Result, memory};

/// Around the axis, and from one pole to the other: corners lie on the surface, and the middle of a triangle 0.2 % of the radius within.
const SEGMENTS: u32 = 64;
const RINGS: u32 = 32;

/// Of all that is within `radius` of a segment along y that reaches `half_length` to either side; outward.
pub(super) fn surface(radius: f32, half_length: f32) -> Result<(Vec<Vec3>, Vec<[u32; 3]>)> {
    // The equator twice, once at each end of the segment; a sphere's are one.
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
        let last = (rings - 1) * SEGMENTS;
        triangles.push([poles[0], segment, next]);
        triangles.push([poles[1], last + next, last + segment]);
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
    fn it_encloses_what_a_sphere_and_a_capsule_do() {
        for half_length in [0.0, 0.7_f32] {
            let radius = 0.3_f32;
            let (positions, triangles) = surface(radius, half_length).expect("a surface");
            let closed = ClosedSurface::new(&positions, &triangles).expect("closed");
            let (radius, half_length) = (f64::from(radius), f64::from(half_length));
            let pi = std::f64::consts::PI;
            let whole = pi * radius.powi(2) * (4.0 / 3.0 * radius + 2.0 * half_length);
            let lacks = 1.0 - closed.volume() / whole;
            assert!(lacks > 0.0 && lacks < 0.006, "{half_length}: {lacks}");
        }
    }
}
