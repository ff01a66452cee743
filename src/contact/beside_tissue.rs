//! Contacts with tools beside contacts of tissue: both act in the same iterations, so that neither undoes the other.
//!
//! The contacts of a body with tools have been found and have acted before those of tissue are known. They go on from there.

use glam::{Vec3, Vec3A};

use super::contacts::Contacts;
use super::impulses::Sweep;
use crate::geometry::Bounds;
use crate::soa::Vectors;

impl Contacts {
    /// Whether a tool touches the body, or may as other tissue moves it.
    pub fn may_press(&self) -> bool {
        !self.nodes.is_empty() || !self.constraints.is_empty()
    }

    /// Shows the nodes that contacts act on. What they have given so far is counted.
    pub fn begin_sweeps(&mut self, mut see: impl FnMut(usize)) {
        for contact in self.nodes.iter_mut() {
            contact.counted = contact.given();
            see(contact.node as usize);
        }
        for constraint in &mut self.constraints {
            constraint.counted = constraint.given();
            constraint.nodes().iter().for_each(|&node| see(node as usize));
        }
    }

    /// One sweep over the contacts, on the velocities of the substep: the most that one of them changed, m/s.
    pub(crate) fn sweep(&mut self, velocities: &mut [Vec3A], sweep: Sweep) -> f32 {
        let of_nodes = self.nodes.sweep(velocities, sweep);
        if self.constraints.is_empty() {
            of_nodes
        } else {
            of_nodes.max(self.presses.sweep(velocities, sweep))
        }
    }

    /// Adds what the sweeps gave to the loads of tools, and shows it, N s, with the nodes that received it. `velocities` are those that they led to.
    pub fn end_sweeps(&mut self, velocities: &[Vec3A], mut give: impl FnMut(usize, Vec3)) {
        if !self.constraints.is_empty() {
            self.presses.hand_over(&mut self.constraints);
        }
        let mut given = Bounds::EMPTY;
        for contact in self.nodes.iter_mut() {
            let impulse = contact.given() - contact.counted;
            if impulse != Vec3::ZERO {
                self.loads[contact.tool].add(-impulse.as_dvec3(), contact.arm);
                given = given.with(velocities[contact.node as usize].into());
                give(contact.node as usize, impulse);
            }
        }
        for constraint in &self.constraints {
            let impulse = constraint.given() - constraint.counted;
            if impulse != Vec3::ZERO {
                self.loads[constraint.tool].add(-impulse.as_dvec3(), constraint.arm);
                for (&node, share) in constraint.nodes().iter().zip(constraint.shares) {
                    given = given.with(velocities[node as usize].into());
                    give(node as usize, impulse * share);
                }
            }
        }
        self.driven.amend(&self.loads);
        if given != Bounds::EMPTY {
            let fastest = given.magnitudes().length();
            self.candidates.spend(self.found_for * fastest);
        }
    }

    /// Moves nodes out of tools that were moved into them as tissue was parted, without giving them speed.
    pub fn keep_out(&self, positions: &mut Vectors) {
        for contact in self.nodes.iter() {
            let lacks = contact.lacks(positions, self.found_for);
            if lacks > 0.0 {
                contact.push_out(positions, lacks);
            }
        }
        for constraint in &self.constraints {
            let lacks = constraint.lacks(positions, self.found_for);
            if lacks > 0.0 {
                constraint.push_out(positions, lacks);
            }
        }
    }
}
