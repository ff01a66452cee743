//! Nodes that are held: where they are led, and the force it takes.

use glam::{BVec3, DVec3, Vec3};

use crate::base::{Result, memory};
use crate::codec::saved;
use crate::soa::{TILE, Vectors};
use crate::threads::Ragged;

/// A node that is held, along all axes or along some. Along the others `force` and `travel` are 0, and what else is kept means
/// nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Pin {
    pub node: u32,
    /// Where the next step leads it, in the caller's coordinates; `None`: it stays.
    pub target: Option<Vec3>,
    /// What holds it, mean over the last step, in newtons, but for the kick that closes the step where that is left open.
    pub force: Vec3,
    /// What part of the mean that kick makes; 0: nothing is missing.
    pub closing_share: f32,
    /// Where the step in progress leads it, in the body's coordinates, and the way there, in metres.
    pub goal: Vec3,
    pub travel: Vec3,
    /// The sum of the forces of the step in progress.
    pub force_sum: DVec3,
    /// What holds it with the nodes where an implicit step has them, N.
    pub solved: Vec3,
    /// The axes along which it is held, at least one; along the others it moves as free nodes do.
    pub axes: BVec3,
}

saved! { Pin { node, target, force, closing_share, goal, travel, force_sum, solved, axes } }

impl Pin {
    fn new(node: u32, axes: BVec3) -> Self {
        Self {
            node,
            axes,
            ..Self::default()
        }
    }

    /// Where it is at this fraction of the step in progress, in the body's coordinates.
    #[inline]
    pub fn place(&self, fraction: f64) -> Vec3 {
        // From the end of the step, so that roundings do not add up.
        self.goal - self.travel * (1.0 - fraction) as f32
    }

    /// Whether it is held along some axes alone.
    pub fn is_partial(&self) -> bool {
        !self.axes.all()
    }

    /// The components of a vector along the axes that it is held along; 0 along the others.
    #[inline]
    pub fn held(&self, vector: Vec3) -> Vec3 {
        Vec3::select(self.axes, vector, Vec3::ZERO)
    }

    /// A vector with those of its components that belong to axes it is held along.
    #[inline]
    pub fn leading(&self, vector: Vec3, held: Vec3) -> Vec3 {
        Vec3::select(self.axes, held, vector)
    }

    /// Puts these components of a vector among those of a tile, of which it is in this place.
    #[inline]
    pub fn put(&self, vectors: &mut [&mut [f32]; 3], place: usize, held: Vec3) {
        for axis in 0..3 {
            if self.axes.test(axis) {
                vectors[axis][place] = held[axis];
            }
        }
    }

    /// Puts these components of a vector among those of all nodes.
    pub fn put_among(&self, vectors: &mut Vectors, held: Vec3) {
        let node = self.node as usize;
        vectors.set(node, self.leading(vectors.get(node), held));
    }
}

/// The pins of a body, in the order of their nodes.
#[derive(Debug, Default)]
pub(crate) struct Pins {
    pins: Vec<Pin>,
    /// Where the pins of each tile begin, up to the last tile that has some.
    tiles: Vec<usize>,
    /// How many are held along some axes alone.
    partial_count: usize,
}

saved! { Pins { pins, tiles, partial_count } }

impl Pins {
    pub fn iter(&self) -> std::slice::Iter<'_, Pin> {
        self.pins.iter()
    }

    pub fn iter_mut(&mut self) -> std::slice::IterMut<'_, Pin> {
        self.pins.iter_mut()
    }

    /// The pins of each tile.
    pub fn tiles_mut(&mut self) -> Ragged<'_, Pin> {
        Ragged::new(&mut self.pins, &self.tiles)
    }

    /// The pins of one tile.
    pub fn of_tile(&self, tile: usize) -> &[Pin] {
        &self.pins[self.start(tile)..self.start(tile + 1)]
    }

    /// Where the pins of a tile begin.
    pub fn start(&self, tile: usize) -> usize {
        self.tiles.get(tile).map_or(self.pins.len(), |&start| start)
    }

    /// The pins in pieces that begin at these places.
    pub fn pieces_mut<'a>(&'a mut self, starts: &'a [usize]) -> Ragged<'a, Pin> {
        Ragged::new(&mut self.pins, starts)
    }

    pub fn get(&self, node: u32) -> Option<&Pin> {
        self.find(node).ok().map(|index| &self.pins[index])
    }

    pub fn get_mut(&mut self, node: u32) -> Option<&mut Pin> {
        self.find(node).ok().map(|index| &mut self.pins[index])
    }

    /// The axes along which a node is held.
    #[inline]
    pub fn axes_of(&self, node: u32) -> BVec3 {
        self.get(node).map_or(BVec3::FALSE, |pin| pin.axes)
    }

    /// The axes along which a node that moves is held.
    #[inline]
    pub fn partial_axes_of(&self, node: u32) -> BVec3 {
        if self.are_partial() {
            self.axes_of(node)
        } else {
            BVec3::FALSE
        }
    }

    /// Whether nodes are held along some axes alone.
    pub fn are_partial(&self) -> bool {
        self.partial_count > 0
    }

    /// Whether the step in progress leads one elsewhere.
    pub fn are_led(&self) -> bool {
        self.pins.iter().any(|pin| pin.travel != Vec3::ZERO)
    }

    /// Those that are held along some axes alone.
    pub fn partial(&self) -> impl Iterator<Item = &Pin> {
        let pins = if self.are_partial() { &*self.pins } else { &[] };
        pins.iter().filter(|pin| pin.is_partial())
    }

    /// Holds `node` along these axes, at least one, and no others; if that is a change it is not led any more.
    pub fn hold(&mut self, node: u32, axes: BVec3) -> Result<()> {
        match self.find(node) {
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

    /// Makes room for so many pins more of a body with so many nodes.
    pub fn reserve(&mut self, count: usize, node_count: usize) -> Result<()> {
        self.pins.try_reserve(count)?;
        let tiles = node_count.div_ceil(TILE);
        Ok(self.tiles.try_reserve(tiles.saturating_sub(self.tiles.len()))?)
    }

    /// Pins of these nodes, for all axes, to be [held](Self::hold_all).
    pub fn of(nodes: &[u32]) -> Result<Vec<Pin>> {
        memory::collected(nodes.iter().map(|&node| Pin::new(node, BVec3::TRUE)))
    }

    /// Holds nodes by these pins, which are in order; none of them is held yet, and there is room.
    pub fn hold_all(&mut self, more: &[Pin]) {
        let Some(last) = more.last() else {
            return;
        };
        let tiles = (last.node as usize / TILE + 1).max(self.tiles.len());
        memory::merge(&mut self.pins, more, |pin| pin.node);
        self.tiles.resize(tiles, 0);
        self.find_tiles();
    }

    /// Whether they are in order, of nodes of which there are so many, and found by tile.
    pub fn are_sound(&self, count: usize) -> bool {
        let is_start = |(tile, &start): (usize, &usize)| {
            start == self.pins.partition_point(|pin| (pin.node as usize) < tile * TILE)
        };
        self.pins.is_sorted_by(|a, b| a.node < b.node)
            && self
                .pins
                .last()
                .is_none_or(|pin| (pin.node as usize) < count && pin.node as usize / TILE < self.tiles.len())
            && self.tiles.iter().enumerate().all(is_start)
            && self.partial_count == self.pins.iter().filter(|pin| pin.is_partial()).count()
    }

    /// Lets go of nodes that are not to stay.
    pub fn retain(&mut self, stays: impl Fn(u32) -> bool) {
        self.pins.retain(|pin| stays(pin.node));
        self.partial_count = self.pins.iter().filter(|pin| pin.is_partial()).count();
        self.find_tiles();
    }

    /// Finds anew where the pins of each tile begin.
    fn find_tiles(&mut self) {
        let mut start = 0;
        for (tile, first) in self.tiles.iter_mut().enumerate() {
            let before = |pin: &Pin| (pin.node as usize) < tile * TILE;
            start += self.pins[start..].iter().take_while(|pin| before(pin)).count();
            *first = start;
        }
    }

    fn insert(&mut self, index: usize, node: u32, axes: BVec3) -> Result<()> {
        self.pins.try_reserve(1)?;
        let pin = Pin::new(node, axes);
        let tiles = node as usize / TILE + 1;
        self.tiles.try_reserve(tiles.saturating_sub(self.tiles.len()))?;
        self.pins.insert(index, pin);
        if tiles > self.tiles.len() {
            self.tiles.resize(tiles, index);
        }
        self.tiles[tiles..].iter_mut().for_each(|start| *start += 1);
        Ok(())
    }

    /// Lets go of `node`; whether it was held.
    pub fn remove(&mut self, node: u32) -> bool {
        let found = self.find(node);
        if let Ok(index) = found {
            let pin = self.pins.remove(index);
            self.partial_count -= usize::from(pin.is_partial());
            self.tiles[node as usize / TILE + 1..]
                .iter_mut()
                .for_each(|start| *start -= 1);
        }
        found.is_ok()
    }

    fn find(&self, node: u32) -> std::result::Result<usize, usize> {
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
            let seen = std::sync::atomic::AtomicUsize::new(0);
            Team::alone().pass(8, pins.tiles_mut(), |tile, pins| {
                assert!(pins.iter().all(|pin| pin.node as usize / TILE == tile));
                seen.fetch_add(pins.len(), std::sync::atomic::Ordering::Relaxed);
            });
            assert_eq!(seen.into_inner(), count);
        }
    }
}
