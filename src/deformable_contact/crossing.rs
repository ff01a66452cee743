//! Detection of surface edges that cross triangles, which contact should prevent.

use super::DeformableContact;
use super::collision_surface::{CollisionSurface, NONE};
use super::plan::are_asleep;
use super::search::shift;
use super::{can_collide, share_attachment};
use crate::geometry::Aabb;
use crate::geometry::predicates::crosses;
use crate::solver::Systems;

impl DeformableContact {
    /// Finds the crossing edges of all islands at the start of a step, or at the end of an attempted one. Returns their
    /// number.
    pub fn find_crossings(&mut self, bodies: &impl Systems, at_end: bool) -> u32 {
        let mut count = 0_u32;
        let islands = std::mem::take(&mut self.islands);
        for island in 0..islands.count() {
            let members = islands.members(island).iter().map(|&body_index| body_index as usize);
            if are_asleep(islands.members(island), bodies) {
                let surfaces = members.filter_map(|body_index| self.surfaces.get(body_index)?.as_ref());
                count = surfaces.fold(count, |count, surface| count.saturating_add(surface.crossings));
                continue;
            }
            for body_index in members.clone() {
                if let (Some(Some(surface)), Some(body)) = (self.surfaces.get_mut(body_index), bodies.at(body_index)) {
                    surface.set_static(body, at_end);
                    surface.is_crossing.fill(false);
                    surface.crossings = 0;
                }
            }
            for a in members {
                if bodies.at(a).is_some_and(|body| body.contact.with_itself) {
                    count = count.saturating_add(self.mark_crossings(bodies, [a; 2]));
                }
            }
            for [a, b] in islands.pairs(island) {
                if let (Some(first), Some(second)) = (bodies.at(a), bodies.at(b))
                    && can_collide(first, second)
                {
                    let counts = [[a, b], [b, a]].map(|pair| self.mark_crossings(bodies, pair));
                    count = counts.into_iter().fold(count, u32::saturating_add);
                    if !at_end {
                        self.update_interpenetration([a, b], counts != [0; 2]);
                    }
                }
            }
        }
        self.islands = islands;
        count
    }

    /// Returns the body with the most crossing edges in the last search.
    pub fn most_crossing(&self) -> Option<usize> {
        let members = (0..self.islands.count()).flat_map(|island| self.islands.members(island));
        members
            .map(|&body_index| body_index as usize)
            .max_by_key(|&body_index| {
                self.surfaces
                    .get(body_index)
                    .and_then(Option::as_ref)
                    .map(|surface| surface.crossings)
            })
    }

    /// Turns off contact between open surfaces that were created through each other. Once they no longer cross, contact
    /// is on again, with their distance as clearance.
    fn update_interpenetration(&mut self, pair: [usize; 2], are_crossing: bool) {
        let [Some(Some(first)), Some(Some(second))] = pair.map(|body_index| self.surfaces.get(body_index)) else {
            return;
        };
        let Ok([Some(clearances_a), Some(clearances_b)]) = self.clearances.get_disjoint_mut(pair) else {
            return;
        };
        if !are_crossing {
            if self.interpenetrating_pairs.remove(pair) {
                (clearances_a.is_new, clearances_b.is_new) = (true, true);
            }
            return;
        }
        let are_open = !first.is_closed && !second.is_closed;
        if are_open && (clearances_a.is_new || clearances_b.is_new) {
            // Surfaces that lie flush on each other cross by rounding.
            let depth = first.min_thickness().min(second.min_thickness());
            if crosses_deeper_than(first, second, depth) || crosses_deeper_than(second, first, depth) {
                self.interpenetrating_pairs.add(pair);
            }
        }
    }

    /// Marks the edges of body `a` that cross triangles of body `b`, which may be the same. Returns their number.
    fn mark_crossings(&mut self, bodies: &impl Systems, [a, b]: [usize; 2]) -> u32 {
        // Moved out, because it is written while both surfaces are read.
        let Some(Some(first)) = self.surfaces.get_mut(a) else {
            return 0;
        };
        let mut is_crossing = std::mem::take(&mut first.is_crossing);
        let mut count = 0;
        if let (Some(Some(first)), Some(Some(second))) = (self.surfaces.get(a), self.surfaces.get(b)) {
            let are_joined = |edge: &[u32], triangle: &[u32]| {
                a == b && edge.iter().any(|node| triangle.contains(node))
                    || !self.attachments.is_empty()
                        && share_attachment(&self.attachments, bodies, [a, b], [edge, triangle])
            };
            count = mark_crossing_edges(first, second, are_joined, &mut is_crossing);
        }
        if let Some(Some(first)) = self.surfaces.get_mut(a) {
            first.is_crossing = is_crossing;
            first.crossings = first.crossings.saturating_add(count);
        }
        count
    }
}

/// Marks the edges of `first` that cross triangles of `second`, except triangles joined with the edge. The trees must
/// be current. Returns their number.
fn mark_crossing_edges(
    first: &CollisionSurface,
    second: &CollisionSurface,
    are_joined: impl Fn(&[u32], &[u32]) -> bool,
    is_crossing: &mut [bool],
) -> u32 {
    let mut count = 0;
    let shift = shift(first, second);
    let is_same_surface = std::ptr::eq(first, second);
    let edges = first.edges.iter().zip(is_crossing);
    for (edge, is_crossing) in edges.filter(|(edge, _)| edge[0] != NONE) {
        let ends = edge.map(|node| first.start(node) + shift);
        let mut crosses_any = false;
        let around = Aabb::of(ends.into_iter());
        let test_triangle = |triangle: usize| {
            let nodes = second.triangles[triangle];
            if crosses_any || are_joined(edge, &nodes) {
                return;
            }
            let corners = nodes.map(|node| second.start(node));
            // Sides that a cut separated touch.
            let depth = if is_same_surface {
                first.crossing_depth(*edge, &nodes)
            } else {
                0.0
            };
            crosses_any = crosses(ends[0], ends[1], corners, depth);
        };
        second.visit_near(&around, 0.0, test_triangle);
        if crosses_any {
            *is_crossing = true;
            count += 1;
        }
    }
    count
}

/// True if an edge of `first` crosses a triangle of `second` by more than `depth`, m.
fn crosses_deeper_than(first: &CollisionSurface, second: &CollisionSurface, depth: f32) -> bool {
    let shift = shift(first, second);
    let mut crossing = first
        .edges
        .iter()
        .zip(&first.is_crossing)
        .filter(|(_, is_crossing)| **is_crossing);
    crossing.any(|(edge, _)| {
        let ends = edge.map(|node| first.start(node) + shift);
        let mut crosses_any = false;
        second.visit_near(&Aabb::of(ends.into_iter()), 0.0, |triangle| {
            let corners = second.triangles[triangle].map(|node| second.start(node));
            crosses_any |= crosses(ends[0], ends[1], corners, f64::from(depth));
        });
        crosses_any
    })
}
