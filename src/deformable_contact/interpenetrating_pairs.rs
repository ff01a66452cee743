//! Pairs of open surfaces that were created through each other.
//!
//! An open surface has no inside, so contact beside a crossing would hold both in each other forever. The two do not
//! collide until they no longer cross.

use crate::base::{Result, memory};
use crate::codec::saved;

/// Capacity for pairs, per surface.
const PAIRS_PER_SURFACE: usize = 8;

/// Pairs of body indices, sorted.
#[derive(Debug, Default)]
pub(super) struct InterpenetratingPairs(Vec<[u32; 2]>);

saved! { InterpenetratingPairs { 0 } }

impl InterpenetratingPairs {
    /// Reserves memory for one surface more than `surfaces`.
    pub fn reserve(&mut self, surfaces: usize) -> Result<()> {
        memory::reserve_in_steps(&mut self.0, PAIRS_PER_SURFACE * (surfaces + 1))
    }

    /// True if the pair is listed.
    pub fn contains(&self, pair: [usize; 2]) -> bool {
        self.0.binary_search(&ordered(pair)).is_ok()
    }

    /// Adds a pair. Without capacity, the two continue to collide.
    pub fn add(&mut self, pair: [usize; 2]) {
        if let Err(slot) = self.0.binary_search(&ordered(pair))
            && self.0.len() < self.0.capacity()
        {
            self.0.insert(slot, ordered(pair));
        }
    }

    /// Removes a pair. Returns true if it was listed.
    pub fn remove(&mut self, pair: [usize; 2]) -> bool {
        let slot = self.0.binary_search(&ordered(pair));
        slot.map(|slot| self.0.remove(slot)).is_ok()
    }

    /// Removes the pairs of a body.
    pub fn remove_body(&mut self, body_index: usize) {
        self.0.retain(|pair| !pair.contains(&(body_index as u32)));
    }
}

/// Sorts the two indices.
fn ordered([a, b]: [usize; 2]) -> [u32; 2] {
    [a.min(b) as u32, a.max(b) as u32]
}
