//! Data that tiles change, cut so that each has a part of its own.

use std::marker::PhantomData;

/// Data in parts that do not overlap.
///
/// # Safety
/// For every number of tiles that it [`fits`](Self::fits), parts of different tiles may be used at the same time, on
/// different threads.
pub(crate) unsafe trait Split: Sync {
    /// What the work on a tile is given.
    type Part;

    /// Whether there is a part for each of so many tiles, and none is left over.
    fn fits(&self, tiles: usize) -> bool;

    /// The part of a tile.
    ///
    /// # Safety
    /// It fits more tiles than `tile`, and this part is asked for once.
    unsafe fn part(&self, tile: usize) -> Self::Part;
}

/// A slice, borrowed mutably by whoever asks for a range that nobody else has.
struct SharedSlice<'a, T> {
    start: *mut T,
    length: usize,
    slice: PhantomData<&'a mut [T]>,
}

// SAFETY: `range` is all it offers, which hands out values of `&mut T`.
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
    /// `start <= end <= length`, and no other range that is asked for overlaps this one.
    unsafe fn range(&self, start: usize, end: usize) -> &'a mut [T] {
        // SAFETY: within the slice, which is borrowed for as long; nobody else has this range.
        unsafe { std::slice::from_raw_parts_mut(self.start.add(start), end - start) }
    }
}

/// A slice in pieces of one length, the last shorter.
pub(crate) struct Tiles<'a, T> {
    slice: SharedSlice<'a, T>,
    length: usize,
}

impl<'a, T> Tiles<'a, T> {
    /// Pieces of `length`, above 0.
    pub fn new(slice: &'a mut [T], length: usize) -> Self {
        assert!(length > 0, "tiles have a length");
        Self {
            slice: SharedSlice::new(slice),
            length,
        }
    }
}

// SAFETY: pieces of a slice one after another.
unsafe impl<'a, T: Send> Split for Tiles<'a, T> {
    type Part = &'a mut [T];

    fn fits(&self, tiles: usize) -> bool {
        self.slice.length.div_ceil(self.length) == tiles
    }

    unsafe fn part(&self, tile: usize) -> &'a mut [T] {
        let start = tile * self.length;
        let end = self.slice.length.min(start + self.length);
        // SAFETY: the tile is below the slice's length over the tiles', rounded up.
        unsafe { self.slice.range(start, end) }
    }
}

/// A slice with one item for each tile.
pub(crate) struct Items<'a, T>(SharedSlice<'a, T>);

impl<'a, T> Items<'a, T> {
    /// As many tiles as the slice has items.
    pub fn new(slice: &'a mut [T]) -> Self {
        Self(SharedSlice::new(slice))
    }
}

// SAFETY: each item is a part of its own.
unsafe impl<'a, T: Send> Split for Items<'a, T> {
    type Part = &'a mut T;

    fn fits(&self, tiles: usize) -> bool {
        self.0.length == tiles
    }

    unsafe fn part(&self, tile: usize) -> &'a mut T {
        // SAFETY: the tile is below the slice's length; an item is asked for once.
        unsafe { &mut *self.0.start.add(tile) }
    }
}

/// A slice in pieces of various lengths.
pub(crate) struct Ragged<'a, T> {
    slice: SharedSlice<'a, T>,
    starts: &'a [usize],
}

impl<'a, T> Ragged<'a, T> {
    /// Pieces from each of these places to the next, from the last to the end, and then empty ones. They go up, within
    /// the slice.
    ///
    /// # Panics
    /// Where they do not.
    pub fn new(slice: &'a mut [T], starts: &'a [usize]) -> Self {
        let end = starts.last().copied().unwrap_or(0);
        assert!(starts.is_sorted() && end <= slice.len(), "pieces lie in order within");
        Self {
            slice: SharedSlice::new(slice),
            starts,
        }
    }
}

// SAFETY: pieces of a slice one after another.
unsafe impl<'a, T: Send> Split for Ragged<'a, T> {
    type Part = &'a mut [T];

    fn fits(&self, tiles: usize) -> bool {
        self.starts.len() <= tiles
    }

    unsafe fn part(&self, tile: usize) -> &'a mut [T] {
        let start = |tile: usize| self.starts.get(tile).copied().unwrap_or(self.slice.length);
        let (start, end) = (start(tile), start(tile + 1));
        // SAFETY: `new` has seen that the starts go up and stay within.
        unsafe { self.slice.range(start, end) }
    }
}

// SAFETY: nothing.
unsafe impl Split for () {
    type Part = ();

    fn fits(&self, _tiles: usize) -> bool {
        true
    }

    unsafe fn part(&self, _tile: usize) {}
}

// SAFETY: what is in it does the same, or there is nothing.
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

// SAFETY: each does the same, and they share nothing.
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
        // SAFETY: each does the same, and they share nothing.
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
