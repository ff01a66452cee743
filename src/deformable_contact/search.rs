//! Contact search between two surfaces, or within one. It finds the first contact of each moving node with faces, and
//! of each moving edge with edges, by conservative advancement.

mod edges;
mod faces;

use glam::Vec3;

use super::candidate_pairs::{CandidateFeature, CandidateView};
use super::clearances::{Clearances, SurfaceFeature};
use super::collision_surface::{COINCIDENT_DISTANCE, Clearance, CollisionSurface};
use super::pair_contact::ContactSide;
use super::wound::Wound;
use crate::contact::time_of_impact::{Corners, Extent, Segment, Separation};
use crate::geometry::Aabb;

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

/// Returns the vector that leads from the coordinates of one body to those of another.
pub(super) fn shift(from: &CollisionSurface, to: &CollisionSurface) -> Vec3 {
    (from.origin - to.origin).as_vec3()
}
