//! Nodes that come after a body was made, as cuts make them: room for them is made at the door, so that adding one moves nothing.

use super::System;
use crate::base::{Error, Result, memory};
use crate::nodes::NewNode;
use crate::soa::{PerNode, Vectors};
use crate::springs::Rewiring;

impl System {
    /// Makes room for so many nodes more than there are.
    pub fn make_room(&mut self, more: usize) -> Result<()> {
        let count = self.node_count().checked_add(more).ok_or(Error::OutOfMemory)?;
        self.reserve_nodes(count)?;
        let triangles = self.surface.len() + 2 * more;
        memory::reserve(&mut self.surface, triangles)?;
        self.forget_early();
        self.node_room = count;
        let known = self.node_count();
        self.bindings.get_or_insert_default().reserve(more, known)
    }

    /// Changes springs, of which there are nodes already, and what a solver knows of them and so many pairs of nodes of elements more. Changes
    /// nothing where it fails.
    pub fn rewire(&mut self, rewiring: &Rewiring, pairs: usize) -> Result<()> {
        self.integrator
            .prepare_cut(&self.forces, rewiring.added.len() + pairs)?;
        self.forces.springs.rewire(rewiring)
    }

    /// Adds nodes, for which there is room, in their own numbers: they follow those that there are.
    pub fn add_nodes(&mut self, nodes: &[NewNode]) {
        let known = self.node_count();
        self.wake();
        self.grow(known + nodes.len());
        self.forget_early();
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
                        damping.copy(bound.nodes[0] as usize, node);
                    }
                    self.bindings.get_or_insert_default().push(*bound);
                }
            }
        }
        self.follow_nodes();
    }

    fn copy_motion(&mut self, source: usize, node: usize) {
        self.state.copy(source, node);
        if let Some(damping) = &mut self.damping {
            damping.copy(source, node);
        }
        self.integrator.copy_motion(source, node);
    }

    /// A zero vector for each node, with room for those that may come.
    pub fn zeros(&self) -> Result<Vectors> {
        let mut vectors = Vectors::zeros(self.node_count())?;
        vectors.reserve_nodes(self.node_room)?;
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
