//! A coarse grid of distances, so that what is far from a surface costs one look.

use glam::{UVec3, Vec3};

use crate::base::{Result, memory};
use crate::geometry::Bounds;

/// Cells for each triangle, about, and in all.
const CELLS_PER_TRIANGLE: usize = 4;
const CELLS: std::ops::RangeInclusive<usize> = 1 << 12..=1 << 16;

/// What rounding may make of a distance, as a part of the largest coordinate.
const ROUNDING: f32 = 1e-6;

/// The signed distance at a cell's centre, and the place of the triangle that is closest there.
pub(in crate::contact) type Sample = (f32, u32);

/// What is known of a point.
#[derive(Clone, Copy, Debug)]
pub(in crate::contact) struct Between {
    /// Its signed distance is no less, and no more.
    pub least: f32,
    pub most: f32,
    /// The place of a triangle that may be closest.
    pub hint: Option<u32>,
}

/// Signed distances at the centres of cubes.
#[derive(Debug)]
pub(in crate::contact) struct CoarseField {
    low: Vec3,
    cell: f32,
    counts: UVec3,
    distances: Vec<Sample>,
    doubt: f32,
}

impl CoarseField {
    /// About a solid of so many triangles within `bounds`. `measure` tells of a point, given a triangle that may be closest.
    pub fn new(bounds: Bounds, triangles: usize, measure: impl Fn(Vec3, u32) -> Sample) -> Result<Self> {
        let sides = bounds.max - bounds.min;
        let cells = (triangles * CELLS_PER_TRIANGLE).clamp(*CELLS.start(), *CELLS.end());
        let longest = sides.max_element();
        // A flat solid has as many cells as its largest side takes.
        let volume = sides
            .as_dvec3()
            .max(sides.as_dvec3() * 0.0 + f64::from(longest) / 64.0)
            .element_product();
        let cell = libm::cbrt(volume / cells as f64) as f32;
        let low = bounds.min - cell;
        let counts = ((sides / cell).ceil() + 2.0).as_uvec3().max(UVec3::ONE);
        let count = counts.as_u64vec3().element_product() as usize;
        let mut grid = Self {
            low,
            cell,
            counts,
            distances: memory::reserved(count)?,
            doubt: ROUNDING * bounds.magnitudes().max_element(),
        };
        let mut hint = 0;
        for z in 0..counts.z {
            for y in 0..counts.y {
                for x in 0..counts.x {
                    let sample = measure(grid.centre(UVec3::new(x, y, z)), hint);
                    hint = sample.1;
                    grid.distances.push(sample);
                }
            }
        }
        Ok(grid)
    }

    /// Names the closest triangles otherwise than by their places.
    pub fn name_hints(&mut self, name: impl Fn(u32) -> u32) {
        self.distances.iter_mut().for_each(|(_, hint)| *hint = name(*hint));
    }

    fn centre(&self, place: UVec3) -> Vec3 {
        self.low + (place.as_vec3() + 0.5) * self.cell
    }

    /// What is known of a point; `None` outside of the grid.
    #[inline]
    pub fn between(&self, point: Vec3) -> Option<Between> {
        let place = (point - self.low) / self.cell;
        if !(place.cmpge(Vec3::ZERO).all() && place.cmplt(self.counts.as_vec3()).all()) {
            return None;
        }
        let place = place.as_uvec3();
        let index = (place.z * self.counts.y + place.y) * self.counts.x + place.x;
        let (distance, hint) = self.distances[index as usize];
        let away = point.distance(self.centre(place)) + self.doubt;
        Some(Between {
            least: distance - away,
            most: distance + away,
            hint: Some(hint),
        })
    }
}
