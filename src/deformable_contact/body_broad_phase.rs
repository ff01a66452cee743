//! Broad phase over bodies: pairs of bodies that are near each other, and islands of bodies that take their substeps
//! together.
//!
//! The swept bounds of bodies are sorted along one axis, and those that overlap along it are compared (sweep and prune,
//! Baraff 1992). Velocities are relative to their mean, so a common velocity has no effect.

use std::ops::Range;

use glam::Vec3;

use crate::base::{Result, memory};
use crate::codec::saved;
use crate::geometry::Aabb;

/// Capacity for near pairs, per body. Beyond it, all bodies of an island count as near each other.
const PAIRS_PER_BODY: usize = 32;

/// Marks a body that is in no island.
const NONE: u32 = u32::MAX;

/// A body in the broad phase, in coordinates shared by all bodies.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SweptBody {
    pub body_index: u32,
    /// Bounds of the body, extended by its contact distance.
    pub bounds: Aabb,
    /// Maximum displacement in the step, relative to the common motion, m.
    pub travel: f32,
}

saved! { SweptBody { body_index, bounds, travel } }

/// An island: bodies that take their substeps together.
#[derive(Clone, Debug, Default)]
pub(super) struct Island {
    pub members: Range<usize>,
    pub pairs: Range<usize>,
}

saved! { Island { members, pairs } }

/// The islands of a world.
#[derive(Debug, Default)]
pub(crate) struct Islands {
    /// Union-find parents, by body index: a lower index of the same island, or the body's own index if it is the
    /// lowest.
    parents: Vec<u32>,
    /// Body indices of all islands, one island after the other.
    members: Vec<u32>,
    islands: Vec<Island>,
    /// Near pairs of all islands, lower body index first, one island after the other.
    pairs: Vec<[u32; 2]>,
    /// True if there was no capacity for a pair.
    has_overflowed: bool,
    swept_bodies: Vec<SweptBody>,
}

saved! { Islands { parents, members, islands, pairs, has_overflowed, swept_bodies } }

impl Islands {
    /// Reserves memory for this body index.
    pub fn reserve_body(&mut self, body_index: usize) -> Result<()> {
        let count = self.parents.len().max(body_index + 1);
        memory::reserve_in_steps(&mut self.members, count)?;
        memory::reserve_in_steps(&mut self.islands, count)?;
        memory::reserve_in_steps(&mut self.swept_bodies, count)?;
        memory::reserve_in_steps(&mut self.pairs, pair_capacity_for(count))?;
        while self.parents.len() < count {
            memory::push(&mut self.parents, NONE)?;
        }
        Ok(())
    }

    /// Capacity for near pairs.
    pub fn pair_capacity(&self) -> usize {
        pair_capacity_for(self.parents.len())
    }

    /// Puts each body that satisfies `is_island` into its own island, and removes all others from islands.
    pub fn reset(&mut self, is_island: impl Fn(usize) -> bool) {
        for (body_index, parent) in self.parents.iter_mut().enumerate() {
            *parent = if is_island(body_index) { body_index as u32 } else { NONE };
        }
        self.pairs.clear();
        self.has_overflowed = false;
    }

    /// Returns the lowest body index of a body's island.
    fn root(&self, body_index: u32) -> Option<u32> {
        let mut root = body_index;
        loop {
            match *self.parents.get(root as usize)? {
                NONE => return None,
                parent if parent == root => return Some(root),
                parent => root = parent,
            }
        }
    }

    pub fn contains(&self, body_index: usize) -> bool {
        self.parents.get(body_index).is_some_and(|&parent| parent != NONE)
    }

    /// Merges the islands of two bodies, for which memory is reserved.
    pub fn merge(&mut self, first: usize, second: usize) {
        let roots = [first, second].map(|body_index| self.root(body_index as u32).unwrap_or(body_index as u32));
        let lowest = roots[0].min(roots[1]);
        for (body_index, root) in [first, second].into_iter().zip(roots) {
            self.parents[root as usize] = lowest;
            self.parents[body_index] = lowest;
        }
    }

    /// Lists pairs whose swept bounds overlap and that satisfy `are_near`, and merges their islands. Returns true if a
    /// pair is new. Call [`Self::sort`] afterwards.
    pub fn merge_near(
        &mut self,
        swept_bodies: impl Iterator<Item = SweptBody>,
        are_near: impl Fn(&SweptBody, &SweptBody) -> bool,
    ) -> bool {
        let mut sorted = std::mem::take(&mut self.swept_bodies);
        sorted.clear();
        sorted.extend(swept_bodies);
        let center = |swept_body: &SweptBody| 0.5 * (swept_body.bounds.min + swept_body.bounds.max);
        let spread = Aabb::of(sorted.iter().map(center));
        let axis = (spread.max - spread.min).max_position();
        let start = |swept_body: &SweptBody| swept_body.bounds.min[axis] - swept_body.travel;
        sorted.sort_unstable_by(|a, b| start(a).total_cmp(&start(b)).then(a.body_index.cmp(&b.body_index)));
        let sorted_count = self.pairs.len();
        for (index, first_body) in sorted.iter().enumerate() {
            let end = first_body.bounds.max[axis] + first_body.travel;
            for second_body in sorted[index + 1..]
                .iter()
                .take_while(|second_body| start(second_body) <= end)
            {
                let within = first_body.bounds.extended(first_body.travel + second_body.travel);
                if !within.overlaps(&second_body.bounds)
                    || self.contains_pair(sorted_count, first_body.body_index, second_body.body_index)
                    || !are_near(first_body, second_body)
                {
                    continue;
                }
                if self.pairs.len() < self.pairs.capacity() {
                    let (low, high) = (
                        first_body.body_index.min(second_body.body_index),
                        first_body.body_index.max(second_body.body_index),
                    );
                    self.pairs.push([low, high]);
                } else {
                    self.has_overflowed = true;
                }
            }
        }
        self.swept_bodies = sorted;
        let mut is_changed = self.pairs.len() > sorted_count;
        if self.has_overflowed {
            // Near pairs that could not be stored are merged one by one.
            is_changed |= self.merge_unlisted(&are_near);
        }
        for index in sorted_count..self.pairs.len() {
            let [low, high] = self.pairs[index];
            self.merge(low as usize, high as usize);
        }
        is_changed
    }

    /// Merges the islands of near pairs without storing the pairs. Returns true if any two bodies were in different
    /// islands.
    fn merge_unlisted(&mut self, are_near: impl Fn(&SweptBody, &SweptBody) -> bool) -> bool {
        let swept_bodies = std::mem::take(&mut self.swept_bodies);
        let mut is_changed = false;
        for (index, first_body) in swept_bodies.iter().enumerate() {
            for second_body in &swept_bodies[..index] {
                let [first, second] = [first_body.body_index, second_body.body_index];
                let roots = [first, second].map(|body_index| self.root(body_index));
                if (roots[0].is_none() || roots[0] != roots[1])
                    && first_body
                        .bounds
                        .extended(first_body.travel + second_body.travel)
                        .overlaps(&second_body.bounds)
                    && are_near(first_body, second_body)
                {
                    self.merge(first as usize, second as usize);
                    is_changed = true;
                }
            }
        }
        self.swept_bodies = swept_bodies;
        is_changed
    }

    /// True if the first `sorted_count` pairs, which are sorted, contain this pair.
    fn contains_pair(&self, sorted_count: usize, first: u32, second: u32) -> bool {
        let (low, high) = (first.min(second), first.max(second));
        let Some(root) = self.root(low).filter(|&root| self.root(high) == Some(root)) else {
            return false;
        };
        let key = |&[low, high]: &[u32; 2]| (self.root(low), low, high);
        self.has_overflowed
            || self.pairs[..sorted_count]
                .binary_search_by_key(&(Some(root), low, high), key)
                .is_ok()
    }

    /// Sorts members and pairs by island.
    pub fn sort(&mut self) {
        for body_index in 0..self.parents.len() {
            if let Some(root) = self.root(body_index as u32) {
                self.parents[body_index] = root;
            }
        }
        let parents = &self.parents;
        self.members.clear();
        self.members
            .extend((0..parents.len() as u32).filter(|&body_index| parents[body_index as usize] != NONE));
        self.members
            .sort_unstable_by_key(|&body_index| (parents[body_index as usize], body_index));
        self.pairs
            .sort_unstable_by_key(|&[low, high]| (parents[low as usize], low, high));
        self.islands.clear();
        let [mut member, mut pair] = [0; 2];
        while member < self.members.len() {
            let root = parents[self.members[member] as usize];
            let has_root = |body_index: u32| parents[body_index as usize] == root;
            let members = self.members[member..]
                .iter()
                .take_while(|&&body_index| has_root(body_index))
                .count();
            let pairs = self.pairs[pair..].iter().take_while(|[low, _]| has_root(*low)).count();
            self.islands.push(Island {
                members: member..member + members,
                pairs: pair..pair + pairs,
            });
            (member, pair) = (member + members, pair + pairs);
        }
    }

    pub fn count(&self) -> usize {
        self.islands.len()
    }

    /// Body indices of an island, in order.
    pub fn members(&self, island: usize) -> &[u32] {
        &self.members[self.islands[island].members.clone()]
    }

    /// Pairs of bodies in which contacts are searched for: each member with itself, then the near pairs.
    pub fn searches(&self, island: usize) -> impl Iterator<Item = [usize; 2]> + Clone + '_ {
        let members = self.members(island).iter();
        members
            .map(|&body_index| [body_index as usize; 2])
            .chain(self.pairs(island))
    }

    /// Near pairs of an island, lower body index first, in order.
    pub fn pairs(&self, island: usize) -> impl Iterator<Item = [usize; 2]> + Clone + '_ {
        let members = if self.has_overflowed { self.members(island) } else { &[] };
        let all_pairs = members.iter().enumerate().flat_map(move |(index, &low)| {
            let higher = members[index + 1..].iter();
            higher.map(move |&high| [low, high])
        });
        let stored = if self.has_overflowed {
            &[]
        } else {
            &self.pairs[self.islands[island].pairs.clone()]
        };
        let pairs = stored.iter().copied().chain(all_pairs);
        pairs.map(|pair| pair.map(|body_index| body_index as usize))
    }
}

/// Capacity for near pairs of this number of bodies.
fn pair_capacity_for(bodies: usize) -> usize {
    (bodies * bodies / 2).min(PAIRS_PER_BODY * bodies)
}

impl SweptBody {
    /// Sweeps these bounds for `duration` seconds. The velocities of the body are within `velocities`, and `common` is
    /// subtracted from them.
    pub fn new(body_index: usize, bounds: Aabb, velocities: &Aabb, common: Vec3, duration: f32) -> Self {
        let own = (velocities.min - common).abs().max((velocities.max - common).abs());
        Self {
            body_index: body_index as u32,
            bounds,
            travel: duration * own.length(),
        }
    }
}
