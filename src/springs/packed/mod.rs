//! PACKED: springs in a SIMD-friendly layout.
//!
//! Each spring is stored at both of its nodes. The force on a node is then a sum over its own links, and tiles can be
//! computed in any order. The links of a tile are packed into columns of sixteen consecutive nodes. A removed spring
//! leaves an unused lane; an added one becomes a stray outside of columns. A tile is repacked if it has many of either.
//! A spring with a new stiffness keeps its lane if its column has per-spring parameters, and becomes a stray otherwise.

mod pack;
mod parameter_table;
#[cfg(test)]
mod tests;

use std::ops::Range;

use crate::def::{Rounding, Spring};
use crate::order::Costs;
use pack::{NO_CLASS, UnpackedLink, pack};
use parameter_table::ParameterTable;

use super::adjacency::Adjacency;
use super::kernels::{Columns, SpringParameters};
use super::{DirectionInput, ForceInput, Link, Rewiring, SpringChange, Springs, already_joined, not_joined, rewire_by};
use crate::base::{Result, ensure, memory};
use crate::codec::{Saved, Writer, saved};
use crate::simd::ChosenKernel;
use crate::soa::{TILE, TileForces, View, tile_count, tile_nodes};

/// The number of links that may be added to a tile before it is repacked.
const MAX_ADDED: usize = 256;

/// The links of a tile, and the changes since it was packed.
#[derive(Debug)]
struct PackedTile {
    columns: Columns,
    /// The number of links when it was packed.
    links: usize,
    /// The number of strays when it was packed.
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

    /// True if repacking pays off after the changes.
    fn needs_repack(&self) -> bool {
        self.columns.strays().len() > self.strays + self.strays / 2 + MAX_ADDED
            || self.removed > self.links / 2 + MAX_ADDED
    }
}

impl SpringParameters {
    fn from_link(link: &Link) -> Self {
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
    classes: ParameterTable,
    table: Vec<SpringParameters>,
    tiles: Vec<PackedTile>,
}

saved! { Packed { kernel, node_count, spring_count, damped, classes, table, tiles } where Self::is_valid }

/// The costs of most columns of these springs.
pub(crate) fn costs(springs: &[Spring], rounding: Rounding) -> Result<Costs> {
    let classes = ParameterTable::new(springs, rounding)?;
    Ok(if classes.is_empty() { Costs::OWN } else { Costs::SHARED })
}

impl Packed {
    /// The tag of this storage in snapshots.
    pub const SAVED_AS: u8 = 0;

    /// Packs `springs` of `node_count` nodes.
    pub fn new(kernel: ChosenKernel, node_count: usize, springs: &[Spring], rounding: Rounding) -> Result<Self> {
        let classes = ParameterTable::new(springs, rounding)?;
        let mut packed = Self {
            kernel,
            node_count,
            spring_count: springs.len(),
            damped: springs.iter().any(|spring| spring.damping != 0.0),
            table: classes.table()?,
            classes,
            tiles: memory::reserved(tile_count(node_count))?,
        };
        let adjacency = Adjacency::new(node_count, springs)?;
        let mut links = Vec::new();
        for tile in 0..tile_count(node_count) {
            let nodes = tile_nodes(tile, node_count);
            links.clear();
            for node in nodes.clone() {
                let node_links = adjacency.links(node);
                links.try_reserve(node_links.len())?;
                links.extend(node_links.map(|link| {
                    let class = packed.classes.find(&SpringParameters::from_link(&link));
                    packed.unpacked(node, &link, class)
                }));
            }
            packed.tiles.push(packed.packed(nodes, &mut links)?);
        }
        Ok(packed)
    }

    /// A link of this class, ready to be packed.
    fn unpacked(&self, node: usize, link: &Link, class: Option<u16>) -> UnpackedLink {
        UnpackedLink {
            node: node as u32,
            neighbor: link.neighbor,
            class: class.unwrap_or(NO_CLASS),
            own: class.map_or(SpringParameters::from_link(link), |class| {
                self.table[usize::from(class)]
            }),
        }
    }

    /// Packs a tile from these links. Their order is lost.
    fn packed(&self, nodes: Range<usize>, links: &mut [UnpackedLink]) -> Result<PackedTile> {
        let count = links.len();
        let columns = pack(nodes, self.node_count, self.damped, &self.table, links)?;
        Ok(PackedTile::new(columns, count))
    }

    fn tile(&self, node: u32) -> &PackedTile {
        &self.tiles[node as usize / TILE]
    }

    fn tile_mut(&mut self, node: u32) -> &mut PackedTile {
        &mut self.tiles[node as usize / TILE]
    }

    /// Adds a spring as two strays.
    fn insert(&mut self, spring: &Spring) -> Result<()> {
        let [a, b] = spring.nodes;
        ensure!(!self.has(a, b), already_joined(a, b));
        for node in [a, b] {
            let node_count = self.node_count;
            let columns = &mut self.tile_mut(node).columns;
            columns.extend_node_count(node_count);
            // Both ends may be in one tile.
            columns.reserve_strays(2)?;
        }
        for (node, link) in spring.nodes.into_iter().zip(Link::ends(spring)) {
            self.tile_mut(node).columns.insert_stray(node as usize, &link);
        }
        self.spring_count += 1;
        Ok(())
    }

    /// Removes an existing spring.
    fn remove_both_ends(&mut self, [a, b]: [u32; 2]) {
        for (node, neighbor) in [(a, b), (b, a)] {
            let tile = self.tile_mut(node);
            tile.columns.remove(node as usize, neighbor as usize);
            tile.removed += 1;
        }
        self.spring_count -= 1;
    }

    /// Removes the last nodes, which have no springs.
    fn shrink(&mut self, node_count: usize) {
        self.tiles.truncate(tile_count(node_count));
        for (tile, packed_tile) in self.tiles.iter_mut().enumerate() {
            packed_tile
                .columns
                .shrink_nodes(tile_nodes(tile, node_count).end, node_count);
        }
        self.node_count = node_count;
    }

    /// True if everything that kernels read without a check is valid.
    fn is_valid(&self) -> bool {
        let mut tiles = self.tiles.iter().enumerate();
        self.tiles.len() == tile_count(self.node_count)
            && tiles.all(|(tile, packed_tile)| {
                let nodes = tile_nodes(tile, self.node_count);
                packed_tile.columns.is_valid(nodes, self.node_count, self.table.len())
            })
    }

    fn has(&self, a: u32, b: u32) -> bool {
        let mut exists = false;
        self.visit(a as usize, &mut |link| exists |= link.neighbor == b);
        exists
    }

    /// Repacks the tile of `node` if that pays off. If memory runs out, the tile stays as it is.
    fn repack_if_needed(&mut self, node: u32) {
        if self.tile(node).needs_repack()
            && let Ok(tile) = self.repacked(node as usize / TILE, &[])
        {
            *self.tile_mut(node) = tile;
        }
    }

    /// Packs a tile again with these changed links, sorted by node and neighbor.
    fn repacked(&self, tile: usize, changed: &[(u32, Link)]) -> Result<PackedTile> {
        let nodes = tile_nodes(tile, self.node_count);
        let mut links = Vec::new();
        for node in nodes.clone() {
            let mut result = Ok(());
            self.visit(node, &mut |mut link| {
                let end = (node as u32, link.neighbor);
                if let Ok(index) = changed.binary_search_by_key(&end, |(node, link)| (*node, link.neighbor)) {
                    link = changed[index].1;
                }
                if result.is_ok() {
                    let class = self.classes.find_exactly(&SpringParameters::from_link(&link));
                    result = memory::push(&mut links, self.unpacked(node, &link, class));
                }
            });
            result?;
        }
        self.packed(nodes, &mut links)
    }
}

impl Springs for Packed {
    fn save(&self, to: &mut Writer) {
        to.write(&[Self::SAVED_AS]);
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
        let tables = size_of_val(&*self.table);
        let mut used = size_of_val(&*self.tiles) + tables;
        let mut held = self.tiles.capacity() * size_of::<PackedTile>() + tables + self.classes.bytes();
        for tile in &self.tiles {
            let (tile_used, tile_held) = tile.columns.bytes();
            used += tile_used;
            held += tile_held;
        }
        (used, held)
    }

    fn visit(&self, node: usize, f: &mut dyn FnMut(Link)) {
        self.tile(node as u32).columns.visit(node, &self.table, f);
    }

    fn reads(&self, tile: usize) -> Option<Range<isize>> {
        Some(self.tiles[tile].columns.reads())
    }

    fn prefers_records(&self) -> bool {
        let gathers: usize = self.tiles.iter().map(|tile| tile.columns.gather_count()).sum();
        // Writing a node's record costs about as much as one gather saves.
        gathers > self.node_count
    }

    fn forces(&self, tile: usize, input: &ForceInput, forces: &mut TileForces) {
        self.tiles[tile].columns.forces(self.kernel, &self.table, input, forces);
    }

    fn force_changes(&self, tile: usize, input: &DirectionInput, changes: &mut TileForces) {
        self.tiles[tile]
            .columns
            .force_changes(self.kernel, &self.table, input, changes);
    }

    fn half_energy(&self, nodes: Range<usize>, positions: View) -> f64 {
        self.tiles[nodes.start / TILE]
            .columns
            .half_energy(self.kernel, &self.table, positions)
    }

    fn reserve_nodes(&mut self, node_count: usize) -> Result<()> {
        memory::reserve(&mut self.tiles, tile_count(node_count))
    }

    fn resize(&mut self, node_count: usize) -> Result<()> {
        if node_count < self.node_count {
            self.shrink(node_count);
            return Ok(());
        }
        let old_count = self.tiles.len();
        let mut new_tiles = memory::reserved(tile_count(node_count).saturating_sub(old_count))?;
        for tile in old_count..tile_count(node_count) {
            let nodes = tile_nodes(tile, node_count);
            let mut columns = Columns::new(nodes.clone(), node_count, None, self.damped);
            columns.grow(nodes.end)?;
            new_tiles.push(PackedTile::new(columns, 0));
        }
        if let Some(last) = self.tiles.last_mut() {
            last.columns.grow(tile_nodes(old_count - 1, node_count).end)?;
        }
        self.tiles.append(&mut new_tiles);
        self.node_count = node_count;
        Ok(())
    }

    fn rewire(&mut self, rewiring: &Rewiring) -> Result<()> {
        // Tiles are repacked last, because columns that refer to new nodes could not be rolled back.
        rewire_by(self, rewiring, Self::insert, |packed, nodes| {
            packed.remove_both_ends(nodes);
            Ok(())
        })?;
        let Rewiring { removed, added, .. } = rewiring;
        for node in removed.iter().chain(added).flat_map(|spring| spring.nodes) {
            self.repack_if_needed(node);
        }
        Ok(())
    }

    fn add(&mut self, spring: &Spring) -> Result<()> {
        self.insert(spring)?;
        spring.nodes.into_iter().for_each(|node| self.repack_if_needed(node));
        Ok(())
    }

    fn remove(&mut self, a: u32, b: u32) -> Result<()> {
        ensure!(self.has(a, b), not_joined(a, b));
        self.remove_both_ends([a, b]);
        self.repack_if_needed(a);
        self.repack_if_needed(b);
        Ok(())
    }

    fn set(&mut self, changes: &[SpringChange]) -> Result<()> {
        let mut ends = memory::collected_within(2 * changes.len(), changes.iter().flat_map(SpringChange::ends))?;
        ends.sort_unstable_by_key(|(node, link)| (*node, link.neighbor));
        let same_node = |(a, _): &(u32, Link), (b, _): &(u32, Link)| a == b;
        let same_tile = |(a, _): &(u32, Link), (b, _): &(u32, Link)| *a as usize / TILE == *b as usize / TILE;
        // Tiles with too many links that would leave their columns.
        let mut repacked_tiles = Vec::new();
        for ends in ends.chunk_by(same_tile) {
            let tile = ends[0].0 as usize / TILE;
            let columns = &mut self.tiles[tile].columns;
            let leaving: usize = ends.chunk_by(same_node).map(|links| columns.count_shared(links)).sum();
            if leaving > MAX_ADDED {
                memory::push(&mut repacked_tiles, (tile, self.repacked(tile, ends)?))?;
            } else {
                columns.reserve_strays(leaving)?;
                columns.reserve_stiffnesses(ends.iter().map(|(_, link)| link.stiffness))?;
            }
        }
        let mut repacked_tiles = repacked_tiles.into_iter().peekable();
        for ends in ends.chunk_by(same_tile) {
            let tile_index = ends[0].0 as usize / TILE;
            let tile = &mut self.tiles[tile_index];
            if let Some((_, packed)) = repacked_tiles.next_if(|(index, _)| *index == tile_index) {
                *tile = packed;
                continue;
            }
            for links in ends.chunk_by(same_node) {
                tile.removed += tile.columns.set(links);
            }
            self.repack_if_needed(ends[0].0);
        }
        Ok(())
    }
}
