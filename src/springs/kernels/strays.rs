//! Links outside of columns, of any nodes of a tile, sorted by node.

use std::ops::Range;

use super::layout::F32x16;
use crate::base::Result;
use crate::codec::saved;
use crate::order::LANES;
use crate::springs::Link;

/// The links of a tile that are in no column.
#[derive(Debug)]
pub(crate) struct Strays {
    /// The first node of the tile.
    first: usize,
    /// The number of nodes in the body.
    node_count: usize,
    damped: bool,
    /// The nodes, relative to the first node of the tile.
    local_nodes: Vec<u16>,
    neighbors: Vec<u32>,
    stiffnesses: Vec<f32>,
    rest_lengths: Vec<f32>,
    dampings: Vec<f32>,
}

saved! { Strays { first, node_count, damped, local_nodes, neighbors, stiffnesses, rest_lengths, dampings } }

/// Up to sixteen strays as the kernel takes them.
pub(super) struct Batch {
    pub count: usize,
    /// The nodes, relative to the first node of the tile.
    pub local_nodes: [u16; LANES],
    pub nodes: [u32; LANES],
    pub neighbors: [u32; LANES],
    pub stiffnesses: F32x16,
    pub rest_lengths: F32x16,
    pub dampings: F32x16,
}

impl Strays {
    pub(super) fn new(first: usize, node_count: usize, damped: bool) -> Self {
        Self {
            first,
            node_count,
            damped,
            local_nodes: Vec::new(),
            neighbors: Vec::new(),
            stiffnesses: Vec::new(),
            rest_lengths: Vec::new(),
            dampings: Vec::new(),
        }
    }

    /// Raises the body's number of nodes.
    pub(super) fn extend_node_count(&mut self, node_count: usize) {
        self.node_count = self.node_count.max(node_count);
    }

    /// Lowers the body's number of nodes.
    pub(super) fn shrink(&mut self, node_count: usize) {
        self.node_count = self.node_count.min(node_count);
    }

    pub fn len(&self) -> usize {
        self.local_nodes.len()
    }

    /// Reserves memory for `count` more.
    pub fn reserve(&mut self, count: usize) -> Result<()> {
        self.local_nodes.try_reserve(count)?;
        self.neighbors.try_reserve(count)?;
        self.stiffnesses.try_reserve(count)?;
        self.rest_lengths.try_reserve(count)?;
        if self.damped {
            self.dampings.try_reserve(count)?;
        }
        Ok(())
    }

    /// Inserts a link of `node`, within the reserved memory.
    pub fn insert(&mut self, node: usize, link: &Link) {
        assert!((link.neighbor as usize) < self.node_count && node < self.node_count);
        let local_node = (node - self.first) as u16;
        let index = self.local_nodes.partition_point(|&other| other <= local_node);
        self.local_nodes.insert(index, local_node);
        self.neighbors.insert(index, link.neighbor);
        self.stiffnesses.insert(index, link.stiffness);
        self.rest_lengths.insert(index, link.rest_length);
        if self.damped {
            self.dampings.insert(index, link.damping);
        }
    }

    /// Sets the parameters of a link of `node`, if it is here.
    pub fn set(&mut self, node: usize, link: &Link) {
        if let Some(index) = self.find(node, link.neighbor as usize) {
            self.stiffnesses[index] = link.stiffness;
            self.rest_lengths[index] = link.rest_length;
            if self.damped {
                self.dampings[index] = link.damping;
            }
        }
    }

    /// Removes the link from `node` to `neighbor`. Returns true if there was one.
    pub fn remove(&mut self, node: usize, neighbor: usize) -> bool {
        let slot = self.find(node, neighbor);
        if let Some(index) = slot {
            self.local_nodes.remove(index);
            self.neighbors.remove(index);
            self.stiffnesses.remove(index);
            self.rest_lengths.remove(index);
            if self.damped {
                self.dampings.remove(index);
            }
        }
        slot.is_some()
    }

    /// Calls `f` for each link of `node`.
    pub fn visit(&self, node: usize, f: &mut dyn FnMut(Link)) {
        for index in self.range_of(node) {
            f(Link {
                neighbor: self.neighbors[index],
                stiffness: self.stiffnesses[index],
                rest_length: self.rest_lengths[index],
                damping: if self.damped { self.dampings[index] } else { 0.0 },
            });
        }
    }

    /// Bytes in use, and bytes held from the allocator.
    pub fn bytes(&self) -> (usize, usize) {
        let used = size_of_val(&*self.local_nodes)
            + size_of_val(&*self.neighbors)
            + size_of_val(&*self.stiffnesses)
            + size_of_val(&*self.rest_lengths)
            + size_of_val(&*self.dampings);
        let floats = self.stiffnesses.capacity() + self.rest_lengths.capacity() + self.dampings.capacity();
        let held = self.local_nodes.capacity() * size_of::<u16>()
            + self.neighbors.capacity() * size_of::<u32>()
            + floats * size_of::<f32>();
        (used, held)
    }

    fn find(&self, node: usize, neighbor: usize) -> Option<usize> {
        self.range_of(node)
            .find(|&index| self.neighbors[index] as usize == neighbor)
    }

    /// The range of a node's links.
    fn range_of(&self, node: usize) -> Range<usize> {
        let local_node = node - self.first;
        let start = self
            .local_nodes
            .partition_point(|&other| usize::from(other) < local_node);
        let count = self.local_nodes[start..].partition_point(|&other| usize::from(other) == local_node);
        start..start + count
    }

    /// True if these are valid strays of `nodes` in a body of `node_count` nodes, with neighbors within the read range.
    pub(super) fn are_valid(
        &self,
        nodes: Range<usize>,
        node_count: usize,
        damped: bool,
        is_read: impl Fn(isize) -> bool,
    ) -> bool {
        let count = self.len();
        self.first == nodes.start
            && self.node_count <= node_count
            && self.damped == damped
            && [self.neighbors.len(), self.stiffnesses.len(), self.rest_lengths.len()] == [count; 3]
            && self.dampings.len() == if damped { count } else { 0 }
            && self.local_nodes.is_sorted()
            && self
                .local_nodes
                .iter()
                .all(|&local_node| usize::from(local_node) < nodes.len())
            && self
                .neighbors
                .iter()
                .all(|&node| (node as usize) < node_count && is_read(node as isize))
    }

    pub(super) fn batch_count(&self) -> usize {
        self.len().div_ceil(LANES)
    }

    /// A batch of sixteen. Lanes beyond the last stray repeat it.
    #[inline(always)]
    pub(super) fn batch(&self, batch: usize) -> Batch {
        let start = batch * LANES;
        let local_nodes: [u16; LANES] = sixteen(&self.local_nodes[start..]);
        Batch {
            count: (self.len() - start).min(LANES),
            local_nodes,
            nodes: local_nodes.map(|local_node| (self.first + usize::from(local_node)) as u32),
            neighbors: sixteen(&self.neighbors[start..]),
            stiffnesses: F32x16(sixteen(&self.stiffnesses[start..])),
            rest_lengths: F32x16(sixteen(&self.rest_lengths[start..])),
            dampings: if self.damped {
                F32x16(sixteen(&self.dampings[start..]))
            } else {
                F32x16::ZERO
            },
        }
    }
}

/// The first sixteen values. If there are fewer, the last one is repeated.
#[inline(always)]
fn sixteen<T: Copy>(values: &[T]) -> [T; LANES] {
    match values.first_chunk() {
        Some(whole) => *whole,
        None => std::array::from_fn(|lane| values[lane.min(values.len() - 1)]),
    }
}
