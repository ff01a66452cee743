//! The broad phase over bodies: which are near each other, and the islands of bodies that take their substeps together.
//!
//! Boxes about what each body may reach in a step are sorted along one axis, and those that overlap along it are compared (sweep and prune, Baraff
//! 1992). Velocities are taken against their mean, so a velocity that all bodies have in common changes nothing.

use std::ops::Range;

use glam::Vec3;

use crate::base::{Result, memory};
use crate::codec::saved;
use crate::geometry::Bounds;

/// Near pairs that there is room for, for each body. Where there are more, all bodies of an island count as near each other.
const ROOM: usize = 32;

/// In no island.
const NONE: u32 = u32::MAX;

/// A body as the broad phase sees it, in coordinates that all bodies share.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reach {
    pub place: u32,
    /// The body, and what keeps off it.
    pub bounds: Bounds,
    /// How much further it may come in the step, beside what all do, m.
    pub travel: f32,
}

saved! { Reach { place, bounds, travel } }

/// Some bodies of a world: an island.
#[derive(Clone, Debug, Default)]
pub(super) struct Island {
    pub members: Range<usize>,
    pub pairs: Range<usize>,
}

saved! { Island { members, pairs } }

/// The islands of the bodies of a world.
#[derive(Debug, Default)]
pub(crate) struct Islands {
    /// By a body's place in the world, a lower place of its island, or its own where it is the lowest.
    parents: Vec<u32>,
    /// The bodies of all islands, by their places, one island after the other.
    members: Vec<u32>,
    islands: Vec<Island>,
    /// Bodies that are near each other, the lower place first, one island after the other.
    pairs: Vec<[u32; 2]>,
    /// Whether there was no room for some.
    is_full: bool,
    reaches: Vec<Reach>,
}

saved! { Islands { parents, members, islands, pairs, is_full, reaches } }

impl Islands {
    /// Makes room for the body at this place.
    pub fn make_place(&mut self, place: usize) -> Result<()> {
        let count = self.parents.len().max(place + 1);
        memory::reserve_in_steps(&mut self.members, count)?;
        memory::reserve_in_steps(&mut self.islands, count)?;
        memory::reserve_in_steps(&mut self.reaches, count)?;
        memory::reserve_in_steps(&mut self.pairs, room_for(count))?;
        while self.parents.len() < count {
            memory::push(&mut self.parents, NONE)?;
        }
        Ok(())
    }

    /// Near pairs that there is room for.
    pub fn room(&self) -> usize {
        room_for(self.parents.len())
    }

    /// Begins anew: each body is an island of its own, where this tells so, or in none.
    pub fn part(&mut self, is_island: impl Fn(usize) -> bool) {
        for (place, parent) in self.parents.iter_mut().enumerate() {
            *parent = if is_island(place) { place as u32 } else { NONE };
        }
        self.pairs.clear();
        self.is_full = false;
    }

    /// The lowest place of the island of the body at this place.
    fn root(&self, place: u32) -> Option<u32> {
        let mut root = place;
        loop {
            match *self.parents.get(root as usize)? {
                NONE => return None,
                parent if parent == root => return Some(root),
                parent => root = parent,
            }
        }
    }

    pub fn has(&self, place: usize) -> bool {
        self.parents.get(place).is_some_and(|&parent| parent != NONE)
    }

    /// Has two bodies, for which there is room, and all that go with one of them go together.
    pub fn join(&mut self, first: usize, second: usize) {
        let roots = [first, second].map(|place| self.root(place as u32).unwrap_or(place as u32));
        let lowest = roots[0].min(roots[1]);
        for (place, root) in [first, second].into_iter().zip(roots) {
            self.parents[root as usize] = lowest;
            self.parents[place] = lowest;
        }
    }

    /// Joins bodies of which `reaches` are near each other, as this tells too, and knows them as near; [`Self::settle`] is to follow. Whether any
    /// was not known yet.
    pub fn join_near(
        &mut self,
        reaches: impl Iterator<Item = Reach>,
        are_near: impl Fn(&Reach, &Reach) -> bool,
    ) -> bool {
        let mut near = std::mem::take(&mut self.reaches);
        near.clear();
        near.extend(reaches);
        let centre = |reach: &Reach| 0.5 * (reach.bounds.min + reach.bounds.max);
        let spread = Bounds::of(near.iter().map(centre));
        let axis = (spread.max - spread.min).max_position();
        let start = |reach: &Reach| reach.bounds.min[axis] - reach.travel;
        near.sort_unstable_by(|a, b| start(a).total_cmp(&start(b)).then(a.place.cmp(&b.place)));
        let known = self.pairs.len();
        for (index, one) in near.iter().enumerate() {
            let end = one.bounds.max[axis] + one.travel;
            for other in near[index + 1..].iter().take_while(|other| start(other) <= end) {
                let within = one.bounds.extended(one.travel + other.travel);
                if !within.overlaps(&other.bounds) || self.knows(known, one.place, other.place) || !are_near(one, other)
                {
                    continue;
                }
                if self.pairs.len() < self.pairs.capacity() {
                    let (low, high) = (one.place.min(other.place), one.place.max(other.place));
                    self.pairs.push([low, high]);
                } else {
                    self.is_full = true;
                }
            }
        }
        self.reaches = near;
        let mut is_changed = self.pairs.len() > known;
        if self.is_full {
            // Those that are near and not listed are joined one after the other.
            is_changed |= self.join_listless(&are_near);
        }
        for index in known..self.pairs.len() {
            let [low, high] = self.pairs[index];
            self.join(low as usize, high as usize);
        }
        is_changed
    }

    /// The same for pairs that there is no room for: whether any bodies were in two islands.
    fn join_listless(&mut self, are_near: impl Fn(&Reach, &Reach) -> bool) -> bool {
        let reaches = std::mem::take(&mut self.reaches);
        let mut is_changed = false;
        for (index, one) in reaches.iter().enumerate() {
            for other in &reaches[..index] {
                let [first, second] = [one.place, other.place];
                let roots = [first, second].map(|place| self.root(place));
                if (roots[0].is_none() || roots[0] != roots[1])
                    && one.bounds.extended(one.travel + other.travel).overlaps(&other.bounds)
                    && are_near(one, other)
                {
                    self.join(first as usize, second as usize);
                    is_changed = true;
                }
            }
        }
        self.reaches = reaches;
        is_changed
    }

    /// Whether two bodies are among the first `known` pairs, which are settled.
    fn knows(&self, known: usize, first: u32, second: u32) -> bool {
        let (low, high) = (first.min(second), first.max(second));
        let Some(root) = self.root(low).filter(|&root| self.root(high) == Some(root)) else {
            return false;
        };
        let key = |&[low, high]: &[u32; 2]| (self.root(low), low, high);
        self.is_full
            || self.pairs[..known]
                .binary_search_by_key(&(Some(root), low, high), key)
                .is_ok()
    }

    /// Puts members and pairs in order, one island after the other.
    pub fn settle(&mut self) {
        for place in 0..self.parents.len() {
            if let Some(root) = self.root(place as u32) {
                self.parents[place] = root;
            }
        }
        let parents = &self.parents;
        self.members.clear();
        self.members
            .extend((0..parents.len() as u32).filter(|&place| parents[place as usize] != NONE));
        self.members
            .sort_unstable_by_key(|&place| (parents[place as usize], place));
        self.pairs
            .sort_unstable_by_key(|&[low, high]| (parents[low as usize], low, high));
        self.islands.clear();
        let [mut member, mut pair] = [0; 2];
        while member < self.members.len() {
            let root = parents[self.members[member] as usize];
            let of_root = |place: u32| parents[place as usize] == root;
            let members = self.members[member..]
                .iter()
                .take_while(|&&place| of_root(place))
                .count();
            let pairs = self.pairs[pair..].iter().take_while(|[low, _]| of_root(*low)).count();
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

    /// The bodies of an island, by their places, in order.
    pub fn members(&self, island: usize) -> &[u32] {
        &self.members[self.islands[island].members.clone()]
    }

    /// What is searched for contacts in an island: each member with itself, then the near pairs.
    pub fn searches(&self, island: usize) -> impl Iterator<Item = [usize; 2]> + Clone + '_ {
        let members = self.members(island).iter();
        members.map(|&place| [place as usize; 2]).chain(self.pairs(island))
    }

    /// The near pairs of an island, the lower place first, in order.
    pub fn pairs(&self, island: usize) -> impl Iterator<Item = [usize; 2]> + Clone + '_ {
        let members = if self.is_full { self.members(island) } else { &[] };
        let all = members.iter().enumerate().flat_map(move |(index, &low)| {
            let higher = members[index + 1..].iter();
            higher.map(move |&high| [low, high])
        });
        let listed = if self.is_full {
            &[]
        } else {
            &self.pairs[self.islands[island].pairs.clone()]
        };
        let pairs = listed.iter().copied().chain(all);
        pairs.map(|pair| pair.map(|place| place as usize))
    }
}

/// Near pairs that there is room for among so many bodies.
fn room_for(bodies: usize) -> usize {
    (bodies * bodies / 2).min(ROOM * bodies)
}

/// What a body reaches with velocities in a box, which others may come near.
impl Reach {
    /// That of a body in this box, of which no part leaves the velocity `common` by more than it does in the box `velocities`, in `duration` seconds.
    pub fn new(place: usize, bounds: Bounds, velocities: &Bounds, common: Vec3, duration: f32) -> Self {
        let own = (velocities.min - common).abs().max((velocities.max - common).abs());
        Self {
            place: place as u32,
            bounds,
            travel: duration * own.length(),
        }
    }
}
