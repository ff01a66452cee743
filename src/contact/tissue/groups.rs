//! Which bodies take their substeps together.

use crate::base::{Result, memory};
use crate::codec::saved;

/// The groups of the bodies of a world.
#[derive(Debug, Default)]
pub(super) struct Groups {
    /// By a body's place in the world, one of the places of those that it goes with; `None`: it goes by itself.
    of: Vec<Option<usize>>,
}

saved!(Groups { of });

impl Groups {
    /// Makes room for the body at this place.
    pub fn make_place(&mut self, place: usize) -> Result<()> {
        while self.of.len() <= place {
            memory::push(&mut self.of, None)?;
        }
        Ok(())
    }

    /// Their numbers are below.
    pub fn count(&self) -> usize {
        self.of.len()
    }

    pub fn of(&self, place: usize) -> Option<usize> {
        *self.of.get(place)?
    }

    pub fn are_one(&self, first: usize, second: usize) -> bool {
        self.of(first).is_some() && self.of(first) == self.of(second)
    }

    /// Begins anew: each body is a group of its own, where this tells so, or in none.
    pub fn part(&mut self, is_group: impl Fn(usize) -> bool) {
        for (place, group) in self.of.iter_mut().enumerate() {
            *group = is_group(place).then_some(place);
        }
    }

    /// Has two bodies, for which there is room, and all that go with one of them go together.
    pub fn join(&mut self, first: usize, second: usize) {
        if self.are_one(first, second) {
            return;
        }
        let joined = self.of(second).unwrap_or(second);
        let left = self.of(first);
        for (place, group) in self.of.iter_mut().enumerate() {
            if place == first || place == second || left.is_some() && *group == left {
                *group = Some(joined);
            }
        }
    }
}
