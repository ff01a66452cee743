//! Nodes that come after a body was made, as cuts make them: room for them is made at the door, so that adding one moves nothing.

use super::System;
use super::energy_sums::TileSums;
use super::kick::Survey;
use crate::base::{Error, Result, memory};
use crate::forces::Parts;
use crate::geometry::Bounds;
use crate::nodes::NewNode;
use crate::soa::{Vectors, tile_count};
use crate::springs::Rewiring;

impl System {
    /// Makes room for so many nodes more than there are.
    pub fn reserve_nodes(&mut self, more: usize) -> Result<()> {
        let count = self.node_count().checked_add(more).ok_or(Error::OutOfMemory)?;
        self.order.reserve(count)?;
        self.forces.reserve_nodes(count)?;
        for values in [&mut self.masses, &mut self.inverse_masses] {
            memory::reserve(values, count)?;
        }
        if let Some(damping) = &mut self.damping {
            damping.reserve(count)?;
        }
        memory::reserve(&mut self.surveys, tile_count(count))?;
        memory::reserve(&mut self.tile_sums, tile_count(count))?;
        memory::reserve(&mut self.boxes, tile_count(count))?;
        if let Some(sleeper) = &mut self.sleeper {
            sleeper.reserve(tile_count(count))?;
        }
        self.state.reserve(count)?;
        self.vectors_mut().try_for_each(|vectors| vectors.reserve(count))?;
        if let Some(coarse) = &mut self.coarse {
            coarse.reserve(count)?;
        }
        self.integrator.reserve_nodes(count)?;
        let triangles = self.surface.len() + 2 * more;
        memory::reserve(&mut self.surface, triangles)?;
        self.forget_early();
        self.node_room = count;
        let known = self.node_count();
        self.bindings.get_or_insert_default().reserve(more, known)
    }

    /// Makes room for one spring more in what its solver knows.
    pub fn reserve_spring(&mut self) -> Result<()> {
        self.integrator.reserve_springs(self.forces.springs.spring_count() + 1)
    }

    /// Makes room for what a cut leaves in a body of so many nodes.
    pub fn prepare_parts(&mut self, parts: &Parts, node_count: usize) -> Result<()> {
        self.forces.prepare_parts(parts, node_count)
    }

    /// Becomes what a cut leaves, for which there is room.
    pub fn take_parts(&mut self, parts: &Parts, node_count: usize) {
        self.forces.take_parts(parts, node_count);
    }

    /// Changes springs, of which there are nodes already, and what a solver knows of them and so many pairs of nodes of elements more. Changes
    /// nothing where it fails.
    pub fn rewire(&mut self, rewiring: &Rewiring, pairs: usize) -> Result<()> {
        self.integrator
            .prepare_cut(&self.forces, rewiring.added.len() + pairs)?;
        self.forces.springs.rewire(rewiring)
    }

    /// Adds nodes, for which there is room, in their own numbers: they follow those that there are. Changes nothing where it fails.
    pub fn add_nodes(&mut self, nodes: &[NewNode]) -> Result<()> {
        let known = self.node_count();
        let count = known + nodes.len();
        self.forces.add_nodes(count)?;
        self.order.grow(count);
        self.masses.resize(count, 0.0);
        self.inverse_masses.resize(count, 0.0);
        self.state.grow(count);
        self.vectors_mut().for_each(|vectors| vectors.grow(count));
        if let Some(coarse) = &mut self.coarse {
            coarse.grow(count);
        }
        self.integrator.grow(count);
        self.forget_early();
        self.surveys.resize(tile_count(count), Survey::NOTHING);
        self.tile_sums.resize(tile_count(count), TileSums::default());
        self.boxes.resize(tile_count(count), Bounds::EMPTY);
        self.wake();
        if let Some(sleeper) = &mut self.sleeper {
            sleeper.grow(tile_count(count));
        }
        // Nodes differ in mass now.
        self.uniform_inverse_mass = None;
        if let Some(scaling) = &mut self.scaling {
            scaling.uniform_inverse_mass = None;
        }
        for (node, new) in (known..).zip(nodes) {
            match new {
                NewNode::Copy(source) => self.copy_motion(*source as usize, node),
                NewNode::Bound(bound) => {
                    if let Some(damping) = &mut self.damping {
                        damping.copy(bound.nodes[0] as usize);
                    }
                    self.bindings.get_or_insert_default().push(*bound);
                }
            }
        }
        self.follow_nodes();
        Ok(())
    }

    /// What there is for each node beside its state and what its solver keeps.
    fn vectors_mut(&mut self) -> impl Iterator<Item = &mut Vectors> {
        let early = self.early.iter_mut().flatten().map(|early| &mut early.velocities);
        early.chain(&mut self.predicted_velocities).chain(&mut self.applied)
    }

    fn copy_motion(&mut self, source: usize, node: usize) {
        self.state.copy(source, node);
        if let Some(damping) = &mut self.damping {
            damping.copy(source);
        }
        self.integrator.copy_motion(source, node);
    }

    /// A zero vector for each node, with room for those that may come.
    pub fn zeros(&self) -> Result<Vectors> {
        let mut vectors = Vectors::zeros(self.node_count())?;
        vectors.reserve(self.node_room)?;
        Ok(vectors)
    }

    /// Puts bound points where their nodes are.
    pub fn follow_nodes(&mut self) {
        if let Some(bindings) = &self.bindings {
            bindings.follow(self.state.positions_mut());
            bindings.follow(self.state.velocities_mut());
        }
    }
}
