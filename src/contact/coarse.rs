//! A coarse grid of distances, so that what is far from a surface costs one look.

use glam::{UVec3, Vec3};

use crate::body::Bounds;
use crate::error::Result;
use crate::memory;

/// Cells for each triangle, about, and in all.
const CELLS_PER_TRIANGLE: usize = 4;
const CELLS: std::ops::RangeInclusive<usize> = 1 << 12..=1 << 16;

/// What rounding may make of a distance, as a part of the largest coordinate.
const ROUNDING: f32 = 1e-6;

/// Signed distances at the centres of cubes.
#[derive(Debug)]
pub(super) struct Coarse {
    low: Vec3,
    cell: f32,
    counts: UVec3,
    distances: Vec<f32>,
    doubt: f32,
}

impl Coarse {
    /// About a solid of so many triangles within `bounds`. `measure` tells the signed distance of a point, with a bound on its size.
    pub fn new(bounds: Bounds, triangles: usize, mut measure: impl FnMut(Vec3, f32) -> f32) -> Result<Self> {
        let sides = bounds.max - bounds.min;
        let cells = (triangles * CELLS_PER_TRIANGLE).clamp(*CELLS.start(), *CELLS.end());
        let longest = sides.max_element();
        // A flat solid has as many cells as its largest side takes.
        let cell = (sides
            .as_dvec3()
            .max(sides.as_dvec3() * 0.0 + f64::from(longest) / 64.0)
            .element_product()
            / cells as f64)
            .cbrt() as f32;
        let low = bounds.min - cell;
        let counts = ((sides / cell).ceil() + 2.0).as_uvec3().max(UVec3::ONE);
        let count = counts.as_u64vec3().element_product() as usize;
        let mut grid = Self {
            low,
            cell,
            counts,
            distances: memory::reserved(count)?,
            doubt: ROUNDING * bounds.min.abs().max(bounds.max.abs()).max_element(),
        };
        let mut before = f32::INFINITY;
        for z in 0..counts.z {
            for y in 0..counts.y {
                for x in 0..counts.x {
                    let centre = grid.centre(UVec3::new(x, y, z));
                    // No point is further from the surface than its neighbour and the way to it.
                    let most = if x == 0 {
                        f32::INFINITY
                    } else {
                        before.abs() + 1.01 * cell
                    };
                    before = measure(centre, most + grid.doubt);
                    grid.distances.push(before);
                }
            }
        }
        Ok(grid)
    }

    fn centre(&self, place: UVec3) -> Vec3 {
        self.low + (place.as_vec3() + 0.5) * self.cell
    }

    /// What the signed distance of a point lies between; `None` outside of the grid.
    #[inline]
    pub fn between(&self, point: Vec3) -> Option<(f32, f32)> {
        let place = (point - self.low) / self.cell;
        if !(place.cmpge(Vec3::ZERO).all() && place.cmplt(self.counts.as_vec3()).all()) {
            return None;
        }
        let place = place.as_uvec3();
        let index = (place.z * self.counts.y + place.y) * self.counts.x + place.x;
        let distance = self.distances[index as usize];
        let away = point.distance(self.centre(place)) + self.doubt;
        Some((distance - away, distance + away))
    }
}
