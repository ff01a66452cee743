//! An array that records changes since the last cut.

use std::ops::Index;

use crate::base::{Result, memory};
use crate::codec::{Saved, saved};

/// Values with an undo log. All changes since [`Tracked::begin`] can be undone without allocation.
#[derive(Clone, Debug)]
pub(crate) struct Tracked<T> {
    values: Vec<T>,
    /// The overwritten values, in order, of indices that existed at the beginning.
    before: Vec<(u32, T)>,
    count_before: u32,
}

saved! { [T: Saved] Tracked<T> { values, before, count_before } }

impl<T: Copy> Tracked<T> {
    pub(crate) fn new(values: Vec<T>) -> Self {
        let count_before = values.len() as u32;
        Self {
            values,
            before: Vec::new(),
            count_before,
        }
    }

    pub(crate) fn values(&self) -> &[T] {
        &self.values
    }

    pub(crate) fn count(&self) -> u32 {
        self.values.len() as u32
    }

    /// The number of values at the beginning.
    pub(crate) fn count_before(&self) -> u32 {
        self.count_before
    }

    /// Begins a new undo log. Earlier changes are permanent.
    pub(crate) fn begin(&mut self) {
        self.before.clear();
        self.count_before = self.count();
    }

    pub(crate) fn undo(&mut self) {
        self.values.truncate(self.count_before as usize);
        for (index, value) in self.before.drain(..).rev() {
            self.values[index as usize] = value;
        }
    }

    pub(crate) fn edit(&mut self, index: u32, change: impl FnOnce(&mut T)) -> Result<()> {
        let value = &mut self.values[index as usize];
        if index < self.count_before {
            memory::push(&mut self.before, (index, *value))?;
        }
        change(value);
        Ok(())
    }

    /// The values at the beginning that were overwritten, in the order of their indices.
    pub(crate) fn before(&self) -> Result<Vec<(u32, T)>> {
        let mut before = memory::copied(&self.before)?;
        // A stable sort would allocate without reporting failure. Sorting positions keeps the first of equal indices.
        let mut order: Vec<usize> = memory::collected(0..before.len())?;
        order.sort_unstable_by_key(|&position| (self.before[position].0, position));
        order.dedup_by_key(|position| self.before[*position].0);
        before.clear();
        before.extend(order.into_iter().map(|position| self.before[position]));
        Ok(before)
    }

    /// Reserves space for `more` values.
    pub(crate) fn reserve(&mut self, more: usize) -> Result<()> {
        Ok(self.values.try_reserve_exact(more)?)
    }

    /// Appends a value and returns its index.
    pub(crate) fn push(&mut self, value: T) -> Result<u32> {
        let number = self.count();
        memory::push(&mut self.values, value)?;
        Ok(number)
    }

    /// The indices that were changed or added since the beginning, in order.
    pub(crate) fn changed_indices(&self) -> Result<Vec<u32>> {
        let added = self.count_before..self.count();
        let mut touched = memory::reserved(self.before.len() + added.len())?;
        touched.extend(self.before.iter().map(|&(index, _)| index));
        memory::sort_once(&mut touched);
        touched.extend(added);
        Ok(touched)
    }
}

impl<T> Index<u32> for Tracked<T> {
    type Output = T;

    fn index(&self, index: u32) -> &T {
        &self.values[index as usize]
    }
}
