//! Which bodies touch each other, and which did in the step before: contact begins and ends by the two.

use super::link::Link;
use super::warm_start::PRESSING;
use crate::base::{Result, memory};
use crate::codec::saved;

/// Two bodies that touch, or did in the step before.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TouchingPair {
    /// Their places, the lower first.
    pub bodies: [usize; 2],
    /// Whether they touched in the last step that became current, and in the one before.
    pub touched: [bool; 2],
    /// Whether they have touched in the step in progress.
    is_noted: bool,
}

saved! { TouchingPair { bodies, touched, is_noted } }

/// All of them, in order.
#[derive(Debug, Default)]
pub(crate) struct TouchingPairs {
    pairs: Vec<TouchingPair>,
}

saved! { TouchingPairs { pairs } }

impl TouchingPairs {
    /// Makes room for those of so many contacts, of which few press at once.
    pub(super) fn reserve(&mut self, contacts: usize) -> Result<()> {
        memory::reserve_in_steps(&mut self.pairs, contacts / PRESSING)
    }

    /// A step begins, or is begun again.
    pub fn begin(&mut self) {
        self.pairs.iter_mut().for_each(|pair| pair.is_noted = false);
    }

    /// The bodies at these places begin a step, or begin it again.
    pub(super) fn begin_island(&mut self, members: &[u32]) {
        let concerned = |pair: &&mut TouchingPair| members.contains(&(pair.bodies[0] as u32));
        let pairs = self.pairs.iter_mut().filter(concerned);
        pairs.for_each(|pair| pair.is_noted = false);
    }

    /// Takes up between which bodies contacts pressed, as far as there is room.
    pub(super) fn note(&mut self, links: &[Link]) {
        for link in links.iter().filter(|link| link.presses()) {
            let mut bodies = link.sides.map(|side| side.body);
            bodies.sort_unstable();
            match self.pairs.binary_search_by_key(&bodies, |pair| pair.bodies) {
                Ok(at) => self.pairs[at].is_noted = true,
                Err(at) if bodies[0] != bodies[1] && self.pairs.len() < self.pairs.capacity() => {
                    let pair = TouchingPair {
                        bodies,
                        touched: [false; 2],
                        is_noted: true,
                    };
                    self.pairs.insert(at, pair);
                }
                Err(_) => {}
            }
        }
    }

    /// The step is taken. Bodies that slept touch what they touched.
    pub fn commit(&mut self, is_asleep: impl Fn(usize) -> bool) {
        self.pairs.retain_mut(|pair| {
            let [before, _] = pair.touched;
            let lies = before && pair.bodies.iter().all(|&place| is_asleep(place));
            pair.touched = [pair.is_noted || lies, before];
            pair.touched.contains(&true)
        });
    }

    /// The step is not taken: what touched does.
    pub fn stay(&mut self) {
        self.pairs.retain_mut(|pair| {
            pair.touched = [pair.touched[0]; 2];
            pair.touched[0]
        });
    }

    /// A body is gone.
    pub(super) fn leave(&mut self, place: usize) {
        self.pairs.retain(|pair| !pair.bodies.contains(&place));
    }

    /// Those that began or ceased to touch in the last step.
    pub fn changes(&self) -> impl Iterator<Item = &TouchingPair> {
        self.pairs.iter().filter(|pair| pair.touched[0] != pair.touched[1])
    }
}
