//! The contacts of edges with edges.

use glam::Vec3;

use super::{
    ClearanceUpdate, FeatureContact, FeatureSource, FoundContact, PairSearch, insert_closest, shift, visit_listed,
};
use crate::contact::time_of_impact::{Segment, Separation};
use crate::deformable_contact::clearances::{Clearances, SurfaceFeature};
use crate::deformable_contact::collision_surface::NONE;
use crate::deformable_contact::pair_contact::ContactSide;
use crate::geometry::Aabb;

/// Distance from an edge's end within which edges of two bodies do not touch, as a fraction of the contact distance.
/// The corner touches faces there. With a quarter, a body that rests on a tip trembles.
const EDGE_END_MARGIN: f32 = 0.05;

/// Maximum number of edges that an edge touches. With the closest one alone, an edge across several would be supported
/// by each in turn and tremble.
const MAX_EDGES: usize = 8;

impl PairSearch<'_> {
    /// Reports the contacts of an edge of the first side with edges of the second. Returns a lower bound of its
    /// distance at the start, m.
    pub(super) fn edge_with_edges(
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
            let sides = ContactSide::of_edges([first, second].map(|side| side.body_index), [edge, other], &found);
            self.report_contact(
                sides,
                ((-found.offset).into(), is_speculative),
                (clearance, shift),
                visit,
            );
        }
        lower_bound
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
}
