//! Minimum translation that separates an edge or face from a solid that it passes through.
//!
//! Where a feature passes through a thin wall, the closest faces of the wall at the deepest point lead along the
//! feature instead of out of the wall. The minimum translation of two convex solids is along a face normal of one of
//! them, or along the common perpendicular of two edges (Gottschalk, Lin, Manocha 1996). A face of tissue therefore
//! moves along its own normal past the deepest corner of the solid behind it, an edge along its perpendicular with an
//! edge of the solid. If a face normal of the solid gives a shorter translation, the ends of the feature are in
//! contact there.

use glam::{DVec3, Vec3};

use super::ExactSolid;
use super::facets::Facets;
use super::separating_planes::SeparatingPlanes;
use crate::contact::closest::Closest;
use crate::geometry::Aabb;
use crate::geometry::nearest::{TriangleFeature, nearest_on_triangle};

/// Maximum number of the solid's edges that are considered for an edge.
const MAX_EDGES: usize = 16;

/// Squared sine of the angle below which two edges are parallel.
const PARALLEL: f64 = 1e-8;

/// Cosine of the angle between translations to the same side, at least.
const MIN_SAME_SIDE: f64 = 0.9;

/// Relative rounding error of a translation.
const ROUNDING: f64 = 1e-3;

/// Result of separating a feature from a solid.
#[derive(Clone, Copy, Debug)]
pub(crate) enum FeatureSeparation {
    /// The feature crosses no triangle: all of it is on one side.
    Uncrossed,
    /// The feature is separated by a contact in its interior.
    Interior(Closest),
    /// The feature has no interior contact: an edge or corner of it has a shorter translation, or something
    /// unbounded has passed through it.
    Elsewhere,
}

/// A separating translation.
#[derive(Clone, Copy, Debug)]
struct Translation {
    /// Barycentric weights of the feature's contact point.
    weights: [f64; 3],
    depth: f64,
    normal: DVec3,
}

impl ExactSolid {
    /// Separates an edge or face (2 or 3 corners) that passes through the solid.
    pub fn separate(&self, corners: &[Vec3]) -> FeatureSeparation {
        let translation = match *corners {
            [a, b] => {
                let Some(face_depth) = self.past_faces_of_edge([a, b]) else {
                    return FeatureSeparation::Uncrossed;
                };
                self.past_edges([a, b], face_depth)
            }
            [a, b, c] => {
                let Some(face_depth) = self.past_faces_of_face([a, b, c]) else {
                    return FeatureSeparation::Uncrossed;
                };
                let translation = self.past_corners([a, b, c], face_depth);
                let limit = translation.map_or(face_depth, |translation| translation.depth);
                let is_shorter = |border: [Vec3; 2]| {
                    let face_depth = self.past_faces_of_edge(border);
                    let edge_translation =
                        face_depth.and_then(|face_depth| self.past_edges(border, face_depth.min(limit)));
                    edge_translation.is_some_and(|edge_translation| edge_translation.depth < limit)
                };
                if [[a, b], [b, c], [c, a]].into_iter().any(is_shorter) {
                    return FeatureSeparation::Elsewhere;
                }
                translation
            }
            _ => return FeatureSeparation::Uncrossed,
        };
        translation.map_or(FeatureSeparation::Elsewhere, |translation| {
            FeatureSeparation::Interior(translation.closest())
        })
    }

    /// Separates a face past the deepest corner of the solid behind it; `None` if that lies beside the face.
    pub fn separate_past_corner(&self, corners: [Vec3; 3]) -> Option<Closest> {
        let [a, b, c] = corners;
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        self.past_corners(corners, f64::from(longest)).map(Translation::closest)
    }

    /// Returns the shortest translation of an edge past one of the faces that it crosses, along the face's normal.
    fn past_faces_of_edge(&self, corners: [Vec3; 2]) -> Option<f64> {
        let ends = corners.map(|corner| corner.as_dvec3());
        self.past_faces(&corners, |slot| self.crossing(ends, slot).is_some())
    }

    /// Returns the shortest translation of a face past one of the faces that it crosses.
    fn past_faces_of_face(&self, corners: [Vec3; 3]) -> Option<f64> {
        let planes = SeparatingPlanes::face(corners);
        self.past_faces(&corners, |slot| self.face_crossing(corners, &planes, slot).is_some())
    }

    fn past_faces(&self, corners: &[Vec3], crosses: impl Fn(usize) -> bool) -> Option<f64> {
        let mut least: Option<f64> = None;
        let bounds = Aabb::of(corners.iter().copied());
        self.tree.near(&bounds, 0.0, |slot| {
            if crosses(slot) {
                let normal = self.facets.normal(slot, TriangleFeature::Face).normalize_or_zero();
                let on_face = self.tree.placed(slot).exact()[0];
                let depths = corners.iter().map(|corner| (on_face - corner.as_dvec3()).dot(normal));
                let depth = depths.fold(0.0, f64::max);
                least = Some(least.map_or(depth, |least| least.min(depth)));
            }
            0.0
        });
        least
    }

    /// Returns the shortest translation of an edge past an edge of the solid, if it is at most `within`.
    fn past_edges(&self, corners: [Vec3; 2], within: f64) -> Option<Translation> {
        let [a, b] = corners.map(|corner| corner.as_dvec3());
        let mut translations = [None; MAX_EDGES];
        let mut count = 0;
        self.visit_triangles(&corners, within, |slot| {
            for edge in self.facets.convex_edges(slot) {
                if count < MAX_EDGES {
                    translations[count] = past_edge(&self.facets, [a, b], edge);
                    count += usize::from(translations[count].is_some());
                }
            }
        });
        let translations = translations[..count].iter().flatten();
        // Of several edges on one side the deepest is passed last.
        let last_on_side = |translation: &Translation| {
            let same_side = translations
                .clone()
                .filter(|other| other.normal.dot(translation.normal) > MIN_SAME_SIDE);
            same_side.copied().fold(
                *translation,
                |deepest, other| if other.depth > deepest.depth { other } else { deepest },
            )
        };
        shortest(translations.clone().map(last_on_side), within)
    }

    /// Returns the shortest translation of a face past a corner of the solid along the face's normal, if it is at
    /// most `within`.
    fn past_corners(&self, corners: [Vec3; 3], within: f64) -> Option<Translation> {
        let face = corners.map(|corner| corner.as_dvec3());
        let face_normal = (face[1] - face[0]).cross(face[2] - face[0]).try_normalize()?;
        // The deepest corner on each side.
        let mut translations: [Option<Translation>; 2] = [None; 2];
        self.visit_triangles(&corners, within, |slot| {
            for node in self.facets.convex_nodes(slot) {
                let height = (self.facets.position(node) - face[0]).dot(face_normal);
                let normal = if height > 0.0 { face_normal } else { -face_normal };
                let side = &mut translations[usize::from(height > 0.0)];
                let depth = height.abs();
                if side.is_some_and(|side| depth <= side.depth) || !self.facets.is_in_node_cone(node, normal) {
                    continue;
                }
                let (weights, spot) = nearest_on_triangle(self.facets.position(node), face);
                if spot == TriangleFeature::Face {
                    *side = Some(Translation { weights, depth, normal });
                }
            }
        });
        shortest(translations.into_iter().flatten(), within)
    }

    /// Visits the tree slots of all triangles within a distance of a feature.
    fn visit_triangles(&self, corners: &[Vec3], within: f64, mut visit: impl FnMut(usize)) {
        let bounds = Aabb::of(corners.iter().copied());
        let limit = (within * (1.0 + ROUNDING)).powi(2) as f32;
        self.tree.near(&bounds, limit, |slot| {
            visit(slot);
            limit
        });
    }
}

impl Translation {
    fn closest(self) -> Closest {
        Closest {
            weights: self.weights.map(|weight| weight as f32),
            distance: -self.depth as f32,
            normal: self.normal.as_vec3(),
            inside: true,
        }
    }
}

/// Returns the shortest translation that is at most `within`.
fn shortest(translations: impl Iterator<Item = Translation>, within: f64) -> Option<Translation> {
    let best = translations.reduce(|best, other| if other.depth < best.depth { other } else { best })?;
    (best.depth <= within * (1.0 + ROUNDING)).then_some(best)
}

/// Returns the translation of an edge from `a` to `b` past an edge of the solid that it has passed.
fn past_edge(facets: &Facets, [a, b]: [DVec3; 2], edge: u32) -> Option<Translation> {
    let [c, d] = facets.ends(edge);
    let (edge_direction, solid_direction) = (b - a, d - c);
    let perpendicular = edge_direction.cross(solid_direction);
    let length_squared = perpendicular.length_squared();
    if !(length_squared > PARALLEL * edge_direction.length_squared() * solid_direction.length_squared()) {
        return None;
    }
    let between = c - a;
    let parameter = between.cross(solid_direction).dot(perpendicular) / length_squared;
    let solid_parameter = between.cross(edge_direction).dot(perpendicular) / length_squared;
    if !(parameter > 0.0 && parameter < 1.0 && (0.0..=1.0).contains(&solid_parameter)) {
        return None;
    }
    let height = between.dot(perpendicular) / length_squared.sqrt();
    let normal = perpendicular * (height.signum() / length_squared.sqrt());
    facets.is_in_edge_cone(edge, normal).then_some(Translation {
        weights: [1.0 - parameter, parameter, 0.0],
        depth: height.abs(),
        normal,
    })
}
