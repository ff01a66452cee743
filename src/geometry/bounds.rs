//! Axis-aligned bounding boxes.

use glam::{DVec3, Vec3};

use crate::codec::saved;
use crate::simd::Range;

/// An axis-aligned bounding box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Aabb {
    pub min: Vec3,
    pub max: Vec3,
}

saved! { Aabb { min, max } }

impl Default for Aabb {
    fn default() -> Self {
        Self::EMPTY
    }
}

impl Aabb {
    pub const EMPTY: Self = Self {
        min: Vec3::INFINITY,
        max: Vec3::NEG_INFINITY,
    };

    /// The bounding box of `points`. NaN coordinates are ignored.
    pub fn of(points: impl Iterator<Item = Vec3>) -> Self {
        points.fold(Self::EMPTY, Self::with)
    }

    /// The largest absolute coordinate along each axis.
    pub fn magnitudes(&self) -> Vec3 {
        self.min.abs().max(self.max.abs())
    }

    pub fn with(self, point: Vec3) -> Self {
        Self {
            min: self.min.min(point),
            max: self.max.max(point),
        }
    }

    /// The union of two boxes.
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

impl From<[Range; 3]> for Aabb {
    fn from(ranges: [Range; 3]) -> Self {
        Self {
            min: ranges.map(|range| range.least).into(),
            max: ranges.map(|range| range.greatest).into(),
        }
    }
}
