//! A tool that is a closed mesh: what it encloses, in its own frame, and how that is found.

use std::sync::Arc;

use glam::Vec3;

use super::closest::Closest;
use super::distance_field::DistanceField;
use super::exact::ExactSolid;
use super::image_space::LayeredImage;
use super::tool::Detection;
use crate::body::Bounds;
use crate::diagnostics::StateHasher;
use crate::error::Result;
use crate::mesh::ClosedSurface;

/// What a mesh encloses.
#[derive(Debug)]
pub(crate) struct MeshSolid {
    surface: ClosedSurface,
    found: Found,
    bounds: Bounds,
    reach: f32,
    hash: u64,
}

/// How what it encloses is found.
#[derive(Debug)]
enum Found {
    Exact(Box<ExactSolid>),
    Field(Box<DistanceField>),
    Image(LayeredImage),
}

/// The longest extent is this many pixels or cells, where it is not said how fine an image or a field is.
const PIXELS: f32 = 256.0;
const CELLS: f32 = 96.0;

impl MeshSolid {
    /// What this surface encloses, to be found in this way; `resolution` as in a tool's definition.
    pub fn shared(
        positions: &[Vec3],
        triangles: &[[u32; 3]],
        detection: Detection,
        resolution: f32,
    ) -> Result<Arc<Self>> {
        let surface = ClosedSurface::new(positions, triangles)?;
        let bounds = Bounds::of(surface.positions().iter().copied());
        let fine = |count: f32| {
            if resolution > 0.0 {
                resolution
            } else {
                (bounds.max - bounds.min).max_element() / count
            }
        };
        let found = match detection {
            Detection::Exact => Found::Exact(Box::new(ExactSolid::new(&surface)?)),
            Detection::ImageSpace => {
                let image = LayeredImage::new(surface.positions(), surface.triangles(), fine(PIXELS))?;
                Found::Image(image)
            }
            Detection::DistanceField => {
                let field = DistanceField::of(&ExactSolid::new(&surface)?, fine(CELLS))?;
                Found::Field(Box::new(field))
            }
        };
        let mut hasher = StateHasher::new();
        hasher.write_u64(detection as u64);
        hasher.write_floats(&[resolution]);
        for position in positions {
            hasher.write_floats(&position.to_array());
        }
        for corner in triangles.as_flattened() {
            hasher.write_u64(u64::from(*corner));
        }
        let solid = Self {
            found,
            bounds,
            reach: surface
                .positions()
                .iter()
                .fold(0.0, |reach, corner| corner.length().max(reach)),
            surface,
            hash: hasher.finish(),
        };
        Ok(Arc::new(solid))
    }

    /// The corners of its surface.
    pub fn positions(&self) -> &[Vec3] {
        self.surface.positions()
    }

    /// Its surface.
    pub fn triangles(&self) -> &[[u32; 3]] {
        self.surface.triangles()
    }

    /// The corners of the box about it.
    pub fn corners(&self) -> [Vec3; 8] {
        let ends = [self.bounds.min, self.bounds.max];
        std::array::from_fn(|corner| Vec3::from_array([0, 1, 2].map(|axis| ends[corner >> axis & 1][axis])))
    }

    /// How far it reaches from the tool's position, m.
    pub fn reach(&self) -> f32 {
        self.reach
    }

    /// Half of its least extent, m.
    pub fn thickness(&self) -> f32 {
        0.5 * (self.bounds.max - self.bounds.min).min_element()
    }

    /// Of everything that what it answers depends on.
    pub fn hash(&self) -> u64 {
        self.hash
    }

    /// The closest that a node, edge or face with these corners comes; `None`: no closer than `within`.
    pub(super) fn closest(&self, corners: &[Vec3], within: f32) -> Option<Closest> {
        match &self.found {
            Found::Exact(solid) => solid.closest(corners, within),
            Found::Field(field) => field.closest(corners, within),
            Found::Image(image) => image.closest(corners, within),
        }
    }
}
