//! Contact search between two surfaces, or within one. It finds the first contact of each moving node with faces, and
//! of each moving edge with edges, by conservative advancement.

use glam::{Vec3, Vec3A};

use super::candidate_pairs::{CandidateFeature, CandidateView};
use super::clearances::{Clearances, SurfaceFeature};
use super::collision_surface::{COINCIDENT_DISTANCE, Clearance, CollisionSurface, NONE, NodeMotion};
use super::pair_contact::ContactSide;
use super::wound::Wound;
use crate::contact::time_of_impact::{Corners, Extent, Segment, Separation};
use crate::geometry::Aabb;

/// Relative difference below which distances are equal. Faces that share the closest point differ by less. The face
/// seen most squarely then decides the side of a point.
const EQUAL_DISTANCE: f32 = 1e-4;

/// Faces of another body are redundant for a corner if their points and directions differ by less than this fraction of
/// the distance. The closest one suffices. A surface that crumples needs all.
const SIMILAR: f32 = 0.05;

/// Distance from an edge's end within which edges of two bodies do not touch, as a fraction of the contact distance.
/// The corner touches faces there. With a quarter, a body that rests on a tip trembles.
const EDGE_END_MARGIN: f32 = 0.05;

/// Maximum number of faces that a corner touches. With the closest one alone, a corner in a fold would be pushed from
/// face to face and tremble. With three, so would a tip in a matching hole, where eight triangles meet.
const MAX_FACES: usize = 8;

/// Maximum number of edges that an edge touches. With the closest one alone, an edge across several would be supported
/// by each in turn and tremble.
const MAX_EDGES: usize = 8;

/// A contact with a face or edge: whether it is speculative, the distance at the start, the feature, the separation and
/// the clearance.
type FeatureContact<Feature> = (bool, f32, Feature, (Separation, Clearance));

/// A body in a search.
#[derive(Clone, Copy)]
pub(super) struct SearchSide<'a> {
    pub body_index: usize,
    pub surface: &'a CollisionSurface,
}

/// A contact found by the search.
#[derive(Clone, Copy, Debug)]
pub(super) struct FoundContact {
    pub sides: [ContactSide; 2],
    /// Unit vector from the second side to the first.
    pub normal: Vec3,
    /// Distance along the normal at the start of the step, minus the contact distance, m.
    pub gap: f32,
    /// True if a cut separated the two sides.
    pub is_cut_apart: bool,
    /// True if the sides only come near.
    pub is_speculative: bool,
}

/// The source of features near a corner or edge.
enum FeatureSource<'a> {
    /// Trees or images.
    Search,
    /// Candidates: triangles near a corner or edges near an edge. The numbers are the accumulated motion and the
    /// distance within which contact is possible, m.
    Listed(&'a mut [CandidateFeature], [f32; 2]),
}

/// A search over a substep of `dt` seconds for features closer than `radius`, m, or within `speculative_margin` of
/// that, m.
pub(super) struct PairSearch<'a> {
    pub search_sides: [SearchSide<'a>; 2],
    pub dt: f32,
    pub radius: f32,
    pub speculative_margin: f32,
    /// Maximum relative displacement of the two sides, m.
    pub motion: f32,
    /// True if the search uses images.
    pub uses_images: bool,
    /// True if it is not the first search of the substep. It then skips features that impulses have not deflected.
    pub is_repeated: bool,
    pub clearance_update: ClearanceUpdate,
    /// True if corners of one body may be inside the other at the start of the step.
    pub may_be_inside: bool,
}

/// The information about near bodies that a search records.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ClearanceUpdate {
    Nothing,
    /// Distances, from which clearances recover.
    Distances,
    /// Distances at which bodies were created, which reduce clearances.
    Reductions,
}

impl PairSearch<'_> {
    /// Calls `visit` with all contacts. `clearances` are those of both sides; self-contact has none. Candidates replace
    /// trees and images if given.
    pub fn run(
        &self,
        clearances: [&mut Option<Clearances>; 2],
        candidates: Option<CandidateView>,
        mut visit: impl FnMut(FoundContact),
    ) {
        let [first, second] = self.search_sides;
        let [mut first_clearances, second_clearances] = clearances.map(Option::as_mut);
        if let Some(CandidateView {
            runs,
            features,
            accumulated_motion,
        }) = candidates
        {
            let [corners, others, edges] = runs;
            for (runs, [corner_side, face_side], mut clearances) in [
                (corners, [first, second], first_clearances.as_deref_mut()),
                (others, [second, first], second_clearances),
            ] {
                for run in runs {
                    let reach = run.contact_reach(self, accumulated_motion);
                    if !(run.distance_bound - accumulated_motion <= reach) {
                        continue;
                    }
                    let corner = run.index as usize;
                    let listed = run.slice(features);
                    let (search_sides, node) = ([corner_side, face_side], [corner_side.surface.nodes[corner]]);
                    let face = |candidate: &CandidateFeature| &face_side.surface.triangles[candidate.feature as usize];
                    if !listed
                        .iter()
                        .any(|candidate| self.needs_test(search_sides, &node, face(candidate)))
                    {
                        continue;
                    }
                    let source = FeatureSource::Listed(listed, [accumulated_motion, reach]);
                    let lower_bound;
                    (lower_bound, run.was_outside) =
                        self.node_with_faces(search_sides, corner, source, clearances.as_deref_mut(), &mut visit);
                    run.distance_bound = accumulated_motion + lower_bound;
                }
            }
            let reach = self.edge_reach();
            for run in edges
                .iter_mut()
                .filter(|run| run.distance_bound - accumulated_motion <= reach)
            {
                let edge = run.index as usize;
                let listed = run.slice(features);
                let ends = &first.surface.edges[edge];
                let other = |candidate: &CandidateFeature| &second.surface.edges[candidate.feature as usize];
                if !listed
                    .iter()
                    .any(|candidate| self.edges_need_test(ends, other(candidate)))
                {
                    continue;
                }
                let source = FeatureSource::Listed(listed, [accumulated_motion, reach]);
                run.distance_bound = accumulated_motion
                    + self.edge_with_edges(edge, source, first_clearances.as_deref_mut(), &mut visit);
            }
        } else {
            self.nodes_with_faces([first, second], first_clearances.as_deref_mut(), &mut visit);
            if !self.is_self_contact() {
                self.nodes_with_faces([second, first], second_clearances, &mut visit);
            }
            for edge in 0..first.surface.edges.len() {
                self.edge_with_edges(edge, FeatureSource::Search, first_clearances.as_deref_mut(), &mut visit);
            }
        }
        if self.is_self_contact() {
            self.report_wound_corners(&mut visit);
            self.report_wound_edges(&mut visit);
        }
    }

    /// True if the first search of the substep found all that impulses may make touch. Wounds change with the
    /// motion and are never complete.
    pub fn is_search_complete(&self) -> bool {
        let max_deviation: f32 = self
            .search_sides
            .iter()
            .map(|search_side| search_side.surface.max_deviation)
            .sum();
        let is_open = self.is_self_contact() && self.search_sides[0].surface.wound().is_some_and(Wound::is_open);
        !is_open && !self.curvature_changed() && max_deviation <= self.speculative_margin
    }

    /// True if the curvature was measured again, so that edges skipped as flat may touch now.
    fn curvature_changed(&self) -> bool {
        self.search_sides
            .iter()
            .any(|search_side| search_side.surface.was_remeasured)
    }

    /// True if two edges need a test, like [`Self::needs_test`].
    fn edges_need_test(&self, edge: &[u32], other: &[u32]) -> bool {
        self.curvature_changed() || self.needs_test(self.search_sides, edge, other)
    }

    /// True if a search needs to test two features: it is the first of the substep, or impulses deflected them
    /// beyond the margin.
    fn needs_test(&self, [a, b]: [SearchSide; 2], nodes: &[u32], others: &[u32]) -> bool {
        !self.is_repeated || a.surface.deviation_of(nodes) + b.surface.deviation_of(others) > self.speculative_margin
    }

    /// Returns the maximum depth from which a node inside one of the bodies is pushed out, m.
    pub(super) fn ejection_depth_in(&self, search_side: SearchSide) -> f32 {
        if self.may_be_inside && search_side.surface.is_closed {
            search_side.surface.ejection_depth()
        } else {
            0.0
        }
    }

    pub(super) fn is_self_contact(&self) -> bool {
        self.search_sides[0].body_index == self.search_sides[1].body_index
    }

    /// Calls `visit` with the triangles within `reach` of a corner's swept bounds, from candidates, images or trees.
    /// `visit` returns the distance of a triangle. Returns the smallest one, m.
    fn visit_near_corner(
        &self,
        source: FeatureSource,
        surface: &CollisionSurface,
        bounds: &Aabb,
        reach: f32,
        mut visit: impl FnMut(usize) -> f32,
    ) -> f32 {
        if let FeatureSource::Listed(triangles, [accumulated_motion, reach]) = source {
            return visit_listed(triangles, (accumulated_motion, reach), |triangle| {
                visit(triangle as usize)
            });
        }
        let mut lower_bound = f32::INFINITY;
        let visit = |triangle| lower_bound = lower_bound.min(visit(triangle));
        match &surface.images {
            Some(images) if self.uses_images => images.visit_near(surface, bounds, reach, visit),
            _ => surface.visit_near(bounds, reach, visit),
        }
        lower_bound
    }

    /// Returns the distance that a feature keeps from the other body, m.
    fn contact_radius(&self, clearances: Option<&Clearances>, feature: SurfaceFeature) -> f32 {
        let allowed_distance = clearances.map_or(f32::INFINITY, |clearances| clearances.allowed_distance(feature));
        let [first, second] = self.search_sides.map(|search_side| search_side.surface.min_thickness());
        self.radius.min(allowed_distance.max(first.min(second)))
    }

    /// Records the distance of a feature from the other body at the start of the step.
    fn update_clearance(&self, clearances: Option<&mut Clearances>, feature: SurfaceFeature, nearest: f32) {
        if let Some(clearances) = clearances.filter(|_| nearest < self.radius) {
            match self.clearance_update {
                ClearanceUpdate::Nothing => {}
                ClearanceUpdate::Distances => clearances.observe(feature, nearest),
                ClearanceUpdate::Reductions => clearances.reduce(feature, nearest),
            }
        }
    }

    fn nodes_with_faces(
        &self,
        search_sides: [SearchSide; 2],
        mut clearances: Option<&mut Clearances>,
        visit: &mut impl FnMut(FoundContact),
    ) {
        for corner in 0..search_sides[0].surface.nodes.len() {
            self.node_with_faces(
                search_sides,
                corner,
                FeatureSource::Search,
                clearances.as_deref_mut(),
                visit,
            );
        }
    }

    /// Reports the contacts of a corner of the first side with faces of the second. Returns a lower bound of its
    /// distance at the start, m, and whether it is outside.
    fn node_with_faces(
        &self,
        [corner_side, face_side]: [SearchSide; 2],
        corner: usize,
        source: FeatureSource,
        clearances: Option<&mut Clearances>,
        visit: &mut impl FnMut(FoundContact),
    ) -> (f32, bool) {
        let shift = shift(corner_side.surface, face_side.surface);
        let node = corner_side.surface.nodes[corner];
        let NodeMotion {
            start: position,
            displacement,
        } = corner_side
            .surface
            .relative_motion(node, (shift, face_side.surface.center_velocity), self.dt);
        let radius = self.contact_radius(clearances.as_deref(), SurfaceFeature::Corner(corner));
        let segment = Segment {
            ends: [position; 2],
            steps: [displacement; 2],
            radius,
        };
        let mut front_distance = f32::INFINITY;
        let mut closest: [Option<FeatureContact<usize>>; MAX_FACES] = [None; MAX_FACES];
        // Distance of the nearest face of a closed surface and its height above it, and whether the corner is behind
        // it.
        let mut nearest = (f32::INFINITY, 0.0_f32);
        let mut behind: Option<(usize, Separation)> = None;
        let around = Aabb::of([position, position + displacement].map(Vec3::from).into_iter());
        let is_solid = face_side.surface.is_closed && !self.is_self_contact();
        let depth = self.ejection_depth_in(face_side);
        // In crushed solids, a face may approach an outside corner with its inner side. Rounding may also put flush
        // corners behind a face.
        let flush = corner_side
            .surface
            .min_thickness()
            .min(face_side.surface.min_thickness());
        let within_behind = if self.may_be_inside { f32::INFINITY } else { flush };
        let reach = (self.radius + self.speculative_margin).max(depth) + face_side.surface.displacement_spread;
        let max_distance = match source {
            FeatureSource::Search => self.contact_reach(),
            FeatureSource::Listed(_, [_, reach]) => reach,
        };
        let comparison = self.comparison_bounds(&segment, max_distance);
        let anywhere = |_: &Separation| true;
        let lower_bound = self.visit_near_corner(source, face_side.surface, &around, reach, |triangle| {
            let nodes = face_side.surface.triangles[triangle];
            if self.is_self_contact() && (nodes.contains(&node) || face_side.surface.are_in_wound([node; 2], &nodes)) {
                return f32::INFINITY;
            }
            let corners = face_side.surface.corners(&nodes);
            let (start, distance) = match self.separation(&corners, &segment, &comparison) {
                Ok(found) => found,
                Err(lower_bound) => return lower_bound,
            };
            if distance > max_distance {
                return distance;
            }
            let height = if is_solid { height_above(&corners, &start) } else { 0.0 };
            let is_in_front = !(height < 0.0 && distance <= within_behind);
            if is_in_front {
                front_distance = front_distance.min(distance);
            }
            let is_nearer = distance < nearest.0 * (1.0 - EQUAL_DISTANCE)
                || distance < nearest.0 * (1.0 + EQUAL_DISTANCE) && height.abs() > nearest.1;
            if is_solid && is_nearer {
                nearest = (distance, height.abs());
                behind = (!is_in_front).then_some((triangle, start));
            }
            if self.needs_test([corner_side, face_side], &[node], &nodes)
                && let Some((found, is_speculative)) = self.first_contact(
                    face_side.surface,
                    ([node; 2], &segment),
                    (&nodes, &corners),
                    start,
                    anywhere,
                )
            {
                insert_closest(&mut closest, (is_speculative, distance, triangle, found));
            }
            distance
        });
        // A corner created inside another body is pushed out by the full thickness. A flush corner touches.
        let nearest_distance = match behind {
            Some(_) if self.clearance_update == ClearanceUpdate::Reductions && nearest.0 > flush => f32::INFINITY,
            Some(_) => 0.0,
            None => front_distance,
        };
        self.update_clearance(clearances, SurfaceFeature::Corner(corner), nearest_distance);
        // A corner on the wrong side is pushed out, or left alone if it is too deep.
        let is_behind = behind.is_some();
        if let Some((triangle, start)) = behind {
            let is_near = nearest.0 < self.radius.max(depth);
            closest = [None; MAX_FACES];
            closest[0] = is_near.then_some((false, nearest.0, triangle, (start, Clearance::of(radius))));
        }
        let side_of = |triangle: usize, found: &Separation| ContactSide {
            body: face_side.body_index,
            nodes: face_side.surface.triangles[triangle],
            weights: found.weights,
        };
        let position_of = |side: &ContactSide| side.weighted(|node| face_side.surface.start(node));
        let similar = if self.is_self_contact() {
            EQUAL_DISTANCE
        } else {
            SIMILAR
        };
        for slot in 0..MAX_FACES {
            let Some((is_speculative, _, triangle, (found, clearance))) = closest[slot] else {
                break;
            };
            let side = side_of(triangle, &found);
            let is_similar = |(_, _, closer, (other, _)): &FeatureContact<usize>| {
                let max_difference = similar * found.offset.length();
                (other.offset - found.offset).length() <= max_difference
                    && position_of(&side_of(*closer, other)).distance(position_of(&side)) <= max_difference
            };
            if closest[..slot].iter().flatten().any(is_similar) {
                continue;
            }
            let mut offset = Vec3::from(if is_behind { found.offset } else { -found.offset });
            if is_solid && offset == Vec3::ZERO {
                offset = face_normal(&face_side.surface.corners(&side.nodes)).into();
            }
            let sides = [ContactSide::of_node(corner_side.body_index, node), side];
            self.report_contact(sides, (offset, is_speculative), (clearance, shift), visit);
        }
        (lower_bound, !is_behind)
    }

    /// Reports the contacts of an edge of the first side with edges of the second. Returns a lower bound of its
    /// distance at the start, m.
    fn edge_with_edges(
        &self,
        index: usize,
        source: FeatureSource,
        clearances: Option<&mut Clearances>,
        visit: &mut impl FnMut(FoundContact),
    ) -> f32 {
        let [first, second] = self.search_sides;
        let shift = shift(first.surface, second.surface);
        let edge = first.surface.edges[index];
        if first.surface.is_crossing[index] || edge[0] == NONE {
            return f32::INFINITY;
        }
        let curvature = first.surface.edge_curvatures.get(index);
        let is_measured = self.is_measured(clearances.as_deref(), index);
        let motions = edge.map(|node| {
            first
                .surface
                .relative_motion(node, (shift, second.surface.center_velocity), self.dt)
        });
        let segment = Segment {
            ends: motions.map(|motion| motion.start),
            steps: motions.map(|motion| motion.displacement),
            radius: self.contact_radius(clearances.as_deref(), SurfaceFeature::Edge(index)),
        };
        let end_margin = if self.is_self_contact() {
            0.0
        } else {
            EDGE_END_MARGIN * segment.radius
        };
        let max_distance = self.edge_reach();
        let motion = Aabb::of(
            motions
                .into_iter()
                .flat_map(|motion| [motion.start(), (motion.start + motion.displacement).into()]),
        );
        let comparison = self.comparison_bounds(&segment, max_distance);
        let mut lower_bound = f32::INFINITY;
        let mut nearest = f32::INFINITY;
        let mut closest: [Option<FeatureContact<[u32; 2]>>; MAX_EDGES] = [None; MAX_EDGES];
        let mut test_edge = |number: u32| {
            let Some((other, is_crossing, other_curvature)) = second.surface.edge(number) else {
                return f32::INFINITY;
            };
            // The side of a crossing edge is unknown, so it cannot touch, but its distance counts.
            let can_touch = !is_crossing && !curvature.is_flat_against(&other_curvature, self.radius);
            if !can_touch && !is_measured {
                return f32::INFINITY;
            }
            if self.is_self_contact()
                && (other <= edge
                    || other.iter().any(|node| edge.contains(node))
                    || first.surface.are_in_wound(edge, &other))
            {
                return f32::INFINITY;
            }
            let corners = second.surface.corners(&other);
            let (start_separation, start_distance) = match self.separation(&corners, &segment, &comparison) {
                Ok(found) => found,
                Err(lower_bound) => return lower_bound,
            };
            nearest = nearest.min(start_distance);
            if !can_touch || start_distance > max_distance || !self.edges_need_test(&edge, &other) {
                return start_distance;
            }
            // Near an end of either edge, the corner touches instead.
            let edges = [segment.ends[1] - segment.ends[0], corners.points[1] - corners.points[0]];
            let is_across = |found: &Separation| found.is_across_beyond(end_margin, edges);
            let found = self.first_contact(
                second.surface,
                (edge, &segment),
                (&other, &corners),
                start_separation,
                is_across,
            );
            if let Some((found, is_speculative)) = found
                && !closest.iter().flatten().any(|(_, _, edge, _)| *edge == other)
            {
                insert_closest(&mut closest, (is_speculative, start_distance, other, found));
            }
            start_distance
        };

        let reach = self.radius + self.speculative_margin + second.surface.displacement_spread;
        match &second.surface.images {
            _ if let FeatureSource::Listed(others, accumulated) = source => {
                lower_bound = visit_listed(others, accumulated.into(), test_edge);
            }
            Some(images) if self.uses_images => {
                // The box of a long edge is mostly empty, so images are searched piece by piece.
                let [from, to] = segment.ends;
                let pieces = images.piece_count((to - from).into());
                for piece in 0..pieces {
                    let shares = [piece, piece + 1].map(|end| end as f32 / pieces as f32);
                    let piece_ends = shares
                        .map(|share| segment.at(share).map(Vec3::from))
                        .into_iter()
                        .flatten();
                    let (surface, around) = (second.surface, Aabb::of(piece_ends));
                    images.visit_near(surface, &around, reach, |triangle| {
                        let edges = images.edges_near(surface, triangle, &around, reach);
                        lower_bound = edges.into_iter().map(&mut test_edge).fold(lower_bound, f32::min);
                    });
                }
            }
            _ => {
                let surface = second.surface;
                surface.visit_near(&motion, reach, |triangle| {
                    lower_bound = surface
                        .owned_edges(triangle)
                        .into_iter()
                        .map(&mut test_edge)
                        .fold(lower_bound, f32::min);
                });
            }
        }
        self.update_clearance(clearances, SurfaceFeature::Edge(index), nearest);
        for (is_speculative, _, other, (found, clearance)) in closest.into_iter().flatten() {
            let sides = [
                ContactSide::of_edge(first.body_index, edge, found.along),
                ContactSide {
                    body: second.body_index,
                    nodes: [other[0], other[1], other[1]],
                    weights: found.weights,
                },
            ];
            self.report_contact(
                sides,
                ((-found.offset).into(), is_speculative),
                (clearance, shift),
                visit,
            );
        }
        lower_bound
    }

    /// Returns the distance and bounds within which other features are compared with a segment, m. Distances to other
    /// bodies are useful for later substeps. In self-contact most features move too much for that, so only swept bounds
    /// count.
    fn comparison_bounds(&self, segment: &Segment, max_distance: f32) -> (f32, Extent) {
        let Segment { ends, steps, .. } = segment;
        if self.is_self_contact() {
            let swept_points = [ends[0], ends[1], ends[0] + steps[0], ends[1] + steps[1]];
            (
                self.radius + self.speculative_margin,
                Extent::of(swept_points.into_iter()),
            )
        } else {
            (max_distance, Extent::of(ends.iter().copied()))
        }
    }

    /// Returns the closest points of a feature and a segment at the start of the substep, and their distance, m. If the
    /// bounds are further apart than the comparison distance, the error is a lower bound of the distance.
    #[inline]
    fn separation(
        &self,
        corners: &Corners,
        segment: &Segment,
        (within, around): &(f32, Extent),
    ) -> Result<(Separation, f32), f32> {
        let other_bounds = if self.is_self_contact() {
            corners.swept_bounds()
        } else {
            corners.bounds()
        };
        let distance_squared = around.distance_squared(&other_bounds);
        if distance_squared > within * within {
            return Err(distance_squared.sqrt());
        }
        let start = corners.separation(segment, 0.0);
        Ok((start, start.offset.length()))
    }

    /// True if the distance of an edge is recorded even if it cannot touch.
    fn is_measured(&self, clearances: Option<&Clearances>, edge: usize) -> bool {
        match self.clearance_update {
            ClearanceUpdate::Nothing => false,
            ClearanceUpdate::Distances => clearances
                .is_some_and(|clearances| clearances.allowed_distance(SurfaceFeature::Edge(edge)) < f32::INFINITY),
            ClearanceUpdate::Reductions => true,
        }
    }

    /// Returns the first contact of a node or edge with a face or edge that satisfies `is_counted`, its clearance, and
    /// whether it is speculative.
    #[inline(always)]
    fn first_contact(
        &self,
        surface: &CollisionSurface,
        (nodes, segment): ([u32; 2], &Segment),
        (others, corners): (&[u32], &Corners),
        start: Separation,
        is_counted: impl Fn(&Separation) -> bool,
    ) -> Option<((Separation, Clearance), bool)> {
        let (found, is_speculative) = corners.first_contact(start, segment, self.speculative_margin)?;
        let (full_clearance, counts_at_full) = (Clearance::of(segment.radius), is_counted(&found));
        // A feature separated by a cut may keep a smaller distance, at which it counts.
        if !counts_at_full && !surface.can_be_cut() {
            return None;
        }
        let clearance = if self.is_self_contact() {
            surface.clearance_between(nodes, (others, found.weights), self.radius)?
        } else {
            full_clearance
        };
        // Without thickness, features separated by a cut keep the same distance as all others.
        if clearance == full_clearance {
            return counts_at_full.then_some(((found, clearance), is_speculative));
        }
        // Features that still coincide have no side.
        let radius = clearance.radius;
        if start.offset.length_squared() < (COINCIDENT_DISTANCE * radius) * (COINCIDENT_DISTANCE * radius) {
            return None;
        }
        let segment = Segment { radius, ..*segment };
        let (found, is_speculative) = corners.first_contact(start, &segment, self.speculative_margin)?;
        is_counted(&found).then_some(((found, clearance), is_speculative))
    }

    /// Calls `visit` with a contact in the direction of `offset`. `shift` leads between the coordinates of the sides.
    pub(super) fn report_contact(
        &self,
        sides: [ContactSide; 2],
        (offset, is_speculative): (Vec3, bool),
        (clearance, shift): (Clearance, Vec3),
        visit: &mut impl FnMut(FoundContact),
    ) {
        if let Some(normal) = offset.try_normalize() {
            let offset = self.offset_between(&sides, shift);
            visit(FoundContact {
                sides,
                normal,
                gap: offset.dot(normal) - clearance.radius,
                is_cut_apart: clearance.is_cut_apart,
                is_speculative,
            });
        }
    }

    /// Returns the vector from the second side to the first at the start of the step.
    fn offset_between(&self, sides: &[ContactSide; 2], shift: Vec3) -> Vec3 {
        let [first, second] = [0, 1].map(|index| {
            let search_side = if self.search_sides[0].body_index == sides[index].body {
                self.search_sides[0]
            } else {
                self.search_sides[1]
            };
            sides[index].weighted(|node| search_side.surface.start(node))
        });
        first + shift - second
    }
}

/// Calls `visit` with the candidates that may be within `reach` after the accumulated motion, m, and stores their
/// distances. Returns a lower bound of all distances.
fn visit_listed(
    all: &mut [CandidateFeature],
    (accumulated_motion, reach): (f32, f32),
    mut visit: impl FnMut(u32) -> f32,
) -> f32 {
    let mut lower_bound = f32::INFINITY;
    for candidate in all {
        if candidate.distance_bound - accumulated_motion <= reach {
            candidate.distance_bound = accumulated_motion + visit(candidate.feature);
        }
        lower_bound = lower_bound.min(candidate.distance_bound - accumulated_motion);
    }
    lower_bound
}

/// Inserts a contact into the closest ones. Speculative contacts come last.
fn insert_closest<Feature: Copy + PartialOrd>(
    closest: &mut [Option<FeatureContact<Feature>>],
    met: FeatureContact<Feature>,
) {
    let order = |(is_speculative, distance, feature, _): FeatureContact<Feature>| (is_speculative, distance, feature);
    let is_closer = |other: FeatureContact<Feature>| order(met) < order(other);
    if let Some(slot) = closest.iter().position(|other| other.is_none_or(is_closer)) {
        closest[slot..].rotate_right(1);
        closest[slot] = Some(met);
    }
}

/// Returns the height of a point above a face at the start of the substep, m; negative on its inner side.
fn height_above(face: &Corners, start: &Separation) -> f32 {
    -start.offset.dot(face_normal(face))
}

/// Returns the normal of a face at the start of the substep.
fn face_normal(face: &Corners) -> Vec3A {
    let [a, b, c] = face.points;
    (b - a).cross(c - a).normalize_or_zero()
}

/// Returns the vector that leads from the coordinates of one body to those of another.
pub(super) fn shift(from: &CollisionSurface, to: &CollisionSurface) -> Vec3 {
    (from.origin - to.origin).as_vec3()
}
