//! What other tissue presses an implicit body with belongs to its equations.
//!
//! Contacts with tissue are solved after the equations of the bodies, by impulses. An equation that knew nothing of them would let a body relax for a
//! substep before it is pressed again, and the nodes at the contact would bear for those behind them: too little force. So each equation takes what
//! contacts gave in the last substep as a force. After it, what that force gave is taken from the nodes again, and contacts give what they have to: as
//! much, where they press on, and nothing where they have opened. Nothing of a body's momentum is made by this.

use glam::Vec3;

use super::solution::{History, Solution};
use crate::codec::saved;
use crate::soa::Vectors;

/// The forces on the nodes of a body.
#[derive(Debug)]
pub(super) struct Pressed {
    /// N; 0 where a node is held.
    forces: Vectors,
    /// Whether there are any.
    acts: bool,
}

saved! { Pressed { forces, acts } }

impl Pressed {
    /// Nothing presses.
    pub fn forget(&mut self) {
        if self.acts {
            self.forces.clear();
            self.acts = false;
        }
    }
}

impl History {
    /// What there is for each node; remainders, but where the equations are solved exactly.
    pub(super) fn vectors_mut(&mut self, is_exact: bool) -> impl Iterator<Item = &mut Vectors> {
        let forces = self.pressed.as_mut().map(|pressed| &mut pressed.forces);
        let remainders = Some(&mut self.remainders).filter(|_| !is_exact);
        [&mut self.ways, &mut self.gains]
            .into_iter()
            .chain(remainders)
            .chain(forces)
    }

    /// Whether it holds vectors of so many nodes.
    pub(super) fn is_sound(&self, count: usize) -> bool {
        let forces = self.pressed.as_ref().map(|pressed| &pressed.forces);
        [&self.ways, &self.gains]
            .into_iter()
            .chain(forces)
            .all(|vectors| vectors.len() == count)
    }

    /// The forces that act, N.
    pub(super) fn pressing(&self) -> Option<&Vectors> {
        let pressed = self.pressed.as_ref().filter(|pressed| pressed.acts)?;
        Some(&pressed.forces)
    }
}

impl Solution {
    /// From now on other tissue may press it; there are no forces yet.
    pub fn add_pressed(&mut self, none: [Vectors; 2]) {
        for (history, forces) in self.histories.iter_mut().zip(none) {
            history.pressed.get_or_insert(Pressed { forces, acts: false });
        }
    }

    /// Has the next equation know what pressed before it; nothing does where the body goes alone.
    pub(super) fn recall_pressed(&mut self, is_first: bool, is_together: bool) {
        let [settled, next] = self.current_and_next();
        let Some(pressed) = &mut next.pressed else {
            return;
        };
        if !is_together {
            pressed.forget();
        } else if is_first {
            pressed.forget();
            if let Some(forces) = settled.pressing() {
                pressed.forces.copy_from(forces);
                pressed.acts = true;
            }
        }
    }

    /// Takes what the forces of the last equation gave from nodes with these masses and rates of damping again: by how much each becomes slower,
    /// m/s.
    pub fn release_pressed(
        &mut self,
        inverse_masses: &[f32],
        rates: Option<&[f32]>,
        mut show: impl FnMut(usize, Vec3),
    ) {
        let history = &mut self.histories[1 - self.settled];
        let Some(pressed) = history.pressed.as_mut().filter(|pressed| pressed.acts) else {
            return;
        };
        for (node, &inverse_mass) in inverse_masses.iter().enumerate() {
            let force = pressed.forces.get(node);
            if force == Vec3::ZERO {
                continue;
            }
            let given = force * (self.latest * inverse_mass / undamped(rates, node, self.latest));
            history.ways.set(node, history.ways.get(node) - given * self.latest);
            history.gains.set(node, Vec3::ZERO);
            show(node, given);
        }
        pressed.forget();
        history.energy = None;
        self.is_deflected = true;
    }

    /// Contacts gave this to a node, N s, and press on.
    pub fn press(&mut self, node: usize, impulse: Vec3, rates: Option<&[f32]>) {
        let latest = self.latest;
        if let Some(pressed) = &mut self.next_mut().pressed {
            let undamped = undamped(rates, node, latest);
            let force = pressed.forces.get(node) + impulse * (undamped / latest);
            pressed.forces.set(node, force.clamp(Vec3::MIN, Vec3::MAX));
            pressed.acts = true;
        }
    }
}

/// What an equation divides the speed by that a force gives to a node in a step, for its damping.
fn undamped(rates: Option<&[f32]>, node: usize, step: f32) -> f32 {
    rates.map_or(1.0, |rates| 1.0 + rates[node] * step)
}
