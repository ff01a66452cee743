//! An array that knows what it was before the last cut.

use std::ops::Index;

use crate::base::{Result, memory};
use crate::codec::{Saved, saved};

/// Values of which each change is kept, so that all changes since [`Tracked::begin`] can be undone without memory.
#[derive(Clone, Debug)]
pub(crate) struct Tracked<T> {
    values: Vec<T>,
    /// What was overwritten, in order, of the values that were there at the beginning.
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

    /// How many there were at the beginning.
    pub(crate) fn count_before(&self) -> u32 {
        self.count_before
    }

    /// From here on changes can be undone; those before stand.
    pub(crate) fn begin(&mut self) {
        self.before.clear();
        self.count_before = self.count();
    }

    pub(crate) fn undo(&mut self) {
        self.values.truncate(self.count_before as usize);
        for (at, value) in self.before.drain(..).rev() {
            self.values[at as usize] = value;
        }
    }

    pub(crate) fn edit(&mut self, at: u32, change: impl FnOnce(&mut T)) -> Result<()> {
        let value = &mut self.values[at as usize];
        if at < self.count_before {
            memory::push(&mut self.before, (at, *value))?;
        }
        change(value);
        Ok(())
    }

    /// What was overwritten first of each value that was there at the beginning, in their order.
    pub(crate) fn before(&self) -> Result<Vec<(u32, T)>> {
        let mut before = memory::copied(&self.before)?;
        // A stable sort would need memory that may not be refused; the first of equals is found by its place.
        let mut places: Vec<usize> = memory::collected(0..before.len())?;
        places.sort_unstable_by_key(|&place| (self.before[place].0, place));
        places.dedup_by_key(|place| self.before[*place].0);
        before.clear();
        before.extend(places.into_iter().map(|place| self.before[place]));
        Ok(before)
    }

    /// Makes room for `more` values.
    pub(crate) fn reserve(&mut self, more: usize) -> Result<()> {
        Ok(self.values.try_reserve_exact(more)?)
    }

    /// Appends a value and returns its number.
    pub(crate) fn push(&mut self, value: T) -> Result<u32> {
        let number = self.count();
        memory::push(&mut self.values, value)?;
        Ok(number)
    }

    /// The numbers of what was changed or added since the beginning, in order.
    pub(crate) fn touched(&self) -> Result<Vec<u32>> {
        let added = self.count_before..self.count();
        let mut touched = memory::reserved(self.before.len() + added.len())?;
        touched.extend(self.before.iter().map(|&(at, _)| at));
        memory::sort_once(&mut touched);
        touched.extend(added);
        Ok(touched)
    }
}

impl<T> Index<u32> for Tracked<T> {
    type Output = T;

    fn index(&self, at: u32) -> &T {
        &self.values[at as usize]
    }
}
