//! The force on a node as a sum over its own links. Only that node is written, so tiles can be computed in any order.
//!
//! Contiguous links are evaluated eight at a time where the processor supports it, others one by one.

use glam::Vec3;

use super::law::pull;
use super::stored_link::{NO_NODE, StoredLink};
use super::{ForceInput, Link};
use crate::simd::{BatchInput, BatchKernel, WithBatches, prefetch};
use crate::soa::TileForces;

/// The number of `f32` values per cache line.
const CACHE_LINE: usize = 16;

/// The number of bytes of a row of links to prefetch. The hardware prefetcher continues a longer row.
const PREFETCHED_BYTES: usize = 512;

/// The positions and velocities that the links of a tile's nodes refer to.
pub(super) struct NodeSum<'a, const DAMPED: bool> {
    positions: [&'a [f32]; 3],
    velocities: [&'a [f32]; 3],
    prefetched: [&'a [f32]; 6],
    /// The first node of the tile.
    first: usize,
}

/// The axes as slices of equal length, so that bounds checks can be merged.
#[inline(always)]
fn equal_lengths([x, y, z]: [&[f32]; 3]) -> [&[f32]; 3] {
    let count = x.len();
    [x, &y[..count], &z[..count]]
}

#[inline(always)]
fn vector_at([x, y, z]: [&[f32]; 3], node: usize) -> Vec3 {
    Vec3::new(x[node], y[node], z[node])
}

impl<'a, const DAMPED: bool> NodeSum<'a, DAMPED> {
    /// The input of the tile that begins with node `first`, in a body of `node_count` nodes.
    #[inline(always)]
    pub fn new(input: &ForceInput<'a>, first: usize, node_count: usize) -> Self {
        Self {
            positions: equal_lengths(input.positions.slices(0..node_count)),
            velocities: input
                .velocities
                .map_or([&[]; 3], |velocities| equal_lengths(velocities.axes())),
            prefetched: input.prefetched,
            first,
        }
    }

    /// Writes the force of these links on `node`, and prefetches the data that is needed after the forces.
    #[inline(always)]
    pub fn write_node(&self, node: usize, links: impl Iterator<Item = Link>, forces: &mut TileForces) {
        self.prefetch_outputs(node);
        let node_state = self.node_state(node);
        let mut sum = Vec3::ZERO;
        links.for_each(|link| sum += self.pull(node_state, &link));
        forces.set(node - self.first, sum);
    }

    /// Writes the force on `node` of links stored in rows of slots, where empty slots come last.
    #[inline(always)]
    pub fn write_node_from_rows<'l, L: StoredLink>(
        &self,
        node: usize,
        rows: impl Iterator<Item = &'l [L]>,
        eights: impl BatchKernel,
        forces: &mut TileForces,
    ) {
        self.prefetch_outputs(node);
        let node_state = self.node_state(node);
        let sight = BatchInput {
            positions: self.positions,
            here: node_state.position,
        };
        let mut sum = Vec3::ZERO;
        for row in rows {
            let (groups, rest) = row.as_chunks::<8>();
            for links in groups {
                // Not a closure: it could be compiled as its own function, without the kernel's instruction set.
                if !DAMPED
                    && links[7].neighbor() != NO_NODE
                    && let Some(links) = L::eight(links)
                    && let Some(force) = eights.pull(sight, links)
                {
                    sum += force;
                } else {
                    sum += self.pull_each(node_state, links);
                }
            }
            sum += self.pull_each(node_state, rest);
        }
        forces.set(node - self.first, sum);
    }

    #[inline(always)]
    fn prefetch_outputs(&self, node: usize) {
        let index = node - self.first;
        if index.is_multiple_of(CACHE_LINE) {
            for axis in self.prefetched {
                prefetch(axis.as_ptr().wrapping_add(index));
            }
        }
    }

    #[inline(always)]
    fn node_state(&self, node: usize) -> NodeState {
        NodeState {
            node,
            position: vector_at(self.positions, node),
            velocity: if DAMPED {
                vector_at(self.velocities, node)
            } else {
                Vec3::ZERO
            },
        }
    }

    #[inline(always)]
    fn pull(&self, node_state: NodeState, link: &Link) -> Vec3 {
        let neighbor = link.neighbor as usize;
        let offset = vector_at(self.positions, neighbor) - node_state.position;
        let velocity = DAMPED.then(|| vector_at(self.velocities, neighbor) - node_state.velocity);
        pull(node_state.node, link, offset, velocity)
    }

    #[inline(always)]
    fn pull_each<L: StoredLink>(&self, node_state: NodeState, links: &[L]) -> Vec3 {
        let mut sum = Vec3::ZERO;
        for link in links.iter().take_while(|link| link.neighbor() != NO_NODE) {
            sum += self.pull(node_state, &link.link());
        }
        sum
    }
}

/// The index and state of the node that links are summed for.
#[derive(Clone, Copy)]
struct NodeState {
    node: usize,
    position: Vec3,
    velocity: Vec3,
}

/// A storage with the links of a node in arrays.
pub(super) trait RowStorage {
    /// Writes the forces on a tile. Implementations must be `#[inline(always)]`, because they are compiled for each
    /// SIMD level.
    fn tile_forces<const DAMPED: bool>(
        &self,
        tile: usize,
        input: &ForceInput,
        eights: impl BatchKernel,
        forces: &mut TileForces,
    );
}

/// The force computation of a row storage on a tile, as work for a kernel.
pub(super) struct RowForces<'a, 'm, S> {
    pub storage: &'a S,
    pub tile: usize,
    pub input: &'a ForceInput<'m>,
    pub forces: &'a mut TileForces,
}

impl<S: RowStorage> WithBatches for RowForces<'_, '_, S> {
    #[inline(always)]
    fn run<E: BatchKernel>(self, eights: E) {
        if self.input.velocities.is_some() {
            self.storage
                .tile_forces::<true>(self.tile, self.input, eights, self.forces);
        } else {
            self.storage
                .tile_forces::<false>(self.tile, self.input, eights, self.forces);
        }
    }
}

/// Prefetches `size` bytes from `address`, which may be invalid.
#[inline(always)]
pub(super) fn prefetch_row<L>(address: *const L, size: usize) {
    for line in (0..size.min(PREFETCHED_BYTES)).step_by(64) {
        prefetch(address.cast::<u8>().wrapping_add(line));
    }
}
