//! Union-find.

use super::{Result, memory};

/// Disjoint sets of the numbers from 0.
#[derive(Default)]
pub(crate) struct DisjointSets {
    parents: Vec<u32>,
}

impl DisjointSets {
    /// `count` sets of one number each.
    pub(crate) fn new(count: usize) -> Result<Self> {
        let parents = memory::collected(0..count as u32)?;
        Ok(Self { parents })
    }

    /// Resets to `count` sets of one number each.
    pub(crate) fn reset(&mut self, count: usize) -> Result<()> {
        self.parents.clear();
        self.parents.try_reserve(count)?;
        self.parents.extend(0..count as u32);
        Ok(())
    }

    /// The lowest number of the set that contains `at`.
    pub(crate) fn lowest(&mut self, mut at: usize) -> usize {
        while self.parents[at] as usize != at {
            let parent = self.parents[at] as usize;
            self.parents[at] = self.parents[parent];
            at = parent;
        }
        at
    }

    pub(crate) fn unite(&mut self, a: usize, b: usize) {
        let (a, b) = (self.lowest(a), self.lowest(b));
        self.parents[a.max(b)] = a.min(b) as u32;
    }

    /// The lowest number of the set of each number.
    pub(crate) fn into_lowest(mut self) -> Vec<u32> {
        for at in 0..self.parents.len() {
            self.parents[at] = self.lowest(at) as u32;
        }
        self.parents
    }

    /// True if there is a single set.
    pub(crate) fn is_one(&mut self) -> bool {
        (0..self.parents.len()).all(|at| self.lowest(at) == 0)
    }
}
