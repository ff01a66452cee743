//! Ridges of a mesh. A ridge may enter tissue between nodes that stay outside the mesh.

use glam::Vec3;

use crate::base::{Result, memory};
use crate::geometry::Aabb;
use crate::geometry::bvh::Bvh;
use crate::mesh::{ClosedSurface, ends_of};

/// Minimum angle of a ridge, a convex edge, rad. Smaller angles result from the triangulation of a smooth surface.
const MIN_RIDGE_ANGLE: f32 = 0.7;

/// The triangles at the ridges of a surface.
#[derive(Debug)]
pub(super) struct Ridges {
    /// Search tree over the triangles. `None` if there are none.
    tree: Option<Bvh>,
    /// Angle of the sharpest ridge of each triangle, rad.
    angles: Vec<f32>,
    /// Angle of the sharpest ridge of all, rad.
    sharpest: f32,
}

impl Ridges {
    pub fn new(surface: &ClosedSurface) -> Result<Self> {
        let (positions, triangles) = (surface.positions(), surface.triangles());
        let corners = |face: usize| triangles[face].map(|corner| positions[corner as usize]);
        let normal = |face: usize| {
            let [a, b, c] = corners(face);
            (b - a).cross(c - a).normalize_or_zero()
        };
        let center = |face: usize| corners(face).iter().sum::<Vec3>() / 3.0;
        let mut edges: Vec<([u32; 2], u32)> = memory::reserved(3 * triangles.len())?;
        for (face, corners) in (0..).zip(triangles) {
            edges.extend(ends_of(*corners).map(|ends| (ends, face)));
        }
        edges.sort_unstable();
        let mut angles = memory::filled(0.0_f32, triangles.len())?;
        for uses in edges.chunk_by(|one, other| one.0 == other.0) {
            for pair in uses.windows(2) {
                let [one, other] = [pair[0].1 as usize, pair[1].1 as usize];
                let is_convex = (center(other) - center(one)).dot(normal(one)) < 0.0;
                let angle = normal(one).angle_between(normal(other));
                // The angle at a triangle without area is unknown.
                let angle = if angle.is_finite() { angle } else { std::f32::consts::PI };
                if is_convex && angle > MIN_RIDGE_ANGLE {
                    for face in [one, other] {
                        angles[face] = angles[face].max(angle);
                    }
                }
            }
        }
        let mut ridges: Vec<u32> = memory::reserved(triangles.len())?;
        ridges.extend((0..triangles.len() as u32).filter(|&face| angles[face as usize] > 0.0));
        angles.retain(|&angle| angle > 0.0);
        let tree = match ridges.len() {
            0 => None,
            count => Some(Bvh::new(count, |ridge| corners(ridges[ridge as usize] as usize))?),
        };
        let sharpest = angles.iter().copied().fold(0.0, f32::max);
        Ok(Self { tree, angles, sharpest })
    }

    /// True if a ridge within `reach` of these bounds may be deeper than `depth` below a chord of this length with its
    /// ends on the surface, m. The depth is at most `length angle / 4`.
    pub fn may_intrude(&self, bounds: &Aabb, reach: f32, length: f32, depth: f32) -> bool {
        let is_deep = |angle: f32| 0.25 * length * angle > depth;
        let mut is_found = false;
        let Some(tree) = self.tree.as_ref().filter(|_| is_deep(self.sharpest)) else {
            return false;
        };
        tree.near(bounds, reach * reach, |index| {
            is_found |= is_deep(self.angles[tree.triangle(index) as usize]);
            if is_found { -1.0 } else { reach * reach }
        });
        is_found
    }
}
