//! State of the nodes, double-buffered so that a failed step can be discarded.

use std::ops::Range;

use glam::Vec3;

use crate::base::Result;
use crate::codec::saved;
use crate::soa::{Vectors, per_node};

/// Positions, velocities and spring forces of all nodes, with buffers for a step in progress.
///
/// A step reads the current state and writes to other buffers until [`State::commit`]. Positions have three buffers: a
/// substep reads one and writes another, while the current one must survive.
#[derive(Debug)]
pub(crate) struct State {
    positions: [Vectors; 3],
    velocities: [Vectors; 2],
    forces: [Vectors; 2],
    /// Rounding remainders: exact minus stored positions, m (Kahan 1965). IMPLICIT and NEWTON have their own.
    remainders: Option<[Vectors; 2]>,
    /// Slot of the current positions.
    position_slot: usize,
    /// Slot of the newest positions of the step in progress.
    newest_position_slot: usize,
    /// Slot of the current velocities and forces.
    velocity_slot: usize,
    /// Slot of the current remainders.
    remainder_slot: usize,
    /// Slot of the remainders of the step in progress.
    newest_remainder_slot: usize,
}

saved! { State {
    positions, velocities, forces, remainders, position_slot, newest_position_slot, velocity_slot, remainder_slot,
    newest_remainder_slot,
} }

per_node! { State { positions, velocities, forces, remainders } }

/// Buffers of a substep.
pub(crate) struct Substep<'a> {
    /// Velocities and spring forces at the start of the step.
    pub first_velocities: &'a Vectors,
    pub first_forces: &'a Vectors,
    /// Positions at the start of the substep.
    pub positions: &'a Vectors,
    /// Positions at the end of the substep.
    pub next_positions: &'a mut Vectors,
    /// Velocities, half a substep ahead of or behind the positions within a step.
    pub velocities: &'a mut Vectors,
    /// Spring forces of the last substep.
    pub forces: &'a mut Vectors,
    /// Remainders at the start of the step, and now, if enabled.
    pub remainders: Option<[&'a mut Vectors; 2]>,
}

impl State {
    /// True if the state belongs to this number of nodes and is finite.
    pub fn is_sound(&self, count: usize) -> bool {
        let mut all =
            (self.positions.iter().chain(&self.velocities).chain(&self.forces)).chain(self.remainders.iter().flatten());
        self.position_slot < self.positions.len()
            && self.newest_position_slot < self.positions.len()
            && self.velocity_slot < self.velocities.len()
            && self.remainder_slot.max(self.newest_remainder_slot) < 2
            && all.all(|vectors| vectors.len() == count)
            && [self.positions(), self.velocities()]
                .into_iter()
                .all(|vectors| vectors.iter().all(|vector| vector.is_finite()))
    }

    /// Creates a zero state. `carries` reserves rounding remainders.
    pub fn new(node_count: usize, carries: bool) -> Result<Self> {
        let zeros = || Vectors::zeros(node_count);
        Ok(Self {
            positions: [zeros()?, zeros()?, zeros()?],
            velocities: [zeros()?, zeros()?],
            forces: [zeros()?, zeros()?],
            remainders: if carries { Some([zeros()?, zeros()?]) } else { None },
            position_slot: 0,
            newest_position_slot: 0,
            velocity_slot: 0,
            remainder_slot: 0,
            newest_remainder_slot: 0,
        })
    }

    /// Copies the motion of `source` to `node`.
    pub fn copy(&mut self, source: usize, node: usize) {
        let current = [
            &mut self.positions[self.position_slot],
            &mut self.velocities[self.velocity_slot],
            &mut self.forces[self.velocity_slot],
        ];
        let remainders = self.remainders.as_mut().map(|slots| &mut slots[self.remainder_slot]);
        for vectors in current.into_iter().chain(remainders) {
            vectors.set(node, vectors.get(source));
        }
    }

    pub fn positions(&self) -> &Vectors {
        &self.positions[self.position_slot]
    }

    pub fn positions_mut(&mut self) -> &mut Vectors {
        &mut self.positions[self.position_slot]
    }

    pub fn velocities(&self) -> &Vectors {
        &self.velocities[self.velocity_slot]
    }

    pub fn velocities_mut(&mut self) -> &mut Vectors {
        &mut self.velocities[self.velocity_slot]
    }

    /// Spring forces at the current positions and velocities.
    pub fn forces(&self) -> &Vectors {
        &self.forces[self.velocity_slot]
    }

    /// Remainders of the current positions, if reserved.
    pub fn remainders(&self) -> Option<&Vectors> {
        self.remainders.as_ref().map(|slots| &slots[self.remainder_slot])
    }

    /// Clears the current remainders.
    pub fn forget_remainders(&mut self) {
        if let Some(slots) = &mut self.remainders {
            slots[self.remainder_slot].clear();
        }
    }

    /// Restarts a step from the current state.
    pub fn begin(&mut self) {
        self.newest_position_slot = self.position_slot;
        self.newest_remainder_slot = self.remainder_slot;
    }

    /// Enables rounding remainders for the step in progress.
    pub fn enable_remainders(&mut self) {
        if self.remainders.is_some() {
            self.newest_remainder_slot = 1 - self.remainder_slot;
        }
    }

    pub fn substep(&mut self) -> Substep<'_> {
        let next = self.next();
        let [a, b, c] = &mut self.positions;
        let (positions, next_positions) = match (self.newest_position_slot, next) {
            (0, 1) => (&*a, b),
            (0, _) => (&*a, c),
            (1, 0) => (&*b, a),
            (1, _) => (&*b, c),
            (_, 0) => (&*c, a),
            _ => (&*c, b),
        };
        let [first_velocities, velocities] = current_and_next(&mut self.velocities, self.velocity_slot);
        let [first_forces, forces] = current_and_next(&mut self.forces, self.velocity_slot);
        let carries = self.newest_remainder_slot != self.remainder_slot;
        let remainders = self.remainders.as_mut().filter(|_| carries);
        Substep {
            remainders: remainders.map(|slots| current_and_next(slots, self.remainder_slot)),
            first_velocities,
            first_forces,
            positions,
            next_positions,
            velocities,
            forces,
        }
    }

    /// Buffers for two fused substeps, after the first substep of a step: positions, next positions and velocities. The
    /// second substep may overwrite the positions. The remainders are returned if they are enabled.
    pub fn substep_pair(&mut self) -> ([&mut Vectors; 3], Option<&mut Vectors>) {
        assert_ne!(
            self.newest_position_slot, self.position_slot,
            "the current positions must survive"
        );
        let is_swapped = self.newest_position_slot > self.next();
        let current = self.position_slot;
        let mut others = (0..).zip(&mut self.positions).filter(|(slot, _)| *slot != current);
        let [Some((_, first)), Some((_, second))] = [others.next(), others.next()] else {
            unreachable!("there are three places");
        };
        let [latest, next] = if is_swapped { [second, first] } else { [first, second] };
        let carries = self.newest_remainder_slot != self.remainder_slot;
        let remainders = self.remainders.as_mut().filter(|_| carries);
        (
            [latest, next, &mut self.velocities[1 - self.velocity_slot]],
            remainders.map(|slots| &mut slots[self.newest_remainder_slot]),
        )
    }

    /// Makes the positions just written the newest of the step in progress.
    pub fn advance(&mut self) {
        self.newest_position_slot = self.next();
    }

    /// Positions written by the substep in progress.
    pub fn next_positions(&self) -> &Vectors {
        &self.positions[self.next()]
    }

    /// Newest positions and velocities of the step in progress.
    pub fn newest(&self) -> (&Vectors, &Vectors) {
        (
            &self.positions[self.newest_position_slot],
            &self.velocities[1 - self.velocity_slot],
        )
    }

    /// True if the newest positions and velocities, and their squares, are finite.
    pub fn newest_is_finite(&self) -> bool {
        let (positions, velocities) = self.newest();
        positions.largest_length().is_finite() && velocities.largest_length().is_finite()
    }

    /// True if the positions and velocities written by the substep in progress, and their squares, are finite.
    pub fn next_is_finite(&self) -> bool {
        let velocities = &self.velocities[1 - self.velocity_slot];
        self.next_positions().largest_length().is_finite() && velocities.largest_length().is_finite()
    }

    /// Stops these nodes at their current positions in all buffers, so that steps can skip them.
    pub fn freeze(&mut self, nodes: Range<usize>) {
        for node in nodes {
            let position = self.positions[self.position_slot].get(node);
            self.positions
                .iter_mut()
                .for_each(|positions| positions.set(node, position));
            let at_rest = self.velocities.iter_mut().chain(self.remainders.iter_mut().flatten());
            at_rest.for_each(|vectors| vectors.set(node, Vec3::ZERO));
        }
    }

    /// Makes the step in progress the current state.
    pub fn commit(&mut self) {
        self.position_slot = self.newest_position_slot;
        self.velocity_slot = 1 - self.velocity_slot;
        self.remainder_slot = self.newest_remainder_slot;
    }

    /// Slot that holds neither the first nor the newest positions of the step.
    fn next(&self) -> usize {
        if self.newest_position_slot == self.position_slot {
            (self.position_slot + 1) % 3
        } else {
            3 - self.position_slot - self.newest_position_slot
        }
    }
}

/// Returns the current and the other item of a double buffer.
pub(crate) fn current_and_next<T>(pair: &mut [T; 2], current: usize) -> [&mut T; 2] {
    let [a, b] = pair;
    if current == 0 { [a, b] } else { [b, a] }
}
