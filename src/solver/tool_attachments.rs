//! Tissue attached to tools: nodes that move rigidly with a tool, and the wrench that this takes. A point of the
//! surface is attached by the corners of its triangle, and a bound corner by the nodes that it is bound to.
//!
//! An attached node is a pin, so that every solver holds it exactly. The reaction on the tool is the force on the pin
//! plus the inertia and the damping of the node.

mod motion;

use std::fmt::Display;

use glam::{DVec3, Vec3};

use super::deferred_half_kick::flush_half_kick;
use super::{Changed, System};
use crate::base::{Error, Result, SlotId, StateHasher, ensure, memory};
use crate::codec::saved;
use crate::nodes::Pins;

use motion::HeldMotion;
pub(super) use motion::ReactionInterval;

/// An attachment of a body to a tool: a node, or a point on a triangle with its corners.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ToolAttachment {
    /// The id of the attachment in the world.
    pub id: SlotId,
    /// The index of the tool in the world.
    tool: usize,
    nodes: [u32; MAX_NODES],
    /// The weight of each node; 0 for unused entries.
    weights: [f32; MAX_NODES],
    /// The mean force over a step at which the attachment breaks, N.
    limit: f32,
    /// The force of the tool on the tissue, mean over the last step, N.
    pub force: Vec3,
}

saved! { ToolAttachment { id, tool, nodes, weights, limit, force } }

/// The maximum number of nodes of an attachment: the corners of a triangle are bound to nodes of one cell.
const MAX_NODES: usize = 4;

/// A node that moves with a tool.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AttachedNode {
    node: u32,
    /// The index of the tool in the world.
    pub tool: usize,
    /// The sum of the weights of its attachments in fixed point, so that adding and removing is exact.
    weight_sum: u64,
    /// Its position in the tool frame, m. `None`: its position at the start of the next step.
    offset: Option<DVec3>,
    /// The force and the torque about the tool's position, mean over the last step (N, N m).
    pub force: Vec3,
    pub torque: Vec3,
    /// The velocity change at the last substep, m/s.
    velocity_change: Vec3,
    motion: HeldMotion,
}

saved! { AttachedNode { node, tool, weight_sum, offset, force, torque, velocity_change, motion } }

/// Units per weight of 1 in fixed point.
const WEIGHT_UNITS: f64 = (1_u64 << 40) as f64;

/// Converts a positive weight to fixed point, at least one unit.
fn weight_units(weight: f32) -> u64 {
    ((f64::from(weight) * WEIGHT_UNITS) as u64).max(1)
}

/// A point to attach: corners and their weights. A corner with weight 0 stays free.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AttachPoint {
    pub corners: [u32; 3],
    pub weights: [f32; 3],
}

/// All tool attachments of a body.
#[derive(Debug, Default)]
pub(crate) struct ToolAttachments {
    /// Sorted by id.
    attachments: Vec<ToolAttachment>,
    /// Sorted by node.
    nodes: Vec<AttachedNode>,
}

saved! { ToolAttachments { attachments, nodes } }

impl AttachPoint {
    /// Attaches a single node.
    pub fn of_node(node: u32) -> Self {
        Self {
            corners: [node; 3],
            weights: [1.0, 0.0, 0.0],
        }
    }

    /// The corners with positive weights.
    fn attached(self) -> impl Iterator<Item = (u32, f32)> {
        let corners = self.corners.into_iter().zip(self.weights);
        corners.filter(|(_, weight)| *weight > 0.0)
    }
}

impl ToolAttachments {
    /// Finds an attachment by id.
    pub fn get(&self, id: SlotId) -> Option<&ToolAttachment> {
        let index = self.attachments.binary_search_by_key(&id, |attachment| attachment.id);
        index.ok().map(|index| &self.attachments[index])
    }

    /// True if the reported sums are finite.
    pub fn sums_fit(&self, fits: impl Fn(DVec3) -> bool) -> bool {
        let fit = |motion: &HeldMotion| fits(motion.force_sum) && fits(motion.torque_sum);
        self.nodes.iter().all(|attached| fit(&attached.motion))
    }

    pub fn hash(&self, hasher: &mut StateHasher) {
        for attached in &self.nodes {
            hasher.write_u64(u64::from(attached.node) << 32 | attached.tool as u64);
            hasher.write_u64(u64::from(attached.offset.is_some()));
            hasher.write_doubles(&attached.offset.unwrap_or_default().to_array());
            hasher.write_floats(&attached.velocity_change.to_array());
        }
        for attachment in &self.attachments {
            attachment.nodes.iter().for_each(|&node| hasher.write_u64(node.into()));
            hasher.write_floats(&attachment.weights);
            hasher.write_floats(&[attachment.limit]);
        }
    }

    fn index_of(&self, node: u32) -> std::result::Result<usize, usize> {
        self.nodes.binary_search_by_key(&node, |attached| attached.node)
    }

    /// The attached nodes in the body's own numbering, with the index of their tool.
    pub fn attached_nodes(&self) -> impl Iterator<Item = (usize, usize)> {
        self.nodes
            .iter()
            .map(|attached| (attached.node as usize, attached.tool))
    }

    fn get_node(&self, node: u32) -> Option<&AttachedNode> {
        self.index_of(node).ok().map(|index| &self.nodes[index])
    }

    /// Distributes the forces on nodes to the attachments by weight.
    fn distribute_forces(&mut self) {
        let Self { attachments, nodes } = self;
        for attachment in attachments {
            attachment.force = Vec3::ZERO;
            for (node, weight) in attachment.attached() {
                if let Ok(index) = nodes.binary_search_by_key(&node, |attached| attached.node) {
                    let share = weight_units(weight) as f64 / nodes[index].weight_sum as f64;
                    attachment.force += nodes[index].force * share as f32;
                }
            }
        }
    }
}

impl ToolAttachment {
    /// The attached nodes with their weights.
    fn attached(&self) -> impl Iterator<Item = (u32, f32)> + use<> {
        let nodes = self.nodes.into_iter().zip(self.weights);
        nodes.filter(|(_, weight)| *weight > 0.0)
    }
}

impl System {
    /// The nodes that are attached to tools.
    pub(crate) fn attached_nodes(&self) -> impl Iterator<Item = &AttachedNode> {
        self.tool_attachments
            .iter()
            .flat_map(|tool_attachments| &tool_attachments.nodes)
    }

    /// The mean force and torque on the attached nodes of a tool, in an attempted step with this number of substeps (N,
    /// N m).
    pub(crate) fn attachment_wrench(&self, tool: usize, substeps: u32) -> [DVec3; 2] {
        let attached = self.attached_nodes().filter(|attached| attached.tool == tool);
        let sums = attached.map(|attached| [attached.motion.force_sum, attached.motion.torque_sum]);
        let sum = sums.fold([DVec3::ZERO; 2], |all, one| [all[0] + one[0], all[1] + one[1]]);
        sum.map(|sum| sum / f64::from(substeps))
    }

    /// True if something is attached to the tool.
    pub(crate) fn has_attachments_to(&self, tool: usize) -> bool {
        self.attached_nodes().any(|attached| attached.tool == tool)
    }

    /// True if something is attached to any tool.
    pub(crate) fn has_tool_attachments(&self) -> bool {
        self.attached_nodes().next().is_some()
    }

    /// Returns an error if the existing `node` cannot be attached to the tool.
    pub(crate) fn check_attachable(&self, name: &dyn Display, node: u32, tool: usize) -> Result<()> {
        let own = self.order.own(node);
        match self.bindings.as_ref().and_then(|bindings| bindings.get(own)) {
            Some(bound) => bound.weighted_nodes().try_for_each(|(node, _)| {
                let name = format_args!("{name} is bound to a node that");
                self.check_node_attachable(&name, node, tool)
            }),
            None => self.check_node_attachable(name, own, tool),
        }
    }

    fn check_node_attachable(&self, name: &dyn Display, own: u32, tool: usize) -> Result<()> {
        let node = self.order.caller(own);
        match self
            .tool_attachments
            .as_ref()
            .and_then(|tool_attachments| tool_attachments.get_node(own))
        {
            Some(attached) if attached.tool == tool => Ok(()),
            Some(_) => Err(Error::invalid(format!("{name} is {node}: another tool holds it"))),
            None if self.pins.get(own).is_some() => Err(Error::invalid(format!(
                "{name} is {node}: it is pinned, and stays where its pin leads it"
            ))),
            None => Ok(()),
        }
    }

    /// Returns an error if the node is attached to a tool.
    pub(crate) fn check_not_attached(&self, name: &dyn Display, node: u32) -> Result<()> {
        ensure!(
            !self.is_attached_node(self.order.own(node)),
            "{name} is {node}: a tool holds it"
        );
        Ok(())
    }

    /// True if one of the body's own nodes is attached to a tool.
    pub(crate) fn is_attached_node(&self, own: u32) -> bool {
        self.tool_attachments
            .as_ref()
            .is_some_and(|tool_attachments| tool_attachments.index_of(own).is_ok())
    }

    /// Reserves memory for `count` more attachments.
    pub(crate) fn reserve_tool_attachments(&mut self, count: usize) -> Result<()> {
        let nodes = count.saturating_mul(MAX_NODES).min(self.masses.len());
        self.pins.reserve(nodes, self.masses.len())?;
        if let Some(contacts) = &mut self.contacts {
            contacts.reserve_attached(nodes)?;
        }
        if let Some(tool_attachments) = &mut self.tool_attachments {
            tool_attachments.attachments.try_reserve(count)?;
            tool_attachments.nodes.try_reserve(nodes)?;
            return Ok(());
        }
        let tool_attachments = ToolAttachments {
            attachments: memory::reserved(count)?,
            nodes: memory::reserved(nodes)?,
        };
        self.tool_attachments = Some(memory::boxed(tool_attachments)?);
        Ok(())
    }

    /// Frees the memory of attachments if there are none.
    pub(crate) fn release_unused_attachments(&mut self) {
        self.tool_attachments
            .take_if(|tool_attachments| tool_attachments.attachments.is_empty());
    }

    /// Attaches points to a tool under the given ids. Memory must be reserved, and the nodes must be attachable.
    pub(crate) fn attach_to_tool(
        &mut self,
        tool: usize,
        points: impl ExactSizeIterator<Item = (SlotId, AttachPoint)>,
        limit: f32,
    ) -> Result<()> {
        let mut added = memory::reserved(points.len())?;
        let mut nodes = memory::reserved(MAX_NODES * points.len())?;
        for (id, point) in points {
            let (attached, weights) = self.nodes_and_weights(point);
            let attachment = ToolAttachment {
                id,
                tool,
                nodes: attached,
                weights,
                limit: if limit > 0.0 { limit } else { f32::INFINITY },
                force: Vec3::ZERO,
            };
            nodes.extend(attachment.attached().map(|(node, _)| node));
            added.push(attachment);
        }
        let Some(tool_attachments) = &mut self.tool_attachments else {
            return Ok(());
        };
        added.sort_unstable_by_key(|attachment| attachment.id);
        memory::sort_once(&mut nodes);
        nodes.retain(|&node| tool_attachments.index_of(node).is_err());
        let mut attached = memory::reserved(nodes.len())?;
        let untouched = memory::collected(nodes.iter().map(|&node| (node, tool)))?;
        let pins = Pins::for_nodes(&nodes)?;
        // Nothing fails from here on.
        flush_half_kick(self);
        // The damping must be that of unscaled masses.
        self.scale_masses(0.0);
        self.pins.hold_all(&pins);
        for &node in &nodes {
            let velocity_change = self
                .integrator
                .solution()
                .map(|solution| solution.velocity_change(node as usize));
            attached.push(AttachedNode {
                node,
                tool,
                weight_sum: 0,
                offset: None,
                force: Vec3::ZERO,
                torque: Vec3::ZERO,
                velocity_change: velocity_change.unwrap_or_default(),
                motion: HeldMotion::default(),
            });
            self.inverse_masses[node as usize] = 0.0;
            if let Some(applied) = &mut self.applied {
                applied.set(node as usize, Vec3::ZERO);
            }
        }
        if let Some(contacts) = &mut self.contacts {
            contacts.attach_nodes(&untouched);
        }
        if let Some(tool_attachments) = &mut self.tool_attachments {
            memory::merge(&mut tool_attachments.nodes, &attached, |attached| attached.node);
            for (node, weight) in added.iter().flat_map(ToolAttachment::attached) {
                if let Ok(index) = tool_attachments.index_of(node) {
                    tool_attachments.nodes[index].weight_sum += weight_units(weight);
                }
            }
            memory::merge(&mut tool_attachments.attachments, &added, |attachment| attachment.id);
        }
        self.update_attached();
        Ok(())
    }

    /// The nodes that carry an attachment, in the body's own numbering, with their weights.
    fn nodes_and_weights(&self, point: AttachPoint) -> ([u32; MAX_NODES], [f32; MAX_NODES]) {
        let own = |corner: u32| self.order.own(corner);
        let Some(bindings) = &self.bindings else {
            let [a, b, c] = point.corners.map(own);
            let [weight_a, weight_b, weight_c] = point.weights;
            return ([a, b, c, a], [weight_a, weight_b, weight_c, 0.0]);
        };
        let (mut nodes, mut weights) = ([own(point.corners[0]); MAX_NODES], [0.0; MAX_NODES]);
        let mut count = 0;
        for (corner, weight) in point.attached() {
            for (node, part) in bindings.weighted_nodes(own(corner)) {
                let existing = nodes[..count].iter().position(|&existing| existing == node);
                let index = existing.unwrap_or(count.min(MAX_NODES - 1));
                count = count.max(index + 1);
                nodes[index] = node;
                weights[index] += weight * part;
            }
        }
        (nodes, weights)
    }

    /// Removes an attachment.
    pub(crate) fn detach(&mut self, id: SlotId) {
        self.detach_where(|attachment| attachment.id == id, |_| ());
        self.release_unused_attachments();
    }

    /// Removes all attachments of a tool.
    pub(crate) fn detach_tool(&mut self, tool: usize) {
        self.detach_where(|attachment| attachment.tool == tool, |_| ());
        self.release_unused_attachments();
    }

    /// Removes the attachments whose force limit was exceeded in the last step and passes their ids to `visit`.
    /// Allocates no memory.
    pub(crate) fn break_overloaded(&mut self, visit: impl FnMut(SlotId)) {
        self.detach_where(|attachment| attachment.force.length() > attachment.limit, visit);
    }

    fn detach_where(&mut self, is_removed: impl Fn(&ToolAttachment) -> bool, mut visit: impl FnMut(SlotId)) {
        if !self
            .tool_attachments
            .iter()
            .flat_map(|tool_attachments| &tool_attachments.attachments)
            .any(&is_removed)
        {
            return;
        }
        flush_half_kick(self);
        let Some(tool_attachments) = &mut self.tool_attachments else {
            return;
        };
        let (pins, contacts) = (&mut self.pins, &mut self.contacts);
        let (masses, inverse_masses) = (&self.masses, &mut self.inverse_masses);
        let ToolAttachments { attachments, nodes } = &mut **tool_attachments;
        attachments.retain(|attachment| {
            let remains = !is_removed(attachment);
            if !remains {
                for (node, weight) in attachment.attached() {
                    if let Ok(index) = nodes.binary_search_by_key(&node, |attached| attached.node) {
                        nodes[index].weight_sum -= weight_units(weight);
                    }
                }
                visit(attachment.id);
            }
            remains
        });
        let is_detached = |node: u32| {
            let index = nodes.binary_search_by_key(&node, |attached| attached.node);
            index.is_ok_and(|index| nodes[index].weight_sum == 0)
        };
        pins.retain(|node| !is_detached(node));
        if let Some(contacts) = contacts {
            contacts.retain_attached(|node| !is_detached(node));
        }
        nodes.retain(|attached| {
            let remains = attached.weight_sum > 0;
            if !remains {
                inverse_masses[attached.node as usize] = 1.0 / masses[attached.node as usize];
            }
            remains
        });
        self.update_attached();
    }

    /// Updates masses and caches after attachments have changed.
    fn update_attached(&mut self) {
        self.scale_masses(self.carry.scaling_substep);
        self.changed(Changed::Masses);
    }
}
