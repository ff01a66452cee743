//! Volume offsets of nodes that a cut has duplicated, for average nodal pressure.
//!
//! The tetrahedra around a node keep their volume together, so single ones are larger or smaller than at rest. After a
//! cut, the copies of the node would have pressures that differ from before, and more energy in all. To prevent this,
//! each copy has an *offset*, which is subtracted from its volume change. The offset is `o = g - G v / V`, with the
//! volume change g and the rest volume v of the copy, and G and V of the original node. Pressures, forces and energy
//! then stay the same.
//!
//! Offsets fade, so that pieces reach their own rest shape. Reducing an offset by a fraction `a` at fixed positions
//! changes the energy by `a o p + a² kappa o² / 2 v`. The energy decreases while the offset approaches the volume
//! change; this part of the reduction is free. The energy that it removes pays for the reductions that increase the
//! energy of other nodes. So the total energy never increases.

use glam::DMat3;

use super::{DeformedTet, Elements, Sums};
use crate::base::{Result, StateHasher, memory};
use crate::codec::saved;
use crate::simd::{ChosenKernel, Record};
use crate::soa::{PerNode, Vectors};
use crate::threads::Team;

/// The time in which offsets fade to 1/e, s: too short to see, and longer than sound takes through a piece.
const FADE: f64 = 0.01;

/// The time between two reductions of offsets, s; each needs the nodal pressures.
const INTERVAL: f64 = 0.25 * FADE;

/// Offsets below this fraction of the nodal volume become 0.
const NEGLIGIBLE: f64 = 1e-9;

#[derive(Debug, Default)]
pub(super) struct PressureOffsets {
    /// The offset of each node, m³. Empty if the body cannot be cut.
    at_nodes: Vec<f32>,
    /// The nodes with a nonzero offset.
    nodes: Vec<u32>,
    /// The energy that fading has removed and not spent, J.
    energy_budget: f64,
    /// The time since the last reduction, s.
    elapsed: f64,
    /// True if offsets count as 0 until the next step begins.
    are_disabled: bool,
}

saved! { PressureOffsets { at_nodes, nodes, energy_budget, elapsed, are_disabled } }

impl PressureOffsets {
    /// The offset of each node, m³; empty if all are 0.
    pub fn values(&self) -> &[f32] {
        if self.are_disabled || self.nodes.is_empty() {
            &[]
        } else {
            &self.at_nodes
        }
    }

    /// The offset of a node, m³.
    pub fn at(&self, node: usize) -> f64 {
        self.values().get(node).map_or(0.0, |&offset| f64::from(offset))
    }

    /// Scales an offset, when the volume of the node is multiplied by `factor`.
    pub fn scale(&mut self, node: u32, factor: f32) {
        if let Some(offset) = self.at_nodes.get_mut(node as usize) {
            let scaled = *offset * factor;
            *offset = if scaled.is_finite() { scaled } else { 0.0 };
        }
    }

    /// Makes offsets count as 0 until [`Self::restore`].
    fn disable(&mut self) {
        self.are_disabled = true;
    }

    /// Restores the offsets.
    pub fn restore(&mut self) {
        self.are_disabled = false;
    }

    /// Makes the current offsets permanent: 0 if they are disabled.
    pub fn commit(&mut self) {
        if self.are_disabled {
            self.at_nodes.fill(0.0);
            self.nodes.clear();
            self.reset();
            self.are_disabled = false;
        }
    }

    /// Resizes to `node_count` nodes, and reserves memory for `capacity` nodes.
    pub fn resize(&mut self, node_count: usize, capacity: usize) -> Result<()> {
        memory::reserve(&mut self.at_nodes, capacity)?;
        self.at_nodes.resize(node_count, 0.0);
        Ok(())
    }

    fn set(&mut self, node: u32, offset: f64) {
        let old = &mut self.at_nodes[node as usize];
        if *old == 0.0 && offset as f32 != 0.0 {
            self.nodes.push(node);
        }
        *old = offset as f32;
    }

    /// Resets the state of fading, when no offsets are left.
    fn reset(&mut self) {
        (self.energy_budget, self.elapsed) = (0.0, 0.0);
    }

    pub fn hash(&self, hasher: &mut StateHasher) {
        for &node in &self.nodes {
            hasher.write_u64(u64::from(node));
            hasher.write_floats(&[self.at_nodes[node as usize]]);
        }
        hasher.write_doubles(&[self.energy_budget, self.elapsed]);
    }
}

/// A node whose offset fades.
struct Fading {
    offset: f64,
    /// Pa
    pressure: f64,
    /// Pa/m³
    stiffness: f64,
}

impl Fading {
    /// The change of energy if this fraction of the offset is removed, J.
    fn change(&self, fraction: f64) -> f64 {
        fraction * self.offset * (self.pressure + 0.5 * fraction * self.stiffness * self.offset)
    }

    /// The fraction, at most `max_fraction`, whose removal lowers the energy.
    fn free_fraction(&self, max_fraction: f64) -> f64 {
        let fraction = -self.pressure / (self.stiffness * self.offset);
        if fraction > 0.0 {
            fraction.min(max_fraction)
        } else {
            0.0
        }
    }
}

impl Elements {
    /// Reserves memory for the offsets of the copies of cut nodes.
    pub fn reserve_pressure_offsets(&mut self, copies: usize) -> Result<()> {
        if self.nodal_volumes.is_some() {
            self.pressure_offsets.nodes.try_reserve(copies)?;
        }
        Ok(())
    }

    /// Resizes to `node_count` nodal volumes and pressures, within the reserved memory.
    pub(super) fn grow_nodal_pressures(&mut self, node_count: usize, other_sums: Option<&mut Sums>) {
        let Some(nodal_volumes) = &mut self.nodal_volumes else {
            return;
        };
        nodal_volumes.volumes.resize(node_count, 0.0);
        self.pressure_offsets.at_nodes.resize(node_count, 0.0);
        if let Some(history) = &mut self.history {
            history.grow_nodal(node_count);
        }
        for sums in std::iter::once(&mut self.forces).chain(other_sums) {
            sums.pressures.grow(node_count);
        }
    }

    /// Splits the nodal volume of `source` between its copies, which include `source`. `cells_at` returns the
    /// tetrahedra around a node.
    pub fn split_nodal_volume<Cells: Iterator<Item = u32>>(
        &mut self,
        source: u32,
        copies: impl Iterator<Item = u32> + Clone,
        cells_at: impl Fn(u32) -> Cells,
        positions: &Vectors,
    ) {
        if self.nodal_volumes.is_none() {
            return;
        }
        let (mut volume_change, mut volume) = (-self.pressure_offsets.at(source as usize), 0.0);
        for copy in copies.clone() {
            let change = self.nodal_volume_change(cells_at(copy), positions);
            volume_change += change[0];
            volume += change[1];
        }
        for copy in copies {
            let [change, copy_volume] = self.nodal_volume_change(cells_at(copy), positions);
            if let Some(nodal_volumes) = &mut self.nodal_volumes {
                nodal_volumes.volumes[copy as usize] = copy_volume as f32;
            }
            let offset = change - volume_change * copy_volume / volume;
            self.pressure_offsets
                .set(copy, if offset.is_finite() { offset } else { 0.0 });
            if let Some(history) = &mut self.history {
                history.copy_node(source, copy);
            }
        }
    }

    /// The nodal volume change of these tetrahedra, and their nodal volume at rest, m³.
    fn nodal_volume_change(&self, cells: impl Iterator<Item = u32>, positions: &Vectors) -> [f64; 2] {
        let mut sums = [0.0; 2];
        for (corners, rest, _) in cells.filter_map(|cell| self.cell(cell)) {
            let [a, b, c, d] = corners.map(|corner| positions.get(corner as usize).as_dvec3());
            let deformed = DeformedTet::new(self.law, &rest, DMat3::from_cols(b - a, c - a, d - a));
            sums[0] += 0.25 * deformed.volume_change();
            sums[1] += 0.25 * rest.volume;
        }
        sums
    }

    /// Adds `time` seconds to the fading time. Returns true if offsets must be reduced now.
    pub fn add_fade_time(&mut self, time: f64) -> bool {
        let pressure_offsets = &mut self.pressure_offsets;
        if pressure_offsets.nodes.is_empty() {
            return false;
        }
        pressure_offsets.elapsed += time;
        pressure_offsets.elapsed >= INTERVAL
    }

    /// Makes all offsets count as 0 until a step begins.
    pub fn disable_pressure_offsets(&mut self) {
        self.pressure_offsets.disable();
    }

    /// Reduces the offsets by the time since the last reduction, with nodes at `positions`, which must be the current
    /// state.
    pub fn fade(&mut self, kernel: ChosenKernel, positions: &[Record], team: &Team) {
        self.find_pressures(kernel, positions, false, team);
        let max_fraction = 1.0 - libm::exp(-self.pressure_offsets.elapsed / FADE);
        self.pressure_offsets.elapsed = 0.0;
        let mut required = 0.0;
        for index in 0..self.pressure_offsets.nodes.len() {
            if let Some(fading) = self.fading_at(index) {
                let free = fading.change(fading.free_fraction(max_fraction));
                self.pressure_offsets.energy_budget -= free;
                required += fading.change(max_fraction) - free;
            }
        }
        let energy_budget = self.pressure_offsets.energy_budget;
        let affordable = if required > energy_budget {
            energy_budget / required
        } else {
            1.0
        };
        for index in 0..self.pressure_offsets.nodes.len() {
            let node = self.pressure_offsets.nodes[index];
            let mut remaining = 0.0;
            if let Some(fading) = self.fading_at(index) {
                let free = fading.free_fraction(max_fraction);
                let fraction = free + affordable * (max_fraction - free);
                self.pressure_offsets.energy_budget -= fading.change(fraction) - fading.change(free);
                remaining = fading.offset * (1.0 - fraction);
                if remaining.abs() * fading.stiffness <= NEGLIGIBLE * f64::from(self.law.kappa) {
                    remaining = 0.0;
                }
                if let Some(history) = &mut self.history {
                    history.shift_nodal_pressure(node, (fading.stiffness * (fading.offset - remaining)) as f32);
                }
            }
            self.pressure_offsets.at_nodes[node as usize] = remaining as f32;
        }
        let pressure_offsets = &mut self.pressure_offsets;
        pressure_offsets.energy_budget = pressure_offsets.energy_budget.max(0.0);
        pressure_offsets
            .nodes
            .retain(|&node| pressure_offsets.at_nodes[node as usize] != 0.0);
        if pressure_offsets.nodes.is_empty() {
            pressure_offsets.reset();
        }
    }

    /// The fading offset at `index` in the list, with the last computed pressure.
    fn fading_at(&self, index: usize) -> Option<Fading> {
        let node = self.pressure_offsets.nodes[index] as usize;
        let volume = self.nodal_volume(node)?;
        let fading = Fading {
            offset: self.pressure_offsets.at(node),
            pressure: f64::from(self.forces.pressures.at_nodes[node]),
            stiffness: f64::from(self.law.kappa) / volume,
        };
        (volume > 0.0 && fading.offset != 0.0 && fading.pressure.is_finite()).then_some(fading)
    }
}
