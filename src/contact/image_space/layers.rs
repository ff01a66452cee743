//! A layered depth image (Shade et al. 1998): for each pixel all surfaces that a ray through its middle passes, by depth.

use glam::Vec3;

use super::draw::draw_triangles;
use super::projection::Projection;
use crate::base::{Result, memory};
use crate::codec::saved;

/// Where the ray of a pixel passes a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct RayCrossing {
    /// Along the view, m.
    pub depth: f32,
    /// The triangle, doubled, and 1 where the ray enters.
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

    /// What it changes of the number of times that the surface is wound around the ray's point.
    pub fn winding(&self) -> i32 {
        if self.code & 1 == 1 { 1 } else { -1 }
    }
}

/// The crossings of all pixels, those of a pixel in ascending depth.
#[derive(Debug, Default)]
pub(super) struct Layers {
    /// Where the crossings of each pixel end; those of the next begin there.
    ends: Vec<u32>,
    crossings: Vec<RayCrossing>,
}

saved! { Layers { ends, crossings } }

impl Layers {
    /// Room for so much.
    pub fn reserved(pixels: usize, crossings: usize) -> Result<Self> {
        Ok(Self {
            ends: memory::reserved(pixels)?,
            crossings: memory::reserved(crossings)?,
        })
    }

    /// Of a surface, in memory of its own.
    pub fn new(projection: &Projection, positions: &[Vec3], triangles: &[[u32; 3]]) -> Result<Self> {
        let mut layers = Self::reserved(projection.pixel_count(), 0)?;
        let corners = |triangle: usize| Some(triangles[triangle].map(|node| positions[node as usize]));
        let crossings = layers.count(projection, triangles.len(), &corners);
        layers.crossings = memory::reserved(crossings)?;
        layers.fill(crossings, projection, triangles.len(), &corners);
        Ok(layers)
    }

    /// Draws so many triangles, those without corners left out, into the memory reserved; answers whether it was enough.
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

    /// Leaves in `ends` where each pixel's crossings are to begin; answers how many there are in all.
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

    /// A counting sort by pixel, then a small sort in each.
    fn fill(
        &mut self,
        crossings: usize,
        projection: &Projection,
        count: usize,
        corners: &impl Fn(usize) -> Option<[Vec3; 3]>,
    ) {
        self.crossings.resize(crossings, RayCrossing::default());
        draw_triangles(projection, count, corners, |triangle, pixel, fragment| {
            let place = &mut self.ends[pixel];
            self.crossings[*place as usize] = RayCrossing::new(fragment.depth, triangle, fragment.front);
            *place += 1;
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

    /// Whether no ray passes anything.
    pub fn is_empty(&self) -> bool {
        self.crossings.is_empty()
    }

    /// What the ray of a pixel passes.
    pub fn at(&self, pixel: usize) -> &[RayCrossing] {
        let begin = pixel.checked_sub(1).map_or(0, |previous| self.ends[previous]);
        &self.crossings[begin as usize..self.ends[pixel] as usize]
    }
}
