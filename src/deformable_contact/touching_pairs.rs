//! Pairs of touching bodies in the last two steps. They determine where contact began or ended.

use super::pair_contact::PairContact;
use super::warm_start::CONTACTS_PER_PRESSING;
use crate::base::{Result, memory};
use crate::codec::saved;

/// A pair of bodies that touch, or did so in the step before.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TouchingPair {
    /// Body indices, lower first.
    pub bodies: [usize; 2],
    /// True if they touched in the last committed step, and in the one before.
    pub touched: [bool; 2],
    /// True if they have touched in the step in progress.
    touched_in_step: bool,
}

saved! { TouchingPair { bodies, touched, touched_in_step } }

/// All pairs, sorted.
#[derive(Debug, Default)]
pub(crate) struct TouchingPairs {
    pairs: Vec<TouchingPair>,
}

saved! { TouchingPairs { pairs } }

impl TouchingPairs {
    /// Reserves memory for this number of contacts, of which few press at once.
    pub(super) fn reserve(&mut self, contacts: usize) -> Result<()> {
        memory::reserve_in_steps(&mut self.pairs, contacts / CONTACTS_PER_PRESSING)
    }

    /// Begins or restarts a step.
    pub fn begin(&mut self) {
        self.pairs.iter_mut().for_each(|pair| pair.touched_in_step = false);
    }

    /// Begins or restarts the step of an island.
    pub(super) fn begin_island(&mut self, members: &[u32]) {
        let is_in_island = |pair: &&mut TouchingPair| members.contains(&(pair.bodies[0] as u32));
        let pairs = self.pairs.iter_mut().filter(is_in_island);
        pairs.for_each(|pair| pair.touched_in_step = false);
    }

    /// Records the pairs of bodies whose contacts press. Pairs beyond the capacity are dropped.
    pub(super) fn record(&mut self, pair_contacts: &[PairContact]) {
        for contact in pair_contacts.iter().filter(|contact| contact.is_pressing()) {
            let mut bodies = contact.sides.map(|side| side.body);
            bodies.sort_unstable();
            match self.pairs.binary_search_by_key(&bodies, |pair| pair.bodies) {
                Ok(slot) => self.pairs[slot].touched_in_step = true,
                Err(slot) if bodies[0] != bodies[1] && self.pairs.len() < self.pairs.capacity() => {
                    let pair = TouchingPair {
                        bodies,
                        touched: [false; 2],
                        touched_in_step: true,
                    };
                    self.pairs.insert(slot, pair);
                }
                Err(_) => {}
            }
        }
    }

    /// Commits the step. Sleeping bodies stay in contact.
    pub fn commit(&mut self, is_asleep: impl Fn(usize) -> bool) {
        self.pairs.retain_mut(|pair| {
            let [before, _] = pair.touched;
            let stays_in_contact = before && pair.bodies.iter().all(|&body_index| is_asleep(body_index));
            pair.touched = [pair.touched_in_step || stays_in_contact, before];
            pair.touched.contains(&true)
        });
    }

    /// Keeps the pairs of the previous step, because this one failed.
    pub fn keep_previous(&mut self) {
        self.pairs.retain_mut(|pair| {
            pair.touched = [pair.touched[0]; 2];
            pair.touched[0]
        });
    }

    /// Removes a body that was destroyed.
    pub(super) fn remove_body(&mut self, body_index: usize) {
        self.pairs.retain(|pair| !pair.bodies.contains(&body_index));
    }

    /// Returns the pairs that began or ceased to touch in the last step.
    pub fn changes(&self) -> impl Iterator<Item = &TouchingPair> {
        self.pairs.iter().filter(|pair| pair.touched[0] != pair.touched[1])
    }
}
