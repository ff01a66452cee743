//! Directions across which a triangle may lie apart from an edge or face.

use glam::{Vec3, Vec3A, Vec4};

/// What rounding may make of a height, as a part of how far a corner is from the feature's first.
const ROUNDING: f32 = 2e-6;

/// An edge or face between four pairs of parallel planes: what lies beside one of them is no closer than that.
#[derive(Clone, Copy, Debug)]
pub(super) struct SeparatingPlanes {
    from: Vec3A,
    /// Across the planes, of unit length: along x, y and z of each.
    across: [Vec4; 3],
    /// Between which heights above `from` the feature lies.
    low: Vec4,
    high: Vec4,
}

impl SeparatingPlanes {
    /// Of an edge: its ends, and two directions across it.
    pub fn edge([a, b]: [Vec3; 2]) -> Self {
        let along = (b - a).normalize_or_zero();
        let (aside, across) = along
            .try_normalize()
            .map_or((Vec3::X, Vec3::Y), Vec3::any_orthonormal_pair);
        Self::between([along, aside, across, (aside + across).normalize()], &[a, b])
    }

    /// Of a face: its plane, and its sides.
    pub fn face([a, b, c]: [Vec3; 3]) -> Self {
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let side = |way: Vec3| way.cross(normal).normalize_or_zero();
        Self::between([normal, side(b - a), side(c - b), side(a - c)], &[a, b, c])
    }

    fn between(across: [Vec3; 4], corners: &[Vec3]) -> Self {
        let axis = |axis: usize| Vec4::from_array(across.map(|across| across[axis]));
        let mut planes = Self {
            from: corners[0].into(),
            across: [0, 1, 2].map(axis),
            low: Vec4::ZERO,
            high: Vec4::ZERO,
        };
        for &corner in &corners[1..] {
            let heights = planes.heights(Vec3A::from(corner) - planes.from);
            planes.low = planes.low.min(heights);
            planes.high = planes.high.max(heights);
        }
        planes
    }

    fn heights(&self, offset: Vec3A) -> Vec4 {
        self.across[0] * offset.x + self.across[1] * offset.y + self.across[2] * offset.z
    }

    /// Whether the planes tell that a triangle is further away than `distance`.
    #[inline]
    pub fn is_beyond(&self, triangle: &[Vec3; 3], distance: f32) -> bool {
        let offsets = triangle.map(|corner| Vec3A::from(corner) - self.from);
        let far = offsets[0].abs().max(offsets[1].abs()).max(offsets[2].abs());
        let distance = Vec4::splat(distance + ROUNDING * far.element_sum());
        let [a, b, c] = offsets.map(|offset| self.heights(offset));
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        (low - self.high).cmpgt(distance).any() || (self.low - high).cmpgt(distance).any()
    }
}
