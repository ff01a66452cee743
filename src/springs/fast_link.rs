//! FAST_LINK: one array with a row of slots per node (Halic et al., section 4).
//!
//! A row holds its links first, then empty slots. No count is stored: the memory is nodes x slots x the size of a link.

use super::adjacency::Adjacency;
use super::node_sum::{NodeSum, RowForces, RowStorage, prefetch_row};
use super::stored_link::{StoredLink, empty_slot, links, remove_slot, slot_of};
use super::{ForceInput, Link, Rewiring, SpringChange, Springs, already_joined, not_joined};
use crate::base::{Error, Result, ensure, memory};
use crate::codec::{Saved, Writer, saved};
use crate::def::Spring;
use crate::simd::{BatchKernel, ChosenKernel};
use crate::soa::{TileForces, tile_nodes};

/// The number of nodes by which rows are prefetched in advance.
const PREFETCH_DISTANCE: usize = 16;

/// Springs in rows of slots.
#[derive(Debug)]
pub(super) struct FastLink<L> {
    kernel: ChosenKernel,
    node_count: usize,
    spring_count: usize,
    springs_per_node: usize,
    slots: Vec<L>,
}

saved! { [L: Saved] FastLink<L> { kernel, node_count, spring_count, springs_per_node, slots } where Self::has_valid_size }

impl<L> FastLink<L> {
    fn has_valid_size(&self) -> bool {
        self.springs_per_node > 0 && self.node_count.checked_mul(self.springs_per_node) == Some(self.slots.len())
    }
}

impl<L: StoredLink> FastLink<L> {
    /// The tag of this storage in snapshots.
    pub const SAVED_AS: u8 = 2 + L::DAMPED as u8;

    /// Creates rows of `springs_per_node` slots. 0: the maximum number of springs per node, at least one.
    pub fn new(kernel: ChosenKernel, node_count: usize, springs: &[Spring], springs_per_node: usize) -> Result<Self> {
        let adjacency = Adjacency::new(node_count, springs)?;
        let (node, max_degree) = adjacency.max_degree();
        let springs_per_node = if springs_per_node == 0 {
            max_degree.max(1)
        } else {
            springs_per_node
        };
        ensure!(
            max_degree <= springs_per_node,
            Error::Capacity(format!(
                "springs_per_node is {springs_per_node}: node {node} has {max_degree} springs"
            ))
        );
        let count = node_count.checked_mul(springs_per_node).ok_or(Error::OutOfMemory)?;
        let mut slots = memory::filled(L::EMPTY, count)?;
        for (node, row) in slots.chunks_exact_mut(springs_per_node).enumerate() {
            for (slot, link) in row.iter_mut().zip(adjacency.links(node)) {
                *slot = L::from_link(&link);
            }
        }
        Ok(Self {
            kernel,
            node_count,
            spring_count: springs.len(),
            springs_per_node,
            slots,
        })
    }

    fn row(&self, node: u32) -> &[L] {
        let width = self.springs_per_node;
        &self.slots[node as usize * width..][..width]
    }

    fn row_mut(&mut self, node: u32) -> &mut [L] {
        let width = self.springs_per_node;
        &mut self.slots[node as usize * width..][..width]
    }

    /// Checks that the row of each node can hold its links after the change.
    fn check_capacity(&self, Rewiring { removed, added, .. }: &Rewiring) -> Result<()> {
        let mut ends = memory::reserved(2 * (removed.len() + added.len()))?;
        for (springs, change) in [(removed, -1), (added, 1)] {
            ends.extend(
                springs
                    .iter()
                    .flat_map(|spring| spring.nodes)
                    .map(|node| (node, change)),
            );
        }
        ends.sort_unstable();
        for node_entries in ends.chunk_by(|a, b| a.0 == b.0) {
            let node = node_entries[0].0;
            let change: isize = node_entries.iter().map(|&(_, change)| change).sum();
            let count = links(self.row(node)).len().saturating_add_signed(change);
            let width = self.springs_per_node;
            ensure!(
                count <= width,
                Error::Capacity(format!(
                    "node {node} needs {count} springs: springs_per_node is {width}"
                ))
            );
        }
        Ok(())
    }

    /// The slot of a node's next link.
    fn empty_slot(&self, node: u32) -> Result<usize> {
        empty_slot(self.row(node)).ok_or_else(|| {
            let width = self.springs_per_node;
            Error::Capacity(format!("node {node} has {width} springs: springs_per_node is {width}"))
        })
    }
}

impl<L: StoredLink> RowStorage for FastLink<L> {
    #[inline(always)]
    fn tile_forces<const DAMPED: bool>(
        &self,
        tile: usize,
        input: &ForceInput,
        eights: impl BatchKernel,
        forces: &mut TileForces,
    ) {
        let nodes = tile_nodes(tile, self.node_count);
        let width = self.springs_per_node;
        let node_sum = NodeSum::<DAMPED>::new(input, nodes.start, self.node_count);
        let rows = self.slots[nodes.start * width..nodes.end * width].chunks_exact(width);
        for (node, row) in nodes.zip(rows) {
            prefetch_row(row.as_ptr().wrapping_add(PREFETCH_DISTANCE * width), size_of_val(row));
            node_sum.write_node_from_rows(node, [row].into_iter(), eights, forces);
        }
    }
}

impl<L: StoredLink> Springs for FastLink<L> {
    fn save(&self, to: &mut Writer) {
        to.write(&[Self::SAVED_AS]);
        Saved::save(self, to);
    }

    fn damped(&self) -> bool {
        L::DAMPED
    }

    fn node_count(&self) -> usize {
        self.node_count
    }

    fn spring_count(&self) -> usize {
        self.spring_count
    }

    fn bytes(&self) -> (usize, usize) {
        (
            2 * self.spring_count * size_of::<L>(),
            self.slots.capacity() * size_of::<L>(),
        )
    }

    fn visit(&self, node: usize, f: &mut dyn FnMut(Link)) {
        links(self.row(node as u32)).iter().map(L::link).for_each(f);
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
        let slots = node_count.checked_mul(self.springs_per_node);
        memory::reserve(&mut self.slots, slots.ok_or(Error::OutOfMemory)?)
    }

    fn resize(&mut self, node_count: usize) -> Result<()> {
        self.slots.resize(node_count * self.springs_per_node, L::EMPTY);
        self.node_count = node_count;
        Ok(())
    }

    fn add(&mut self, spring: &Spring) -> Result<()> {
        let [a, b] = spring.nodes;
        ensure!(slot_of(self.row(a), b).is_none(), already_joined(a, b));
        let slots = [self.empty_slot(a)?, self.empty_slot(b)?];
        for ((node, slot), link) in spring.nodes.into_iter().zip(slots).zip(Link::ends(spring)) {
            self.row_mut(node)[slot] = L::from_link(&link);
        }
        self.spring_count += 1;
        Ok(())
    }

    fn remove(&mut self, a: u32, b: u32) -> Result<()> {
        for (node, neighbor) in [(a, b), (b, a)] {
            // Either both ends have the link or none has.
            let slot = slot_of(self.row(node), neighbor).ok_or_else(|| not_joined(a, b))?;
            remove_slot(self.row_mut(node), slot);
        }
        self.spring_count -= 1;
        Ok(())
    }

    fn rewire(&mut self, rewiring: &Rewiring) -> Result<()> {
        self.check_capacity(rewiring)?;
        for Spring { nodes: [a, b], .. } in &rewiring.removed {
            self.remove(*a, *b)?;
        }
        self.set(&rewiring.changed)?;
        rewiring.added.iter().try_for_each(|spring| self.add(spring))
    }

    fn set(&mut self, changes: &[SpringChange]) -> Result<()> {
        for (node, link) in changes.iter().flat_map(SpringChange::ends) {
            let row = self.row_mut(node);
            if let Some(slot) = slot_of(row, link.neighbor) {
                row[slot] = L::from_link(&link);
            }
        }
        Ok(())
    }
}
