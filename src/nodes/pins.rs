//! Pinned nodes: prescribed motion and reaction forces.

use glam::{BVec3, DVec3, Vec3};

use crate::base::{Result, memory};
use crate::codec::saved;
use crate::soa::{TILE, Vectors};
use crate::threads::Ragged;

/// Pin of a node along all axes or some. Along free axes, `force` and `travel` are 0 and the other vectors are
/// undefined.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Pin {
    pub node: u32,
    /// Target of the next step in the caller's coordinates; `None` if the node stays.
    pub target: Option<Vec3>,
    /// Mean reaction force over the last step, N, without the deferred half kick.
    pub force: Vec3,
    /// Weight of the deferred half kick in the mean force; 0 if nothing is deferred.
    pub deferred_share: f32,
    /// Target of the step in progress in the body's coordinates, and the displacement to it, m.
    pub goal: Vec3,
    pub travel: Vec3,
    /// Sum of the reaction forces in the step in progress.
    pub force_sum: DVec3,
    /// Reaction force at the positions of an implicit step, N.
    pub reaction: Vec3,
    /// Held axes, at least one. Along the others the node moves freely.
    pub axes: BVec3,
}

saved! { Pin { node, target, force, deferred_share, goal, travel, force_sum, reaction, axes } }

impl Pin {
    fn new(node: u32, axes: BVec3) -> Self {
        Self {
            node,
            axes,
            ..Self::default()
        }
    }

    /// Position at this fraction of the step in progress, in the body's coordinates.
    #[inline]
    pub fn position_at(&self, fraction: f64) -> Vec3 {
        // Relative to the end of the step, so that rounding errors do not accumulate.
        self.goal - self.travel * (1.0 - fraction) as f32
    }

    /// True if some axes are free.
    pub fn is_partial(&self) -> bool {
        !self.axes.all()
    }

    /// Components of a vector along held axes; 0 along the others.
    #[inline]
    pub fn held(&self, vector: Vec3) -> Vec3 {
        Vec3::select(self.axes, vector, Vec3::ZERO)
    }

    /// Replaces the components of `vector` along held axes by those of `held`.
    #[inline]
    pub fn with_held(&self, vector: Vec3, held: Vec3) -> Vec3 {
        Vec3::select(self.axes, held, vector)
    }

    /// Writes the components along held axes to entry `index` of a tile's vectors.
    #[inline]
    pub fn write_held(&self, vectors: &mut [&mut [f32]; 3], index: usize, held: Vec3) {
        for axis in 0..3 {
            if self.axes.test(axis) {
                vectors[axis][index] = held[axis];
            }
        }
    }

    /// Writes the components along held axes to the node's vector.
    pub fn set_held(&self, vectors: &mut Vectors, held: Vec3) {
        let node = self.node as usize;
        vectors.set(node, self.with_held(vectors.get(node), held));
    }
}

/// Pins of a body, sorted by node.
#[derive(Debug, Default)]
pub(crate) struct Pins {
    pins: Vec<Pin>,
    /// Index of the first pin of each tile, up to the last tile with pins.
    tile_starts: Vec<usize>,
    /// Number of partial pins.
    partial_count: usize,
}

saved! { Pins { pins, tile_starts, partial_count } }

impl Pins {
    pub fn iter(&self) -> std::slice::Iter<'_, Pin> {
        self.pins.iter()
    }

    pub fn iter_mut(&mut self) -> std::slice::IterMut<'_, Pin> {
        self.pins.iter_mut()
    }

    /// Pins of each tile.
    pub fn tiles_mut(&mut self) -> Ragged<'_, Pin> {
        Ragged::new(&mut self.pins, &self.tile_starts)
    }

    /// Pins of one tile.
    pub fn of_tile(&self, tile: usize) -> &[Pin] {
        &self.pins[self.start(tile)..self.start(tile + 1)]
    }

    /// Index of the first pin of a tile.
    pub fn start(&self, tile: usize) -> usize {
        self.tile_starts.get(tile).map_or(self.pins.len(), |&start| start)
    }

    /// Splits the pins at these indices.
    pub fn pieces_mut<'a>(&'a mut self, starts: &'a [usize]) -> Ragged<'a, Pin> {
        Ragged::new(&mut self.pins, starts)
    }

    pub fn get(&self, node: u32) -> Option<&Pin> {
        self.search(node).ok().map(|index| &self.pins[index])
    }

    pub fn get_mut(&mut self, node: u32) -> Option<&mut Pin> {
        self.search(node).ok().map(|index| &mut self.pins[index])
    }

    /// Held axes of a node.
    #[inline]
    pub fn axes_of(&self, node: u32) -> BVec3 {
        self.get(node).map_or(BVec3::FALSE, |pin| pin.axes)
    }

    /// Held axes of a node, if any pin is partial.
    #[inline]
    pub fn partial_axes_of(&self, node: u32) -> BVec3 {
        if self.are_partial() {
            self.axes_of(node)
        } else {
            BVec3::FALSE
        }
    }

    /// True if any pin is partial.
    pub fn are_partial(&self) -> bool {
        self.partial_count > 0
    }

    /// True if any pin moves in the step in progress.
    pub fn any_moves(&self) -> bool {
        self.pins.iter().any(|pin| pin.travel != Vec3::ZERO)
    }

    /// Partial pins.
    pub fn partial(&self) -> impl Iterator<Item = &Pin> {
        let pins = if self.are_partial() { &*self.pins } else { &[] };
        pins.iter().filter(|pin| pin.is_partial())
    }

    /// Holds `node` along exactly these axes, at least one. A change removes its target.
    pub fn hold(&mut self, node: u32, axes: BVec3) -> Result<()> {
        match self.search(node) {
            Ok(index) if self.pins[index].axes == axes => return Ok(()),
            Ok(index) => {
                let pin = &mut self.pins[index];
                self.partial_count -= usize::from(pin.is_partial());
                pin.axes = axes;
                pin.target = None;
                pin.force = pin.held(pin.force);
            }
            Err(index) => self.insert(index, node, axes)?,
        }
        self.partial_count += usize::from(!axes.all());
        Ok(())
    }

    /// Reserves capacity for `count` more pins of a body with `node_count` nodes.
    pub fn reserve(&mut self, count: usize, node_count: usize) -> Result<()> {
        self.pins.try_reserve(count)?;
        let tiles = node_count.div_ceil(TILE);
        Ok(self
            .tile_starts
            .try_reserve(tiles.saturating_sub(self.tile_starts.len()))?)
    }

    /// Creates pins along all axes for [`hold_all`](Self::hold_all).
    pub fn for_nodes(nodes: &[u32]) -> Result<Vec<Pin>> {
        memory::collected(nodes.iter().map(|&node| Pin::new(node, BVec3::TRUE)))
    }

    /// Adds sorted pins of nodes that are not pinned, within the capacity.
    pub fn hold_all(&mut self, added: &[Pin]) {
        let Some(last) = added.last() else {
            return;
        };
        let tiles = (last.node as usize / TILE + 1).max(self.tile_starts.len());
        memory::merge(&mut self.pins, added, |pin| pin.node);
        self.tile_starts.resize(tiles, 0);
        self.update_tile_starts();
    }

    /// True if the pins are sorted, belong to this number of nodes, and match the tile index.
    pub fn are_sound(&self, count: usize) -> bool {
        let is_start = |(tile, &start): (usize, &usize)| {
            start == self.pins.partition_point(|pin| (pin.node as usize) < tile * TILE)
        };
        self.pins.is_sorted_by(|a, b| a.node < b.node)
            && self
                .pins
                .last()
                .is_none_or(|pin| (pin.node as usize) < count && pin.node as usize / TILE < self.tile_starts.len())
            && self.tile_starts.iter().enumerate().all(is_start)
            && self.partial_count == self.pins.iter().filter(|pin| pin.is_partial()).count()
    }

    /// Removes the pins of nodes for which `keep` is false.
    pub fn retain(&mut self, keep: impl Fn(u32) -> bool) {
        self.pins.retain(|pin| keep(pin.node));
        self.partial_count = self.pins.iter().filter(|pin| pin.is_partial()).count();
        self.update_tile_starts();
    }

    /// Updates the first pin of each tile.
    fn update_tile_starts(&mut self) {
        let mut start = 0;
        for (tile, first) in self.tile_starts.iter_mut().enumerate() {
            let before = |pin: &Pin| (pin.node as usize) < tile * TILE;
            start += self.pins[start..].iter().take_while(|pin| before(pin)).count();
            *first = start;
        }
    }

    fn insert(&mut self, index: usize, node: u32, axes: BVec3) -> Result<()> {
        self.pins.try_reserve(1)?;
        let pin = Pin::new(node, axes);
        let tiles = node as usize / TILE + 1;
        self.tile_starts
            .try_reserve(tiles.saturating_sub(self.tile_starts.len()))?;
        self.pins.insert(index, pin);
        if tiles > self.tile_starts.len() {
            self.tile_starts.resize(tiles, index);
        }
        self.tile_starts[tiles..].iter_mut().for_each(|start| *start += 1);
        Ok(())
    }

    /// Removes the pin of `node`. Returns true if there was one.
    pub fn remove(&mut self, node: u32) -> bool {
        let found = self.search(node);
        if let Ok(index) = found {
            let pin = self.pins.remove(index);
            self.partial_count -= usize::from(pin.is_partial());
            self.tile_starts[node as usize / TILE + 1..]
                .iter_mut()
                .for_each(|start| *start -= 1);
        }
        found.is_ok()
    }

    fn search(&self, node: u32) -> std::result::Result<usize, usize> {
        self.pins.binary_search_by_key(&node, |pin| pin.node)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use crate::threads::Team;

    #[test]
    fn every_tile_has_its_own_pins() {
        let mut random = Random(1);
        let mut pins = Pins::default();
        for _ in 0..2000 {
            let node = random.below(8 * TILE) as u32;
            if random.below(2) == 0 {
                pins.hold(node, BVec3::TRUE).expect("memory");
            } else {
                pins.remove(node);
            }
            let count = pins.iter().count();
            let visited = std::sync::atomic::AtomicUsize::new(0);
            Team::alone().pass(8, pins.tiles_mut(), |tile, pins| {
                assert!(pins.iter().all(|pin| pin.node as usize / TILE == tile));
                visited.fetch_add(pins.len(), std::sync::atomic::Ordering::Relaxed);
            });
            assert_eq!(visited.into_inner(), count);
        }
    }
}
