//! Pins of several nodes at once: all of them, or none where a call is refused.

use glam::Vec3;

use super::Body;
#[cfg(doc)]
use crate::base::Error;
use crate::base::{Result, ensure, memory};
use crate::def::finite_vector;

impl Body {
    /// Holds nodes where they are, from now on, as [`Body::pin`] holds one.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: there is no such node, a tool holds it, or it is a point that is bound to nodes.
    /// [`Error::OutOfMemory`]. Then no node has changed.
    pub fn pin_nodes(&mut self, nodes: &[u32]) -> Result<()> {
        self.check_all_free_to_pin(nodes)?;
        self.system.pins.reserve(nodes.len(), self.node_count())?;
        nodes.iter().try_for_each(|&node| self.pin(node))
    }

    /// Lets go of nodes along all axes, as [`Body::unpin`] does of one.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: there is no such node, a tool holds it, or it has no mass. Then no node has changed.
    pub fn unpin_nodes(&mut self, nodes: &[u32]) -> Result<()> {
        self.check_all_free_to_pin(nodes)?;
        for &node in nodes {
            self.mass_of_unpinned(node)?;
        }
        nodes.iter().try_for_each(|&node| self.unpin(node))
    }

    /// Holds all nodes in a box, m, its sides included, where they are. Returns how many nodes of the box are held
    /// then. Points that are bound to nodes do not count.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: a corner is not finite, `min` is above `max` along an axis, or a tool holds a node
    /// of the box. [`Error::OutOfMemory`]. Then no node has changed.
    pub fn pin_box(&mut self, min: Vec3, max: Vec3) -> Result<usize> {
        let nodes = self.nodes_in(min, max)?;
        self.pin_nodes(&nodes)?;
        Ok(nodes.len())
    }

    /// Lets go of all pinned nodes in a box, m, its sides included, but of those without mass. Returns how many.
    ///
    /// # Errors
    /// As [`Body::pin_box`].
    pub fn unpin_box(&mut self, min: Vec3, max: Vec3) -> Result<usize> {
        let mut nodes = self.nodes_in(min, max)?;
        nodes.retain(|&node| {
            let own = self.system.order.own(node);
            self.system.pins.get(own).is_some() && self.system.masses[own as usize] > 0.0
        });
        self.unpin_nodes(&nodes)?;
        Ok(nodes.len())
    }

    /// What holds each node against its springs and its weight, N, mean over the last step: as [`Body::pin_force`],
    /// and 0 of nodes that are not pinned or that a tool holds.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: not one place for each node.
    pub fn pin_forces(&self, forces: &mut [Vec3]) -> Result<()> {
        crate::def::expect_count("forces", forces.len(), self.node_count())?;
        forces.fill(Vec3::ZERO);
        let pins = self.system.pins.iter();
        for pin in pins.filter(|pin| !self.system.is_held_by_tool(pin.node)) {
            let node = self.system.order.caller(pin.node);
            forces[node as usize] = self.pin_force(node)?;
        }
        Ok(())
    }

    /// Refuses nodes that are none, that a tool holds, or that are bound to others.
    fn check_all_free_to_pin(&self, nodes: &[u32]) -> Result<()> {
        let mut named = nodes.iter().enumerate();
        named.try_for_each(|(index, &node)| self.check_free_to_pin(&format_args!("nodes[{index}]"), node))
    }

    /// Refuses a node that is not there, is bound, or that a tool holds.
    pub(super) fn check_free_to_pin(&self, name: &dyn std::fmt::Display, node: u32) -> Result<()> {
        self.check_node(name, node)?;
        self.check_not_bound(name, node)?;
        self.system.check_not_held(name, node)
    }

    /// The nodes in a box that a pin can hold.
    fn nodes_in(&self, min: Vec3, max: Vec3) -> Result<Vec<u32>> {
        finite_vector("min", min)?;
        finite_vector("max", max)?;
        ensure!(
            min.cmple(max).all(),
            "min is {min}: must be at most max, which is {max}, along each axis"
        );
        let is_within = |position: &Vec3| min.cmple(*position).all() && position.cmple(max).all();
        let nodes = (0..).zip(self.positions());
        let within = nodes.filter(|&(node, position)| is_within(position) && !self.is_bound(node));
        memory::gathered(within.map(|(node, _)| node))
    }
}
