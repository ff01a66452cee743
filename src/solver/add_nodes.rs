//! Nodes that cuts add to a body. Their memory is reserved in advance, so that adding a node moves no data.

use super::System;
use crate::base::{Error, Result, memory};
use crate::nodes::NewNode;
use crate::soa::{PerNode, Vectors};
use crate::springs::Rewiring;

impl System {
    /// Reserves memory for `more` additional nodes.
    pub fn reserve_added_nodes(&mut self, more: usize) -> Result<()> {
        let count = self.node_count().checked_add(more).ok_or(Error::OutOfMemory)?;
        self.reserve_nodes(count)?;
        let triangles = self.surface.len() + 2 * more;
        memory::reserve(&mut self.surface, triangles)?;
        self.hide_pre_kick_velocities();
        self.node_capacity = count;
        let node_count = self.node_count();
        self.bindings.get_or_insert_default().reserve(more, node_count)
    }

    /// Changes springs between existing nodes and reserves solver memory for them and for `pairs` node pairs of
    /// elements. Changes nothing on failure.
    pub fn rewire(&mut self, rewiring: &Rewiring, pairs: usize) -> Result<()> {
        self.integrator
            .prepare_cut(&self.forces, rewiring.added.len() + pairs)?;
        self.forces.springs.rewire(rewiring)
    }

    /// Appends nodes in the body's own numbering. Their memory must be reserved.
    pub fn add_nodes(&mut self, nodes: &[NewNode]) {
        let node_count = self.node_count();
        self.wake();
        self.grow(node_count + nodes.len());
        self.hide_pre_kick_velocities();
        // Nodes now differ in mass.
        self.uniform_inverse_mass = None;
        if let Some(scaling) = &mut self.scaling {
            scaling.uniform_inverse_mass = None;
        }
        for (node, new) in (node_count..).zip(nodes) {
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
        self.update_bound_points();
    }

    fn copy_motion(&mut self, source: usize, node: usize) {
        self.state.copy(source, node);
        if let Some(damping) = &mut self.damping {
            damping.copy(source, node);
        }
        self.integrator.copy_motion(source, node);
    }

    /// A zero vector for each node, with capacity for nodes that may be added.
    pub fn zeros(&self) -> Result<Vectors> {
        let mut vectors = Vectors::zeros(self.node_count())?;
        vectors.reserve_nodes(self.node_capacity)?;
        Ok(vectors)
    }

    /// Moves bound points to their nodes.
    pub fn update_bound_points(&mut self) {
        if let Some(bindings) = &self.bindings {
            bindings.update_points(self.state.positions_mut());
            bindings.update_points(self.state.velocities_mut());
        }
    }
}
