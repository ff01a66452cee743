//! FAST_LINK: one array with a row per node (Halic et al., section 4).
//!
//! A row holds its links first and empty places behind them. Nothing else is kept, not even a count: the memory is
//! nodes x places x the size of a link.

use super::ends::Ends;
use super::gather::{Gather, RowStorage, Rows, prefetch_row};
use super::kept::{KeptLink, empty_place, links, place_of, vacate};
use super::{Link, Motion, Rewiring, SpringChange, Springs, already_joined, not_joined};
use crate::base::{Error, Result, ensure, memory};
use crate::codec::{Saved, Writer, saved};
use crate::def::Spring;
use crate::simd::{ChosenKernel, Eights};
use crate::soa::{TileForces, tile_nodes};

/// How many nodes ahead rows are fetched from memory.
const AHEAD: usize = 16;

/// Springs in rows.
#[derive(Debug)]
pub(super) struct FastLink<L> {
    kernel: ChosenKernel,
    node_count: usize,
    spring_count: usize,
    springs_per_node: usize,
    places: Vec<L>,
}

saved! { [L: Saved] FastLink<L> { kernel, node_count, spring_count, springs_per_node, places } where Self::has_rows }

impl<L> FastLink<L> {
    fn has_rows(&self) -> bool {
        self.springs_per_node > 0 && self.node_count.checked_mul(self.springs_per_node) == Some(self.places.len())
    }
}

impl<L: KeptLink> FastLink<L> {
    /// Which storage it is, in bytes.
    pub const SAVED_AS: u8 = 2 + L::DAMPED as u8;

    /// Rows of `springs_per_node` places; 0: as many as the node with the most springs needs, at least one.
    pub fn new(kernel: ChosenKernel, node_count: usize, springs: &[Spring], springs_per_node: usize) -> Result<Self> {
        let ends = Ends::of(node_count, springs)?;
        let (node, longest) = ends.longest();
        let springs_per_node = if springs_per_node == 0 {
            longest.max(1)
        } else {
            springs_per_node
        };
        ensure!(
            longest <= springs_per_node,
            Error::Capacity(format!(
                "springs_per_node is {springs_per_node}: node {node} has {longest} springs"
            ))
        );
        let count = node_count.checked_mul(springs_per_node).ok_or(Error::OutOfMemory)?;
        let mut places = memory::filled(L::EMPTY, count)?;
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

    fn row(&self, node: u32) -> &[L] {
        let width = self.springs_per_node;
        &self.places[node as usize * width..][..width]
    }

    fn row_mut(&mut self, node: u32) -> &mut [L] {
        let width = self.springs_per_node;
        &mut self.places[node as usize * width..][..width]
    }

    /// Whether each node's row has room for what it is to have.
    fn check_room(&self, Rewiring { removed, added, .. }: &Rewiring) -> Result<()> {
        let mut ends = memory::reserved(2 * (removed.len() + added.len()))?;
        for (springs, more) in [(removed, -1), (added, 1)] {
            ends.extend(springs.iter().flat_map(|spring| spring.nodes).map(|node| (node, more)));
        }
        ends.sort_unstable();
        for of_node in ends.chunk_by(|a, b| a.0 == b.0) {
            let node = of_node[0].0;
            let more: isize = of_node.iter().map(|&(_, more)| more).sum();
            let count = links(self.row(node)).len().saturating_add_signed(more);
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

    /// The place of a node's next link.
    fn empty_place(&self, node: u32) -> Result<usize> {
        empty_place(self.row(node)).ok_or_else(|| {
            let width = self.springs_per_node;
            Error::Capacity(format!("node {node} has {width} springs: springs_per_node is {width}"))
        })
    }
}

impl<L: KeptLink> RowStorage for FastLink<L> {
    #[inline(always)]
    fn tile_forces<const DAMPED: bool>(
        &self,
        tile: usize,
        motion: &Motion,
        eights: impl Eights,
        forces: &mut TileForces,
    ) {
        let nodes = tile_nodes(tile, self.node_count);
        let width = self.springs_per_node;
        let gather = Gather::<DAMPED>::new(motion, nodes.start, self.node_count);
        let rows = self.places[nodes.start * width..nodes.end * width].chunks_exact(width);
        for (node, row) in nodes.zip(rows) {
            prefetch_row(row.as_ptr().wrapping_add(AHEAD * width), size_of_val(row));
            gather.node_of_rows(node, [row].into_iter(), eights, forces);
        }
    }
}

impl<L: KeptLink> Springs for FastLink<L> {
    fn save(&self, to: &mut Writer) {
        to.put(&[Self::SAVED_AS]);
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
            self.places.capacity() * size_of::<L>(),
        )
    }

    fn visit(&self, node: usize, see: &mut dyn FnMut(Link)) {
        links(self.row(node as u32)).iter().map(L::link).for_each(see);
    }

    fn forces(&self, tile: usize, motion: &Motion, forces: &mut TileForces) {
        self.kernel.run_with_eights(Rows {
            storage: self,
            tile,
            motion,
            forces,
        });
    }

    fn reserve_nodes(&mut self, node_count: usize) -> Result<()> {
        let places = node_count.checked_mul(self.springs_per_node);
        memory::reserve(&mut self.places, places.ok_or(Error::OutOfMemory)?)
    }

    fn resize(&mut self, node_count: usize) -> Result<()> {
        self.places.resize(node_count * self.springs_per_node, L::EMPTY);
        self.node_count = node_count;
        Ok(())
    }

    fn add(&mut self, spring: &Spring) -> Result<()> {
        let [a, b] = spring.nodes;
        ensure!(place_of(self.row(a), b).is_none(), already_joined(a, b));
        let places = [self.empty_place(a)?, self.empty_place(b)?];
        for ((node, place), link) in spring.nodes.into_iter().zip(places).zip(Link::ends(spring)) {
            self.row_mut(node)[place] = L::of(&link);
        }
        self.spring_count += 1;
        Ok(())
    }

    fn remove(&mut self, a: u32, b: u32) -> Result<()> {
        for (node, neighbour) in [(a, b), (b, a)] {
            // Both ends have it, or none.
            let place = place_of(self.row(node), neighbour).ok_or_else(|| not_joined(a, b))?;
            vacate(self.row_mut(node), place);
        }
        self.spring_count -= 1;
        Ok(())
    }

    fn rewire(&mut self, rewiring: &Rewiring) -> Result<()> {
        self.check_room(rewiring)?;
        for Spring { nodes: [a, b], .. } in &rewiring.removed {
            self.remove(*a, *b)?;
        }
        self.set(&rewiring.changed)?;
        rewiring.added.iter().try_for_each(|spring| self.add(spring))
    }

    fn set(&mut self, changes: &[SpringChange]) -> Result<()> {
        for (node, link) in changes.iter().flat_map(SpringChange::ends) {
            let row = self.row_mut(node);
            if let Some(place) = place_of(row, link.neighbour) {
                row[place] = L::of(&link);
            }
        }
        Ok(())
    }
}
