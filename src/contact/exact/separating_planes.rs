//! Separating-plane test between a triangle and an edge or face.

use glam::{Vec3, Vec3A, Vec4};

/// Rounding error of a height, relative to a corner's distance from the feature's first corner.
const ROUNDING: f32 = 2e-6;

/// An edge or face between four pairs of parallel planes, which bound its distance from below.
#[derive(Clone, Copy, Debug)]
pub(super) struct SeparatingPlanes {
    origin: Vec3A,
    /// Unit normals of the planes: the x, y and z components of all four.
    normals: [Vec4; 3],
    /// Range of the feature's heights above `origin`.
    low: Vec4,
    high: Vec4,
}

impl SeparatingPlanes {
    /// Planes of an edge: along its ends, and in two directions across it.
    pub fn edge([a, b]: [Vec3; 2]) -> Self {
        let along = (b - a).normalize_or_zero();
        let (first, second) = along
            .try_normalize()
            .map_or((Vec3::X, Vec3::Y), Vec3::any_orthonormal_pair);
        Self::new([along, first, second, (first + second).normalize()], &[a, b])
    }

    /// Planes of a face: its own, and those of its sides.
    pub fn face([a, b, c]: [Vec3; 3]) -> Self {
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let side = |edge: Vec3| edge.cross(normal).normalize_or_zero();
        Self::new([normal, side(b - a), side(c - b), side(a - c)], &[a, b, c])
    }

    fn new(normals: [Vec3; 4], corners: &[Vec3]) -> Self {
        let axis = |axis: usize| Vec4::from_array(normals.map(|normal| normal[axis]));
        let mut planes = Self {
            origin: corners[0].into(),
            normals: [0, 1, 2].map(axis),
            low: Vec4::ZERO,
            high: Vec4::ZERO,
        };
        for &corner in &corners[1..] {
            let heights = planes.heights(Vec3A::from(corner) - planes.origin);
            planes.low = planes.low.min(heights);
            planes.high = planes.high.max(heights);
        }
        planes
    }

    fn heights(&self, offset: Vec3A) -> Vec4 {
        self.normals[0] * offset.x + self.normals[1] * offset.y + self.normals[2] * offset.z
    }

    /// True if a plane separates a triangle from the feature by more than `distance`.
    #[inline]
    pub fn separates(&self, triangle: &[Vec3; 3], distance: f32) -> bool {
        let offsets = triangle.map(|corner| Vec3A::from(corner) - self.origin);
        let extent = offsets[0].abs().max(offsets[1].abs()).max(offsets[2].abs());
        let distance = Vec4::splat(distance + ROUNDING * extent.element_sum());
        let [a, b, c] = offsets.map(|offset| self.heights(offset));
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        (low - self.high).cmpgt(distance).any() || (self.low - high).cmpgt(distance).any()
    }
}
