//! History of implicit solutions, and its changes by contact with other tissue.

use glam::Vec3;

use super::contact_forces::ContactForces;
use super::energy::EnergyTotals;
use crate::base::Result;
use crate::codec::saved;
use crate::nodes::current_and_next;
use crate::soa::Vectors;

/// Data of the last step that the second-order formula uses.
#[derive(Debug)]
pub(crate) struct History {
    /// Displacements, m.
    pub displacements: Vectors,
    /// Velocity changes, m/s.
    pub velocity_changes: Vectors,
    /// Rounding remainders: exact minus stored positions, m (Kahan 1965). NEWTON has its own.
    pub remainders: Vectors,
    /// Length of the step, s; 0 if there is no history.
    pub step: f32,
    /// Kinetic and elastic energy at the end of the step, J, if known.
    pub(super) energy: Option<EnergyTotals>,
    /// Recent energy loss that may be recovered: the formula conserves a slightly different energy.
    pub credit: f64,
    /// The same for contact with tools: the energy that was put in and is no longer there, J.
    pub contact_credit: f64,
    /// Forces by other tissue, if the body can be in contact with it.
    pub(super) contact_forces: Option<ContactForces>,
}

saved! { History { displacements, velocity_changes, remainders, step, energy, credit, contact_credit, contact_forces } }

impl History {
    /// Creates a history for `node_count` nodes, of which `solved_count` have remainders.
    fn new(node_count: usize, solved_count: usize) -> Result<Self> {
        Ok(Self {
            displacements: Vectors::zeros(node_count)?,
            velocity_changes: Vectors::zeros(node_count)?,
            remainders: Vectors::zeros(solved_count)?,
            step: 0.0,
            energy: None,
            credit: 0.0,
            contact_credit: 0.0,
            contact_forces: None,
        })
    }
}

/// Histories of the last step and of the step in progress.
#[derive(Debug)]
pub(crate) struct Solution {
    pub(super) histories: [History; 2],
    /// Index of the history of the current state.
    pub(super) current_index: usize,
    /// Length of the last solved substep, s.
    pub(super) substep_duration: f32,
    /// True if other tissue changed the result of the last equation.
    pub(super) is_deflected: bool,
    /// True if the body is attached to another one in this step. Attachment forces are not extrapolated, so substeps
    /// use first order.
    pub is_attached: bool,
}

saved! { Solution { histories, current_index, substep_duration, is_deflected, is_attached } }

impl Solution {
    /// Creates histories for `node_count` nodes, of which `solved_count` have remainders.
    pub(super) fn new(node_count: usize, solved_count: usize) -> Result<Self> {
        Ok(Self {
            histories: [
                History::new(node_count, solved_count)?,
                History::new(node_count, solved_count)?,
            ],
            current_index: 0,
            substep_duration: 0.0,
            is_deflected: false,
            is_attached: false,
        })
    }

    /// True if the histories belong to this number of nodes.
    pub fn is_sound(&self, count: usize) -> bool {
        self.histories.iter().all(|history| history.is_sound(count))
    }

    /// History of the current state.
    pub(super) fn current(&self) -> &History {
        &self.histories[self.current_index]
    }

    pub(super) fn current_mut(&mut self) -> &mut History {
        &mut self.histories[self.current_index]
    }

    pub(super) fn current_and_next(&mut self) -> [&mut History; 2] {
        current_and_next(&mut self.histories, self.current_index)
    }

    /// History of the step in progress.
    pub(super) fn next(&self) -> &History {
        &self.histories[1 - self.current_index]
    }

    pub(super) fn next_mut(&mut self) -> &mut History {
        &mut self.histories[1 - self.current_index]
    }

    /// History before the next substep.
    pub(super) fn last(&self, is_first: bool) -> &History {
        &self.histories[self.history_index(is_first)]
    }

    /// Index of the history before the next substep.
    pub(super) fn history_index(&self, is_first: bool) -> usize {
        if is_first {
            self.current_index
        } else {
            1 - self.current_index
        }
    }

    /// Velocity change of a node in the last step, m/s.
    pub fn velocity_change(&self, node: usize) -> Vec3 {
        self.current().velocity_changes.get(node)
    }

    /// Mean velocity of a node in the last solved substep, m/s.
    pub fn mean_velocity(&self, node: usize) -> Vec3 {
        self.next().displacements.get(node) / self.substep_duration
    }

    /// Adds a velocity by an attachment to a node, in a substep of `duration` seconds. It is not extrapolated.
    pub fn add_mean_velocity(&mut self, node: usize, velocity_change: Vec3, duration: f32) {
        let history = self.next_mut();
        history
            .displacements
            .set(node, history.displacements.get(node) + velocity_change * duration);
        history.energy = None;
    }

    /// Forgets the energy after nodes were moved.
    pub fn invalidate_energy(&mut self) {
        self.next_mut().energy = None;
    }

    /// Replaces the mean velocity of a node, in contact with other tissue, m/s. Returns the change.
    pub fn set_mean_velocity(&mut self, node: usize, mean: Vec3) -> Vec3 {
        let velocity_change = mean - self.mean_velocity(node);
        if velocity_change != Vec3::ZERO {
            let substep_duration = self.substep_duration;
            let history = self.next_mut();
            history.displacements.set(node, mean * substep_duration);
            // A contact impulse is not extrapolated.
            history.velocity_changes.set(node, Vec3::ZERO);
            history.energy = None;
            self.is_deflected = true;
        }
        velocity_change
    }

    /// Restarts with first order if the substep did not end as its equation did.
    pub fn restart_after_deflection(&mut self) {
        if std::mem::take(&mut self.is_deflected) {
            self.next_mut().step = 0.0;
        }
    }
}
