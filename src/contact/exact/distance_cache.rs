//! Coarse grid of signed distances, which bounds the distance of points far from a surface without a search.

use glam::{UVec3, Vec3};

use crate::base::{Result, memory};
use crate::geometry::Aabb;

/// Number of cells per triangle, about, and range of the total number.
const CELLS_PER_TRIANGLE: usize = 4;
const CELLS: std::ops::RangeInclusive<usize> = 1 << 12..=1 << 16;

/// Rounding error of a distance, relative to the largest coordinate.
const ROUNDING: f32 = 1e-6;

/// Signed distance at a cell's center, and the tree slot of the triangle closest to it.
pub(in crate::contact) type Sample = (f32, u32);

/// Bounds of a point's distance.
#[derive(Clone, Copy, Debug)]
pub(in crate::contact) struct DistanceRange {
    /// Lower and upper bound of the signed distance.
    pub min: f32,
    pub max: f32,
    /// Tree slot of a triangle that may be closest.
    pub hint: Option<u32>,
}

/// Signed distances at the centers of grid cells.
#[derive(Debug)]
pub(in crate::contact) struct DistanceCache {
    low: Vec3,
    cell_size: f32,
    counts: UVec3,
    distances: Vec<Sample>,
    rounding: f32,
}

impl DistanceCache {
    /// Samples a solid with `triangles` triangles within `bounds`. `measure` returns the sample of a point, given a
    /// triangle that may be closest.
    pub fn new(bounds: Aabb, triangles: usize, measure: impl Fn(Vec3, u32) -> Sample) -> Result<Self> {
        let sides = bounds.max - bounds.min;
        let cells = (triangles * CELLS_PER_TRIANGLE).clamp(*CELLS.start(), *CELLS.end());
        let longest = sides.max_element();
        // A flat solid gets as many cells as its largest side takes.
        let volume = sides
            .as_dvec3()
            .max(sides.as_dvec3() * 0.0 + f64::from(longest) / 64.0)
            .element_product();
        let cell_size = libm::cbrt(volume / cells as f64) as f32;
        let low = bounds.min - cell_size;
        let counts = ((sides / cell_size).ceil() + 2.0).as_uvec3().max(UVec3::ONE);
        let count = counts.as_u64vec3().element_product() as usize;
        let mut grid = Self {
            low,
            cell_size,
            counts,
            distances: memory::reserved(count)?,
            rounding: ROUNDING * bounds.magnitudes().max_element(),
        };
        let mut hint = 0;
        for z in 0..counts.z {
            for y in 0..counts.y {
                for x in 0..counts.x {
                    let sample = measure(grid.center(UVec3::new(x, y, z)), hint);
                    hint = sample.1;
                    grid.distances.push(sample);
                }
            }
        }
        Ok(grid)
    }

    /// Replaces tree slots of the closest triangles by other indices.
    pub fn map_hints(&mut self, map: impl Fn(u32) -> u32) {
        self.distances.iter_mut().for_each(|(_, hint)| *hint = map(*hint));
    }

    fn center(&self, cell: UVec3) -> Vec3 {
        self.low + (cell.as_vec3() + 0.5) * self.cell_size
    }

    /// Returns bounds of a point's distance; `None` outside the grid.
    #[inline]
    pub fn distance_range(&self, point: Vec3) -> Option<DistanceRange> {
        let offset = (point - self.low) / self.cell_size;
        if !(offset.cmpge(Vec3::ZERO).all() && offset.cmplt(self.counts.as_vec3()).all()) {
            return None;
        }
        let cell = offset.as_uvec3();
        let index = (cell.z * self.counts.y + cell.y) * self.counts.x + cell.x;
        let (distance, hint) = self.distances[index as usize];
        let uncertainty = point.distance(self.center(cell)) + self.rounding;
        Some(DistanceRange {
            min: distance - uncertainty,
            max: distance + uncertainty,
            hint: Some(hint),
        })
    }
}
