//! DYNAMIC_BULK: a chain of arrays per node (Halic et al., section 4).
//!
//! Where a node's arrays are full another is added, and nothing is copied; one that becomes empty is given back. The
//! first array of each node is named in a table, those beyond it in a linked list.

use std::ops::RangeInclusive;

use super::chain::{Chain, ListElement, Unlinked, unlinked};
use super::ends::Ends;
use super::gather::{Gather, RowStorage, Rows, prefetch_row};
use super::kept::{KeptLink, empty_place, links, place_of, vacate};
use super::{Link, Motion, SpringChange, Springs, already_joined, not_joined};
use crate::base::{Result, ensure, memory};
use crate::codec::{Saved, Writer, saved};
use crate::def::Spring;
use crate::simd::{ChosenKernel, Eights, prefetch};
use crate::soa::{TileForces, tile_nodes};

/// How many nodes ahead arrays are fetched from memory.
const AHEAD: usize = 16;

/// An array of places, the first of them with links; not allocated while no place has one.
type Bulk<L> = Box<[L]>;

/// The arrays of one node.
#[derive(Debug)]
struct Bulks<L> {
    first: Bulk<L>,
    more: Chain<Bulk<L>>,
}

saved! { [L: Saved] Bulks<L> { first, more } }

/// Where a node's next link goes, with memory for it.
enum LinkRoom<L> {
    Open,
    First(Bulk<L>),
    More(Unlinked<Bulk<L>>),
}

impl<L: KeptLink> Bulks<L> {
    fn none() -> Self {
        Self {
            first: Bulk::default(),
            more: Chain::EMPTY,
        }
    }

    fn links(&self) -> impl Iterator<Item = &L> {
        std::iter::once(&self.first)
            .chain(self.more.iter())
            .flat_map(|bulk| links(bulk))
    }

    fn has(&self, neighbour: u32) -> bool {
        self.links().any(|link| link.neighbour() == neighbour)
    }

    /// An array with an empty place.
    fn open(&mut self) -> Option<&mut Bulk<L>> {
        let is_open = |bulk: &Bulk<L>| empty_place(bulk).is_some();
        if is_open(&self.first) {
            Some(&mut self.first)
        } else {
            self.more.find_mut(is_open)
        }
    }

    /// Finds room for a link, in a new array of `places` where there is none.
    fn room(&mut self, places: usize) -> Result<LinkRoom<L>> {
        if self.open().is_some() {
            return Ok(LinkRoom::Open);
        }
        let bulk = memory::filled(L::EMPTY, places)?.into_boxed_slice();
        if self.first.is_empty() {
            Ok(LinkRoom::First(bulk))
        } else {
            Ok(LinkRoom::More(unlinked(bulk)?))
        }
    }

    /// Puts in a link where room was found.
    fn insert(&mut self, link: &Link, room: LinkRoom<L>) {
        match room {
            LinkRoom::Open => {}
            LinkRoom::First(bulk) => self.first = bulk,
            LinkRoom::More(bulk) => self.more.put(bulk),
        }
        if let Some(bulk) = self.open()
            && let Some(place) = empty_place(bulk)
        {
            bulk[place] = L::of(link);
        }
    }

    /// Puts another link to the same neighbour in the place of one.
    fn replace(&mut self, link: &Link) {
        let has = |bulk: &Bulk<L>| place_of(bulk, link.neighbour).is_some();
        let bulk = if has(&self.first) {
            Some(&mut self.first)
        } else {
            self.more.find_mut(has)
        };
        if let Some(bulk) = bulk
            && let Some(place) = place_of(bulk, link.neighbour)
        {
            bulk[place] = L::of(link);
        }
    }

    /// Takes out the link to a neighbour; whether there was one.
    fn remove(&mut self, neighbour: u32) -> bool {
        if let Some(place) = place_of(&self.first, neighbour) {
            vacate(&mut self.first, place);
            if links(&self.first).is_empty() {
                self.first = Bulk::default();
            }
            return true;
        }
        let Some(bulk) = self.more.find_mut(|bulk| place_of(bulk, neighbour).is_some()) else {
            return false;
        };
        if let Some(place) = place_of(bulk, neighbour) {
            vacate(bulk, place);
        }
        self.more.remove(|bulk| links(bulk).is_empty());
        true
    }
}

/// Springs in chains of arrays.
#[derive(Debug)]
pub(super) struct DynamicBulk<L> {
    kernel: ChosenKernel,
    spring_count: usize,
    springs_per_node: usize,
    nodes: Vec<Bulks<L>>,
}

saved! { [L: Saved] DynamicBulk<L> { kernel, spring_count, springs_per_node, nodes } }

impl<L: KeptLink> DynamicBulk<L> {
    /// Which storage it is, in bytes.
    pub const SAVED_AS: u8 = 4 + L::DAMPED as u8;

    /// Arrays of `springs_per_node` places; 0: chosen from the springs.
    pub fn new(kernel: ChosenKernel, node_count: usize, springs: &[Spring], springs_per_node: usize) -> Result<Self> {
        let ends = Ends::of(node_count, springs)?;
        let springs_per_node = match springs_per_node {
            0 => least_memory::<L>(node_count, &ends),
            chosen => chosen,
        };
        let mut nodes = memory::reserved(node_count)?;
        for node in 0..node_count {
            let mut bulks = Bulks::none();
            for link in ends.links(node) {
                let room = bulks.room(springs_per_node)?;
                bulks.insert(&link, room);
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

impl<L: KeptLink> RowStorage for DynamicBulk<L> {
    #[inline(always)]
    fn tile_forces<const DAMPED: bool>(
        &self,
        tile: usize,
        motion: &Motion,
        eights: impl Eights,
        forces: &mut TileForces,
    ) {
        let nodes = tile_nodes(tile, self.nodes.len());
        let gather = Gather::<DAMPED>::new(motion, nodes.start, self.nodes.len());
        for node in nodes {
            if let Some(ahead) = self.nodes.get(node + AHEAD) {
                prefetch_row(ahead.first.as_ptr(), size_of_val(&*ahead.first));
                if let Some(more) = ahead.more.first() {
                    prefetch(more);
                }
            }
            let bulks = &self.nodes[node];
            let rows = std::iter::once(&bulks.first).chain(bulks.more.iter());
            gather.node_of_rows(node, rows.map(|bulk| &**bulk), eights, forces);
        }
    }
}

/// The places of an array that are chosen from, where none are asked for.
const CHOICE: RangeInclusive<usize> = 4..=32;

/// The number of places with which the arrays take the least memory: in time there is hardly a difference.
fn least_memory<L>(node_count: usize, ends: &Ends) -> usize {
    let bytes = |places: &usize| {
        let of_node = |node| {
            let arrays = ends.links(node).len().div_ceil(*places);
            arrays * places * size_of::<L>() + arrays.saturating_sub(1) * size_of::<ListElement<Bulk<L>>>()
        };
        (0..node_count).map(of_node).sum::<usize>()
    };
    CHOICE.min_by_key(bytes).unwrap_or(*CHOICE.end())
}

impl<L: KeptLink> Springs for DynamicBulk<L> {
    fn save(&self, to: &mut Writer) {
        to.put(&[Self::SAVED_AS]);
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
        let mut held = self.nodes.capacity() * size_of::<Bulks<L>>();
        for bulks in &self.nodes {
            held += size_of_val(&*bulks.first);
            for bulk in bulks.more.iter() {
                held += size_of::<ListElement<Bulk<L>>>() + size_of_val(&**bulk);
            }
        }
        (2 * self.spring_count * size_of::<L>(), held)
    }

    fn visit(&self, node: usize, see: &mut dyn FnMut(Link)) {
        self.nodes[node].links().map(L::link).for_each(see);
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
        memory::reserve(&mut self.nodes, node_count)
    }

    fn resize(&mut self, node_count: usize) -> Result<()> {
        self.nodes.resize_with(node_count, Bulks::none);
        Ok(())
    }

    fn add(&mut self, spring: &Spring) -> Result<()> {
        let [a, b] = spring.nodes;
        ensure!(!self.nodes[a as usize].has(b), already_joined(a, b));
        let room_a = self.nodes[a as usize].room(self.springs_per_node)?;
        let room_b = self.nodes[b as usize].room(self.springs_per_node)?;
        let [link_a, link_b] = Link::ends(spring);
        self.nodes[a as usize].insert(&link_a, room_a);
        self.nodes[b as usize].insert(&link_b, room_b);
        self.spring_count += 1;
        Ok(())
    }

    fn remove(&mut self, a: u32, b: u32) -> Result<()> {
        for (node, neighbour) in [(a, b), (b, a)] {
            // Both ends have it, or none.
            ensure!(self.nodes[node as usize].remove(neighbour), not_joined(a, b));
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
