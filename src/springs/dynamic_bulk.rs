//! DYNAMIC_BULK: a linked list of arrays ("bulks") per node (Halic et al., section 4).
//!
//! If all arrays of a node are full, another is added and nothing is copied. An array that becomes empty is freed. A
//! table holds the first array of each node, a linked list the others.

use std::ops::RangeInclusive;

use super::adjacency::Adjacency;
use super::chain::{Chain, ListElement, Unlinked, unlinked};
use super::node_sum::{NodeSum, RowForces, RowStorage, prefetch_row};
use super::stored_link::{StoredLink, empty_slot, links, remove_slot, slot_of};
use super::{ForceInput, Link, SpringChange, Springs, already_joined, not_joined};
use crate::base::{Result, ensure, memory};
use crate::codec::{Saved, Writer, saved};
use crate::def::Spring;
use crate::simd::{BatchKernel, ChosenKernel, prefetch};
use crate::soa::{TileForces, tile_nodes};

/// The number of nodes by which arrays are prefetched in advance.
const PREFETCH_DISTANCE: usize = 16;

/// An array of slots with the links first. It is not allocated while it has no link.
type Bulk<L> = Box<[L]>;

/// The arrays of one node.
#[derive(Debug)]
struct NodeBulks<L> {
    first: Bulk<L>,
    overflow: Chain<Bulk<L>>,
}

saved! { [L: Saved] NodeBulks<L> { first, overflow } }

/// The slot of a node's next link, with the memory that it needs.
enum LinkSlot<L> {
    Open,
    First(Bulk<L>),
    More(Unlinked<Bulk<L>>),
}

impl<L: StoredLink> NodeBulks<L> {
    fn empty() -> Self {
        Self {
            first: Bulk::default(),
            overflow: Chain::EMPTY,
        }
    }

    fn links(&self) -> impl Iterator<Item = &L> {
        std::iter::once(&self.first)
            .chain(self.overflow.iter())
            .flat_map(|bulk| links(bulk))
    }

    fn has(&self, neighbor: u32) -> bool {
        self.links().any(|link| link.neighbor() == neighbor)
    }

    /// An array with an empty slot.
    fn bulk_with_empty_slot(&mut self) -> Option<&mut Bulk<L>> {
        let is_open = |bulk: &Bulk<L>| empty_slot(bulk).is_some();
        if is_open(&self.first) {
            Some(&mut self.first)
        } else {
            self.overflow.find_mut(is_open)
        }
    }

    /// Reserves a slot for a link, in a new array of `slots` slots if all others are full.
    fn reserve_slot(&mut self, slots: usize) -> Result<LinkSlot<L>> {
        if self.bulk_with_empty_slot().is_some() {
            return Ok(LinkSlot::Open);
        }
        let bulk = memory::filled(L::EMPTY, slots)?.into_boxed_slice();
        if self.first.is_empty() {
            Ok(LinkSlot::First(bulk))
        } else {
            Ok(LinkSlot::More(unlinked(bulk)?))
        }
    }

    /// Inserts a link into its reserved slot.
    fn insert(&mut self, link: &Link, reserved: LinkSlot<L>) {
        match reserved {
            LinkSlot::Open => {}
            LinkSlot::First(bulk) => self.first = bulk,
            LinkSlot::More(bulk) => self.overflow.push_element(bulk),
        }
        if let Some(bulk) = self.bulk_with_empty_slot()
            && let Some(slot) = empty_slot(bulk)
        {
            bulk[slot] = L::from_link(link);
        }
    }

    /// Replaces the link to the same neighbor.
    fn replace(&mut self, link: &Link) {
        let has = |bulk: &Bulk<L>| slot_of(bulk, link.neighbor).is_some();
        let bulk = if has(&self.first) {
            Some(&mut self.first)
        } else {
            self.overflow.find_mut(has)
        };
        if let Some(bulk) = bulk
            && let Some(slot) = slot_of(bulk, link.neighbor)
        {
            bulk[slot] = L::from_link(link);
        }
    }

    /// Removes the link to a neighbor. Returns true if there was one.
    fn remove(&mut self, neighbor: u32) -> bool {
        if let Some(slot) = slot_of(&self.first, neighbor) {
            remove_slot(&mut self.first, slot);
            if links(&self.first).is_empty() {
                self.first = Bulk::default();
            }
            return true;
        }
        let Some(bulk) = self.overflow.find_mut(|bulk| slot_of(bulk, neighbor).is_some()) else {
            return false;
        };
        if let Some(slot) = slot_of(bulk, neighbor) {
            remove_slot(bulk, slot);
        }
        self.overflow.remove(|bulk| links(bulk).is_empty());
        true
    }
}

/// Springs in linked lists of arrays.
#[derive(Debug)]
pub(super) struct DynamicBulk<L> {
    kernel: ChosenKernel,
    spring_count: usize,
    springs_per_node: usize,
    nodes: Vec<NodeBulks<L>>,
}

saved! { [L: Saved] DynamicBulk<L> { kernel, spring_count, springs_per_node, nodes } }

impl<L: StoredLink> DynamicBulk<L> {
    /// The tag of this storage in snapshots.
    pub const SAVED_AS: u8 = 4 + L::DAMPED as u8;

    /// Creates arrays of `springs_per_node` slots. 0: the size is chosen from the springs.
    pub fn new(kernel: ChosenKernel, node_count: usize, springs: &[Spring], springs_per_node: usize) -> Result<Self> {
        let adjacency = Adjacency::new(node_count, springs)?;
        let springs_per_node = match springs_per_node {
            0 => least_memory::<L>(node_count, &adjacency),
            chosen => chosen,
        };
        let mut nodes = memory::reserved(node_count)?;
        for node in 0..node_count {
            let mut bulks = NodeBulks::empty();
            for link in adjacency.links(node) {
                let reserved = bulks.reserve_slot(springs_per_node)?;
                bulks.insert(&link, reserved);
            }
            nodes.push(bulks);
        }
        Ok(Self {
            kernel,
            spring_count: springs.len(),
            springs_per_node,
            nodes,
        })
    }
}

impl<L: StoredLink> RowStorage for DynamicBulk<L> {
    #[inline(always)]
    fn tile_forces<const DAMPED: bool>(
        &self,
        tile: usize,
        input: &ForceInput,
        eights: impl BatchKernel,
        forces: &mut TileForces,
    ) {
        let nodes = tile_nodes(tile, self.nodes.len());
        let node_sum = NodeSum::<DAMPED>::new(input, nodes.start, self.nodes.len());
        for node in nodes {
            if let Some(ahead) = self.nodes.get(node + PREFETCH_DISTANCE) {
                prefetch_row(ahead.first.as_ptr(), size_of_val(&*ahead.first));
                if let Some(overflow) = ahead.overflow.first() {
                    prefetch(overflow);
                }
            }
            let bulks = &self.nodes[node];
            let rows = std::iter::once(&bulks.first).chain(bulks.overflow.iter());
            node_sum.write_node_from_rows(node, rows.map(|bulk| &**bulk), eights, forces);
        }
    }
}

/// The candidate array sizes if the caller sets none.
const SLOT_COUNTS: RangeInclusive<usize> = 4..=32;

/// The array size with the least memory. Its effect on run time is negligible.
fn least_memory<L>(node_count: usize, adjacency: &Adjacency) -> usize {
    let bytes = |slots: &usize| {
        let node_entries = |node| {
            let arrays = adjacency.links(node).len().div_ceil(*slots);
            arrays * slots * size_of::<L>() + arrays.saturating_sub(1) * size_of::<ListElement<Bulk<L>>>()
        };
        (0..node_count).map(node_entries).sum::<usize>()
    };
    SLOT_COUNTS.min_by_key(bytes).unwrap_or(*SLOT_COUNTS.end())
}

impl<L: StoredLink> Springs for DynamicBulk<L> {
    fn save(&self, to: &mut Writer) {
        to.write(&[Self::SAVED_AS]);
        Saved::save(self, to);
    }

    fn damped(&self) -> bool {
        L::DAMPED
    }

    fn node_count(&self) -> usize {
        self.nodes.len()
    }

    fn spring_count(&self) -> usize {
        self.spring_count
    }

    fn bytes(&self) -> (usize, usize) {
        let mut held = self.nodes.capacity() * size_of::<NodeBulks<L>>();
        for bulks in &self.nodes {
            held += size_of_val(&*bulks.first);
            for bulk in bulks.overflow.iter() {
                held += size_of::<ListElement<Bulk<L>>>() + size_of_val(&**bulk);
            }
        }
        (2 * self.spring_count * size_of::<L>(), held)
    }

    fn visit(&self, node: usize, f: &mut dyn FnMut(Link)) {
        self.nodes[node].links().map(L::link).for_each(f);
    }

    fn forces(&self, tile: usize, input: &ForceInput, forces: &mut TileForces) {
        self.kernel.run_with_batches(RowForces {
            storage: self,
            tile,
            input,
            forces,
        });
    }

    fn reserve_nodes(&mut self, node_count: usize) -> Result<()> {
        memory::reserve(&mut self.nodes, node_count)
    }

    fn resize(&mut self, node_count: usize) -> Result<()> {
        self.nodes.resize_with(node_count, NodeBulks::empty);
        Ok(())
    }

    fn add(&mut self, spring: &Spring) -> Result<()> {
        let [a, b] = spring.nodes;
        ensure!(!self.nodes[a as usize].has(b), already_joined(a, b));
        let slot_a = self.nodes[a as usize].reserve_slot(self.springs_per_node)?;
        let slot_b = self.nodes[b as usize].reserve_slot(self.springs_per_node)?;
        let [link_a, link_b] = Link::ends(spring);
        self.nodes[a as usize].insert(&link_a, slot_a);
        self.nodes[b as usize].insert(&link_b, slot_b);
        self.spring_count += 1;
        Ok(())
    }

    fn remove(&mut self, a: u32, b: u32) -> Result<()> {
        for (node, neighbor) in [(a, b), (b, a)] {
            // Either both ends have the link or none has.
            ensure!(self.nodes[node as usize].remove(neighbor), not_joined(a, b));
        }
        self.spring_count -= 1;
        Ok(())
    }

    fn set(&mut self, changes: &[SpringChange]) -> Result<()> {
        for (node, link) in changes.iter().flat_map(SpringChange::ends) {
            self.nodes[node as usize].replace(&link);
        }
        Ok(())
    }
}
