//! Solves the contacts of a slice and moves the nodes that they touch.

use glam::Vec3;

use super::constraint::Constraint;
use super::contact_input::{ContactInput, SubSlice};
use super::contacts::Contacts;
use super::features::Feature;
use super::node_contacts::NodeContact;
use super::sweep_control::depth_correction;

impl Contacts {
    pub(super) fn solve(&mut self, input: &mut ContactInput, slice: &SubSlice) {
        if self.constraints.is_empty() {
            self.solve_nodes(input, slice);
            return;
        }
        // Edges and faces share nodes, so their contacts are solved together. Contacts of other nodes are independent.
        self.contact_rows.list_nodes(&self.constraints);
        for index in 0..self.nodes.len() {
            let contact = *self.nodes.get(index);
            if !self.contact_rows.contains(contact.node) {
                continue;
            }
            let geometry = contact.geometry(input);
            self.add(
                input,
                slice,
                (contact.tool, contact.friction),
                (Feature::node(contact.node), 0),
                Some(geometry),
            );
        }
        let contact_rows = &self.contact_rows;
        self.nodes.retain(|contact| !contact_rows.contains(contact.node));
        self.solve_nodes(input, slice);
        let first_change = self
            .contact_rows
            .solve(&mut self.constraints, input.velocities, slice.sweeps);
        // If contacts add nothing to the solved equation, the nodes are already where the equation put them.
        let moves_nodes = first_change > 0.0 || self.multipliers.is_empty();
        for index in 0..self.constraints.len() {
            let constraint = self.constraints[index];
            self.apply_impulse(input, slice, &constraint, moves_nodes);
        }
        if input.drifts {
            for constraint in &self.constraints {
                if constraint.depth > 0.0 {
                    let displacement = depth_correction(input.substep) * constraint.depth;
                    constraint.push_out(input.next_positions, displacement);
                    if let Some(tool) = self
                        .contact_rows
                        .dynamic_tools
                        .get_mut(constraint.dynamic_index as usize)
                    {
                        constraint.push_tool_out(tool, displacement);
                    }
                }
            }
            // Removes penetration that an inexactly solved equation left.
            for index in 0..self.multipliers.len() {
                let missing = self
                    .multipliers
                    .penetration(index, |node| input.next_positions.get(node));
                if missing > 0.0 {
                    self.constraints[index].push_out(input.next_positions, missing as f32);
                }
            }
        }
    }

    /// Solves contacts of single nodes independently.
    fn solve_nodes(&mut self, input: &mut ContactInput, slice: &SubSlice) {
        self.nodes.solve(input.velocities, slice.sweeps);
        for index in 0..self.nodes.len() {
            let contact = *self.nodes.get(index);
            self.apply_node_impulse(input, slice, &contact);
        }
        if input.drifts {
            for contact in self.nodes.iter().filter(|contact| contact.depth > 0.0) {
                contact.push_out(input.next_positions, depth_correction(input.substep) * contact.depth);
            }
        }
    }

    /// Adds the impulse of a node contact to its tool's load, and moves the node.
    pub(super) fn apply_node_impulse(&mut self, input: &mut ContactInput, slice: &SubSlice, contact: &NodeContact) {
        if contact.total_impulse() == Vec3::ZERO {
            return;
        }
        let received = -contact.total_impulse().as_dvec3();
        self.loads[contact.tool].add(received, contact.arm);
        let node = contact.node as usize;
        if let Some(pin) = input.pins.get_mut(contact.node) {
            pin.force_sum += received / f64::from(input.substep);
        }
        let velocity = input.velocities.get(node);
        self.velocity_bounds = self.velocity_bounds.with(velocity);
        if input.drifts {
            let held = input.pins.partial_axes_of(contact.node);
            let prescribed = input.next_positions.get(node);
            let moved = contact.start + velocity * slice.time_left;
            input.next_positions.set(node, Vec3::select(held, prescribed, moved));
        }
    }

    /// Adds the impulse of a contact to its tool's load, and moves its nodes.
    pub(super) fn apply_impulse(
        &mut self,
        input: &mut ContactInput,
        slice: &SubSlice,
        constraint: &Constraint,
        moves_nodes: bool,
    ) {
        let received = -constraint.total_impulse().as_dvec3();
        self.loads[constraint.tool].add(received, constraint.arm);
        let starts_and_shares = constraint.starts.iter().zip(constraint.shares);
        for (&node, (&start, share)) in constraint.nodes().iter().zip(starts_and_shares) {
            if let Some(pin) = input.pins.get_mut(node) {
                pin.force_sum += received * f64::from(share / input.substep);
                if !pin.is_partial() {
                    continue;
                }
            }
            let velocity = input.velocities.get(node as usize);
            self.velocity_bounds = self.velocity_bounds.with(velocity);
            if input.drifts && moves_nodes {
                let held = input.pins.partial_axes_of(node);
                let prescribed = input.next_positions.get(node as usize);
                let moved = start + velocity * slice.time_left;
                input
                    .next_positions
                    .set(node as usize, Vec3::select(held, prescribed, moved));
            }
        }
    }
}
