//! Mutable data, split into one part per tile.

use std::marker::PhantomData;

/// Data in disjoint parts.
///
/// # Safety
/// For every number of tiles that it [`fits`](Self::fits), parts of different tiles may be used at the same time, on
/// different threads.
pub(crate) unsafe trait Split: Sync {
    /// Data passed to the work on a tile.
    type Part;

    /// True if there is exactly one part for each of `tiles` tiles.
    fn fits(&self, tiles: usize) -> bool;

    /// Returns the part of a tile.
    ///
    /// # Safety
    /// The data must fit a number of tiles greater than `tile`. Each part may be requested only once.
    unsafe fn part(&self, tile: usize) -> Self::Part;
}

/// A slice that hands out disjoint mutable ranges.
struct SharedSlice<'a, T> {
    start: *mut T,
    length: usize,
    slice: PhantomData<&'a mut [T]>,
}

// SAFETY: only `range` accesses the slice, and it returns `&mut T`.
unsafe impl<T: Send> Sync for SharedSlice<'_, T> {}

impl<'a, T> SharedSlice<'a, T> {
    fn new(slice: &'a mut [T]) -> Self {
        Self {
            start: slice.as_mut_ptr(),
            length: slice.len(),
            slice: PhantomData,
        }
    }

    /// # Safety
    /// `start <= end <= length`, and ranges must not overlap.
    unsafe fn range(&self, start: usize, end: usize) -> &'a mut [T] {
        // SAFETY: the range is within the slice, which is borrowed for this lifetime, and no other range overlaps it.
        unsafe { std::slice::from_raw_parts_mut(self.start.add(start), end - start) }
    }
}

/// A slice in pieces of equal length; the last one may be shorter.
pub(crate) struct Tiles<'a, T> {
    slice: SharedSlice<'a, T>,
    length: usize,
}

impl<'a, T> Tiles<'a, T> {
    /// Creates pieces of `length`, which must be positive.
    pub fn new(slice: &'a mut [T], length: usize) -> Self {
        assert!(length > 0, "tiles have a length");
        Self {
            slice: SharedSlice::new(slice),
            length,
        }
    }
}

// SAFETY: the pieces are disjoint.
unsafe impl<'a, T: Send> Split for Tiles<'a, T> {
    type Part = &'a mut [T];

    fn fits(&self, tiles: usize) -> bool {
        self.slice.length.div_ceil(self.length) == tiles
    }

    unsafe fn part(&self, tile: usize) -> &'a mut [T] {
        let start = tile * self.length;
        let end = self.slice.length.min(start + self.length);
        // SAFETY: the tile is less than the slice's length divided by that of the pieces, rounded up.
        unsafe { self.slice.range(start, end) }
    }
}

/// A slice with one item per tile.
pub(crate) struct Items<'a, T>(SharedSlice<'a, T>);

impl<'a, T> Items<'a, T> {
    /// Creates one part per item.
    pub fn new(slice: &'a mut [T]) -> Self {
        Self(SharedSlice::new(slice))
    }
}

// SAFETY: the items are disjoint.
unsafe impl<'a, T: Send> Split for Items<'a, T> {
    type Part = &'a mut T;

    fn fits(&self, tiles: usize) -> bool {
        self.0.length == tiles
    }

    unsafe fn part(&self, tile: usize) -> &'a mut T {
        // SAFETY: the tile is less than the slice's length, and each item is requested once.
        unsafe { &mut *self.0.start.add(tile) }
    }
}

/// A slice in pieces of different lengths.
pub(crate) struct Ragged<'a, T> {
    slice: SharedSlice<'a, T>,
    starts: &'a [usize],
}

impl<'a, T> Ragged<'a, T> {
    /// Creates pieces that begin at `starts`. The last one reaches to the end, and further ones are empty.
    ///
    /// # Panics
    /// If the starts are not sorted or exceed the slice.
    pub fn new(slice: &'a mut [T], starts: &'a [usize]) -> Self {
        let end = starts.last().copied().unwrap_or(0);
        assert!(starts.is_sorted() && end <= slice.len(), "pieces lie in order within");
        Self {
            slice: SharedSlice::new(slice),
            starts,
        }
    }
}

// SAFETY: the pieces are disjoint.
unsafe impl<'a, T: Send> Split for Ragged<'a, T> {
    type Part = &'a mut [T];

    fn fits(&self, tiles: usize) -> bool {
        self.starts.len() <= tiles
    }

    unsafe fn part(&self, tile: usize) -> &'a mut [T] {
        let start = |tile: usize| self.starts.get(tile).copied().unwrap_or(self.slice.length);
        let (start, end) = (start(tile), start(tile + 1));
        // SAFETY: `new` has checked that the starts are sorted and within the slice.
        unsafe { self.slice.range(start, end) }
    }
}

// SAFETY: there are no data.
unsafe impl Split for () {
    type Part = ();

    fn fits(&self, _tiles: usize) -> bool {
        true
    }

    unsafe fn part(&self, _tile: usize) {}
}

// SAFETY: the contained data satisfy the contract, if there are any.
unsafe impl<D: Split> Split for Option<D> {
    type Part = Option<D::Part>;

    fn fits(&self, tiles: usize) -> bool {
        self.as_ref().is_none_or(|data| data.fits(tiles))
    }

    unsafe fn part(&self, tile: usize) -> Self::Part {
        // SAFETY: the same contract.
        self.as_ref().map(|data| unsafe { data.part(tile) })
    }
}

// SAFETY: each item satisfies the contract, and items are disjoint.
unsafe impl<D: Split, const N: usize> Split for [D; N] {
    type Part = [D::Part; N];

    fn fits(&self, tiles: usize) -> bool {
        self.iter().all(|data| data.fits(tiles))
    }

    unsafe fn part(&self, tile: usize) -> Self::Part {
        // SAFETY: the same contract.
        self.each_ref().map(|data| unsafe { data.part(tile) })
    }
}

macro_rules! split_tuples {
    ($($name:ident)*) => {
        // SAFETY: each item satisfies the contract, and items are disjoint.
        #[allow(non_snake_case)]
        unsafe impl<$($name: Split),*> Split for ($($name,)*) {
            type Part = ($($name::Part,)*);

            fn fits(&self, tiles: usize) -> bool {
                let ($($name,)*) = self;
                true $(&& $name.fits(tiles))*
            }

            unsafe fn part(&self, tile: usize) -> Self::Part {
                let ($($name,)*) = self;
                // SAFETY: the same contract.
                unsafe { ($($name.part(tile),)*) }
            }
        }
    };
}

split_tuples!(A);
split_tuples!(A B);
split_tuples!(A B C);
split_tuples!(A B C D);
split_tuples!(A B C D E);
split_tuples!(A B C D E F);
split_tuples!(A B C D E F G);
split_tuples!(A B C D E F G H);
