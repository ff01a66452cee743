//! Open surfaces that were made through each other.
//!
//! Nothing tells which side of an open surface what crosses it belongs to. Contact beside the crossing would keep both in each other for good. So the
//! two keep nothing off until they are out of each other.

use crate::base::{Result, memory};
use crate::codec::saved;

/// Pairs that there is room for, for each surface.
const ROOM: usize = 8;

/// The pairs of bodies that are in each other, by their places in the world, in order.
#[derive(Debug, Default)]
pub(super) struct Entangled(Vec<[u32; 2]>);

saved! { Entangled { 0 } }

impl Entangled {
    /// Makes room for one more surface, where there are so many.
    pub fn reserve(&mut self, surfaces: usize) -> Result<()> {
        memory::reserve_in_steps(&mut self.0, ROOM * (surfaces + 1))
    }

    /// Whether these two are.
    pub fn has(&self, pair: [usize; 2]) -> bool {
        self.0.binary_search(&named(pair)).is_ok()
    }

    /// These two are. Without room for them they go on keeping each other off.
    pub fn add(&mut self, pair: [usize; 2]) {
        if let Err(place) = self.0.binary_search(&named(pair))
            && self.0.len() < self.0.capacity()
        {
            self.0.insert(place, named(pair));
        }
    }

    /// These two are out of each other: whether they were in each other before.
    pub fn remove(&mut self, pair: [usize; 2]) -> bool {
        let place = self.0.binary_search(&named(pair));
        place.map(|place| self.0.remove(place)).is_ok()
    }

    /// The body at this place is gone.
    pub fn leave(&mut self, place: usize) {
        self.0.retain(|pair| !pair.contains(&(place as u32)));
    }
}

/// The two in order.
fn named([a, b]: [usize; 2]) -> [u32; 2] {
    [a.min(b) as u32, a.max(b) as u32]
}
