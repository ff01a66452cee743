//! EXACT: closest points of nodes, edges and faces and a solid's triangles, with the side they are on.
//!
//! A tree finds the triangles that are near. The side is that of the pseudonormal of the face, edge or corner that is closest (Baerentzen,
//! Aanaes 2005). An edge outside is closest to a convex edge or corner of the solid, a face to a corner, or else at their borders.

pub(super) mod coarse;
mod deepest;
mod facets;
mod features;
pub(crate) mod overlap;
pub(super) mod pierced;
mod separating_planes;
#[cfg(test)]
pub(super) mod tests;

use glam::{DVec3, Vec3};

use self::coarse::{Between, CoarseField};
use self::deepest::Signed;
use self::facets::Facets;
use crate::base::Result;
use crate::geometry::Bounds;
use crate::geometry::nearest::{Spot, nearest_on_triangle, weighted};
use crate::geometry::predicates::pierce;
use crate::geometry::tree::Tree;
use crate::mesh::ClosedSurface;

/// What is closer than this part of the solid's size looks the way that its surface does.
const TOUCHING: f64 = 1e-9;

/// The rounding of a radius, as a part of it.
const ROUNDING: f32 = 1e-5;

/// A solid that answers exactly.
#[derive(Debug)]
pub(crate) struct ExactSolid {
    tree: Tree,
    facets: Facets,
    /// None where the solid changes its shape.
    coarse: Option<CoarseField>,
    /// The largest of its coordinates.
    size: f64,
}

/// The point of a surface that is closest to some point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nearest {
    place: usize,
    part: Spot,
    /// From the surface to the point.
    offset: DVec3,
    squared: f64,
    point: Vec3,
}

/// Where a segment passes through the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Crossing {
    /// How far along it, 0 to 1.
    pub fraction: f64,
    /// Whether it goes in there.
    pub enters: bool,
    pub triangle: u32,
}

impl ExactSolid {
    /// A solid that keeps its shape.
    pub fn new(surface: &ClosedSurface) -> Result<Self> {
        let mut solid = Self::changing(surface)?;
        let count = solid.tree.triangle_count();
        let coarse = CoarseField::new(solid.tree.bounds(), count, |point, hint| {
            let nearest = solid.nearest_from(point, f32::INFINITY, Some(hint));
            let sample = |nearest: Nearest| (solid.signed(&nearest).distance as f32, nearest.place as u32);
            nearest.map_or((0.0, 0), sample)
        })?;
        solid.coarse = Some(coarse);
        Ok(solid)
    }

    /// A solid that may change its shape.
    pub fn changing(surface: &ClosedSurface) -> Result<Self> {
        let (positions, triangles) = (surface.positions(), surface.triangles());
        let corners = |triangle: u32| triangles[triangle as usize].map(|node| positions[node as usize]);
        let tree = Tree::new(triangles.len(), corners)?;
        let mut solid = Self {
            facets: Facets::new(surface, &tree)?,
            tree,
            coarse: None,
            size: 0.0,
        };
        solid.find_size();
        Ok(solid)
    }

    /// Takes its nodes where they are now. Whether they still enclose a solid is not asked.
    pub fn refit(&mut self, position: impl Fn(usize) -> Vec3) {
        self.coarse = None;
        self.facets.refit(&position);
        let facets = &self.facets;
        self.tree
            .refit_places(|place| facets.nodes(place).map(|node| position(node as usize)));
        self.find_size();
    }

    fn find_size(&mut self) {
        let bounds = self.tree.bounds();
        self.size = f64::from(bounds.magnitudes().max_element());
    }

    pub fn bounds(&self) -> Bounds {
        self.tree.bounds()
    }

    /// Whether a point lies within the solid.
    pub fn is_inside(&self, point: Vec3) -> bool {
        let known = self.between(point);
        if known.least > 0.0 || known.most < 0.0 {
            return known.most < 0.0;
        }
        self.nearest_from(point, known.reach(), known.hint)
            .is_some_and(|nearest| self.signed(&nearest).distance < 0.0)
    }

    /// The signed distance of a point, and the direction away from the solid there; `None` further outside than `within`.
    pub fn measure(&self, point: Vec3, within: f32) -> Option<(f32, Vec3)> {
        let known = self.between(point);
        if known.least > within {
            return None;
        }
        let reach = if known.least > 0.0 {
            within
        } else {
            known.reach().max(within)
        };
        let signed = self.signed(&self.nearest_from(point, reach, known.hint)?);
        (signed.distance <= f64::from(within)).then(|| (signed.distance as f32, signed.normal.as_vec3()))
    }

    /// The point of the surface that is closest to `point`, within a distance of it.
    pub fn nearest(&self, point: Vec3, within: f32) -> Option<Nearest> {
        self.nearest_from(point, within, self.between(point).hint)
    }

    /// The same, with the place of a triangle that may be closest.
    fn nearest_from(&self, point: Vec3, within: f32, hint: Option<u32>) -> Option<Nearest> {
        let exact = point.as_dvec3();
        let mut limit = f64::from(within) * f64::from(within);
        let mut found = None;
        let mut look = |place: usize, distance: f32| {
            let placed = self.tree.placed(place);
            if placed.is_beside(&[point], distance) {
                return None;
            }
            let corners = placed.exact();
            let (weights, part) = nearest_on_triangle(exact, corners);
            let offset = exact - weighted(corners, weights);
            let squared = offset.length_squared();
            if squared < limit || found.is_none() && squared == limit {
                limit = squared;
                found = Some(Nearest {
                    place,
                    part,
                    offset,
                    squared,
                    point,
                });
                return Some(limit as f32);
            }
            None
        };
        let mut limit_squared = within * within;
        if let Some(hint) = hint {
            limit_squared = look(hint as usize, f32::INFINITY).unwrap_or(limit_squared);
        }
        let mut distance = limit_squared.sqrt() * (1.0 + ROUNDING);
        let bounds = Bounds { min: point, max: point };
        self.tree.near(&bounds, limit_squared, |place| {
            if let Some(closer) = look(place, distance) {
                limit_squared = closer;
                distance = closer.sqrt() * (1.0 + ROUNDING);
            }
            limit_squared
        });
        found
    }
    /// Shows all places where the segment passes through the surface, in no order. As if it were shifted by next to nothing, in one
    /// direction for all triangles: where it meets an edge or a corner it passes through as many triangles as it should.
    pub fn crossings(&self, from: Vec3, to: Vec3, mut see: impl FnMut(Crossing)) {
        let ends = [from, to].map(|end| end.as_dvec3());
        self.tree.along(from, to - from, 1.0, |place| {
            if let Some((fraction, enters)) = self.crossing(ends, place) {
                let triangle = self.tree.triangle(place);
                see(Crossing {
                    fraction,
                    enters,
                    triangle,
                });
            }
            1.0
        });
    }

    fn crossing(&self, [p, q]: [DVec3; 2], place: usize) -> Option<(f64, bool)> {
        let corners = self.tree.placed(place).exact();
        pierce(p, q, corners, self.facets.nodes(place))
    }

    /// What is known of a point without looking for what is closest.
    fn between(&self, point: Vec3) -> Between {
        if let Some(known) = self.coarse.as_ref().and_then(|coarse| coarse.between(point)) {
            return known;
        }
        let bounds = self.tree.bounds();
        let apart = (bounds.min - point).max(point - bounds.max);
        let gap = apart.max(Vec3::ZERO).length();
        Between {
            least: if gap > 0.0 {
                gap * (1.0 - ROUNDING)
            } else {
                f32::NEG_INFINITY
            },
            most: f32::INFINITY,
            hint: None,
        }
    }

    /// The side that a point lies on, by what it is closest to.
    fn signed(&self, nearest: &Nearest) -> Signed {
        let normal = self.facets.normal(nearest.place, nearest.part);
        let is_inside = if self.facets.are_doubtful() {
            self.is_wound_about(nearest.point)
        } else {
            nearest.offset.dot(normal) < 0.0
        };
        let side = if is_inside { -1.0 } else { 1.0 };
        let distance = nearest.squared.sqrt();
        let normal = if distance > TOUCHING * self.size {
            nearest.offset * (side / distance)
        } else {
            // Edges folded flat look nowhere: then the face.
            normal
                .try_normalize()
                .unwrap_or_else(|| self.facets.normal(nearest.place, Spot::Face).normalize_or(DVec3::Y))
        };
        Signed {
            distance: side * distance,
            normal,
        }
    }

    /// Whether a way from a point to far outside comes out once more than it goes in.
    fn is_wound_about(&self, point: Vec3) -> bool {
        let bounds = self.tree.bounds();
        let reach = (bounds.max - bounds.min).length() + point.distance(bounds.min);
        let mut winding = 0;
        self.crossings(point, point + Vec3::new(0.8, 0.5, 0.33) * 2.0 * reach, |crossing| {
            winding += if crossing.enters { -1 } else { 1 };
        });
        winding > 0
    }
}

impl Between {
    /// How far the surface is at most.
    fn reach(&self) -> f32 {
        (-self.least).max(self.most).max(0.0) * (1.0 + ROUNDING)
    }
}
