//! Images of surfaces, for bodies that find each other in images.

use glam::Vec3;

use super::collision_surface::{CollisionSurface, NONE};
use crate::base::Result;
use crate::codec::saved;
use crate::contact::image_space::DeformableImages;
use crate::geometry::Aabb;

/// Maximum length of a piece of an edge in pixels. Longer edges are searched piece by piece.
const PIECE_LENGTH: f32 = 8.0;

/// Images of a surface.
#[derive(Debug)]
pub(super) struct SurfaceImages {
    images: DeformableImages,
    /// Pixel size, m.
    pixel_size: f32,
}

saved! { SurfaceImages { images, pixel_size } }

impl SurfaceImages {
    /// Reserves images for a surface.
    pub fn new(surface: &CollisionSurface) -> Result<Self> {
        let triangles = surface.forest.placed().map(|placed| placed.corners);
        // Cuts add triangles near existing ones.
        let triangle_capacity = if surface.topology.is_some() {
            surface.triangles.capacity()
        } else {
            0
        };
        let spare = triangle_capacity.saturating_sub(surface.triangles.len());
        let triangles = triangles.chain(std::iter::repeat_n([Vec3::ZERO; 3], spare));
        let images = DeformableImages::reserved(surface.resolution, &surface.forest.bounds(), triangles)?;
        Ok(Self {
            images,
            pixel_size: surface.resolution,
        })
    }

    /// Draws the part of the surface within `bounds`, at the start of a substep.
    pub fn draw(&mut self, surface: &CollisionSurface, bounds: &Aabb) {
        let corners = |triangle: usize| surface.triangles[triangle].map(|node| surface.start(node));
        self.images
            .draw(&surface.forest.bounds(), bounds, surface.triangles.len(), corners);
    }

    /// Calls `visit` with the visible triangles within `reach` of a box.
    pub fn visit_near(&self, surface: &CollisionSurface, bounds: &Aabb, reach: f32, mut visit: impl FnMut(usize)) {
        let around = bounds.extended(reach);
        self.images.near(bounds, reach, |triangle| {
            let corners = surface.triangles[triangle].map(|node| surface.start(node));
            if Aabb::of(corners.into_iter()).overlaps(&around) {
                visit(triangle);
            }
        });
    }

    /// Returns the edges of a triangle within `reach` of a box, else [`NONE`]. It ignores which triangle owns an edge,
    /// since that one may be hidden.
    pub fn edges_near(&self, surface: &CollisionSurface, triangle: usize, bounds: &Aabb, reach: f32) -> [u32; 3] {
        let around = bounds.extended(reach);
        surface.edges_of(triangle).map(|edge| {
            let is_near = surface.edges.get(edge as usize).is_some_and(|ends| {
                let ends = ends.map(|node| surface.start(node));
                Aabb::of(ends.into_iter()).overlaps(&around)
            });
            if is_near { edge } else { NONE }
        })
    }

    /// Returns the number of pieces of an edge.
    pub fn piece_count(&self, displacement: Vec3) -> u32 {
        (displacement.length() / (PIECE_LENGTH * self.pixel_size)).clamp(1.0, 1e3) as u32
    }
}
