//! Axis-aligned boxes.

use glam::{DVec3, Vec3};

use crate::codec::saved;
use crate::simd::Range;

/// The corners of an axis-aligned box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bounds {
    pub min: Vec3,
    pub max: Vec3,
}

saved! { Bounds { min, max } }

impl Default for Bounds {
    fn default() -> Self {
        Self::EMPTY
    }
}

impl Bounds {
    pub const EMPTY: Self = Self {
        min: Vec3::INFINITY,
        max: Vec3::NEG_INFINITY,
    };

    /// The box about `points`; a NaN among them is not seen.
    pub fn of(points: impl Iterator<Item = Vec3>) -> Self {
        points.fold(Self::EMPTY, Self::with)
    }

    /// The largest magnitude of a coordinate along each axis.
    pub fn magnitudes(&self) -> Vec3 {
        self.min.abs().max(self.max.abs())
    }

    pub fn with(self, point: Vec3) -> Self {
        Self {
            min: self.min.min(point),
            max: self.max.max(point),
        }
    }

    /// The box about both.
    pub fn and(self, other: &Self) -> Self {
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
        }
    }

    pub fn extended(self, margin: f32) -> Self {
        Self {
            min: self.min - margin,
            max: self.max + margin,
        }
    }

    pub fn moved(self, by: DVec3) -> Self {
        let [min, max] = [self.min, self.max].map(|corner| (corner.as_dvec3() + by).as_vec3());
        Self { min, max }
    }

    pub fn contains(&self, other: &Self) -> bool {
        self.min.cmple(other.min).all() && other.max.cmple(self.max).all()
    }

    pub fn overlaps(&self, other: &Self) -> bool {
        self.min.cmple(other.max).all() && other.min.cmple(self.max).all()
    }
}

impl From<[Range; 3]> for Bounds {
    fn from(ranges: [Range; 3]) -> Self {
        Self {
            min: ranges.map(|range| range.least).into(),
            max: ranges.map(|range| range.greatest).into(),
        }
    }
}
