//! Solves the contacts of a slice, and moves what they touch.

use glam::Vec3;

use super::constraint::Constraint;
use super::contacts::Contacts;
use super::features::Feature;
use super::impulses::pushed_out;
use super::meeting::{Meeting, Slice};
use super::node_contacts::NodeContact;

impl Contacts {
    pub(super) fn solve(&mut self, meeting: &mut Meeting, slice: &Slice) {
        if self.constraints.is_empty() {
            self.solve_nodes(meeting, slice);
            return;
        }
        // Edges and faces share nodes: all their contacts are solved together. The other nodes answer each by itself.
        self.presses.list_nodes(&self.constraints);
        for index in 0..self.nodes.len() {
            let contact = *self.nodes.get(index);
            if !self.presses.has(contact.node) {
                continue;
            }
            let geometry = contact.geometry(meeting);
            self.add(
                meeting,
                slice,
                (contact.tool, contact.friction),
                (Feature::node(contact.node), 0),
                Some(geometry),
            );
        }
        let presses = &self.presses;
        self.nodes.retain(|contact| !presses.has(contact.node));
        self.solve_nodes(meeting, slice);
        let first = self
            .presses
            .solve(&mut self.constraints, meeting.velocities, slice.sweeps);
        // Where nothing was given beside what an equation found the nodes are where that has put them.
        let moves = first > 0.0 || self.holds.is_empty();
        for index in 0..self.constraints.len() {
            let constraint = self.constraints[index];
            self.settle(meeting, slice, &constraint, moves);
        }
        if meeting.drifts {
            for constraint in &self.constraints {
                if constraint.depth > 0.0 {
                    let way = pushed_out(meeting.substep) * constraint.depth;
                    constraint.push_out(meeting.next_positions, way);
                    if let Some(tool) = self.presses.yielding.get_mut(constraint.yielding as usize) {
                        constraint.push_back(tool, way);
                    }
                }
            }
            // What an equation that was not solved to the end has let in.
            for index in 0..self.holds.len() {
                let lacks = self.holds.lacks(index, |node| meeting.next_positions.get(node));
                if lacks > 0.0 {
                    self.constraints[index].push_out(meeting.next_positions, lacks as f32);
                }
            }
        }
    }

    /// Solves contacts of nodes alone, each node by itself.
    fn solve_nodes(&mut self, meeting: &mut Meeting, slice: &Slice) {
        self.nodes.solve(meeting.velocities, slice.sweeps);
        for index in 0..self.nodes.len() {
            let contact = *self.nodes.get(index);
            self.settle_node(meeting, slice, &contact);
        }
        if meeting.drifts {
            for contact in self.nodes.iter().filter(|contact| contact.depth > 0.0) {
                contact.push_out(meeting.next_positions, pushed_out(meeting.substep) * contact.depth);
            }
        }
    }

    /// Adds what the contact of a node gave to its tool's load, and moves the node.
    pub(super) fn settle_node(&mut self, meeting: &mut Meeting, slice: &Slice, contact: &NodeContact) {
        if contact.given() == Vec3::ZERO {
            return;
        }
        let received = -contact.given().as_dvec3();
        self.loads[contact.tool].add(received, contact.arm);
        let node = contact.node as usize;
        if let Some(pin) = meeting.pins.get_mut(contact.node) {
            pin.force_sum += received / f64::from(meeting.substep);
        }
        let velocity = meeting.velocities.get(node);
        self.given = self.given.with(velocity);
        if meeting.drifts {
            let held = meeting.pins.partial_axes_of(contact.node);
            let led = meeting.next_positions.get(node);
            let moved = contact.start + velocity * slice.remains;
            meeting.next_positions.set(node, Vec3::select(held, led, moved));
        }
    }

    /// Adds what a contact gave to its tool's load, and moves its nodes.
    pub(super) fn settle(&mut self, meeting: &mut Meeting, slice: &Slice, constraint: &Constraint, moves: bool) {
        let received = -constraint.given().as_dvec3();
        self.loads[constraint.tool].add(received, constraint.arm);
        let supports = constraint.starts.iter().zip(constraint.shares);
        for (&node, (&start, share)) in constraint.nodes().iter().zip(supports) {
            if let Some(pin) = meeting.pins.get_mut(node) {
                pin.force_sum += received * f64::from(share / meeting.substep);
                if !pin.is_partial() {
                    continue;
                }
            }
            let velocity = meeting.velocities.get(node as usize);
            self.given = self.given.with(velocity);
            if meeting.drifts && moves {
                let held = meeting.pins.partial_axes_of(node);
                let led = meeting.next_positions.get(node as usize);
                let moved = start + velocity * slice.remains;
                meeting
                    .next_positions
                    .set(node as usize, Vec3::select(held, led, moved));
            }
        }
    }
}
