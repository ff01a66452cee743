//! Contact forces by other tissue in the equations of implicit bodies.
//!
//! Impulses between bodies are solved after the equations of the bodies. Without contact forces in its equation, a body
//! would relax for a substep before the next impulse, and the nodes in contact would carry too little force. Therefore
//! each equation includes the contact impulses of the last substep as forces. Afterwards their effect is removed from
//! the nodes, and the contact solver applies new impulses: about the same for lasting contacts, none for open ones.
//! This conserves momentum.

use glam::Vec3;

use super::solution::{History, Solution};
use crate::codec::saved;
use crate::soa::Vectors;

/// Contact forces on the nodes of a body.
#[derive(Debug)]
pub(super) struct ContactForces {
    /// N; 0 for a pinned node.
    forces: Vectors,
    /// True if there are any forces.
    is_active: bool,
}

saved! { ContactForces { forces, is_active } }

impl ContactForces {
    /// Removes all forces.
    pub fn forget(&mut self) {
        if self.is_active {
            self.forces.clear();
            self.is_active = false;
        }
    }
}

impl History {
    /// All arrays with one entry per node. NEWTON has no remainders here.
    pub(super) fn vectors_mut(&mut self, is_exact: bool) -> impl Iterator<Item = &mut Vectors> {
        let forces = self
            .contact_forces
            .as_mut()
            .map(|contact_forces| &mut contact_forces.forces);
        let remainders = Some(&mut self.remainders).filter(|_| !is_exact);
        [&mut self.displacements, &mut self.velocity_changes]
            .into_iter()
            .chain(remainders)
            .chain(forces)
    }

    /// True if the arrays belong to this number of nodes.
    pub(super) fn is_sound(&self, count: usize) -> bool {
        let forces = self
            .contact_forces
            .as_ref()
            .map(|contact_forces| &contact_forces.forces);
        [&self.displacements, &self.velocity_changes]
            .into_iter()
            .chain(forces)
            .all(|vectors| vectors.len() == count)
    }

    /// The forces, if there are any, N.
    pub(super) fn active_contact_forces(&self) -> Option<&Vectors> {
        let contact_forces = self
            .contact_forces
            .as_ref()
            .filter(|contact_forces| contact_forces.is_active)?;
        Some(&contact_forces.forces)
    }
}

impl Solution {
    /// Enables contact forces, which are zero at first.
    pub fn enable_contact_forces(&mut self, zeros: [Vectors; 2]) {
        for (history, forces) in self.histories.iter_mut().zip(zeros) {
            history.contact_forces.get_or_insert(ContactForces {
                forces,
                is_active: false,
            });
        }
    }

    /// Starts a substep with the contact forces of the last one, or without forces if the body is stepped alone.
    pub(super) fn begin_contact_forces(&mut self, is_first: bool, is_coupled: bool) {
        let [current, next] = self.current_and_next();
        let Some(contact_forces) = &mut next.contact_forces else {
            return;
        };
        if !is_coupled {
            contact_forces.forget();
        } else if is_first {
            contact_forces.forget();
            if let Some(forces) = current.active_contact_forces() {
                contact_forces.forces.copy_from(forces);
                contact_forces.is_active = true;
            }
        }
    }

    /// Removes the effect of the contact forces in the last equation from nodes with these masses and damping rates.
    /// `visit` receives each node's velocity loss, m/s.
    pub fn remove_contact_forces(
        &mut self,
        inverse_masses: &[f32],
        rates: Option<&[f32]>,
        mut visit: impl FnMut(usize, Vec3),
    ) {
        let history = &mut self.histories[1 - self.current_index];
        let Some(contact_forces) = history
            .contact_forces
            .as_mut()
            .filter(|contact_forces| contact_forces.is_active)
        else {
            return;
        };
        for (node, &inverse_mass) in inverse_masses.iter().enumerate() {
            let force = contact_forces.forces.get(node);
            if force == Vec3::ZERO {
                continue;
            }
            let velocity_change =
                force * (self.substep_duration * inverse_mass / damping_divisor(rates, node, self.substep_duration));
            history.displacements.set(
                node,
                history.displacements.get(node) - velocity_change * self.substep_duration,
            );
            history.velocity_changes.set(node, Vec3::ZERO);
            visit(node, velocity_change);
        }
        contact_forces.forget();
        history.energy = None;
        self.is_deflected = true;
    }

    /// Adds the contact impulse on a node to the forces of the next equation, N s.
    pub fn add_contact_impulse(&mut self, node: usize, impulse: Vec3, rates: Option<&[f32]>) {
        let substep_duration = self.substep_duration;
        if let Some(contact_forces) = &mut self.next_mut().contact_forces {
            let damping_divisor = damping_divisor(rates, node, substep_duration);
            let force = contact_forces.forces.get(node) + impulse * (damping_divisor / substep_duration);
            contact_forces.forces.set(node, force.clamp(Vec3::MIN, Vec3::MAX));
            contact_forces.is_active = true;
        }
    }
}

/// Factor by which damping reduces the velocity that a force causes in a step.
fn damping_divisor(rates: Option<&[f32]>, node: usize, step: f32) -> f32 {
    rates.map_or(1.0, |rates| 1.0 + rates[node] * step)
}
