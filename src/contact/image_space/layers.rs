//! Layered depth image (Shade et al. 1998): for each pixel, all surfaces that the ray through its center crosses,
//! sorted by depth.

use glam::Vec3;

use super::projection::Projection;
use super::rasterize::draw_triangles;
use crate::base::{Result, memory};
use crate::codec::saved;

/// An intersection of a pixel's ray with a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct RayCrossing {
    /// Distance along the view, m.
    pub depth: f32,
    /// Twice the triangle's index, plus 1 if the ray enters.
    code: u32,
}

saved! { RayCrossing { depth, code } }

impl RayCrossing {
    fn new(depth: f32, triangle: usize, enters: bool) -> Self {
        Self {
            depth,
            code: (triangle as u32) << 1 | u32::from(enters),
        }
    }

    pub fn triangle(&self) -> u32 {
        self.code >> 1
    }

    /// Change of the winding number along the ray.
    pub fn winding(&self) -> i32 {
        if self.code & 1 == 1 { 1 } else { -1 }
    }
}

/// The crossings of all pixels, sorted by depth in each pixel.
#[derive(Debug, Default)]
pub(super) struct Layers {
    /// End of each pixel's crossings, and start of the next pixel's.
    ends: Vec<u32>,
    crossings: Vec<RayCrossing>,
}

saved! { Layers { ends, crossings } }

impl Layers {
    /// Reserves memory for this many pixels and crossings.
    pub fn reserved(pixels: usize, crossings: usize) -> Result<Self> {
        Ok(Self {
            ends: memory::reserved(pixels)?,
            crossings: memory::reserved(crossings)?,
        })
    }

    /// Draws a surface into new memory.
    pub fn new(projection: &Projection, positions: &[Vec3], triangles: &[[u32; 3]]) -> Result<Self> {
        let mut layers = Self::reserved(projection.pixel_count(), 0)?;
        let corners = |triangle: usize| Some(triangles[triangle].map(|node| positions[node as usize]));
        let crossings = layers.count(projection, triangles.len(), &corners);
        layers.crossings = memory::reserved(crossings)?;
        layers.fill(crossings, projection, triangles.len(), &corners);
        Ok(layers)
    }

    /// Draws `count` triangles into the reserved memory, without those that have no corners. Returns false if the
    /// memory is too small.
    pub fn draw(
        &mut self,
        projection: &Projection,
        count: usize,
        corners: &impl Fn(usize) -> Option<[Vec3; 3]>,
    ) -> bool {
        if projection.pixel_count() > self.ends.capacity() {
            return false;
        }
        let crossings = self.count(projection, count, corners);
        let fits = crossings <= self.crossings.capacity().min(u32::MAX as usize);
        if fits {
            self.fill(crossings, projection, count, corners);
        }
        fits
    }

    /// Stores the start of each pixel's crossings in `ends`. Returns the total number of crossings.
    fn count(&mut self, projection: &Projection, count: usize, corners: &impl Fn(usize) -> Option<[Vec3; 3]>) -> usize {
        self.ends.clear();
        self.ends.resize(projection.pixel_count(), 0);
        draw_triangles(projection, count, corners, |_, pixel, _| {
            self.ends[pixel] = self.ends[pixel].saturating_add(1);
        });
        let mut total = 0;
        for end in &mut self.ends {
            let count = *end as usize;
            *end = u32::try_from(total).unwrap_or(u32::MAX);
            total += count;
        }
        total
    }

    /// Fills the crossings by a counting sort over pixels, then sorts each pixel by depth.
    fn fill(
        &mut self,
        crossings: usize,
        projection: &Projection,
        count: usize,
        corners: &impl Fn(usize) -> Option<[Vec3; 3]>,
    ) {
        self.crossings.resize(crossings, RayCrossing::default());
        draw_triangles(projection, count, corners, |triangle, pixel, fragment| {
            let slot = &mut self.ends[pixel];
            self.crossings[*slot as usize] = RayCrossing::new(fragment.depth, triangle, fragment.front);
            *slot += 1;
        });
        let mut begin = 0;
        for &end in &self.ends {
            if end > begin + 1 {
                let by_depth = |a: &RayCrossing, b: &RayCrossing| a.depth.total_cmp(&b.depth).then(a.code.cmp(&b.code));
                self.crossings[begin as usize..end as usize].sort_unstable_by(by_depth);
            }
            begin = end;
        }
    }

    /// True if there are no crossings.
    pub fn is_empty(&self) -> bool {
        self.crossings.is_empty()
    }

    /// Returns the crossings of a pixel's ray.
    pub fn at(&self, pixel: usize) -> &[RayCrossing] {
        let begin = pixel.checked_sub(1).map_or(0, |previous| self.ends[previous]);
        &self.crossings[begin as usize..self.ends[pixel] as usize]
    }
}
