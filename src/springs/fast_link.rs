//! FAST_LINK: one array with a row per node (Halic et al., section 4).
//!
//! A row holds its links first and empty places behind them. Nothing else is kept, not even a count: the memory is
//! nodes x places x the size of a link.

use super::batch::Batch;
use super::ends::Ends;
use super::kept::{KeptLink, NOBODY};
use super::kernels::{ChosenKernel, prefetch};
use super::{Link, Loops, Motion, Springs, TileForces, already_joined, not_joined, tile_nodes};
use crate::body::Spring;
use crate::error::{Error, Result};
use crate::memory;

/// How many nodes ahead rows are fetched from memory.
const AHEAD: usize = 16;

/// How much of a row is fetched ahead, bytes; the processor sees by itself how a longer one goes on.
const FETCHED: usize = 512;

/// Springs in rows.
#[derive(Debug)]
pub(super) struct FastLink<L> {
    kernel: ChosenKernel,
    node_count: usize,
    spring_count: usize,
    springs_per_node: usize,
    places: Vec<L>,
}

impl<L: KeptLink> FastLink<L> {
    /// Rows of `springs_per_node` places; 0: as many as the node with the most springs needs, at least one.
    pub fn new(kernel: ChosenKernel, node_count: usize, springs: &[Spring], springs_per_node: usize) -> Result<Self> {
        let ends = Ends::of(node_count, springs)?;
        let (node, longest) = ends.longest();
        let springs_per_node = if springs_per_node == 0 {
            longest.max(1)
        } else {
            springs_per_node
        };
        if longest > springs_per_node {
            return Err(Error::Capacity(format!(
                "springs_per_node is {springs_per_node}: node {node} has {longest} springs"
            )));
        }
        let count = node_count.checked_mul(springs_per_node).ok_or(Error::OutOfMemory)?;
        let mut places = memory::filled(L::of(&EMPTY), count)?;
        for (node, row) in places.chunks_exact_mut(springs_per_node).enumerate() {
            for (place, link) in row.iter_mut().zip(ends.links(node)) {
                *place = L::of(&link);
            }
        }
        Ok(Self {
            kernel,
            node_count,
            spring_count: springs.len(),
            springs_per_node,
            places,
        })
    }

    #[inline(always)]
    fn links(&self, node: usize) -> &[L] {
        let row = &self.places[node * self.springs_per_node..][..self.springs_per_node];
        let count = row.iter().position(|link| link.neighbour() == NOBODY);
        &row[..count.unwrap_or(row.len())]
    }

    /// The place of a node's link.
    fn place(&self, node: u32, neighbour: u32) -> Option<usize> {
        let node = node as usize;
        let place = self.links(node).iter().position(|link| link.neighbour() == neighbour)?;
        Some(node * self.springs_per_node + place)
    }

    /// The place of a node's next link.
    fn free_place(&self, node: u32) -> Result<usize> {
        let count = self.links(node as usize).len();
        if count == self.springs_per_node {
            return Err(Error::Capacity(format!(
                "node {node} has {count} springs already: springs_per_node is {count}"
            )));
        }
        Ok(node as usize * self.springs_per_node + count)
    }

    /// Empties a place of a node's row; the row's last link moves there.
    fn free(&mut self, node: u32, place: usize) {
        let node = node as usize;
        let last = node * self.springs_per_node + self.links(node).len() - 1;
        self.places[place] = self.places[last];
        self.places[last] = L::of(&EMPTY);
    }
}

/// What an empty place holds.
const EMPTY: Link = Link {
    neighbour: NOBODY,
    stiffness: 0.0,
    rest_length: 0.0,
    damping: 0.0,
};

struct TileLoop<'a, 'b, L> {
    storage: &'b FastLink<L>,
    tile: usize,
    motion: &'b Motion<'a>,
    forces: &'b mut TileForces,
}

impl<L: KeptLink> FastLink<L> {
    #[inline(always)]
    fn tile_forces<const DAMPED: bool>(&self, tile: usize, motion: &Motion, forces: &mut TileForces) {
        let nodes = tile_nodes(tile, self.node_count);
        let width = self.springs_per_node;
        let mut batch = Batch::<DAMPED>::new(motion, nodes.start, nodes.len(), forces);
        let rows = self.places[nodes.start * width..nodes.end * width].chunks_exact(width);
        for (node, row) in nodes.zip(rows) {
            let ahead = row.as_ptr().wrapping_add(AHEAD * width).cast::<u8>();
            for line in (0..size_of_val(row).min(FETCHED)).step_by(64) {
                prefetch(ahead.wrapping_add(line));
            }
            let links = row.iter().take_while(|link| link.neighbour() != NOBODY);
            batch.add(node, links.map(L::link));
        }
        batch.finish();
    }
}

impl<L: KeptLink> Loops for TileLoop<'_, '_, L> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        if L::DAMPED && self.motion.velocities.is_some() {
            self.storage.tile_forces::<true>(self.tile, self.motion, self.forces);
        } else {
            self.storage.tile_forces::<false>(self.tile, self.motion, self.forces);
        }
    }
}

impl<L: KeptLink> Springs for FastLink<L> {
    fn damped(&self) -> bool {
        L::DAMPED
    }

    fn spring_count(&self) -> usize {
        self.spring_count
    }

    fn bytes(&self) -> (usize, usize) {
        (
            2 * self.spring_count * size_of::<L>(),
            self.places.capacity() * size_of::<L>(),
        )
    }

    fn visit(&self, node: usize, see: &mut dyn FnMut(Link)) {
        self.links(node).iter().map(L::link).for_each(see);
    }

    fn forces(&self, tile: usize, motion: &Motion, forces: &mut TileForces) {
        self.kernel.run(TileLoop {
            storage: self,
            tile,
            motion,
            forces,
        });
    }

    fn add(&mut self, spring: &Spring) -> Result<()> {
        let [a, b] = spring.nodes;
        if self.place(a, b).is_some() {
            return Err(already_joined(a, b));
        }
        let (place_a, place_b) = (self.free_place(a)?, self.free_place(b)?);
        let [link_a, link_b] = Link::ends(spring);
        self.places[place_a] = L::of(&link_a);
        self.places[place_b] = L::of(&link_b);
        self.spring_count += 1;
        Ok(())
    }

    fn remove(&mut self, a: u32, b: u32) -> Result<()> {
        let (Some(place_a), Some(place_b)) = (self.place(a, b), self.place(b, a)) else {
            return Err(not_joined(a, b));
        };
        self.free(a, place_a);
        self.free(b, place_b);
        self.spring_count -= 1;
        Ok(())
    }
}
