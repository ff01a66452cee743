//! Surfaces in images, for bodies that are to be found there by each other.

use glam::Vec3;

use super::skin::{NONE, Skin};
use crate::base::Result;
use crate::codec::saved;
use crate::contact::image_space::Drawn;
use crate::geometry::Bounds;

/// A longer part of an edge, in pixels, is looked along piece by piece.
const PIECE: f32 = 8.0;

/// Images of a surface.
#[derive(Debug)]
pub(super) struct Images {
    drawn: Drawn,
    /// Metres.
    pixel: f32,
}

saved! { Images { drawn, pixel } }

impl Images {
    /// Room for those of a surface.
    pub fn new(skin: &Skin) -> Result<Self> {
        let triangles = skin.forest.placed().map(|placed| placed.corners);
        // Those that may come lie where others do.
        let room = if skin.changing.is_some() {
            skin.triangles.capacity()
        } else {
            0
        };
        let spare = room.saturating_sub(skin.triangles.len());
        let triangles = triangles.chain(std::iter::repeat_n([Vec3::ZERO; 3], spare));
        let drawn = Drawn::reserved(skin.resolution, &skin.forest.bounds(), triangles)?;
        Ok(Self {
            drawn,
            pixel: skin.resolution,
        })
    }

    /// Draws what of the surface lies within `part`, where it is as a substep begins.
    pub fn draw(&mut self, skin: &Skin, part: &Bounds) {
        let corners = |triangle: usize| skin.triangles[triangle].map(|node| skin.start(node));
        self.drawn
            .draw(&skin.forest.bounds(), part, skin.triangles.len(), corners);
    }

    /// Shows the triangles that are seen within `reach` of a box, and come so near.
    pub fn near(&self, skin: &Skin, bounds: &Bounds, reach: f32, mut see: impl FnMut(usize)) {
        let around = bounds.extended(reach);
        self.drawn.near(bounds, reach, |triangle| {
            let corners = skin.triangles[triangle].map(|node| skin.start(node));
            if Bounds::of(corners.into_iter()).overlaps(&around) {
                see(triangle);
            }
        });
    }

    /// Those edges of a triangle, or none, that come within `reach` of a box: the triangle that an edge is looked at with by its tree may not be seen.
    pub fn edges_near(&self, skin: &Skin, triangle: usize, bounds: &Bounds, reach: f32) -> [u32; 3] {
        let around = bounds.extended(reach);
        skin.sides(triangle).map(|edge| {
            let is_near = skin.edges.get(edge as usize).is_some_and(|ends| {
                let ends = ends.map(|node| skin.start(node));
                Bounds::of(ends.into_iter()).overlaps(&around)
            });
            if is_near { edge } else { NONE }
        })
    }

    /// In how many pieces something so long is looked along.
    pub fn pieces(&self, along: Vec3) -> u32 {
        (along.length() / (PIECE * self.pixel)).clamp(1.0, 1e3) as u32
    }
}
