//! Rings that a cut parts.
//!
//! The tetrahedra of a ring keep their volume together: single ones are larger or smaller than at rest. So the rings of a node's copies
//! would have other pressures than the ring had, and together more energy. Each is given an *offset* instead: it presses by what it has
//! grown less that. With `o = g - G v / V` (g, v: growth and volume of the copy's ring, G, V: the whole ring's) pressures, forces and
//! energy are what they were.
//!
//! Offsets fade, or pieces would never come to the rest shape that they have by themselves. To lessen an offset by a part `a` changes
//! the energy of its ring, with nodes where they are, by `a o p + a² kappa o² / 2 v`. Where it lies between the ring's growth and 0 that
//! takes energy, and as far as it does it is done. The energy that was taken pays for others, which are pressed the other way: so the
//! energy is never more than it was.

use glam::DMat3;

use super::{Deformed, Elements, Sums};
use crate::base::{Result, StateHasher, memory};
use crate::codec::saved;
use crate::simd::{ChosenKernel, Record};
use crate::soa::{PerNode, Vectors};
use crate::threads::Team;

/// How long they take to fade to 1/e, s: short for an eye, and longer than sound takes through what is cut.
const FADE: f64 = 0.01;

/// How long they wait to fade, s: pressures have to be found for it.
const WAIT: f64 = 0.25 * FADE;

/// What is no more than this part of a ring's volume is nothing.
const NOTHING: f64 = 1e-9;

#[derive(Debug, Default)]
pub(super) struct Offsets {
    /// Of each node, m³; of none where the body cannot be cut.
    of_nodes: Vec<f32>,
    /// The nodes that have one.
    nodes: Vec<u32>,
    /// The energy that fading has taken, J.
    taken: f64,
    /// How long they have not faded, s.
    waited: f64,
    /// Whether there are none until a step begins.
    are_released: bool,
}

saved! { Offsets { of_nodes, nodes, taken, waited, are_released } }

impl Offsets {
    /// Of each node, m³; nothing where there are none.
    pub fn get(&self) -> &[f32] {
        if self.are_released || self.nodes.is_empty() {
            &[]
        } else {
            &self.of_nodes
        }
    }

    /// That of a node, m³.
    pub fn of(&self, node: usize) -> f64 {
        self.get().get(node).map_or(0.0, |&offset| f64::from(offset))
    }

    /// A ring has so many times its volume.
    pub fn scale(&mut self, node: u32, factor: f32) {
        if let Some(offset) = self.of_nodes.get_mut(node as usize) {
            let scaled = *offset * factor;
            *offset = if scaled.is_finite() { scaled } else { 0.0 };
        }
    }

    /// There are none until [`Self::recall`].
    fn release(&mut self) {
        self.are_released = true;
    }

    /// They are what they were.
    pub fn recall(&mut self) {
        self.are_released = false;
    }

    /// What is now stays.
    pub fn keep(&mut self) {
        if self.are_released {
            self.of_nodes.fill(0.0);
            self.nodes.clear();
            self.done();
            self.are_released = false;
        }
    }

    /// Is there for so many nodes, with room for so many in all.
    pub fn make_room(&mut self, node_count: usize, most: usize) -> Result<()> {
        memory::reserve(&mut self.of_nodes, most)?;
        self.of_nodes.resize(node_count, 0.0);
        Ok(())
    }

    fn set(&mut self, node: u32, offset: f64) {
        let known = &mut self.of_nodes[node as usize];
        if *known == 0.0 && offset as f32 != 0.0 {
            self.nodes.push(node);
        }
        *known = offset as f32;
    }

    /// There are none any more.
    fn done(&mut self) {
        (self.taken, self.waited) = (0.0, 0.0);
    }

    pub fn hash(&self, hasher: &mut StateHasher) {
        for &node in &self.nodes {
            hasher.write_u64(u64::from(node));
            hasher.write_floats(&[self.of_nodes[node as usize]]);
        }
        hasher.write_doubles(&[self.taken, self.waited]);
    }
}

/// A ring whose offset fades.
struct Fading {
    offset: f64,
    /// Pa
    pressure: f64,
    /// Pa/m³
    stiffness: f64,
}

impl Fading {
    /// What the energy changes by where a part of the offset goes, J.
    fn change(&self, part: f64) -> f64 {
        part * self.offset * (self.pressure + 0.5 * part * self.stiffness * self.offset)
    }

    /// The part of at most `most` that takes energy.
    fn free_part(&self, most: f64) -> f64 {
        let part = -self.pressure / (self.stiffness * self.offset);
        if part > 0.0 { part.min(most) } else { 0.0 }
    }
}

impl Elements {
    /// Makes room for the rings of nodes that fall apart, into so many copies in all.
    pub fn reserve_rings(&mut self, copies: usize) -> Result<()> {
        if self.rings.is_some() {
            self.offsets.nodes.try_reserve(copies)?;
        }
        Ok(())
    }

    /// Has rings of so many nodes, for which there is room.
    pub(super) fn grow_rings(&mut self, node_count: usize, beside: Option<&mut Sums>) {
        let Some(rings) = &mut self.rings else {
            return;
        };
        rings.volumes.resize(node_count, 0.0);
        self.offsets.of_nodes.resize(node_count, 0.0);
        if let Some(memory) = &mut self.memory {
            memory.grow_rings(node_count);
        }
        for sums in std::iter::once(&mut self.forces).chain(beside) {
            sums.pressures.grow(node_count);
        }
    }

    /// Parts the ring of a node between its copies, of which it is one, given the cells at each.
    pub fn part_ring<Cells: Iterator<Item = u32>>(
        &mut self,
        source: u32,
        copies: impl Iterator<Item = u32> + Clone,
        cells_at: impl Fn(u32) -> Cells,
        positions: &Vectors,
    ) {
        if self.rings.is_none() {
            return;
        }
        let (mut growth, mut volume) = (-self.offsets.of(source as usize), 0.0);
        for copy in copies.clone() {
            let of_copy = self.grown(cells_at(copy), positions);
            growth += of_copy[0];
            volume += of_copy[1];
        }
        for copy in copies {
            let [of_copy, of_volume] = self.grown(cells_at(copy), positions);
            if let Some(rings) = &mut self.rings {
                rings.volumes[copy as usize] = of_volume as f32;
            }
            let offset = of_copy - growth * of_volume / volume;
            self.offsets.set(copy, if offset.is_finite() { offset } else { 0.0 });
            if let Some(memory) = &mut self.memory {
                memory.copy_ring(source, copy);
            }
        }
    }

    /// How much a ring of these tetrahedra has grown, and its volume at rest, m³.
    fn grown(&self, cells: impl Iterator<Item = u32>, positions: &Vectors) -> [f64; 2] {
        let mut sums = [0.0; 2];
        for (corners, rest, _) in cells.filter_map(|cell| self.cell(cell)) {
            let [a, b, c, d] = corners.map(|corner| positions.get(corner as usize).as_dvec3());
            let deformed = Deformed::new(self.law, &rest, DMat3::from_cols(b - a, c - a, d - a));
            sums[0] += 0.25 * deformed.swelling();
            sums[1] += 0.25 * rest.volume;
        }
        sums
    }

    /// So many seconds have passed: whether offsets are to fade.
    pub fn wait(&mut self, time: f64) -> bool {
        let offsets = &mut self.offsets;
        if offsets.nodes.is_empty() {
            return false;
        }
        offsets.waited += time;
        offsets.waited >= WAIT
    }

    /// Rings have none, until a step begins.
    pub fn release_rings(&mut self) {
        self.offsets.release();
    }

    /// Lets the offsets fade for as long as they have waited, with nodes at `positions`, which are the current state.
    pub fn fade(&mut self, kernel: ChosenKernel, positions: &[Record], team: &Team) {
        self.find_pressures(kernel, positions, false, team);
        let most = 1.0 - libm::exp(-self.offsets.waited / FADE);
        self.offsets.waited = 0.0;
        let mut lacking = 0.0;
        for place in 0..self.offsets.nodes.len() {
            if let Some(ring) = self.fading(place) {
                let free = ring.change(ring.free_part(most));
                self.offsets.taken -= free;
                lacking += ring.change(most) - free;
            }
        }
        let taken = self.offsets.taken;
        let paid = if lacking > taken { taken / lacking } else { 1.0 };
        for place in 0..self.offsets.nodes.len() {
            let node = self.offsets.nodes[place];
            let mut left = 0.0;
            if let Some(ring) = self.fading(place) {
                let free = ring.free_part(most);
                let part = free + paid * (most - free);
                self.offsets.taken -= ring.change(part) - ring.change(free);
                left = ring.offset * (1.0 - part);
                if left.abs() * ring.stiffness <= NOTHING * f64::from(self.law.kappa) {
                    left = 0.0;
                }
                if let Some(memory) = &mut self.memory {
                    memory.shift_ring(node, (ring.stiffness * (ring.offset - left)) as f32);
                }
            }
            self.offsets.of_nodes[node as usize] = left as f32;
        }
        let offsets = &mut self.offsets;
        offsets.taken = offsets.taken.max(0.0);
        offsets.nodes.retain(|&node| offsets.of_nodes[node as usize] != 0.0);
        if offsets.nodes.is_empty() {
            offsets.done();
        }
    }

    /// One of those with offsets, whose pressures were just found.
    fn fading(&self, place: usize) -> Option<Fading> {
        let node = self.offsets.nodes[place] as usize;
        let volume = self.ring_volume(node)?;
        let ring = Fading {
            offset: self.offsets.of(node),
            pressure: f64::from(self.forces.pressures.of_nodes[node]),
            stiffness: f64::from(self.law.kappa) / volume,
        };
        (volume > 0.0 && ring.offset != 0.0 && ring.pressure.is_finite()).then_some(ring)
    }
}
