//! EFFICIENT: a linked list per node, with each link allocated individually (Halic et al., section 4).
//!
//! Only existing springs take memory, and adding or removing one does not touch others. The cost is pointer chasing.
//! Sixteen lists are therefore traversed concurrently, so that their memory latencies overlap.

use super::adjacency::Adjacency;
use super::chain::{Chain, ListElement, unlinked};
use super::node_sum::NodeSum;
use super::stored_link::{DampedLink, StoredLink};
use super::{ForceInput, Link, SpringChange, Springs, already_joined, not_joined};
use crate::base::{Result, ensure, memory};
use crate::codec::{Saved, Writer, saved};
use crate::def::Spring;
use crate::simd::prefetch;
use crate::soa::{TileForces, tile_nodes};

/// The number of lists that are traversed concurrently.
const CONCURRENT_LISTS: usize = 16;

/// Springs in linked lists.
#[derive(Debug)]
pub(super) struct Efficient {
    spring_count: usize,
    damped: bool,
    /// Element sizes are multiples of a pointer's size, so a link with damping takes no more memory than one without.
    lists: Vec<Chain<DampedLink>>,
}

saved! { Efficient { spring_count, damped, lists } }

impl Efficient {
    /// The tag of this storage in snapshots.
    pub const SAVED_AS: u8 = 1;

    pub fn new(node_count: usize, springs: &[Spring]) -> Result<Self> {
        let adjacency = Adjacency::new(node_count, springs)?;
        let mut lists = memory::reserved(node_count)?;
        // Allocated node by node, so that lists that are traversed together are adjacent in memory.
        for node in 0..node_count {
            let mut list = Chain::EMPTY;
            for link in adjacency.links(node) {
                list.push(DampedLink::from_link(&link))?;
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
        self.lists[a as usize].iter().any(|link| link.neighbor() == b)
    }

    #[inline(always)]
    fn tile_forces<const DAMPED: bool>(&self, tile: usize, input: &ForceInput, forces: &mut TileForces) {
        let nodes = tile_nodes(tile, self.lists.len());
        let node_sum = NodeSum::<DAMPED>::new(input, nodes.start, self.lists.len());
        let mut prefetched_end = nodes.start;
        for node in nodes.clone() {
            if node == prefetched_end {
                prefetched_end = nodes.end.min(node + CONCURRENT_LISTS);
                prefetch_lists(&self.lists[node..prefetched_end]);
            }
            node_sum.write_node(node, self.lists[node].iter().map(DampedLink::link), forces);
        }
    }
}

/// Traverses lists concurrently, which brings all their links into the first-level cache.
#[inline(always)]
fn prefetch_lists(lists: &[Chain<DampedLink>]) {
    let mut cursor: [Option<&ListElement<DampedLink>>; CONCURRENT_LISTS] = [None; CONCURRENT_LISTS];
    for (cursor, list) in cursor.iter_mut().zip(lists) {
        *cursor = list.first();
    }
    let mut any_left = true;
    while any_left {
        any_left = false;
        for element in &mut cursor {
            if let Some(link) = *element {
                *element = link.next();
                if let Some(next) = *element {
                    prefetch(next);
                    any_left = true;
                }
            }
        }
    }
}

impl Springs for Efficient {
    fn save(&self, to: &mut Writer) {
        to.write(&[Self::SAVED_AS]);
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

    fn visit(&self, node: usize, f: &mut dyn FnMut(Link)) {
        self.lists[node].iter().map(DampedLink::link).for_each(f);
    }

    fn forces(&self, tile: usize, input: &ForceInput, forces: &mut TileForces) {
        if input.velocities.is_some() {
            self.tile_forces::<true>(tile, input, forces);
        } else {
            self.tile_forces::<false>(tile, input, forces);
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
        let (link_a, link_b) = (
            unlinked(DampedLink::from_link(&link_a))?,
            unlinked(DampedLink::from_link(&link_b))?,
        );
        self.lists[a as usize].push_element(link_a);
        self.lists[b as usize].push_element(link_b);
        self.spring_count += 1;
        Ok(())
    }

    fn remove(&mut self, a: u32, b: u32) -> Result<()> {
        for (node, neighbor) in [(a, b), (b, a)] {
            // Either both ends have the link or none has.
            if !self.lists[node as usize].remove(|link| link.neighbor() == neighbor) {
                return Err(not_joined(a, b));
            }
        }
        self.spring_count -= 1;
        Ok(())
    }

    fn set(&mut self, changes: &[SpringChange]) -> Result<()> {
        for (node, link) in changes.iter().flat_map(SpringChange::ends) {
            if let Some(stored) = self.lists[node as usize].find_mut(|stored| stored.neighbor() == link.neighbor) {
                *stored = DampedLink::from_link(&link);
            }
        }
        Ok(())
    }
}
