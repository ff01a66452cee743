//! Where equations have led a body, which contacts with other tissue change after each.

use glam::Vec3;

use super::energy::Total;
use super::pressed::Pressed;
use crate::base::Result;
use crate::codec::saved;
use crate::nodes::current_and_next;
use crate::soa::Vectors;

/// What the last step leaves to the next, for order 2.
#[derive(Debug)]
pub(crate) struct History {
    /// How far each node went, m.
    pub ways: Vectors,
    /// How its velocity changed, m/s.
    pub gains: Vectors,
    /// What its position lacks of where it is, m: less than the last place of its coordinates (Kahan 1965). NEWTON keeps its own.
    pub remainders: Vectors,
    /// s; 0: there is none.
    pub step: f32,
    /// Kinetic and elastic energy at its end, J, where they are known.
    pub(super) energy: Option<Total>,
    /// What was lost not long ago, and may come back: the energy of a step's formula is not quite this one.
    pub credit: f64,
    /// What other tissue presses it with, where it meets some.
    pub(super) pressed: Option<Pressed>,
}

saved! { History { ways, gains, remainders, step, energy, credit, pressed } }

impl History {
    /// For so many nodes, and those of them whose remainders are kept.
    fn new(node_count: usize, solved_count: usize) -> Result<Self> {
        Ok(Self {
            ways: Vectors::zeros(node_count)?,
            gains: Vectors::zeros(node_count)?,
            remainders: Vectors::zeros(solved_count)?,
            step: 0.0,
            energy: None,
            credit: 0.0,
            pressed: None,
        })
    }
}

/// Where equations have led a body in the last step, and lead it in the one in progress.
#[derive(Debug)]
pub(crate) struct Solution {
    pub(super) histories: [History; 2],
    /// Which of them belongs to the current state.
    pub(super) settled: usize,
    /// How long the substep that was just solved is, s.
    pub(super) latest: f32,
    /// Whether other tissue changed what the last equation led to.
    pub(super) is_deflected: bool,
    /// Whether the body is attached to another in the step in progress: what that does is not carried on, and substeps are of order 1.
    pub is_attached: bool,
}

saved! { Solution { histories, settled, latest, is_deflected, is_attached } }

impl Solution {
    /// For so many nodes, and those of them whose remainders are kept.
    pub(super) fn new(node_count: usize, solved_count: usize) -> Result<Self> {
        Ok(Self {
            histories: [
                History::new(node_count, solved_count)?,
                History::new(node_count, solved_count)?,
            ],
            settled: 0,
            latest: 0.0,
            is_deflected: false,
            is_attached: false,
        })
    }

    /// Whether what it keeps of steps belongs to so many nodes.
    pub fn is_sound(&self, count: usize) -> bool {
        self.histories.iter().all(|history| history.is_sound(count))
    }

    /// That of the current state.
    pub(super) fn current(&self) -> &History {
        &self.histories[self.settled]
    }

    pub(super) fn current_mut(&mut self) -> &mut History {
        &mut self.histories[self.settled]
    }

    pub(super) fn current_and_next(&mut self) -> [&mut History; 2] {
        current_and_next(&mut self.histories, self.settled)
    }

    /// That of the step in progress.
    pub(super) fn next(&self) -> &History {
        &self.histories[1 - self.settled]
    }

    pub(super) fn next_mut(&mut self) -> &mut History {
        &mut self.histories[1 - self.settled]
    }

    /// What the step before the next substep left.
    pub(super) fn last(&self, is_first: bool) -> &History {
        &self.histories[self.place(is_first)]
    }

    /// Which of them that is.
    pub(super) fn place(&self, is_first: bool) -> usize {
        if is_first { self.settled } else { 1 - self.settled }
    }

    /// How much faster a node became in the last step, m/s.
    pub fn gain_of(&self, node: usize) -> Vec3 {
        self.current().gains.get(node)
    }

    /// How fast a node goes on its way in the substep that was just solved, m/s.
    pub fn mean(&self, node: usize) -> Vec3 {
        self.next().ways.get(node) / self.latest
    }

    /// What it is attached to has a node go so much faster in a substep of `duration` seconds: no gain that will go on.
    pub fn draw(&mut self, node: usize, given: Vec3, duration: f32) {
        let history = self.next_mut();
        history.ways.set(node, history.ways.get(node) + given * duration);
        history.energy = None;
    }

    /// Nodes were moved after the substep that was just solved: its energy is no longer known.
    pub fn part(&mut self) {
        self.next_mut().energy = None;
    }

    /// Other tissue has a node go with this mean velocity instead, m/s: by how much it becomes faster.
    pub fn deflect(&mut self, node: usize, mean: Vec3) -> Vec3 {
        let given = mean - self.mean(node);
        if given != Vec3::ZERO {
            let latest = self.latest;
            let history = self.next_mut();
            history.ways.set(node, mean * latest);
            // What it gives is no gain that will go on.
            history.gains.set(node, Vec3::ZERO);
            history.energy = None;
            self.is_deflected = true;
        }
        given
    }

    /// After a part that ended otherwise than its equation did the next is one of order 1.
    pub fn settle_deflection(&mut self) {
        if std::mem::take(&mut self.is_deflected) {
            self.next_mut().step = 0.0;
        }
    }
}
