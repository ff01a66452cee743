//! EXACT detection: signed closest points between features (nodes, edges, faces) and a solid's triangles.
//!
//! A tree finds nearby triangles. The sign is that of the angle-weighted pseudonormal of the closest face, edge or
//! corner (Baerentzen, Aanaes 2005). The closest point of an edge outside the solid lies on a convex edge or corner,
//! that of a face on a corner, or else on the border of the feature.

mod deepest;
pub(super) mod distance_cache;
mod facets;
mod features;
pub(crate) mod overlap;
mod separating_planes;
pub(super) mod separation;
#[cfg(test)]
pub(super) mod tests;

use glam::{DVec3, Vec3};

use self::deepest::SignedDistance;
use self::distance_cache::{DistanceCache, DistanceRange};
use self::facets::Facets;
use crate::base::Result;
use crate::geometry::Aabb;
use crate::geometry::bvh::Bvh;
use crate::geometry::nearest::{TriangleFeature, nearest_on_triangle, weighted};
use crate::geometry::predicates::pierce;
use crate::mesh::ClosedSurface;

/// Distance below which a point counts as lying on the surface, relative to the solid's size. The direction is then
/// the surface normal.
const TOUCHING: f64 = 1e-9;

/// Relative rounding error of a radius.
const ROUNDING: f32 = 1e-5;

/// A solid with exact distance queries.
#[derive(Debug)]
pub(crate) struct ExactSolid {
    tree: Bvh,
    facets: Facets,
    /// `None` for a deformable solid.
    cache: Option<DistanceCache>,
    /// Largest coordinate.
    size: f64,
}

/// A closest point of a surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nearest {
    slot: usize,
    spot: TriangleFeature,
    /// From the surface to the point.
    offset: DVec3,
    distance_squared: f64,
    point: Vec3,
}

/// An intersection of a segment with the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Crossing {
    /// Position along the segment, 0 to 1.
    pub fraction: f64,
    /// True if the segment enters the solid there.
    pub enters: bool,
    pub triangle: u32,
}

impl ExactSolid {
    /// Creates a rigid solid.
    pub fn new(surface: &ClosedSurface) -> Result<Self> {
        let mut solid = Self::changing(surface)?;
        let count = solid.tree.triangle_count();
        let cache = DistanceCache::new(solid.tree.bounds(), count, |point, hint| {
            let nearest = solid.nearest_from(point, f32::INFINITY, Some(hint));
            let sample = |nearest: Nearest| (solid.signed_distance(&nearest).distance as f32, nearest.slot as u32);
            nearest.map_or((0.0, 0), sample)
        })?;
        solid.cache = Some(cache);
        Ok(solid)
    }

    /// Creates a deformable solid.
    pub fn changing(surface: &ClosedSurface) -> Result<Self> {
        let (positions, triangles) = (surface.positions(), surface.triangles());
        let corners = |triangle: u32| triangles[triangle as usize].map(|node| positions[node as usize]);
        let tree = Bvh::new(triangles.len(), corners)?;
        let mut solid = Self {
            facets: Facets::new(surface, &tree)?,
            tree,
            cache: None,
            size: 0.0,
        };
        solid.update_size();
        Ok(solid)
    }

    /// Updates the node positions. The surface is not checked for self-intersection.
    pub fn refit(&mut self, position: impl Fn(usize) -> Vec3) {
        self.cache = None;
        self.facets.refit(&position);
        let facets = &self.facets;
        self.tree
            .refit_slots(|slot| facets.nodes(slot).map(|node| position(node as usize)));
        self.update_size();
    }

    fn update_size(&mut self) {
        let bounds = self.tree.bounds();
        self.size = f64::from(bounds.magnitudes().max_element());
    }

    pub fn bounds(&self) -> Aabb {
        self.tree.bounds()
    }

    /// True if a point lies within the solid.
    pub fn is_inside(&self, point: Vec3) -> bool {
        let range = self.distance_range(point);
        if range.min > 0.0 || range.max < 0.0 {
            return range.max < 0.0;
        }
        self.nearest_from(point, range.max_distance(), range.hint)
            .is_some_and(|nearest| self.signed_distance(&nearest).distance < 0.0)
    }

    /// Returns the signed distance of a point and the direction away from the solid; `None` if it is further outside
    /// than `within`.
    pub fn measure(&self, point: Vec3, within: f32) -> Option<(f32, Vec3)> {
        let range = self.distance_range(point);
        if range.min > within {
            return None;
        }
        let limit = if range.min > 0.0 {
            within
        } else {
            range.max_distance().max(within)
        };
        let signed = self.signed_distance(&self.nearest_from(point, limit, range.hint)?);
        (signed.distance <= f64::from(within)).then(|| (signed.distance as f32, signed.normal.as_vec3()))
    }

    /// Returns the closest point of the surface within a distance of `point`.
    pub fn nearest(&self, point: Vec3, within: f32) -> Option<Nearest> {
        self.nearest_from(point, within, self.distance_range(point).hint)
    }

    /// As [`ExactSolid::nearest`], with the tree slot of a triangle that may be closest.
    fn nearest_from(&self, point: Vec3, within: f32, hint: Option<u32>) -> Option<Nearest> {
        let exact = point.as_dvec3();
        let mut limit = f64::from(within) * f64::from(within);
        let mut nearest = None;
        let mut consider = |slot: usize, distance: f32| {
            let triangle = self.tree.placed(slot);
            if triangle.is_beside(&[point], distance) {
                return None;
            }
            let corners = triangle.exact();
            let (weights, spot) = nearest_on_triangle(exact, corners);
            let offset = exact - weighted(corners, weights);
            let distance_squared = offset.length_squared();
            if distance_squared < limit || nearest.is_none() && distance_squared == limit {
                limit = distance_squared;
                nearest = Some(Nearest {
                    slot,
                    spot,
                    offset,
                    distance_squared,
                    point,
                });
                return Some(limit as f32);
            }
            None
        };
        let mut limit_squared = within * within;
        if let Some(hint) = hint {
            limit_squared = consider(hint as usize, f32::INFINITY).unwrap_or(limit_squared);
        }
        let mut distance = limit_squared.sqrt() * (1.0 + ROUNDING);
        let bounds = Aabb { min: point, max: point };
        self.tree.near(&bounds, limit_squared, |slot| {
            if let Some(closer) = consider(slot, distance) {
                limit_squared = closer;
                distance = closer.sqrt() * (1.0 + ROUNDING);
            }
            limit_squared
        });
        nearest
    }
    /// Visits all intersections of the segment with the surface, unordered. A symbolic perturbation, the same for all
    /// triangles, keeps the count consistent where the segment meets an edge or a corner.
    pub fn crossings(&self, from: Vec3, to: Vec3, mut visit: impl FnMut(Crossing)) {
        let ends = [from, to].map(|end| end.as_dvec3());
        self.tree.along(from, to - from, 1.0, |slot| {
            if let Some((fraction, enters)) = self.crossing(ends, slot) {
                let triangle = self.tree.triangle(slot);
                visit(Crossing {
                    fraction,
                    enters,
                    triangle,
                });
            }
            1.0
        });
    }

    fn crossing(&self, [p, q]: [DVec3; 2], slot: usize) -> Option<(f64, bool)> {
        let corners = self.tree.placed(slot).exact();
        pierce(p, q, corners, self.facets.nodes(slot))
    }

    /// Returns bounds of the distance of a point without a search.
    fn distance_range(&self, point: Vec3) -> DistanceRange {
        if let Some(range) = self.cache.as_ref().and_then(|cache| cache.distance_range(point)) {
            return range;
        }
        let bounds = self.tree.bounds();
        let outside = (bounds.min - point).max(point - bounds.max);
        let gap = outside.max(Vec3::ZERO).length();
        DistanceRange {
            min: if gap > 0.0 {
                gap * (1.0 - ROUNDING)
            } else {
                f32::NEG_INFINITY
            },
            max: f32::INFINITY,
            hint: None,
        }
    }

    /// Returns the signed distance of a point from its closest point.
    fn signed_distance(&self, nearest: &Nearest) -> SignedDistance {
        let normal = self.facets.normal(nearest.slot, nearest.spot);
        let is_inside = if self.facets.are_normals_unreliable() {
            self.has_positive_winding(nearest.point)
        } else {
            nearest.offset.dot(normal) < 0.0
        };
        let side = if is_inside { -1.0 } else { 1.0 };
        let distance = nearest.distance_squared.sqrt();
        let normal = if distance > TOUCHING * self.size {
            nearest.offset * (side / distance)
        } else {
            // The pseudonormal of edges folded flat vanishes; the face normal replaces it.
            normal.try_normalize().unwrap_or_else(|| {
                self.facets
                    .normal(nearest.slot, TriangleFeature::Face)
                    .normalize_or(DVec3::Y)
            })
        };
        SignedDistance {
            distance: side * distance,
            normal,
        }
    }

    /// True if a ray to a point far outside leaves the solid once more than it enters.
    fn has_positive_winding(&self, point: Vec3) -> bool {
        let bounds = self.tree.bounds();
        let length = (bounds.max - bounds.min).length() + point.distance(bounds.min);
        let mut winding = 0;
        self.crossings(point, point + Vec3::new(0.8, 0.5, 0.33) * 2.0 * length, |crossing| {
            winding += if crossing.enters { -1 } else { 1 };
        });
        winding > 0
    }
}

impl DistanceRange {
    /// Returns an upper bound of the distance to the surface.
    fn max_distance(&self) -> f32 {
        (-self.min).max(self.max).max(0.0) * (1.0 + ROUNDING)
    }
}
