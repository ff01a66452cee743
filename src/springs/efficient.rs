//! EFFICIENT: a linked list per node, each link allocated on its own (Halic et al., section 4).
//!
//! Only springs that exist take memory, and each can be added and removed without touching another. What it costs is
//! that a list must be followed from link to link: here sixteen lists are followed side by side, so that the waits for
//! memory overlap.

use super::chain::{Chain, ListElement, unlinked};
use super::ends::Ends;
use super::gather::Gather;
use super::kept::{DampedLink, KeptLink};
use super::{Link, Motion, SpringChange, Springs, already_joined, not_joined};
use crate::base::{Result, ensure, memory};
use crate::codec::{Saved, Writer, saved};
use crate::def::Spring;
use crate::simd::prefetch;
use crate::soa::{TileForces, tile_nodes};

/// How many lists are followed side by side.
const SIDE_BY_SIDE: usize = 16;

/// Springs in linked lists.
#[derive(Debug)]
pub(super) struct Efficient {
    spring_count: usize,
    damped: bool,
    /// The size of an element is a multiple of a pointer's: a link with damping takes no more than one without.
    lists: Vec<Chain<DampedLink>>,
}

saved! { Efficient { spring_count, damped, lists } }

impl Efficient {
    /// Which storage it is, in bytes.
    pub const SAVED_AS: u8 = 1;

    pub fn new(node_count: usize, springs: &[Spring]) -> Result<Self> {
        let ends = Ends::of(node_count, springs)?;
        let mut lists = memory::reserved(node_count)?;
        // Node by node: what is followed together is allocated together.
        for node in 0..node_count {
            let mut list = Chain::EMPTY;
            for link in ends.links(node) {
                list.push(DampedLink::of(&link))?;
            }
            lists.push(list);
        }
        Ok(Self {
            spring_count: springs.len(),
            damped: springs.iter().any(|spring| spring.damping != 0.0),
            lists,
        })
    }

    fn has(&self, a: u32, b: u32) -> bool {
        self.lists[a as usize].iter().any(|link| link.neighbour() == b)
    }

    #[inline(always)]
    fn tile_forces<const DAMPED: bool>(&self, tile: usize, motion: &Motion, forces: &mut TileForces) {
        let nodes = tile_nodes(tile, self.lists.len());
        let gather = Gather::<DAMPED>::new(motion, nodes.start, self.lists.len());
        let mut fetched = nodes.start;
        for node in nodes.clone() {
            if node == fetched {
                fetched = nodes.end.min(node + SIDE_BY_SIDE);
                fetch(&self.lists[node..fetched]);
            }
            gather.node(node, self.lists[node].iter().map(DampedLink::link), forces);
        }
    }
}

/// Follows lists side by side, so that all their links are in the nearest cache.
#[inline(always)]
fn fetch(lists: &[Chain<DampedLink>]) {
    let mut followed: [Option<&ListElement<DampedLink>>; SIDE_BY_SIDE] = [None; SIDE_BY_SIDE];
    for (followed, list) in followed.iter_mut().zip(lists) {
        *followed = list.first();
    }
    let mut more = true;
    while more {
        more = false;
        for element in &mut followed {
            if let Some(link) = *element {
                *element = link.next();
                if let Some(next) = *element {
                    prefetch(next);
                    more = true;
                }
            }
        }
    }
}

impl Springs for Efficient {
    fn save(&self, to: &mut Writer) {
        to.put(&[Self::SAVED_AS]);
        Saved::save(self, to);
    }

    fn damped(&self) -> bool {
        self.damped
    }

    fn node_count(&self) -> usize {
        self.lists.len()
    }

    fn spring_count(&self) -> usize {
        self.spring_count
    }

    fn bytes(&self) -> (usize, usize) {
        let links = 2 * self.spring_count * size_of::<ListElement<DampedLink>>();
        (links, links + self.lists.capacity() * size_of::<Chain<DampedLink>>())
    }

    fn visit(&self, node: usize, see: &mut dyn FnMut(Link)) {
        self.lists[node].iter().map(DampedLink::link).for_each(see);
    }

    fn forces(&self, tile: usize, motion: &Motion, forces: &mut TileForces) {
        if motion.velocities.is_some() {
            self.tile_forces::<true>(tile, motion, forces);
        } else {
            self.tile_forces::<false>(tile, motion, forces);
        }
    }

    fn reserve_nodes(&mut self, node_count: usize) -> Result<()> {
        memory::reserve(&mut self.lists, node_count)
    }

    fn resize(&mut self, node_count: usize) -> Result<()> {
        self.lists.resize_with(node_count, || Chain::EMPTY);
        Ok(())
    }

    fn add(&mut self, spring: &Spring) -> Result<()> {
        let [a, b] = spring.nodes;
        ensure!(!self.has(a, b), already_joined(a, b));
        let [mut link_a, mut link_b] = Link::ends(spring);
        if !self.damped {
            (link_a.damping, link_b.damping) = (0.0, 0.0);
        }
        let (link_a, link_b) = (unlinked(DampedLink::of(&link_a))?, unlinked(DampedLink::of(&link_b))?);
        self.lists[a as usize].put(link_a);
        self.lists[b as usize].put(link_b);
        self.spring_count += 1;
        Ok(())
    }

    fn remove(&mut self, a: u32, b: u32) -> Result<()> {
        for (node, neighbour) in [(a, b), (b, a)] {
            // Both ends have it, or none.
            if !self.lists[node as usize].remove(|link| link.neighbour() == neighbour) {
                return Err(not_joined(a, b));
            }
        }
        self.spring_count -= 1;
        Ok(())
    }

    fn set(&mut self, changes: &[SpringChange]) -> Result<()> {
        for (node, link) in changes.iter().flat_map(SpringChange::ends) {
            if let Some(kept) = self.lists[node as usize].find_mut(|kept| kept.neighbour() == link.neighbour) {
                *kept = DampedLink::of(&link);
            }
        }
        Ok(())
    }
}
