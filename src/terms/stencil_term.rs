//! Implements `Term` for the terms of a stencil law.

use std::array::from_fn;
use std::ops::Range;

use glam::DVec3;

use super::axial_terms::HistoryUpdate;
use super::pieces::TermPieces;
use super::stencils::{Stencil, StencilLaw, Stencils, tile_of};
use super::{HistoryEvent, TangentBlocks, Term};
use crate::base::{Result, StateHasher, ensure, memory};
use crate::codec::{Saved, Writer};
use crate::def::RelaxationStep;
use crate::simd::ChosenKernel;
use crate::soa::{NodalMasses, Region, Scale, TileForces, Vectors, View, tile_count};
use crate::springs::SpringChange;
use crate::threads::{Ragged, Team};

impl<L: StencilLaw<N>, const N: usize> Term for Stencils<L, N> {
    fn save(&self, to: &mut Writer) {
        to.write(&[L::SAVED_AS]);
        Saved::save(self, to);
    }

    fn add_forces(
        &self,
        kernel: ChosenKernel,
        (tile, nodes): (usize, Range<usize>),
        positions: View,
        forces: &mut TileForces,
    ) -> f64 {
        if L::IS_AXIAL {
            return kernel.run(self.tile_axial_terms((tile, nodes), positions, None, forces));
        }
        let mut stiffening = 1.0_f64;
        for index in self.touching(tile) {
            let stencil = &self.all[index];
            if stencil.stiffness > 0.0 {
                let positions = stencil.vectors_in(&positions);
                stencil.scatter(&nodes, &self.law.forces(&stencil.shape, &positions), forces);
                stiffening = stiffening.max(self.law.stiffening(&stencil.shape, &positions));
            }
        }
        stiffening
    }

    fn add_force_changes(
        &self,
        kernel: ChosenKernel,
        (tile, nodes): (usize, Range<usize>),
        [positions, displacements]: [View; 2],
        changes: &mut TileForces,
    ) {
        if L::IS_AXIAL {
            kernel.run(self.tile_axial_terms((tile, nodes), positions, Some(displacements), changes));
            return;
        }
        for index in self.touching(tile) {
            let stencil = &self.all[index];
            if stencil.stiffness > 0.0 {
                let (positions, displacements) = (stencil.vectors_in(&positions), stencil.vectors_in(&displacements));
                stencil.scatter(
                    &nodes,
                    &self.law.force_changes(&stencil.shape, &positions, &displacements),
                    changes,
                );
            }
        }
    }

    fn energy(&self, tile: usize, at: &dyn Fn(usize) -> DVec3) -> f64 {
        let active = self.owned(tile).map(|index| &self.all[index]);
        active
            .filter(|stencil| stencil.stiffness > 0.0)
            .map(|stencil| f64::from(stencil.stiffness) * self.law.energy(&stencil.shape, &stencil.at(at)))
            .sum()
    }

    fn visit_forces(&self, at: &dyn Fn(usize) -> DVec3, f: &mut dyn FnMut(usize, DVec3)) {
        for stencil in self.active() {
            let forces = self.law.forces(&stencil.shape, &stencil.at(at));
            for (&node, force) in stencil.nodes.iter().zip(forces) {
                f(node as usize, force * f64::from(stencil.stiffness));
            }
        }
    }

    fn visit_changes(
        &self,
        at: &dyn Fn(usize) -> DVec3,
        displacement: &dyn Fn(usize) -> DVec3,
        f: &mut dyn FnMut(f64),
    ) {
        for stencil in self.active() {
            let (positions, displacements) = (stencil.at(at), stencil.at(displacement));
            f(f64::from(stencil.stiffness) * self.law.energy_change(&stencil.shape, &positions, &displacements));
            f(f64::from(stencil.stiffness) * self.law.load_energy_change(&stencil.shape, &positions, &displacements));
        }
    }

    fn visit_blocks(&self, at: &dyn Fn(usize) -> DVec3, is_exact: bool, f: &mut dyn FnMut(&[u32], &TangentBlocks)) {
        let mut scaled_blocks = TangentBlocks::default();
        for stencil in self.active() {
            let blocks = self.law.blocks(&stencil.shape, &stencil.at(at), is_exact);
            for (scaled_blocks, blocks) in scaled_blocks.iter_mut().zip(blocks) {
                for (scaled_blocks, block) in scaled_blocks.iter_mut().zip(blocks) {
                    *scaled_blocks = block * f64::from(stencil.stiffness);
                }
            }
            f(&stencil.nodes, &scaled_blocks);
        }
    }

    fn visit_nodes(&self, f: &mut dyn FnMut(&[u32], f32)) {
        let all = self.all.iter().chain(&self.added);
        let present = all.filter(|stencil| stencil.stiffness >= 0.0);
        present.for_each(|stencil| f(&stencil.nodes, stencil.stiffness));
    }

    fn stiffening(&self, positions: &Vectors) -> f64 {
        let positions = positions.view();
        let stiffening = |stencil: &Stencil<_, N>| self.law.stiffening(&stencil.shape, &stencil.vectors_in(&positions));
        self.active().map(stiffening).fold(1.0, f64::max)
    }

    fn add_rates(&self, masses: &NodalMasses, rates: &mut [f32]) {
        for stencil in self.active() {
            let inverse_masses = stencil.nodes.map(|node| f64::from(masses.inverse(node as usize)));
            let rate = f64::from(stencil.stiffness) * self.law.rate_bound(&stencil.shape, inverse_masses);
            for (&node, inverse_mass) in stencil.nodes.iter().zip(inverse_masses) {
                if inverse_mass > 0.0 {
                    rates[node as usize] += rate as f32;
                }
            }
        }
    }

    fn visit_nodal_stiffness(&self, masses: &NodalMasses, f: &mut dyn FnMut(usize, f32)) {
        for stencil in self.active() {
            // The amplitude of each node: the root of the rate if only that node has a mass, of 1 kg.
            let amplitudes: [f64; N] = from_fn(|node| {
                let is_free = masses.inverse(stencil.nodes[node] as usize) > 0.0;
                let alone = from_fn(|other| if is_free && other == node { 1.0 } else { 0.0 });
                self.law.rate_bound(&stencil.shape, alone).sqrt()
            });
            let all: f64 = amplitudes.iter().sum();
            for (&node, amplitude) in stencil.nodes.iter().zip(amplitudes) {
                f(node as usize, (f64::from(stencil.stiffness) * amplitude * all) as f32);
            }
        }
    }

    fn remove_edge(&mut self, a: u32, b: u32) -> usize {
        let tile = tile_of(a);
        let first = self.initial(tile);
        let visitors = self.visitors(tile);
        let Self {
            law,
            all,
            visitors: visitor_list,
            cut_terms,
            ..
        } = self;
        let mut removed = 0;
        let mut remove_if_edge = |stencil: &mut Stencil<L::Shape, N>| {
            let slot = |node: u32| stencil.nodes.iter().position(|&other| other == node);
            if stencil.stiffness >= 0.0
                && let (Some(a), Some(b)) = (slot(a), slot(b))
                && law.is_edge(a, b)
            {
                stencil.stiffness = -1.0;
                removed += 1;
            }
        };
        all[first].iter_mut().for_each(&mut remove_if_edge);
        let others = visitor_list[visitors]
            .iter()
            .chain(cut_terms.get(tile).into_iter().flatten());
        others.for_each(|&index| remove_if_edge(&mut all[index as usize]));
        removed
    }

    fn set_spring(&mut self, change: &SpringChange) {
        if !L::BELONGS_TO_SPRINGS {
            return;
        }
        let mut nodes = [change.node, change.after.neighbor];
        nodes.sort_unstable();
        if let Some(slot) = self.find(&nodes) {
            let stencil = &mut self.all[slot];
            match self
                .law
                .shape_with_rest_length(&stencil.shape, change.after.rest_length)
            {
                Some(shape) => (stencil.stiffness, stencil.shape) = (change.after.stiffness, shape),
                None => stencil.stiffness = 0.0,
            }
        }
    }

    fn reserve_nodes(&mut self, node_count: usize, added_nodes: usize) -> Result<()> {
        // A new node has about as many terms as the existing ones.
        let terms_per_node = (N * self.all.len()).div_ceil(node_count.max(1));
        Ok(self.all.try_reserve(terms_per_node.saturating_mul(added_nodes))?)
    }

    fn prepare_cut(&mut self, pieces: &TermPieces, node_count: usize) -> Result<()> {
        self.discard_cut();
        let mut tiles = memory::copied(pieces.touched())?;
        tiles.iter_mut().for_each(|node| *node = tile_of(*node) as u32);
        tiles.dedup();
        let mut affected: Vec<u32> = Vec::new();
        for &tile in &tiles {
            let touched = |stencil: &Stencil<_, N>| stencil.stiffness >= 0.0 && pieces.touches(&stencil.nodes);
            let touching = self.touching(tile as usize).filter(|&index| touched(&self.all[index]));
            memory::extend(&mut affected, touching.map(|index| index as u32))?;
        }
        memory::sort_once(&mut affected);
        let Self {
            law,
            all,
            changed,
            added,
            ..
        } = self;
        for index in affected {
            let stencil = &all[index as usize];
            let mut result = Ok(());
            let mut remaining_stiffness = -1.0;
            let mut add_piece = |nodes: [u32; N], share: f64| {
                let stiffness = (f64::from(stencil.stiffness) * share) as f32;
                if nodes == stencil.nodes {
                    remaining_stiffness = stiffness;
                } else if result.is_ok() {
                    let piece = Stencil {
                        nodes,
                        stiffness,
                        shape: stencil.shape,
                    };
                    result = memory::push(added, piece);
                }
            };
            if L::BELONGS_TO_SPRINGS {
                for piece in pieces.spring_pieces([stencil.nodes[0], stencil.nodes[N - 1]]) {
                    add_piece(std::array::from_fn(|end| piece.nodes[end]), piece.share);
                }
            } else {
                law.visit_pieces(&stencil.shape, stencil.nodes, pieces, &mut add_piece);
            }
            result?;
            if remaining_stiffness != stencil.stiffness {
                memory::push(changed, (index, remaining_stiffness))?;
            }
        }
        if self.added.is_empty() {
            return Ok(());
        }
        self.all.try_reserve(self.added.len())?;
        let missing = tile_count(node_count).saturating_sub(self.cut_terms.len());
        self.cut_terms.try_reserve(missing)?;
        self.cut_terms.resize_with(self.cut_terms.len() + missing, Vec::new);
        tiles.clear();
        tiles.try_reserve(N * self.added.len())?;
        tiles.extend(
            self.added
                .iter()
                .flat_map(|stencil| stencil.nodes.map(|node| tile_of(node) as u32)),
        );
        tiles.sort_unstable();
        for at_tile in tiles.chunk_by(|a, b| a == b) {
            self.cut_terms[at_tile[0] as usize].try_reserve(at_tile.len())?;
        }
        Ok(())
    }

    fn apply_cut(&mut self) {
        for (index, stiffness) in self.changed.drain(..) {
            self.all[index as usize].stiffness = stiffness;
        }
        for stencil in self.added.drain(..) {
            let mut tiles = stencil.nodes.map(tile_of);
            tiles.sort_unstable();
            for (slot, &tile) in tiles.iter().enumerate() {
                if slot == 0 || tiles[slot - 1] != tile {
                    self.cut_terms[tile].push(self.all.len() as u32);
                }
            }
            self.all.push(stencil);
        }
    }

    fn discard_cut(&mut self) {
        self.changed.clear();
        self.added.clear();
    }

    fn check_scale(&self, region: &Region, scale: Scale) -> Result<()> {
        for index in self.within(region) {
            let Stencil { stiffness, shape, .. } = self.scaled(index, scale);
            ensure!(
                stiffness.is_finite() && self.law.is_finite(&shape),
                "stiffness_factor is {} and length_factor {}: a stiffness of {stiffness}, or a length, would be too much or too little",
                scale.stiffness,
                scale.length
            );
        }
        Ok(())
    }

    fn scale(&mut self, region: &Region, scale: Scale) -> usize {
        let mut count = 0;
        for tile in region.tiles().filter(|_| !L::BELONGS_TO_SPRINGS) {
            for slot in 0..self.initial(tile).len() + self.cut_terms(tile).len() {
                let first = self.initial(tile);
                let index = match slot.checked_sub(first.len()) {
                    None => first.start + slot,
                    Some(slot) => self.cut_terms(tile)[slot] as usize,
                };
                let stencil = &self.all[index];
                let is_here = slot < first.len() || stencil.first_tile() == tile;
                if is_here && stencil.stiffness > 0.0 && region.has_all(&stencil.nodes) {
                    self.all[index] = self.scaled(index, scale);
                    count += 1;
                }
            }
        }
        count
    }

    fn move_origin(&mut self, origin: DVec3) {
        for stencil in &mut self.all {
            self.law.move_origin(&mut stencil.shape, origin);
        }
    }

    fn anchors(&self, node: usize) -> bool {
        // A term of a single node connects it to the world.
        N == 1
            && self
                .find(&[node as u32])
                .is_some_and(|slot| self.all[slot].stiffness > 0.0)
    }

    fn has_history(&self) -> bool {
        L::HAS_HISTORY
    }

    fn apply_event(&mut self, event: HistoryEvent) {
        if L::HAS_HISTORY {
            self.law.begin_event(event);
            for stencil in &mut self.all {
                self.law.apply_event(event, &mut stencil.shape);
            }
        }
    }

    fn advance(&mut self, kernel: ChosenKernel, positions: View, relaxation: RelaxationStep, team: &Team) {
        if L::HAS_HISTORY {
            self.law.begin_event(HistoryEvent::Advance);
            let (law, tiles) = (&self.law, self.starts.len() - 1);
            let terms = Ragged::new(&mut self.all, &self.starts[..tiles]);
            team.pass(tiles, terms, |_, terms| {
                kernel.run(HistoryUpdate {
                    law,
                    terms,
                    positions,
                    relaxation,
                });
            });
        }
    }

    fn hash(&self, hasher: &mut StateHasher) {
        for stencil in &self.all {
            hasher.write_floats(&[stencil.stiffness, self.law.size(&stencil.shape)]);
            self.law.hash(&stencil.shape, hasher);
        }
    }
}
