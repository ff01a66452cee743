//! The way out of a solid for an edge or face that has passed into it.
//!
//! At the deepest point of what a thin wall cuts off its sides are closest, and lead along the feature instead of out of the wall.
//! What parts two convex solids with the least way is a side of the one, a side of the other, or the common perpendicular of an edge of
//! each (Gottschalk, Lin, Manocha 1996): for a face of tissue its own perpendicular, off the corner of the solid that is deepest behind
//! it; for an edge that with an edge of the solid. Where a side of the solid is a shorter way, the ends of the feature are there.

use glam::{DVec3, Vec3};

use super::ExactSolid;
use super::facets::Facets;
use super::separating_planes::SeparatingPlanes;
use crate::contact::closest::Closest;
use crate::geometry::Bounds;
use crate::geometry::nearest::{Spot, nearest_on_triangle};

/// Edges of a solid that an edge has passed, at most.
const PASSED: usize = 16;

/// Edges with less between their directions, as the squared sine of their angle, are parallel.
const PARALLEL: f64 = 1e-8;

/// Ways that differ by less, as the cosine of their angle, lead out on the same side.
const SAME_SIDE: f64 = 0.9;

/// What rounding may make of a way, as a part of it.
const ROUNDING: f64 = 1e-3;

/// What leads a feature out of a solid.
#[derive(Clone, Copy, Debug)]
pub(crate) enum WayOut {
    /// It passes through no triangle: all of it is on one side.
    Whole,
    /// It is led out between its ends.
    Between(Closest),
    /// It is not: an edge or a corner of it has a shorter way, or something without an end has passed through it.
    Elsewhere,
}

/// A way out.
#[derive(Clone, Copy, Debug)]
struct Exit {
    /// The point of the feature that goes it.
    weights: [f64; 3],
    depth: f64,
    normal: DVec3,
}

impl ExactSolid {
    /// What leads an edge or face (2 or 3 corners) out that has passed into the solid.
    pub fn way_out(&self, corners: &[Vec3]) -> WayOut {
        let way = match *corners {
            [a, b] => {
                let Some(beyond) = self.past_sides_of_edge([a, b]) else {
                    return WayOut::Whole;
                };
                self.past_edges([a, b], beyond)
            }
            [a, b, c] => {
                let Some(beyond) = self.past_sides_of_face([a, b, c]) else {
                    return WayOut::Whole;
                };
                let way = self.past_corners([a, b, c], beyond);
                let limit = way.map_or(beyond, |way| way.depth);
                let is_shorter = |border: [Vec3; 2]| {
                    let beyond = self.past_sides_of_edge(border);
                    let beside = beyond.and_then(|beyond| self.past_edges(border, beyond.min(limit)));
                    beside.is_some_and(|beside| beside.depth < limit)
                };
                if [[a, b], [b, c], [c, a]].into_iter().any(is_shorter) {
                    return WayOut::Elsewhere;
                }
                way
            }
            _ => return WayOut::Whole,
        };
        way.map_or(WayOut::Elsewhere, |way| WayOut::Between(way.closest()))
    }

    /// What leads a face out past the corner of the solid that is deepest behind it; `None` where that lies beside it.
    pub fn past_corner(&self, corners: [Vec3; 3]) -> Option<Closest> {
        let [a, b, c] = corners;
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        self.past_corners(corners, f64::from(longest)).map(Exit::closest)
    }

    /// The shortest way that takes all of an edge before one of the sides that it passes through, along that side's normal.
    fn past_sides_of_edge(&self, corners: [Vec3; 2]) -> Option<f64> {
        let ends = corners.map(|corner| corner.as_dvec3());
        self.past_sides(&corners, |place| self.crossing(ends, place).is_some())
    }

    /// The same for a face.
    fn past_sides_of_face(&self, corners: [Vec3; 3]) -> Option<f64> {
        let planes = SeparatingPlanes::face(corners);
        self.past_sides(&corners, |place| self.crossed(corners, &planes, place).is_some())
    }

    fn past_sides(&self, corners: &[Vec3], passes: impl Fn(usize) -> bool) -> Option<f64> {
        let mut least: Option<f64> = None;
        let bounds = Bounds::of(corners.iter().copied());
        self.tree.near(&bounds, 0.0, |place| {
            if passes(place) {
                let normal = self.facets.normal(place, Spot::Face).normalize_or_zero();
                let on_side = self.tree.placed(place).exact()[0];
                let ways = corners.iter().map(|corner| (on_side - corner.as_dvec3()).dot(normal));
                let way = ways.fold(0.0, f64::max);
                least = Some(least.map_or(way, |least| least.min(way)));
            }
            0.0
        });
        least
    }

    /// The way of an edge out past an edge of the solid, no longer than `within`.
    fn past_edges(&self, corners: [Vec3; 2], within: f64) -> Option<Exit> {
        let [a, b] = corners.map(|corner| corner.as_dvec3());
        let mut ways = [None; PASSED];
        let mut count = 0;
        self.look_within(&corners, within, |place| {
            for edge in self.facets.salient_edges(place) {
                if count < PASSED {
                    ways[count] = past_edge(&self.facets, [a, b], edge);
                    count += usize::from(ways[count].is_some());
                }
            }
        });
        let ways = ways[..count].iter().flatten();
        // Of several edges on one side the furthest is the last to be passed.
        let last = |way: &Exit| {
            let same = ways.clone().filter(|other| other.normal.dot(way.normal) > SAME_SIDE);
            same.copied()
                .fold(*way, |last, other| if other.depth > last.depth { other } else { last })
        };
        shortest(ways.clone().map(last), within)
    }

    /// The way of a face out past a corner of the solid, along its own perpendicular, no longer than `within`.
    fn past_corners(&self, corners: [Vec3; 3], within: f64) -> Option<Exit> {
        let face = corners.map(|corner| corner.as_dvec3());
        let across = (face[1] - face[0]).cross(face[2] - face[0]).try_normalize()?;
        // To either side of it.
        let mut ways: [Option<Exit>; 2] = [None; 2];
        self.look_within(&corners, within, |place| {
            for node in self.facets.salient_nodes(place) {
                let height = (self.facets.position(node) - face[0]).dot(across);
                let normal = if height > 0.0 { across } else { -across };
                let side = &mut ways[usize::from(height > 0.0)];
                let depth = height.abs();
                if side.is_some_and(|side| depth <= side.depth) || !self.facets.leads_off_node(node, normal) {
                    continue;
                }
                let (weights, part) = nearest_on_triangle(self.facets.position(node), face);
                if part == Spot::Face {
                    *side = Some(Exit { weights, depth, normal });
                }
            }
        });
        shortest(ways.into_iter().flatten(), within)
    }

    /// Shows the places of all triangles that are no further than `within` from a feature.
    fn look_within(&self, corners: &[Vec3], within: f64, mut see: impl FnMut(usize)) {
        let bounds = Bounds::of(corners.iter().copied());
        let limit = (within * (1.0 + ROUNDING)).powi(2) as f32;
        self.tree.near(&bounds, limit, |place| {
            see(place);
            limit
        });
    }
}

impl Exit {
    fn closest(self) -> Closest {
        Closest {
            weights: self.weights.map(|weight| weight as f32),
            distance: -self.depth as f32,
            normal: self.normal.as_vec3(),
            inside: true,
        }
    }
}

/// The shortest of several ways, where it is no longer than `within`.
fn shortest(ways: impl Iterator<Item = Exit>, within: f64) -> Option<Exit> {
    let best = ways.reduce(|best, other| if other.depth < best.depth { other } else { best })?;
    (best.depth <= within * (1.0 + ROUNDING)).then_some(best)
}

/// The way of an edge from `a` to `b` out past an edge of a solid, where it has passed that.
fn past_edge(facets: &Facets, [a, b]: [DVec3; 2], edge: u32) -> Option<Exit> {
    let [c, d] = facets.ends(edge);
    let (along, other) = (b - a, d - c);
    let across = along.cross(other);
    let square = across.length_squared();
    if !(square > PARALLEL * along.length_squared() * other.length_squared()) {
        return None;
    }
    let between = c - a;
    let share = between.cross(other).dot(across) / square;
    let place = between.cross(along).dot(across) / square;
    if !(share > 0.0 && share < 1.0 && (0.0..=1.0).contains(&place)) {
        return None;
    }
    let height = between.dot(across) / square.sqrt();
    let normal = across * (height.signum() / square.sqrt());
    facets.leads_off_edge(edge, normal).then_some(Exit {
        weights: [1.0 - share, share, 0.0],
        depth: height.abs(),
        normal,
    })
}
