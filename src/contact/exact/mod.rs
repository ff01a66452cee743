//! EXACT: closest points of nodes, edges and faces and a solid's triangles, with the side they are on.
//!
//! A tree finds the triangles that are near. The side is that of the pseudonormal of the face, edge or corner that is closest (Baerentzen,
//! Aanaes 2005). An edge outside is closest to a convex edge or corner of the solid, a face to a corner, or else at their borders.

pub(super) mod coarse;
mod deepest;
mod facets;
pub(crate) mod overlap;
#[cfg(test)]
pub(super) mod tests;

use glam::{DVec3, Vec3};

use self::coarse::{Between, Coarse};
use self::deepest::{Deepest, Signed, deepest, lies_between};
use self::facets::Facets;
use super::closest::Closest;
use super::nearest::{Part, nearest_of_segments, nearest_on_triangle};
use super::predicates::pierce;
use super::tree::{Placed, Tree};
use crate::body::Bounds;
use crate::error::Result;
use crate::mesh::ClosedSurface;

/// Crossings of one edge that are looked at, at most.
const CROSSINGS: usize = 16;

/// Crossings of one face that a search within the solid starts from, at most.
const STARTS: usize = 4;

/// What is closer than this part of the solid's size looks the way that its surface does.
const TOUCHING: f64 = 1e-9;

/// Where a way that begins on the surface is on it no more.
const BEGUN: f64 = 1e-6;

/// The rounding of a radius, as a part of it.
const ROUNDING: f32 = 1e-5;

/// A solid that answers exactly.
#[derive(Debug)]
pub(crate) struct ExactSolid {
    tree: Tree,
    facets: Facets,
    /// None where the solid changes its shape.
    coarse: Option<Coarse>,
    /// The largest of its coordinates.
    size: f64,
}

/// The point of a surface that is closest to some point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nearest {
    place: usize,
    part: Part,
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

/// A pair of closest points of a feature and a part of the solid.
#[derive(Clone, Copy, Debug)]
struct Pair {
    weights: [f64; 3],
    /// From the solid to the feature.
    offset: DVec3,
    squared: f64,
}

/// The closest pairs of a feature so far.
#[derive(Clone, Copy, Debug)]
struct Pairs {
    /// Between the feature's ends.
    inner: Option<Pair>,
    /// At its border.
    border: Option<Pair>,
    limit: f64,
}

impl ExactSolid {
    /// A solid that keeps its shape.
    pub fn new(surface: &ClosedSurface) -> Result<Self> {
        let mut solid = Self::changing(surface)?;
        let count = solid.tree.triangle_count();
        let coarse = Coarse::new(solid.tree.bounds(), count, |point, hint| {
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
        self.size = f64::from(bounds.min.abs().max(bounds.max.abs()).max_element());
    }

    pub fn bounds(&self) -> Bounds {
        self.tree.bounds()
    }

    /// The closest that a node, edge or face (1, 2 or 3 corners) comes; `None` where it is outside and further than `within`, or
    /// closest at its border to something that is closer to a smaller feature.
    pub fn closest(&self, corners: &[Vec3], within: f32) -> Option<Closest> {
        match *corners {
            [point] => self.closest_to_point(point, within),
            [a, b] => self.closest_to_edge([a, b], within),
            [a, b, c] => self.closest_to_face([a, b, c], within),
            _ => None,
        }
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
            let offset = exact - (corners[0] * weights[0] + corners[1] * weights[1] + corners[2] * weights[2]);
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
                .unwrap_or_else(|| self.facets.normal(nearest.place, Part::Face).normalize_or(DVec3::Y))
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

    fn closest_to_point(&self, point: Vec3, within: f32) -> Option<Closest> {
        let (distance, normal) = self.measure(point, within)?;
        Some(Closest {
            weights: [1.0, 0.0, 0.0],
            distance,
            normal,
            inside: true,
        })
    }

    fn closest_to_edge(&self, corners: [Vec3; 2], within: f32) -> Option<Closest> {
        let middle = (corners[0] + corners[1]) * 0.5;
        let radius = corners[0].distance(corners[1]) * 0.5;
        let known = self.between(middle);
        if known.least > (radius + within) * (1.0 + ROUNDING) {
            return None;
        }
        let ends = corners.map(|corner| corner.as_dvec3());
        let mut pairs = Pairs::within(within);
        let mut crossings = [(0.0, false); CROSSINGS];
        let mut count = 0;
        let bounds = Bounds::of(corners.into_iter());
        let mut distance = within;
        self.tree.near(&bounds, pairs.limit as f32, |place| {
            if self.tree.placed(place).is_beside(&corners, distance) {
                return pairs.limit as f32;
            }
            if let Some(crossing) = self.crossing(ends, place)
                && count < CROSSINGS
            {
                crossings[count] = crossing;
                count += 1;
            }
            for edge in self.facets.salient_edges(place) {
                let others = self.facets.ends(edge);
                let (along, other) = nearest_of_segments(ends[0], ends[1], others[0], others[1]);
                let offset = ends[0].lerp(ends[1], along) - others[0].lerp(others[1], other);
                let pair = Pair {
                    weights: [1.0 - along, along, 0.0],
                    offset,
                    squared: offset.length_squared(),
                };
                let between = along > 0.0 && along < 1.0 && (0.0..=1.0).contains(&other);
                let at_end = other == 0.0 || other == 1.0;
                let across = || {
                    let way = others[1] - others[0];
                    let along = offset.dot(way);
                    !at_end || along * along <= 1e-12 * offset.length_squared() * way.length_squared()
                };
                pairs.see(pair, || between && across() && self.facets.leads_off_edge(edge, offset));
            }
            for node in self.facets.salient_nodes(place) {
                let position = self.facets.position(node);
                let way = ends[1] - ends[0];
                let along = ((position - ends[0]).dot(way) / way.length_squared()).clamp(0.0, 1.0);
                let along = if along >= 0.0 { along } else { 0.0 };
                let offset = ends[0].lerp(ends[1], along) - position;
                let pair = Pair {
                    weights: [1.0 - along, along, 0.0],
                    offset,
                    squared: offset.length_squared(),
                };
                pairs.see(pair, || {
                    along > 0.0 && along < 1.0 && self.facets.leads_off_node(node, offset)
                });
            }
            distance = (pairs.limit as f32).sqrt() * (1.0 + ROUNDING);
            pairs.limit as f32
        });
        if count > 0 {
            let start = longest_within(&mut crossings[..count]);
            return self.deepest_of(&corners, [1.0 - start, start, 0.0], &pairs);
        }
        self.apart_or_within(&corners, middle, known, &pairs)
    }

    fn closest_to_face(&self, corners: [Vec3; 3], within: f32) -> Option<Closest> {
        let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
        let radius = corners
            .iter()
            .fold(0.0_f32, |radius, corner| radius.max(corner.distance(middle)));
        let known = self.between(middle);
        if known.least > (radius + within) * (1.0 + ROUNDING) {
            return None;
        }
        let face = corners.map(|corner| corner.as_dvec3());
        let mut pairs = Pairs::within(within);
        let mut crossed = [None; STARTS];
        let mut count = 0;
        let bounds = Bounds::of(corners.into_iter());
        let plane = Placed::new(corners);
        self.tree.near(&bounds, pairs.limit as f32, |place| {
            if plane.is_beside(&self.tree.placed(place).corners, within) {
                return pairs.limit as f32;
            }
            if count < STARTS {
                crossed[count] = self.crossed(face, place);
                count += usize::from(crossed[count].is_some());
            }
            for node in self.facets.salient_nodes(place) {
                let position = self.facets.position(node);
                let (weights, part) = nearest_on_triangle(position, face);
                let offset = face[0] * weights[0] + face[1] * weights[1] + face[2] * weights[2] - position;
                let pair = Pair {
                    weights,
                    offset,
                    squared: offset.length_squared(),
                };
                pairs.see(pair, || part == Part::Face && self.facets.leads_off_node(node, offset));
            }
            pairs.limit as f32
        });
        if count == 0 {
            return self.apart_or_within(&corners, middle, known, &pairs);
        }
        let mut best: Option<Closest> = None;
        let starts = crossed.into_iter().flatten();
        let starts = starts.map(|(weights, normals)| self.start_within(face, weights, normals));
        // What passes through a sharp or folded edge may start outside: then from elsewhere, and from corners.
        for start in starts.chain([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]) {
            let found = self.deepest_of(&corners, start, &pairs);
            if let Some(found) = found
                && best.is_none_or(|best| found.distance < best.distance)
            {
                best = Some(found);
            }
            if best.is_some_and(|best| best.distance < 0.0) {
                break;
            }
        }
        best
    }

    /// A point, as weights, where a face and the border of the triangle at a place pass through each other, and the
    /// normals of what meets there.
    fn crossed(&self, face: [DVec3; 3], place: usize) -> Option<([f64; 3], [DVec3; 2])> {
        let triangle = self.tree.placed(place).exact();
        if lies_beside(triangle, face) || lies_beside(face, triangle) {
            return None;
        }
        let normal = self.facets.normal(place, Part::Face);
        for ([p, q], others) in self.facets.edges(place) {
            let (p, q) = (p.as_dvec3(), q.as_dvec3());
            if let Some((fraction, _)) = pierce(p, q, face, [0, 1, 2]) {
                return Some((nearest_on_triangle(p.lerp(q, fraction), face).0, [normal, others]));
            }
        }
        for side in 0..3 {
            let next = (side + 1) % 3;
            if let Some((fraction, _)) = self.crossing([face[side], face[next]], place) {
                let mut weights = [0.0; 3];
                weights[side] = 1.0 - fraction;
                weights[next] = fraction;
                return Some((weights, [normal, DVec3::ZERO]));
            }
        }
        None
    }

    /// A point of a face within the solid, found from one of its points on the surface on, where that has these normals: midway between them, so
    /// that it stays within a sharp edge.
    fn start_within(&self, face: [DVec3; 3], weights: [f64; 3], normals: [DVec3; 2]) -> [f64; 3] {
        let across = (face[1] - face[0]).cross(face[2] - face[0]);
        let [one, other] = normals.map(|normal| normal.reject_from(across).normalize_or_zero());
        let inward = -(one + other);
        // How fast each weight grows on the way, and where the first is used up.
        let rate = |from: usize, to: usize| across.dot((face[to] - face[from]).cross(inward)) / across.length_squared();
        let rates = [rate(1, 2), rate(2, 0), rate(0, 1)];
        let furthest = (0..3).fold(f64::INFINITY, |furthest: f64, corner| {
            if rates[corner] < 0.0 {
                furthest.min(weights[corner] / -rates[corner])
            } else {
                furthest
            }
        });
        if !(furthest > 0.0 && furthest.is_finite()) {
            return weights;
        }
        let from = face[0] * weights[0] + face[1] * weights[1] + face[2] * weights[2];
        let ends = [from, from + inward * furthest];
        let mut leaves = 1.0_f64;
        let bounds = Bounds::of(ends.map(|end| end.as_vec3()).into_iter());
        self.tree.near(&bounds, 0.0, |place| {
            if let Some((fraction, false)) = self.crossing(ends, place)
                && fraction > BEGUN
            {
                leaves = leaves.min(fraction);
            }
            0.0
        });
        std::array::from_fn(|corner| weights[corner] + rates[corner] * furthest * 0.5 * leaves)
    }

    /// The answer of an edge or face that passes through no triangle.
    fn apart_or_within(&self, corners: &[Vec3], middle: Vec3, known: Between, pairs: &Pairs) -> Option<Closest> {
        // All of it is on one side: that of any of its points.
        let is_inside = if known.least > 0.0 || known.most < 0.0 {
            known.most < 0.0
        } else if let Some(pair) = pairs.inner {
            let reach = pair.squared.sqrt() as f32 * (1.0 + ROUNDING) + (TOUCHING * self.size) as f32;
            let nearest = self.nearest_from(point_of(corners, pair.weights), reach, None);
            nearest.is_some_and(|nearest| self.signed(&nearest).distance < 0.0)
        } else {
            self.nearest_from(middle, known.reach(), known.hint)
                .is_some_and(|nearest| self.signed(&nearest).distance < 0.0)
        };
        if is_inside {
            let part = 1.0 / corners.len() as f64;
            let start = std::array::from_fn(|corner| if corner < corners.len() { part } else { 0.0 });
            return self.deepest_of(corners, start, pairs);
        }
        self.answer(corners, pairs)
    }

    /// The closest pair between the ends of a feature outside, or else at its border.
    fn answer(&self, corners: &[Vec3], pairs: &Pairs) -> Option<Closest> {
        let pair = pairs.inner.or(pairs.border)?;
        let distance = pair.squared.sqrt();
        if self.facets.are_doubtful() && pairs.inner.is_some() {
            // Where triangles are folded, what looks closest may be behind another.
            let closer = (distance - TOUCHING * self.size) as f32 * (1.0 - ROUNDING);
            let nearest = self.nearest(point_of(corners, pair.weights), closer.max(0.0));
            if nearest.is_some() && closer > 0.0 {
                return self.deepest_from(corners, pair.weights);
            }
        }
        let normal = if distance > TOUCHING * self.size {
            pair.offset / distance
        } else {
            let nearest = self.nearest(point_of(corners, pair.weights), f32::INFINITY)?;
            self.signed(&nearest).normal
        };
        Some(Closest {
            weights: pair.weights.map(|weight| weight as f32),
            distance: distance as f32,
            normal: normal.as_vec3(),
            inside: pairs.inner.is_some(),
        })
    }

    fn deepest_of(&self, corners: &[Vec3], start: [f64; 3], pairs: &Pairs) -> Option<Closest> {
        self.deepest_from(corners, start)
            .or_else(|| self.answer(corners, pairs))
    }

    fn deepest_from(&self, corners: &[Vec3], start: [f64; 3]) -> Option<Closest> {
        // What was closest to the last point may be to the next.
        let mut hint = None;
        let measure = |point: Vec3| {
            let known = self.between(point);
            let nearest = self.nearest_from(point, known.reach(), hint.or(known.hint))?;
            hint = Some(nearest.place as u32);
            Some(self.signed(&nearest))
        };
        let Deepest { weights, signed } = deepest(corners, start, measure)?;
        Some(Closest {
            weights: weights.map(|weight| weight as f32),
            distance: signed.distance as f32,
            normal: signed.normal.as_vec3(),
            inside: lies_between(&weights[..corners.len()]),
        })
    }
}

impl Pairs {
    fn within(within: f32) -> Self {
        Self {
            inner: None,
            border: None,
            limit: f64::from(within) * f64::from(within),
        }
    }

    /// Takes a pair where it is closer. Between the ends of the feature it counts where nothing of the solid beside it is closer.
    #[inline]
    fn see(&mut self, pair: Pair, is_inner: impl FnOnce() -> bool) {
        if !(pair.squared <= self.limit) {
            return;
        }
        if is_inner() {
            if self.inner.is_none_or(|inner| pair.squared < inner.squared) {
                self.limit = pair.squared;
                self.inner = Some(pair);
            }
        } else if self.border.is_none_or(|border| pair.squared < border.squared) {
            self.border = Some(pair);
        }
    }
}

impl Between {
    /// How far the surface is at most.
    fn reach(&self) -> f32 {
        (-self.least).max(self.most).max(0.0) * (1.0 + ROUNDING)
    }
}

fn point_of(corners: &[Vec3], weights: [f64; 3]) -> Vec3 {
    let points = corners.iter().zip(weights);
    points
        .map(|(corner, weight)| corner.as_dvec3() * weight)
        .sum::<DVec3>()
        .as_vec3()
}

/// Whether all of the first triangle lies on one side of the second's plane.
fn lies_beside(triangle: [DVec3; 3], [a, b, c]: [DVec3; 3]) -> bool {
    let normal = (b - a).cross(c - a);
    let heights = triangle.map(|corner| normal.dot(corner - a));
    heights.iter().all(|&height| height > 0.0) || heights.iter().all(|&height| height < 0.0)
}

/// The middle of the longest stretch that lies inside, of an edge with these crossings.
fn longest_within(crossings: &mut [(f64, bool)]) -> f64 {
    crossings.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut best = (f64::NEG_INFINITY, 0.5);
    let mut entered = 0.0;
    for (index, &(fraction, enters)) in crossings.iter().enumerate() {
        let mut look = |from: f64, to: f64| {
            if to - from > best.0 {
                best = (to - from, 0.5 * (from + to));
            }
        };
        if enters {
            entered = fraction;
            if index + 1 == crossings.len() {
                look(fraction, 1.0);
            }
        } else {
            look(entered, fraction);
        }
    }
    best.1
}
