//! Closest points between a solid and nodes, edges and faces.

use glam::{DVec3, Vec3};

use super::deepest::{DeepestPoint, deepest, is_interior};
use super::distance_cache::DistanceRange;
use super::separating_planes::SeparatingPlanes;
use super::{ExactSolid, ROUNDING, TOUCHING};
use crate::contact::closest::Closest;
use crate::geometry::Aabb;
use crate::geometry::nearest::{TriangleFeature, nearest_on_segments, nearest_on_triangle, weighted};
use crate::geometry::predicates::pierce;

/// Least fraction of a path that begins on the surface, after which it is off the surface.
const START_TOLERANCE: f64 = 1e-6;

/// Maximum number of crossings considered for an edge.
const MAX_CROSSINGS: usize = 16;

/// Maximum number of crossings of a face from which the search inside the solid starts.
const MAX_STARTS: usize = 4;

/// A pair of closest points of a feature and of an edge or corner of the solid.
#[derive(Clone, Copy, Debug)]
struct Pair {
    weights: [f64; 3],
    /// From the solid to the feature.
    offset: DVec3,
    distance_squared: f64,
}

impl Pair {
    fn new(weights: [f64; 3], offset: DVec3) -> Self {
        Self {
            weights,
            offset,
            distance_squared: offset.length_squared(),
        }
    }
}

/// The closest pairs found for a feature.
#[derive(Clone, Copy, Debug)]
struct ClosestPairs {
    /// In the feature's interior.
    inner: Option<Pair>,
    /// At the feature's border.
    border: Option<Pair>,
    limit: f64,
}

impl ExactSolid {
    /// Returns the closest point of a node, edge or face (1, 2 or 3 corners); `None` if it is further outside than
    /// `within`, or if its closest point lies on its border, where a smaller feature is closer.
    pub fn closest(&self, corners: &[Vec3], within: f32) -> Option<Closest> {
        match *corners {
            [point] => self.closest_to_point(point, within),
            [a, b] => self.closest_to_edge([a, b], within),
            [a, b, c] => self.closest_to_face([a, b, c], within),
            _ => None,
        }
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
        let range = self.distance_range(middle);
        if range.min > (radius + within) * (1.0 + ROUNDING) {
            return None;
        }
        let ends = corners.map(|corner| corner.as_dvec3());
        let mut pairs = ClosestPairs::within(within);
        let mut crossings = [(0.0, false); MAX_CROSSINGS];
        let mut count = 0;
        let bounds = Aabb::of(corners.into_iter());
        let mut distance = within;
        let planes = SeparatingPlanes::edge(corners);
        self.tree.near(&bounds, pairs.limit as f32, |slot| {
            let placed = self.tree.placed(slot);
            if placed.is_beside(&corners, distance) || planes.separates(&placed.corners, distance) {
                return pairs.limit as f32;
            }
            if count < MAX_CROSSINGS
                && !placed.is_beside(&corners, 0.0)
                && let Some(crossing) = self.crossing(ends, slot)
            {
                crossings[count] = crossing;
                count += 1;
            }
            for edge in self.facets.convex_edges(slot) {
                let solid_ends = self.facets.ends(edge);
                let (parameter, solid_parameter) = nearest_on_segments(ends[0], ends[1], solid_ends[0], solid_ends[1]);
                let offset = ends[0].lerp(ends[1], parameter) - solid_ends[0].lerp(solid_ends[1], solid_parameter);
                let pair = Pair::new([1.0 - parameter, parameter, 0.0], offset);
                let is_interior = parameter > 0.0 && parameter < 1.0 && (0.0..=1.0).contains(&solid_parameter);
                let at_end = solid_parameter == 0.0 || solid_parameter == 1.0;
                let is_perpendicular = || {
                    let edge = solid_ends[1] - solid_ends[0];
                    let component = offset.dot(edge);
                    !at_end || component * component <= 1e-12 * offset.length_squared() * edge.length_squared()
                };
                pairs.add(pair, || {
                    is_interior && is_perpendicular() && self.facets.is_in_edge_cone(edge, offset)
                });
            }
            for node in self.facets.convex_nodes(slot) {
                let position = self.facets.position(node);
                let edge = ends[1] - ends[0];
                let parameter = ((position - ends[0]).dot(edge) / edge.length_squared()).clamp(0.0, 1.0);
                let parameter = if parameter >= 0.0 { parameter } else { 0.0 };
                let offset = ends[0].lerp(ends[1], parameter) - position;
                let pair = Pair::new([1.0 - parameter, parameter, 0.0], offset);
                pairs.add(pair, || {
                    parameter > 0.0 && parameter < 1.0 && self.facets.is_in_node_cone(node, offset)
                });
            }
            distance = (pairs.limit as f32).sqrt() * (1.0 + ROUNDING);
            pairs.limit as f32
        });
        if count > 0 {
            let start = middle_of_longest_inside(&mut crossings[..count]);
            return self.deepest_or_outside(&corners, [1.0 - start, start, 0.0], &pairs);
        }
        self.closest_on_one_side(&corners, middle, range, &pairs)
    }

    fn closest_to_face(&self, corners: [Vec3; 3], within: f32) -> Option<Closest> {
        let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
        let radius = corners
            .iter()
            .fold(0.0_f32, |radius, corner| radius.max(corner.distance(middle)));
        let range = self.distance_range(middle);
        if range.min > (radius + within) * (1.0 + ROUNDING) {
            return None;
        }
        let face = corners.map(|corner| corner.as_dvec3());
        let mut pairs = ClosestPairs::within(within);
        let mut crossings = [None; MAX_STARTS];
        let mut count = 0;
        let bounds = Aabb::of(corners.into_iter());
        let planes = SeparatingPlanes::face(corners);
        self.tree.near(&bounds, pairs.limit as f32, |slot| {
            if planes.separates(&self.tree.placed(slot).corners, within) {
                return pairs.limit as f32;
            }
            if count < MAX_STARTS {
                crossings[count] = self.face_crossing(corners, &planes, slot);
                count += usize::from(crossings[count].is_some());
            }
            for node in self.facets.convex_nodes(slot) {
                let position = self.facets.position(node);
                let (weights, spot) = nearest_on_triangle(position, face);
                let offset = weighted(face, weights) - position;
                let pair = Pair::new(weights, offset);
                pairs.add(pair, || {
                    spot == TriangleFeature::Face && self.facets.is_in_node_cone(node, offset)
                });
            }
            pairs.limit as f32
        });
        if count == 0 {
            return self.closest_on_one_side(&corners, middle, range, &pairs);
        }
        let mut best: Option<Closest> = None;
        let starts = crossings.into_iter().flatten();
        let starts = starts.map(|(weights, normals)| self.interior_start(face, weights, normals));
        // A crossing of a sharp or folded edge may give a start outside. Further starts are the corners.
        for start in starts.chain([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]) {
            let candidate = self.deepest_or_outside(&corners, start, &pairs);
            if let Some(candidate) = candidate
                && best.is_none_or(|best| candidate.distance < best.distance)
            {
                best = Some(candidate);
            }
            if best.is_some_and(|best| best.distance < 0.0) {
                break;
            }
        }
        best
    }

    /// Returns a point of a face, as weights, where it crosses the border of the triangle at a tree slot, and the
    /// normals of the solid's faces there. `planes` are those of the face.
    pub(super) fn face_crossing(
        &self,
        corners: [Vec3; 3],
        planes: &SeparatingPlanes,
        slot: usize,
    ) -> Option<([f64; 3], [DVec3; 2])> {
        let placed = self.tree.placed(slot);
        // Most pairs are separated clearly, so that rounding does not matter.
        if placed.is_beside(&corners, 0.0) || planes.separates(&placed.corners, 0.0) {
            return None;
        }
        let (triangle, face) = (placed.exact(), corners.map(|corner| corner.as_dvec3()));
        if is_on_one_side(triangle, face) || is_on_one_side(face, triangle) {
            return None;
        }
        let normal = self.facets.normal(slot, TriangleFeature::Face);
        for ([p, q], other_normals) in self.facets.edges(slot) {
            let (p, q) = (p.as_dvec3(), q.as_dvec3());
            if let Some((fraction, _)) = pierce(p, q, face, [0, 1, 2]) {
                return Some((
                    nearest_on_triangle(p.lerp(q, fraction), face).0,
                    [normal, other_normals],
                ));
            }
        }
        for side in 0..3 {
            let next = (side + 1) % 3;
            if let Some((fraction, _)) = self.crossing([face[side], face[next]], slot) {
                let mut weights = [0.0; 3];
                weights[side] = 1.0 - fraction;
                weights[next] = fraction;
                return Some((weights, [normal, DVec3::ZERO]));
            }
        }
        None
    }

    /// Returns a point of a face inside the solid, starting from a point on the surface with these normals. It lies
    /// midway between two surfaces, so that it stays inside a sharp edge.
    fn interior_start(&self, face: [DVec3; 3], weights: [f64; 3], normals: [DVec3; 2]) -> [f64; 3] {
        let face_normal = (face[1] - face[0]).cross(face[2] - face[0]);
        let [one, other] = normals.map(|normal| normal.reject_from(face_normal).normalize_or_zero());
        let inward = -(one + other);
        // Rates of change of the weights along the path; the path ends at the first weight that reaches 0.
        let rate = |from: usize, to: usize| {
            face_normal.dot((face[to] - face[from]).cross(inward)) / face_normal.length_squared()
        };
        let rates = [rate(1, 2), rate(2, 0), rate(0, 1)];
        let path_length = (0..3).fold(f64::INFINITY, |path_length: f64, corner| {
            if rates[corner] < 0.0 {
                path_length.min(weights[corner] / -rates[corner])
            } else {
                path_length
            }
        });
        if !(path_length > 0.0 && path_length.is_finite()) {
            return weights;
        }
        let from = weighted(face, weights);
        let ends = [from, from + inward * path_length];
        let mut exit = 1.0_f64;
        let bounds = Aabb::of(ends.map(|end| end.as_vec3()).into_iter());
        self.tree.near(&bounds, 0.0, |slot| {
            if let Some((fraction, false)) = self.crossing(ends, slot)
                && fraction > START_TOLERANCE
            {
                exit = exit.min(fraction);
            }
            0.0
        });
        std::array::from_fn(|corner| weights[corner] + rates[corner] * path_length * 0.5 * exit)
    }

    /// Returns the closest point of an edge or face that crosses no triangle.
    fn closest_on_one_side(
        &self,
        corners: &[Vec3],
        middle: Vec3,
        range: DistanceRange,
        pairs: &ClosestPairs,
    ) -> Option<Closest> {
        // The whole feature is on one side, that of any of its points.
        let is_inside = if range.min > 0.0 || range.max < 0.0 {
            range.max < 0.0
        } else if let Some(pair) = pairs.inner {
            let limit = pair.distance_squared.sqrt() as f32 * (1.0 + ROUNDING) + (TOUCHING * self.size) as f32;
            let nearest = self.nearest_from(point_of(corners, pair.weights), limit, None);
            nearest.is_some_and(|nearest| self.signed_distance(&nearest).distance < 0.0)
        } else {
            self.nearest_from(middle, range.max_distance(), range.hint)
                .is_some_and(|nearest| self.signed_distance(&nearest).distance < 0.0)
        };
        if is_inside {
            let weight = 1.0 / corners.len() as f64;
            let start = std::array::from_fn(|corner| if corner < corners.len() { weight } else { 0.0 });
            return self.deepest_or_outside(corners, start, pairs);
        }
        self.closest_outside(corners, pairs)
    }

    /// Returns the closest pair in the interior of a feature outside, or else on its border.
    fn closest_outside(&self, corners: &[Vec3], pairs: &ClosestPairs) -> Option<Closest> {
        let pair = pairs.inner.or(pairs.border)?;
        let distance = pair.distance_squared.sqrt();
        if self.facets.are_normals_unreliable() && pairs.inner.is_some() {
            // Where triangles are folded, another one may hide the closest pair.
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
            self.signed_distance(&nearest).normal
        };
        Some(Closest {
            weights: pair.weights.map(|weight| weight as f32),
            distance: distance as f32,
            normal: normal.as_vec3(),
            inside: pairs.inner.is_some(),
        })
    }

    fn deepest_or_outside(&self, corners: &[Vec3], start: [f64; 3], pairs: &ClosestPairs) -> Option<Closest> {
        self.deepest_from(corners, start)
            .or_else(|| self.closest_outside(corners, pairs))
    }

    fn deepest_from(&self, corners: &[Vec3], start: [f64; 3]) -> Option<Closest> {
        // The triangle closest to the last point may be closest to the next one.
        let mut hint = None;
        let measure = |point: Vec3| {
            let range = self.distance_range(point);
            let nearest = self.nearest_from(point, range.max_distance(), hint.or(range.hint))?;
            hint = Some(nearest.slot as u32);
            Some(self.signed_distance(&nearest))
        };
        let DeepestPoint { weights, signed } = deepest(corners, start, measure)?;
        Some(Closest {
            weights: weights.map(|weight| weight as f32),
            distance: signed.distance as f32,
            normal: signed.normal.as_vec3(),
            inside: is_interior(&weights[..corners.len()]),
        })
    }
}

impl ClosestPairs {
    fn within(within: f32) -> Self {
        Self {
            inner: None,
            border: None,
            limit: f64::from(within) * f64::from(within),
        }
    }

    /// Adds a pair if it is closer. It counts as interior if no adjacent part of the solid is closer.
    #[inline]
    fn add(&mut self, pair: Pair, is_inner: impl FnOnce() -> bool) {
        if !(pair.distance_squared <= self.limit) {
            return;
        }
        if is_inner() {
            if self
                .inner
                .is_none_or(|inner| pair.distance_squared < inner.distance_squared)
            {
                self.limit = pair.distance_squared;
                self.inner = Some(pair);
            }
        } else if self
            .border
            .is_none_or(|border| pair.distance_squared < border.distance_squared)
        {
            self.border = Some(pair);
        }
    }
}

fn point_of(corners: &[Vec3], weights: [f64; 3]) -> Vec3 {
    let points = corners.iter().zip(weights);
    points
        .map(|(corner, weight)| corner.as_dvec3() * weight)
        .sum::<DVec3>()
        .as_vec3()
}

/// True if all of the first triangle lies on one side of the second's plane.
fn is_on_one_side(triangle: [DVec3; 3], [a, b, c]: [DVec3; 3]) -> bool {
    let normal = (b - a).cross(c - a);
    let heights = triangle.map(|corner| normal.dot(corner - a));
    heights.iter().all(|&height| height > 0.0) || heights.iter().all(|&height| height < 0.0)
}

/// Returns the middle of the longest part inside the solid of an edge with these crossings.
fn middle_of_longest_inside(crossings: &mut [(f64, bool)]) -> f64 {
    crossings.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut best = (f64::NEG_INFINITY, 0.5);
    let mut entered = 0.0;
    for (index, &(fraction, enters)) in crossings.iter().enumerate() {
        let mut consider = |from: f64, to: f64| {
            if to - from > best.0 {
                best = (to - from, 0.5 * (from + to));
            }
        };
        if enters {
            entered = fraction;
            if index + 1 == crossings.len() {
                consider(fraction, 1.0);
            }
        } else {
            consider(entered, fraction);
        }
    }
    best.1
}
