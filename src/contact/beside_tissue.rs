//! Iterates contacts with tools together with contacts of tissue, so that neither undoes the other.
//!
//! Contacts with tools have been found and solved before contacts of tissue are known. The common iterations continue
//! from there.

use glam::{Vec3, Vec3A};

use super::contacts::Contacts;
use super::sweep_control::PgsPass;
use crate::geometry::Aabb;
use crate::soa::Vectors;

impl Contacts {
    /// True if a tool touches the body, or may touch it as other tissue moves the body.
    pub fn may_touch(&self) -> bool {
        !self.nodes.is_empty() || !self.constraints.is_empty()
    }

    /// Begins the common sweeps. Visits the nodes that contacts act on, and stores the impulses that are already
    /// counted.
    pub fn begin_sweeps(&mut self, mut visit: impl FnMut(usize)) {
        for contact in self.nodes.iter_mut() {
            contact.counted_impulse = contact.total_impulse();
            visit(contact.node as usize);
        }
        for constraint in &mut self.constraints {
            constraint.counted_impulse = constraint.total_impulse();
            constraint.nodes().iter().for_each(|&node| visit(node as usize));
        }
    }

    /// Sweeps once over the contacts, with the velocities of the substep. Returns the largest velocity change, m/s.
    pub(crate) fn sweep(&mut self, velocities: &mut [Vec3A], sweep: PgsPass) -> f32 {
        let node_change = self.nodes.sweep(velocities, sweep);
        if self.constraints.is_empty() {
            node_change
        } else {
            node_change.max(self.contact_rows.sweep(velocities, sweep))
        }
    }

    /// Adds the impulses of the sweeps to the loads of the tools. `visit_impulse` receives each node and its impulse, N
    /// s. `velocities` are those after the sweeps.
    pub fn end_sweeps(&mut self, velocities: &[Vec3A], mut visit_impulse: impl FnMut(usize, Vec3)) {
        if !self.constraints.is_empty() {
            self.contact_rows.store_impulses(&mut self.constraints);
        }
        let mut bounds = Aabb::EMPTY;
        for contact in self.nodes.iter_mut() {
            let impulse = contact.total_impulse() - contact.counted_impulse;
            if impulse != Vec3::ZERO {
                self.loads[contact.tool].add(-impulse.as_dvec3(), contact.arm);
                bounds = bounds.with(velocities[contact.node as usize].into());
                visit_impulse(contact.node as usize, impulse);
            }
        }
        for constraint in &self.constraints {
            let impulse = constraint.total_impulse() - constraint.counted_impulse;
            if impulse != Vec3::ZERO {
                self.loads[constraint.tool].add(-impulse.as_dvec3(), constraint.arm);
                for (&node, share) in constraint.nodes().iter().zip(constraint.shares) {
                    bounds = bounds.with(velocities[node as usize].into());
                    visit_impulse(node as usize, impulse * share);
                }
            }
        }
        self.dynamic_tools.correct(&self.loads);
        if bounds != Aabb::EMPTY {
            let fastest = bounds.magnitudes().length();
            self.candidates.spend_slack(self.slice_duration * fastest);
        }
    }

    /// Moves nodes out of tools after the separation of tissue has moved them in. Velocities do not change.
    pub fn push_nodes_out(&self, positions: &mut Vectors) {
        for contact in self.nodes.iter() {
            let missing = contact.missing_distance(positions, self.slice_duration);
            if missing > 0.0 {
                contact.push_out(positions, missing);
            }
        }
        for constraint in &self.constraints {
            let missing = constraint.missing_distance(positions, self.slice_duration);
            if missing > 0.0 {
                constraint.push_out(positions, missing);
            }
        }
    }
}
