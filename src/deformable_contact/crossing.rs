//! Edges of one surface that pass through triangles of another: what contact is to prevent, and what it left.

use super::DeformableContact;
use super::plan::are_asleep;
use super::search::shift;
use super::skin::{NONE, Skin};
use super::{join_movers, meet_each_other};
use crate::geometry::Bounds;
use crate::geometry::predicates::crosses;
use crate::solver::Systems;

impl DeformableContact {
    /// Finds the edges of bodies that go together that pass through tissue when a step begins, or as one that was tried ends: how many
    /// there are.
    pub fn find_crossings(&mut self, bodies: &impl Systems, at_end: bool) -> u32 {
        let mut count = 0_u32;
        let islands = std::mem::take(&mut self.islands);
        for island in 0..islands.count() {
            let members = islands.members(island).iter().map(|&place| place as usize);
            if are_asleep(islands.members(island), bodies) {
                let skins = members.filter_map(|place| self.skins.get(place)?.as_ref());
                count = skins.fold(count, |count, skin| count.saturating_add(skin.crossings));
                continue;
            }
            for place in members.clone() {
                if let (Some(Some(skin)), Some(body)) = (self.skins.get_mut(place), bodies.at(place)) {
                    skin.stand(body, at_end);
                    skin.pierces.fill(false);
                    skin.crossings = 0;
                }
            }
            for a in members {
                if bodies.at(a).is_some_and(|body| body.contact.with_itself) {
                    count = count.saturating_add(self.mark_crossings(bodies, [a; 2]));
                }
            }
            for [a, b] in islands.pairs(island) {
                if let (Some(first), Some(second)) = (bodies.at(a), bodies.at(b))
                    && meet_each_other(first, second)
                {
                    let of_pair = [[a, b], [b, a]].map(|pair| self.mark_crossings(bodies, pair));
                    count = of_pair.into_iter().fold(count, u32::saturating_add);
                    if !at_end {
                        self.entangle([a, b], of_pair != [0; 2]);
                    }
                }
            }
        }
        self.islands = islands;
        count
    }

    /// Which body has the most of those that were found last.
    pub fn most_crossing(&self) -> Option<usize> {
        let members = (0..self.islands.count()).flat_map(|island| self.islands.members(island));
        members.map(|&place| place as usize).max_by_key(|&place| {
            self.skins
                .get(place)
                .and_then(Option::as_ref)
                .map(|skin| skin.crossings)
        })
    }

    /// Has two open surfaces that were made through each other let go, and those that no longer cross keep each other off again, from as near as
    /// they are.
    fn entangle(&mut self, pair: [usize; 2], cross: bool) {
        let [Some(Some(first)), Some(Some(second))] = pair.map(|place| self.skins.get(place)) else {
            return;
        };
        let Ok([Some(kept_a), Some(kept_b)]) = self.clearances.get_disjoint_mut(pair) else {
            return;
        };
        if !cross {
            if self.entangled.remove(pair) {
                (kept_a.is_new, kept_b.is_new) = (true, true);
            }
            return;
        }
        let are_open = !first.is_closed && !second.is_closed;
        if are_open && (kept_a.is_new || kept_b.is_new) {
            // Surfaces that lie flush on each other cross by rounding.
            let depth = first.least_thickness().min(second.least_thickness());
            if is_deep(first, second, depth) || is_deep(second, first, depth) {
                self.entangled.add(pair);
            }
        }
    }

    /// Marks the edges of the first of two bodies, or of one, that pass through triangles of the second: how many there are.
    fn mark_crossings(&mut self, bodies: &impl Systems, [a, b]: [usize; 2]) -> u32 {
        // It is written to while both are read.
        let Some(Some(first)) = self.skins.get_mut(a) else {
            return 0;
        };
        let mut pierces = std::mem::take(&mut first.pierces);
        let mut count = 0;
        if let (Some(Some(first)), Some(Some(second))) = (self.skins.get(a), self.skins.get(b)) {
            let are_joined = |edge: &[u32], triangle: &[u32]| {
                a == b && edge.iter().any(|node| triangle.contains(node))
                    || !self.bonds.are_none() && join_movers(&self.bonds, bodies, [a, b], [edge, triangle])
            };
            count = mark(first, second, are_joined, &mut pierces);
        }
        if let Some(Some(first)) = self.skins.get_mut(a) {
            first.pierces = pierces;
            first.crossings = first.crossings.saturating_add(count);
        }
        count
    }
}

/// Marks the edges of `first` that pass through triangles of `second`, as their trees have them, but for those that are joined with the
/// edge: how many there are.
fn mark(first: &Skin, second: &Skin, are_joined: impl Fn(&[u32], &[u32]) -> bool, pierces: &mut [bool]) -> u32 {
    let mut count = 0;
    let shift = shift(first, second);
    let is_of_one = std::ptr::eq(first, second);
    let edges = first.edges.iter().zip(pierces);
    for (edge, pierces) in edges.filter(|(edge, _)| edge[0] != NONE) {
        let ends = edge.map(|node| first.start(node) + shift);
        let mut passes = false;
        let around = Bounds::of(ends.into_iter());
        let see = |triangle: usize| {
            let nodes = second.triangles[triangle];
            if passes || are_joined(edge, &nodes) {
                return;
            }
            let corners = nodes.map(|node| second.start(node));
            // What a cut has parted touches.
            let depth = if is_of_one {
                first.crossing_depth(*edge, &nodes)
            } else {
                0.0
            };
            passes = crosses(ends[0], ends[1], corners, depth);
        };
        second.near(&around, 0.0, see);
        if passes {
            *pierces = true;
            count += 1;
        }
    }
    count
}

/// Whether an edge of `first` passes through a triangle of `second` by more than `depth`, m.
fn is_deep(first: &Skin, second: &Skin, depth: f32) -> bool {
    let shift = shift(first, second);
    let mut crossing = first.edges.iter().zip(&first.pierces).filter(|(_, pierces)| **pierces);
    crossing.any(|(edge, _)| {
        let ends = edge.map(|node| first.start(node) + shift);
        let mut passes = false;
        second.near(&Bounds::of(ends.into_iter()), 0.0, |triangle| {
            let corners = second.triangles[triangle].map(|node| second.start(node));
            passes |= crosses(ends[0], ends[1], corners, f64::from(depth));
        });
        passes
    })
}
