//! Pins of several nodes at once. An error changes none of them.

use glam::Vec3;

use super::Body;
#[cfg(doc)]
use crate::base::Error;
use crate::base::{Result, ensure, memory};
use crate::def::finite_vector;

impl Body {
    /// Holds nodes at their positions from now on, as [`Body::pin`] does for one node.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: there is no such node, a tool holds it, or it is a point that is bound to nodes.
    /// [`Error::OutOfMemory`]. An error changes no node.
    pub fn pin_nodes(&mut self, nodes: &[u32]) -> Result<()> {
        self.check_all_pinnable(nodes)?;
        self.system.pins.reserve(nodes.len(), self.node_count())?;
        nodes.iter().try_for_each(|&node| self.pin(node))
    }

    /// Releases nodes along all axes, as [`Body::unpin`] does for one node.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: there is no such node, a tool holds it, or it has no mass. An error changes no node.
    pub fn unpin_nodes(&mut self, nodes: &[u32]) -> Result<()> {
        self.check_all_pinnable(nodes)?;
        for &node in nodes {
            self.mass_to_unpin(node)?;
        }
        nodes.iter().try_for_each(|&node| self.unpin(node))
    }

    /// Holds all nodes in a closed box at their positions, m. Returns the number of nodes in the box that are then
    /// held. Points that are bound to nodes do not count.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: a corner is not finite, `min` is above `max` along an axis, or a tool holds a node
    /// in the box. [`Error::OutOfMemory`]. An error changes no node.
    pub fn pin_box(&mut self, min: Vec3, max: Vec3) -> Result<usize> {
        let nodes = self.pinnable_nodes_in(min, max)?;
        self.pin_nodes(&nodes)?;
        Ok(nodes.len())
    }

    /// Releases all pinned nodes with mass in a closed box, m. Returns their number.
    ///
    /// # Errors
    /// As [`Body::pin_box`].
    pub fn unpin_box(&mut self, min: Vec3, max: Vec3) -> Result<usize> {
        let mut nodes = self.pinnable_nodes_in(min, max)?;
        nodes.retain(|&node| {
            let own = self.system.order.own(node);
            self.system.pins.get(own).is_some() && self.system.masses[own as usize] > 0.0
        });
        self.unpin_nodes(&nodes)?;
        Ok(nodes.len())
    }

    /// Writes the force that holds each node, N, averaged over the last step, as [`Body::pin_force`]. It is 0 for nodes
    /// that are not pinned or that a tool holds.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: the length of `forces` is not the number of nodes.
    pub fn pin_forces(&self, forces: &mut [Vec3]) -> Result<()> {
        crate::def::expect_count("forces", forces.len(), self.node_count())?;
        forces.fill(Vec3::ZERO);
        let pins = self.system.pins.iter();
        for pin in pins.filter(|pin| !self.system.is_attached_node(pin.node)) {
            let node = self.system.order.caller(pin.node);
            forces[node as usize] = self.pin_force(node)?;
        }
        Ok(())
    }

    /// Refuses nodes that do not exist, are bound to others, or are held by a tool.
    fn check_all_pinnable(&self, nodes: &[u32]) -> Result<()> {
        let mut indexed = nodes.iter().enumerate();
        indexed.try_for_each(|(index, &node)| self.check_pinnable(&format_args!("nodes[{index}]"), node))
    }

    /// Refuses a node that does not exist, is bound to others, or is held by a tool.
    pub(super) fn check_pinnable(&self, name: &dyn std::fmt::Display, node: u32) -> Result<()> {
        self.check_node(name, node)?;
        self.check_not_bound(name, node)?;
        self.system.check_not_attached(name, node)
    }

    /// The nodes in a box that a pin can hold.
    fn pinnable_nodes_in(&self, min: Vec3, max: Vec3) -> Result<Vec<u32>> {
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
