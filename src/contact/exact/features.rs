//! How nodes, edges and faces are closest to a solid.

use glam::{DVec3, Vec3};

use super::coarse::Between;
use super::deepest::{Deepest, deepest, lies_between};
use super::separating_planes::SeparatingPlanes;
use super::{ExactSolid, ROUNDING, TOUCHING};
use crate::contact::closest::Closest;
use crate::geometry::Bounds;
use crate::geometry::nearest::{Spot, nearest_of_segments, nearest_on_triangle, weighted};
use crate::geometry::predicates::pierce;

/// Where a way that begins on the surface is on it no more.
const BEGUN: f64 = 1e-6;

/// Crossings of one edge that are looked at, at most.
const CROSSINGS: usize = 16;

/// Crossings of one face that a search within the solid starts from, at most.
const STARTS: usize = 4;

/// A pair of closest points of a feature and a part of the solid.
#[derive(Clone, Copy, Debug)]
struct Pair {
    weights: [f64; 3],
    /// From the solid to the feature.
    offset: DVec3,
    squared: f64,
}

impl Pair {
    fn new(weights: [f64; 3], offset: DVec3) -> Self {
        Self {
            weights,
            offset,
            squared: offset.length_squared(),
        }
    }
}

/// The closest pairs of a feature so far.
#[derive(Clone, Copy, Debug)]
struct ClosestPairs {
    /// Between the feature's ends.
    inner: Option<Pair>,
    /// At its border.
    border: Option<Pair>,
    limit: f64,
}

impl ExactSolid {
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
        let mut pairs = ClosestPairs::within(within);
        let mut crossings = [(0.0, false); CROSSINGS];
        let mut count = 0;
        let bounds = Bounds::of(corners.into_iter());
        let mut distance = within;
        let planes = SeparatingPlanes::edge(corners);
        self.tree.near(&bounds, pairs.limit as f32, |place| {
            let placed = self.tree.placed(place);
            if placed.is_beside(&corners, distance) || planes.is_beyond(&placed.corners, distance) {
                return pairs.limit as f32;
            }
            if count < CROSSINGS
                && !placed.is_beside(&corners, 0.0)
                && let Some(crossing) = self.crossing(ends, place)
            {
                crossings[count] = crossing;
                count += 1;
            }
            for edge in self.facets.salient_edges(place) {
                let others = self.facets.ends(edge);
                let (along, other) = nearest_of_segments(ends[0], ends[1], others[0], others[1]);
                let offset = ends[0].lerp(ends[1], along) - others[0].lerp(others[1], other);
                let pair = Pair::new([1.0 - along, along, 0.0], offset);
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
                let pair = Pair::new([1.0 - along, along, 0.0], offset);
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
        let mut pairs = ClosestPairs::within(within);
        let mut crossed = [None; STARTS];
        let mut count = 0;
        let bounds = Bounds::of(corners.into_iter());
        let planes = SeparatingPlanes::face(corners);
        self.tree.near(&bounds, pairs.limit as f32, |place| {
            if planes.is_beyond(&self.tree.placed(place).corners, within) {
                return pairs.limit as f32;
            }
            if count < STARTS {
                crossed[count] = self.crossed(corners, &planes, place);
                count += usize::from(crossed[count].is_some());
            }
            for node in self.facets.salient_nodes(place) {
                let position = self.facets.position(node);
                let (weights, part) = nearest_on_triangle(position, face);
                let offset = weighted(face, weights) - position;
                let pair = Pair::new(weights, offset);
                pairs.see(pair, || part == Spot::Face && self.facets.leads_off_node(node, offset));
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

    /// A point, as weights, where a face, which lies between these planes, and the border of the triangle at a place pass through each other, and
    /// the normals of what meets there.
    pub(super) fn crossed(
        &self,
        corners: [Vec3; 3],
        planes: &SeparatingPlanes,
        place: usize,
    ) -> Option<([f64; 3], [DVec3; 2])> {
        let placed = self.tree.placed(place);
        // Most are told apart before rounding would decide.
        if placed.is_beside(&corners, 0.0) || planes.is_beyond(&placed.corners, 0.0) {
            return None;
        }
        let (triangle, face) = (placed.exact(), corners.map(|corner| corner.as_dvec3()));
        if lies_beside(triangle, face) || lies_beside(face, triangle) {
            return None;
        }
        let normal = self.facets.normal(place, Spot::Face);
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
        let from = weighted(face, weights);
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
    fn apart_or_within(&self, corners: &[Vec3], middle: Vec3, known: Between, pairs: &ClosestPairs) -> Option<Closest> {
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
    fn answer(&self, corners: &[Vec3], pairs: &ClosestPairs) -> Option<Closest> {
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

    fn deepest_of(&self, corners: &[Vec3], start: [f64; 3], pairs: &ClosestPairs) -> Option<Closest> {
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

impl ClosestPairs {
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
