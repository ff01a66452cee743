//! Data that is cut into parts, one for each tile, which threads may write at the same time.

use std::marker::PhantomData;

/// Data in parts.
///
/// # Safety
/// Parts of different tiles have nothing in common that either could write, and may be handed to other threads. Where
/// [`Split::check`] returns, there is a part for every tile.
pub(crate) unsafe trait Split: Sync {
    type Part;

    /// Panics where there are fewer parts than `tiles`.
    fn check(&self, tiles: usize);

    /// The part of a tile.
    ///
    /// # Safety
    /// `check` has returned for more tiles than `tile`, and nobody else has this part.
    unsafe fn part(&self, tile: usize) -> Self::Part;
}

/// A slice in tiles of the same length; the last may be shorter.
#[derive(Debug)]
pub(crate) struct Tiles<'a, T> {
    first: *mut T,
    count: usize,
    tile: usize,
    slice: PhantomData<&'a mut [T]>,
}

// SAFETY: it stands for a mutable slice of which threads take disjoint parts.
unsafe impl<T: Send> Sync for Tiles<'_, T> {}

impl<'a, T> Tiles<'a, T> {
    /// `slice` in tiles of `tile` entries, more than 0.
    pub fn new(slice: &'a mut [T], tile: usize) -> Self {
        assert!(tile > 0);
        Self {
            first: slice.as_mut_ptr(),
            count: slice.len(),
            tile,
            slice: PhantomData,
        }
    }
}

// SAFETY: tiles do not overlap.
unsafe impl<'a, T: Send> Split for Tiles<'a, T> {
    type Part = &'a mut [T];

    fn check(&self, tiles: usize) {
        assert!(tiles <= self.count.div_ceil(self.tile), "a tile beyond the end");
    }

    unsafe fn part(&self, tile: usize) -> &'a mut [T] {
        let start = tile * self.tile;
        let count = self.tile.min(self.count - start);
        // SAFETY: within the slice, by `check`; nobody else has it.
        unsafe { std::slice::from_raw_parts_mut(self.first.add(start), count) }
    }
}

/// One entry of a slice for each tile.
#[derive(Debug)]
pub(crate) struct Each<'a, T>(Tiles<'a, T>);

impl<'a, T> Each<'a, T> {
    pub fn new(slice: &'a mut [T]) -> Self {
        Self(Tiles::new(slice, 1))
    }
}

// SAFETY: entries do not overlap.
unsafe impl<'a, T: Send> Split for Each<'a, T> {
    type Part = &'a mut T;

    fn check(&self, tiles: usize) {
        self.0.check(tiles);
    }

    unsafe fn part(&self, tile: usize) -> &'a mut T {
        // SAFETY: the same contract; such a tile has one entry.
        unsafe { &mut *self.0.first.add(tile) }
    }
}

/// A slice in parts of different lengths.
#[derive(Debug)]
pub(crate) struct Ragged<'a, T> {
    whole: Tiles<'a, T>,
    starts: &'a [u32],
}

impl<'a, T> Ragged<'a, T> {
    /// The part of tile i is from `starts[i]` up to `starts[i + 1]`, or the slice's end; it is empty where there is no
    /// `starts[i]`.
    pub fn new(slice: &'a mut [T], starts: &'a [u32]) -> Self {
        let sorted = starts.is_sorted() && starts.last().is_none_or(|&last| last as usize <= slice.len());
        assert!(sorted, "parts that overlap or end beyond the slice");
        Self {
            whole: Tiles::new(slice, 1),
            starts,
        }
    }
}

// SAFETY: sorted starts make parts that do not overlap.
unsafe impl<'a, T: Send> Split for Ragged<'a, T> {
    type Part = &'a mut [T];

    fn check(&self, _: usize) {}

    unsafe fn part(&self, tile: usize) -> &'a mut [T] {
        let start = |tile: usize| self.starts.get(tile).map_or(self.whole.count, |&start| start as usize);
        let (start, end) = (start(tile), start(tile + 1));
        // SAFETY: within the slice, because starts are sorted up to its end; nobody else has it.
        unsafe { std::slice::from_raw_parts_mut(self.whole.first.add(start), end - start) }
    }
}

// SAFETY: each of the three does as it says.
unsafe impl<D: Split> Split for [D; 3] {
    type Part = [D::Part; 3];

    fn check(&self, tiles: usize) {
        self.iter().for_each(|data| data.check(tiles));
    }

    unsafe fn part(&self, tile: usize) -> Self::Part {
        // SAFETY: the same contract.
        self.each_ref().map(|data| unsafe { data.part(tile) })
    }
}

macro_rules! tuple {
    ($($name:ident $index:tt),+) => {
        // SAFETY: each of them does as it says.
        unsafe impl<$($name: Split),+> Split for ($($name,)+) {
            type Part = ($($name::Part,)+);

            fn check(&self, tiles: usize) {
                $(self.$index.check(tiles);)+
            }

            unsafe fn part(&self, tile: usize) -> Self::Part {
                // SAFETY: the same contract.
                unsafe { ($(self.$index.part(tile),)+) }
            }
        }
    };
}

tuple!(A 0, B 1);
tuple!(A 0, B 1, C 2);
tuple!(A 0, B 1, C 2, D 3, E 4);
