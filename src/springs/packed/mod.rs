//! PACKED: springs laid out for the processor.
//!
//! Each spring is kept at both of its nodes, so that the force on a node is a sum over its own links, nothing is written
//! but that node, and tiles can be worked on in any order. The links of a tile are packed into columns, which sixteen nodes
//! side by side share. A spring that is removed leaves a lane empty; one that is added goes beside the columns. A tile
//! is packed again when it has many of either. A spring whose stiffness changes keeps its lane where that has parameters of its own, and
//! goes beside the columns else.

mod materials;
mod pack;
#[cfg(test)]
mod tests;

use std::ops::Range;

use crate::def::{Rounding, Spring};
use crate::order::Costs;
use materials::Kinds;
use pack::{Loose, NO_KIND, pack};

use super::ends::Ends;
use super::kernels::{Columns, SpringMaterial};
use super::{Course, Link, Motion, Rewiring, SpringChange, Springs, already_joined, not_joined, rewire_by};
use crate::base::{Result, ensure, memory};
use crate::codec::{Saved, Writer, saved};
use crate::simd::ChosenKernel;
use crate::soa::{TILE, TileForces, View, tile_count, tile_nodes};

/// How many links may be added to a tile before it is packed again.
const ADDED: usize = 256;

/// A tile's links, and how much they have changed since they were packed.
#[derive(Debug)]
struct PackedTile {
    columns: Columns,
    /// Links when it was packed.
    links: usize,
    /// Those that were strays then.
    strays: usize,
    removed: usize,
}

saved! { PackedTile { columns, links, strays, removed } }

impl PackedTile {
    fn new(columns: Columns, links: usize) -> Self {
        Self {
            links,
            strays: columns.strays().len(),
            removed: 0,
            columns,
        }
    }

    /// Whether so much has changed since it was packed that it pays to pack it again.
    fn is_worn(&self) -> bool {
        self.columns.strays().len() > self.strays + self.strays / 2 + ADDED || self.removed > self.links / 2 + ADDED
    }
}

impl SpringMaterial {
    fn of(link: &Link) -> Self {
        Self {
            stiffness: link.stiffness,
            rest_length: link.rest_length,
            damping: link.damping,
        }
    }
}

/// Springs in columns.
#[derive(Debug)]
pub(crate) struct Packed {
    kernel: ChosenKernel,
    node_count: usize,
    spring_count: usize,
    damped: bool,
    kinds: Kinds,
    materials: Vec<SpringMaterial>,
    tiles: Vec<PackedTile>,
}

saved! { Packed { kernel, node_count, spring_count, damped, kinds, materials, tiles } where Self::is_sound }

/// What columns of these springs cost, the most of them.
pub(crate) fn costs(springs: &[Spring], rounding: Rounding) -> Result<Costs> {
    let kinds = Kinds::of(springs, rounding)?;
    Ok(if kinds.is_empty() { Costs::OWN } else { Costs::SHARED })
}

impl Packed {
    /// Which storage it is, in bytes.
    pub const SAVED_AS: u8 = 0;

    /// Packs `springs` of `node_count` nodes.
    pub fn new(kernel: ChosenKernel, node_count: usize, springs: &[Spring], rounding: Rounding) -> Result<Self> {
        let kinds = Kinds::of(springs, rounding)?;
        let mut packed = Self {
            kernel,
            node_count,
            spring_count: springs.len(),
            damped: springs.iter().any(|spring| spring.damping != 0.0),
            materials: kinds.materials()?,
            kinds,
            tiles: memory::reserved(tile_count(node_count))?,
        };
        let ends = Ends::of(node_count, springs)?;
        let mut links = Vec::new();
        for tile in 0..tile_count(node_count) {
            let nodes = tile_nodes(tile, node_count);
            links.clear();
            for node in nodes.clone() {
                let of_node = ends.links(node);
                links.try_reserve(of_node.len())?;
                links.extend(of_node.map(|link| {
                    let kind = packed.kinds.find(&SpringMaterial::of(&link));
                    packed.loose(node, &link, kind)
                }));
            }
            packed.tiles.push(packed.packed(nodes, &mut links)?);
        }
        Ok(packed)
    }

    /// An end of a spring of this kind, to be packed.
    fn loose(&self, node: usize, link: &Link, kind: Option<u16>) -> Loose {
        Loose {
            node: node as u32,
            neighbour: link.neighbour,
            kind: kind.unwrap_or(NO_KIND),
            own: kind.map_or(SpringMaterial::of(link), |kind| self.materials[usize::from(kind)]),
        }
    }

    /// A tile of these links, whose order is lost.
    fn packed(&self, nodes: Range<usize>, links: &mut [Loose]) -> Result<PackedTile> {
        let count = links.len();
        let columns = pack(nodes, self.node_count, self.damped, &self.materials, links)?;
        Ok(PackedTile::new(columns, count))
    }

    fn tile(&self, node: u32) -> &PackedTile {
        &self.tiles[node as usize / TILE]
    }

    fn tile_mut(&mut self, node: u32) -> &mut PackedTile {
        &mut self.tiles[node as usize / TILE]
    }

    /// Puts a spring beside the columns.
    fn insert(&mut self, spring: &Spring) -> Result<()> {
        let [a, b] = spring.nodes;
        ensure!(!self.has(a, b), already_joined(a, b));
        for node in [a, b] {
            let node_count = self.node_count;
            let columns = &mut self.tile_mut(node).columns;
            columns.reach(node_count);
            // Both ends may be in one tile.
            columns.reserve_strays(2)?;
        }
        for (node, link) in spring.nodes.into_iter().zip(Link::ends(spring)) {
            self.tile_mut(node).columns.insert_stray(node as usize, &link);
        }
        self.spring_count += 1;
        Ok(())
    }

    /// Takes out a spring that is there.
    fn take_out(&mut self, [a, b]: [u32; 2]) {
        for (node, neighbour) in [(a, b), (b, a)] {
            let tile = self.tile_mut(node);
            tile.columns.remove(node as usize, neighbour as usize);
            tile.removed += 1;
        }
        self.spring_count -= 1;
    }

    /// Takes away the last nodes, which have no springs.
    fn shrink(&mut self, node_count: usize) {
        self.tiles.truncate(tile_count(node_count));
        for (tile, of) in self.tiles.iter_mut().enumerate() {
            of.columns.shrink_nodes(tile_nodes(tile, node_count).end, node_count);
        }
        self.node_count = node_count;
    }

    /// Whether kernels find all that they read without a check.
    fn is_sound(&self) -> bool {
        let mut tiles = self.tiles.iter().enumerate();
        self.tiles.len() == tile_count(self.node_count)
            && tiles.all(|(tile, of)| {
                let nodes = tile_nodes(tile, self.node_count);
                of.columns.is_sound(nodes, self.node_count, self.materials.len())
            })
    }

    fn has(&self, a: u32, b: u32) -> bool {
        let mut found = false;
        self.visit(a as usize, &mut |link| found |= link.neighbour == b);
        found
    }

    /// Packs the tile of `node` again where that pays; where there is no memory for it, it stays as it is.
    fn mend(&mut self, node: u32) {
        if self.tile(node).is_worn()
            && let Ok(tile) = self.repacked(node as usize / TILE, &[])
        {
            *self.tile_mut(node) = tile;
        }
    }

    /// A tile packed again, with these of its links changed, in the order of their nodes and neighbours.
    fn repacked(&self, tile: usize, changed: &[(u32, Link)]) -> Result<PackedTile> {
        let nodes = tile_nodes(tile, self.node_count);
        let mut links = Vec::new();
        for node in nodes.clone() {
            let mut room = Ok(());
            self.visit(node, &mut |mut link| {
                let end = (node as u32, link.neighbour);
                if let Ok(place) = changed.binary_search_by_key(&end, |(node, link)| (*node, link.neighbour)) {
                    link = changed[place].1;
                }
                if room.is_ok() {
                    let kind = self.kinds.find_exactly(&SpringMaterial::of(&link));
                    room = memory::push(&mut links, self.loose(node, &link, kind));
                }
            });
            room?;
        }
        self.packed(nodes, &mut links)
    }
}

impl Springs for Packed {
    fn save(&self, to: &mut Writer) {
        to.put(&[Self::SAVED_AS]);
        Saved::save(self, to);
    }

    fn damped(&self) -> bool {
        self.damped
    }

    fn node_count(&self) -> usize {
        self.node_count
    }

    fn spring_count(&self) -> usize {
        self.spring_count
    }

    fn bytes(&self) -> (usize, usize) {
        let tables = size_of_val(&*self.materials);
        let mut used = size_of_val(&*self.tiles) + tables;
        let mut held = self.tiles.capacity() * size_of::<PackedTile>() + tables + self.kinds.bytes();
        for tile in &self.tiles {
            let (tile_used, tile_held) = tile.columns.bytes();
            used += tile_used;
            held += tile_held;
        }
        (used, held)
    }

    fn visit(&self, node: usize, see: &mut dyn FnMut(Link)) {
        self.tile(node as u32).columns.visit(node, &self.materials, see);
    }

    fn reads(&self, tile: usize) -> Option<Range<isize>> {
        Some(self.tiles[tile].columns.reads())
    }

    fn gathers(&self) -> bool {
        let gathers: usize = self.tiles.iter().map(|tile| tile.columns.gathers()).sum();
        // Making its record costs a node about what one gather saves.
        gathers > self.node_count
    }

    fn forces(&self, tile: usize, motion: &Motion, forces: &mut TileForces) {
        self.tiles[tile]
            .columns
            .forces(self.kernel, &self.materials, motion, forces);
    }

    fn changes(&self, tile: usize, course: &Course, changes: &mut TileForces) {
        self.tiles[tile]
            .columns
            .changes(self.kernel, &self.materials, course, changes);
    }

    fn half_energy(&self, nodes: Range<usize>, positions: View) -> f64 {
        self.tiles[nodes.start / TILE]
            .columns
            .half_energy(self.kernel, &self.materials, positions)
    }

    fn reserve_nodes(&mut self, node_count: usize) -> Result<()> {
        memory::reserve(&mut self.tiles, tile_count(node_count))
    }

    fn resize(&mut self, node_count: usize) -> Result<()> {
        if node_count < self.node_count {
            self.shrink(node_count);
            return Ok(());
        }
        let known = self.tiles.len();
        let mut more = memory::reserved(tile_count(node_count).saturating_sub(known))?;
        for tile in known..tile_count(node_count) {
            let nodes = tile_nodes(tile, node_count);
            let mut columns = Columns::new(nodes.clone(), node_count, None, self.damped);
            columns.grow(nodes.end)?;
            more.push(PackedTile::new(columns, 0));
        }
        if let Some(last) = self.tiles.last_mut() {
            last.columns.grow(tile_nodes(known - 1, node_count).end)?;
        }
        self.tiles.append(&mut more);
        self.node_count = node_count;
        Ok(())
    }

    fn rewire(&mut self, rewiring: &Rewiring) -> Result<()> {
        // No tile is packed again before all is done: columns that lead to new nodes could not be taken back.
        rewire_by(self, rewiring, Self::insert, |packed, nodes| {
            packed.take_out(nodes);
            Ok(())
        })?;
        let Rewiring { removed, added, .. } = rewiring;
        for node in removed.iter().chain(added).flat_map(|spring| spring.nodes) {
            self.mend(node);
        }
        Ok(())
    }

    fn add(&mut self, spring: &Spring) -> Result<()> {
        self.insert(spring)?;
        spring.nodes.into_iter().for_each(|node| self.mend(node));
        Ok(())
    }

    fn remove(&mut self, a: u32, b: u32) -> Result<()> {
        ensure!(self.has(a, b), not_joined(a, b));
        self.take_out([a, b]);
        self.mend(a);
        self.mend(b);
        Ok(())
    }

    fn set(&mut self, changes: &[SpringChange]) -> Result<()> {
        let mut ends = memory::collected_within(2 * changes.len(), changes.iter().flat_map(SpringChange::ends))?;
        ends.sort_unstable_by_key(|(node, link)| (*node, link.neighbour));
        let same_node = |(a, _): &(u32, Link), (b, _): &(u32, Link)| a == b;
        let same_tile = |(a, _): &(u32, Link), (b, _): &(u32, Link)| *a as usize / TILE == *b as usize / TILE;
        // Those with too many links that would leave their columns.
        let mut anew = Vec::new();
        for ends in ends.chunk_by(same_tile) {
            let tile = ends[0].0 as usize / TILE;
            let columns = &mut self.tiles[tile].columns;
            let leaving: usize = ends.chunk_by(same_node).map(|links| columns.shared(links)).sum();
            if leaving > ADDED {
                memory::push(&mut anew, (tile, self.repacked(tile, ends)?))?;
            } else {
                columns.reserve_strays(leaving)?;
                columns.room_for_stiffnesses(ends.iter().map(|(_, link)| link.stiffness))?;
            }
        }
        let mut anew = anew.into_iter().peekable();
        for ends in ends.chunk_by(same_tile) {
            let place = ends[0].0 as usize / TILE;
            let tile = &mut self.tiles[place];
            if let Some((_, packed)) = anew.next_if(|(of, _)| *of == place) {
                *tile = packed;
                continue;
            }
            for links in ends.chunk_by(same_node) {
                tile.removed += tile.columns.set(links);
            }
            self.mend(ends[0].0);
        }
        Ok(())
    }
}
