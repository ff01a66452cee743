//! What the parts of a law of a few nodes do as a term.

use std::array::from_fn;
use std::ops::Range;

use glam::DVec3;

use super::parting::Parting;
use super::stencils::{Stencil, StencilLaw, Stencils, tile_of};
use super::strings::Aging;
use super::{Event, TangentBlocks, Term};
use crate::base::{Result, StateHasher, ensure, memory};
use crate::codec::{Saved, Writer};
use crate::def::RelaxationStep;
use crate::simd::ChosenKernel;
use crate::soa::{Masses, Region, Scale, TileForces, Vectors, View, tile_count};
use crate::springs::SpringChange;
use crate::threads::{Ragged, Team};

impl<L: StencilLaw<N>, const N: usize> Term for Stencils<L, N> {
    fn save(&self, to: &mut Writer) {
        to.put(&[L::SAVED_AS]);
        Saved::save(self, to);
    }

    fn add_forces(
        &self,
        kernel: ChosenKernel,
        (tile, nodes): (usize, Range<usize>),
        positions: View,
        forces: &mut TileForces,
    ) -> f64 {
        if L::IS_STRING {
            return kernel.run(self.strings((tile, nodes), positions, None, forces));
        }
        let mut stiffening = 1.0_f64;
        for index in self.of_tile(tile) {
            let stencil = &self.all[index];
            if stencil.stiffness > 0.0 {
                let places = stencil.seen(&positions);
                stencil.give(&nodes, &self.law.forces(&stencil.shape, &places), forces);
                stiffening = stiffening.max(self.law.stiffening(&stencil.shape, &places));
            }
        }
        stiffening
    }

    fn add_changes(
        &self,
        kernel: ChosenKernel,
        (tile, nodes): (usize, Range<usize>),
        [positions, ways]: [View; 2],
        changes: &mut TileForces,
    ) {
        if L::IS_STRING {
            kernel.run(self.strings((tile, nodes), positions, Some(ways), changes));
            return;
        }
        for index in self.of_tile(tile) {
            let stencil = &self.all[index];
            if stencil.stiffness > 0.0 {
                let (places, ways) = (stencil.seen(&positions), stencil.seen(&ways));
                stencil.give(&nodes, &self.law.changes(&stencil.shape, &places, &ways), changes);
            }
        }
    }

    fn energy(&self, tile: usize, at: &dyn Fn(usize) -> DVec3) -> f64 {
        let there = self.beginning(tile).map(|index| &self.all[index]);
        there
            .filter(|stencil| stencil.stiffness > 0.0)
            .map(|stencil| f64::from(stencil.stiffness) * self.law.energy(&stencil.shape, &stencil.at(at)))
            .sum()
    }

    fn show_forces(&self, at: &dyn Fn(usize) -> DVec3, see: &mut dyn FnMut(usize, DVec3)) {
        for stencil in self.there() {
            let forces = self.law.forces(&stencil.shape, &stencil.at(at));
            for (&node, force) in stencil.nodes.iter().zip(forces) {
                see(node as usize, force * f64::from(stencil.stiffness));
            }
        }
    }

    fn show_changes(&self, at: &dyn Fn(usize) -> DVec3, more: &dyn Fn(usize) -> DVec3, see: &mut dyn FnMut(f64)) {
        for stencil in self.there() {
            let (places, ways) = (stencil.at(at), stencil.at(more));
            see(f64::from(stencil.stiffness) * self.law.change(&stencil.shape, &places, &ways));
            see(f64::from(stencil.stiffness) * self.law.change_of_load(&stencil.shape, &places, &ways));
        }
    }

    fn show_blocks(&self, at: &dyn Fn(usize) -> DVec3, is_exact: bool, see: &mut dyn FnMut(&[u32], &TangentBlocks)) {
        let mut shown = TangentBlocks::default();
        for stencil in self.there() {
            let blocks = self.law.blocks(&stencil.shape, &stencil.at(at), is_exact);
            for (shown, blocks) in shown.iter_mut().zip(blocks) {
                for (shown, block) in shown.iter_mut().zip(blocks) {
                    *shown = block * f64::from(stencil.stiffness);
                }
            }
            see(&stencil.nodes, &shown);
        }
    }

    fn show_nodes(&self, see: &mut dyn FnMut(&[u32], f32)) {
        let all = self.all.iter().chain(&self.added);
        let kept = all.filter(|stencil| stencil.stiffness >= 0.0);
        kept.for_each(|stencil| see(&stencil.nodes, stencil.stiffness));
    }

    fn stiffening(&self, positions: &Vectors) -> f64 {
        let positions = positions.view();
        let stiffening = |stencil: &Stencil<_, N>| self.law.stiffening(&stencil.shape, &stencil.seen(&positions));
        self.there().map(stiffening).fold(1.0, f64::max)
    }

    fn add_rates(&self, masses: &Masses, rates: &mut [f32]) {
        for stencil in self.there() {
            let inverse_masses = stencil.nodes.map(|node| f64::from(masses.inverse(node as usize)));
            let rate = f64::from(stencil.stiffness) * self.law.rate(&stencil.shape, inverse_masses);
            for (&node, inverse_mass) in stencil.nodes.iter().zip(inverse_masses) {
                if inverse_mass > 0.0 {
                    rates[node as usize] += rate as f32;
                }
            }
        }
    }

    fn show_carried(&self, masses: &Masses, see: &mut dyn FnMut(usize, f32)) {
        for stencil in self.there() {
            // The square of what each node takes part with: the rate where it alone has a mass, of 1 kg.
            let parts: [f64; N] = from_fn(|node| {
                let is_free = masses.inverse(stencil.nodes[node] as usize) > 0.0;
                let alone = from_fn(|other| if is_free && other == node { 1.0 } else { 0.0 });
                self.law.rate(&stencil.shape, alone).sqrt()
            });
            let all: f64 = parts.iter().sum();
            for (&node, part) in stencil.nodes.iter().zip(parts) {
                see(node as usize, (f64::from(stencil.stiffness) * part * all) as f32);
            }
        }
    }

    fn remove_edge(&mut self, a: u32, b: u32) -> usize {
        let tile = tile_of(a);
        let first = self.first(tile);
        let visitors = self.visitors(tile);
        let Self {
            law,
            all,
            visitors: of_tiles,
            later,
            ..
        } = self;
        let mut removed = 0;
        let mut look = |stencil: &mut Stencil<L::Shape, N>| {
            let place = |node: u32| stencil.nodes.iter().position(|&other| other == node);
            if stencil.stiffness >= 0.0
                && let (Some(a), Some(b)) = (place(a), place(b))
                && law.is_edge(a, b)
            {
                stencil.stiffness = -1.0;
                removed += 1;
            }
        };
        all[first].iter_mut().for_each(&mut look);
        let others = of_tiles[visitors].iter().chain(later.get(tile).into_iter().flatten());
        others.for_each(|&index| look(&mut all[index as usize]));
        removed
    }

    fn set_spring(&mut self, change: &SpringChange) {
        if !L::IS_OF_SPRINGS {
            return;
        }
        let mut nodes = [change.node, change.after.neighbour];
        nodes.sort_unstable();
        if let Some(place) = self.find(&nodes) {
            let stencil = &mut self.all[place];
            match self.law.shape_of_spring(&stencil.shape, change.after.rest_length) {
                Some(shape) => (stencil.stiffness, stencil.shape) = (change.after.stiffness, shape),
                None => stencil.stiffness = 0.0,
            }
        }
    }

    fn reserve_nodes(&mut self, node_count: usize, more: usize) -> Result<()> {
        // A new node has about as many terms as those there are.
        let of_node = (N * self.all.len()).div_ceil(node_count.max(1));
        Ok(self.all.try_reserve(of_node.saturating_mul(more))?)
    }

    fn prepare_parts(&mut self, parting: &Parting, node_count: usize) -> Result<()> {
        self.forget_parts();
        let mut tiles = memory::copied(parting.touched())?;
        tiles.iter_mut().for_each(|node| *node = tile_of(*node) as u32);
        tiles.dedup();
        let mut near: Vec<u32> = Vec::new();
        for &tile in &tiles {
            let touched = |stencil: &Stencil<_, N>| stencil.stiffness >= 0.0 && parting.touches(&stencil.nodes);
            let of_tile = self.of_tile(tile as usize).filter(|&index| touched(&self.all[index]));
            memory::extend(&mut near, of_tile.map(|index| index as u32))?;
        }
        memory::sort_once(&mut near);
        let Self {
            law,
            all,
            changed,
            added,
            ..
        } = self;
        for index in near {
            let stencil = &all[index as usize];
            let mut room = Ok(());
            let mut left = -1.0;
            let mut see = |nodes: [u32; N], part: f64| {
                let stiffness = (f64::from(stencil.stiffness) * part) as f32;
                if nodes == stencil.nodes {
                    left = stiffness;
                } else if room.is_ok() {
                    let of_part = Stencil {
                        nodes,
                        stiffness,
                        shape: stencil.shape,
                    };
                    room = memory::push(added, of_part);
                }
            };
            if L::IS_OF_SPRINGS {
                for part in parting.of_spring([stencil.nodes[0], stencil.nodes[N - 1]]) {
                    see(std::array::from_fn(|end| part.nodes[end]), part.part);
                }
            } else {
                law.show_parts(&stencil.shape, stencil.nodes, parting, &mut see);
            }
            room?;
            if left != stencil.stiffness {
                memory::push(changed, (index, left))?;
            }
        }
        if self.added.is_empty() {
            return Ok(());
        }
        self.all.try_reserve(self.added.len())?;
        let more = tile_count(node_count).saturating_sub(self.later.len());
        self.later.try_reserve(more)?;
        self.later.resize_with(self.later.len() + more, Vec::new);
        tiles.clear();
        tiles.try_reserve(N * self.added.len())?;
        tiles.extend(
            self.added
                .iter()
                .flat_map(|stencil| stencil.nodes.map(|node| tile_of(node) as u32)),
        );
        tiles.sort_unstable();
        for at_tile in tiles.chunk_by(|a, b| a == b) {
            self.later[at_tile[0] as usize].try_reserve(at_tile.len())?;
        }
        Ok(())
    }

    fn take_parts(&mut self) {
        for (index, stiffness) in self.changed.drain(..) {
            self.all[index as usize].stiffness = stiffness;
        }
        for stencil in self.added.drain(..) {
            let mut tiles = stencil.nodes.map(tile_of);
            tiles.sort_unstable();
            for (place, &tile) in tiles.iter().enumerate() {
                if place == 0 || tiles[place - 1] != tile {
                    self.later[tile].push(self.all.len() as u32);
                }
            }
            self.all.push(stencil);
        }
    }

    fn forget_parts(&mut self) {
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
        for tile in region.tiles().filter(|_| !L::IS_OF_SPRINGS) {
            for place in 0..self.first(tile).len() + self.later(tile).len() {
                let first = self.first(tile);
                let index = match place.checked_sub(first.len()) {
                    None => first.start + place,
                    Some(place) => self.later(tile)[place] as usize,
                };
                let stencil = &self.all[index];
                let is_here = place < first.len() || stencil.first_tile() == tile;
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

    fn holds(&self, node: usize) -> bool {
        // A term of a single node is one between it and the world.
        N == 1
            && self
                .find(&[node as u32])
                .is_some_and(|place| self.all[place].stiffness > 0.0)
    }

    fn remembers(&self) -> bool {
        L::REMEMBERS
    }

    fn pass(&mut self, moment: Event) {
        if L::REMEMBERS {
            self.law.begin(moment);
            for stencil in &mut self.all {
                self.law.pass(moment, &mut stencil.shape);
            }
        }
    }

    fn age(&mut self, kernel: ChosenKernel, positions: View, course: RelaxationStep, team: &Team) {
        if L::REMEMBERS {
            self.law.begin(Event::Age);
            let (law, tiles) = (&self.law, self.starts.len() - 1);
            let strings = Ragged::new(&mut self.all, &self.starts[..tiles]);
            team.pass(tiles, strings, |_, strings| {
                kernel.run(Aging {
                    law,
                    strings,
                    positions,
                    course,
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
