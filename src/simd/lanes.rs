//! What the spring kernel asks of a processor: some numbers side by side.

use glam::Vec3;

use super::Record;

use super::link_batches::{EightLinks, Sight, pull_one_by_one};

/// What an index is kept as.
pub(crate) trait Index: Copy {
    fn place(self) -> usize;
}

impl Index for u32 {
    #[inline(always)]
    fn place(self) -> usize {
        self as usize
    }
}

impl Index for u16 {
    #[inline(always)]
    fn place(self) -> usize {
        self.into()
    }
}

/// A few `f32` side by side, and what the spring kernel does with them.
///
/// # Safety
/// Every function is called only where the processor has the implementation's instructions; functions that take a pointer
/// also ask for what they say.
pub(crate) trait Lanes: Copy {
    /// How many; divides 16.
    const COUNT: usize;

    /// The same number in all.
    unsafe fn splat(value: f32) -> Self;

    /// `COUNT` numbers from `from`, readable and aligned to 4 bytes.
    unsafe fn load(from: *const f32) -> Self;

    /// To `COUNT` numbers at `to`, writable and aligned to 4 bytes.
    unsafe fn store(self, to: *mut f32);

    /// `base[indices[lane]]` for `COUNT` readable indices that are all less than 2^31 and lead to readable numbers.
    unsafe fn gather<I: Index>(base: *const f32, indices: *const I) -> Self;

    /// The four numbers of the readable record at `at(lane)`, for each of `COUNT` lanes.
    unsafe fn transposed(at: impl Fn(usize) -> *const Record) -> [Self; 4];

    /// The three numbers of `base[indices[lane]]` for `COUNT` readable indices that lead to readable records.
    #[inline(always)]
    unsafe fn records<I: Index>(base: *const Record, indices: *const I) -> [Self; 3] {
        // SAFETY: the caller's promise.
        let [x, y, z, _] = unsafe { Self::transposed(|lane| base.wrapping_add(indices.add(lane).read().place())) };
        [x, y, z]
    }

    /// The four numbers of `base[indices[lane] / 2]` for `COUNT` readable even indices that lead to readable records.
    #[inline(always)]
    unsafe fn records_twice(base: *const Record, indices: *const u16) -> [Self; 4] {
        // SAFETY: the caller's promise.
        unsafe { Self::transposed(|lane| twice(base, indices.add(lane))) }
    }

    /// Adds a vector of each lane to the three numbers of `sums[indices[lane] / 2]`, lane by lane, for `COUNT` readable even indices
    /// that lead to writable records; indices may be equal.
    #[inline(always)]
    unsafe fn add_to_records(sums: *mut Record, indices: *const u16, vectors: [Self; 3]) {
        let mut axes = [[0.0_f32; 16]; 3];
        for (axis, vector) in axes.iter_mut().zip(vectors) {
            // SAFETY: there are no more than sixteen lanes.
            unsafe { vector.store(axis.as_mut_ptr()) };
        }
        for lane in 0..Self::COUNT {
            // SAFETY: the caller's promise.
            let Record(sum) = unsafe { &mut *twice(sums, indices.add(lane)).cast_mut() };
            for (sum, axis) in sum.iter_mut().zip(&axes) {
                *sum += axis[lane];
            }
        }
    }

    unsafe fn add(self, other: Self) -> Self;

    /// `self * factor - subtrahend`
    unsafe fn multiply_subtract(self, factor: Self, subtrahend: Self) -> Self;

    /// Without their signs.
    unsafe fn size(self) -> Self;

    unsafe fn subtract(self, other: Self) -> Self;

    unsafe fn multiply(self, other: Self) -> Self;

    unsafe fn divide(self, other: Self) -> Self;

    /// `self * factor + summand`
    unsafe fn multiply_add(self, factor: Self, summand: Self) -> Self;

    /// The forces of springs over their lengths, `stiffness - 2 half_tension / length`, and 1 over their lengths, within
    /// 2^-22 of `2 half_tension / length` and of themselves, from the squares of the lengths; for normal numbers.
    unsafe fn pulls<const N: usize>(
        squares: [Self; N],
        stiffnesses: [Self; N],
        half_tensions: [Self; N],
    ) -> ([Self; N], [Self; N]);

    /// As [`Eights::pull`](super::Eights::pull).
    #[inline(always)]
    unsafe fn pull_eight(sight: Sight, links: &EightLinks) -> Option<Vec3> {
        pull_one_by_one(sight, links)
    }

    /// 0 in the lanes whose bit in `mask` is not set.
    unsafe fn where_set(self, mask: u32) -> Self;

    /// The lesser of each lane of both; that of `self` where `other` has no number.
    unsafe fn lesser(self, other: Self) -> Self;

    /// The greater of each lane of both; that of `self` where `other` has no number.
    unsafe fn greater(self, other: Self) -> Self;

    /// Whether any lane is NaN.
    unsafe fn any_nan(self) -> bool;
}

/// Functions of lanes that are one instruction each.
macro_rules! instructions {
    ($($name:ident($($operand:ident),*) = $instruction:ident;)*) => {$(
        #[inline(always)]
        unsafe fn $name(self $(, $operand: Self)*) -> Self {
            Self(unsafe { $instruction(self.0 $(, $operand.0)*) })
        }
    )*};
}

pub(super) use instructions;

/// Functions of lanes for which every processor has an instruction, alike but for its name.
macro_rules! common_instructions {
    ($splat:ident, $load:ident, $store:ident, $lesser:ident, $greater:ident) => {
        #[inline(always)]
        unsafe fn splat(value: f32) -> Self {
            Self(unsafe { $splat(value) })
        }

        #[inline(always)]
        unsafe fn load(from: *const f32) -> Self {
            Self(unsafe { $load(from) })
        }

        #[inline(always)]
        unsafe fn store(self, to: *mut f32) {
            unsafe { $store(to, self.0) }
        }

        #[inline(always)]
        unsafe fn lesser(self, other: Self) -> Self {
            Self(unsafe { $lesser(other.0, self.0) })
        }

        #[inline(always)]
        unsafe fn greater(self, other: Self) -> Self {
            Self(unsafe { $greater(other.0, self.0) })
        }
    };
}

pub(super) use common_instructions;

/// The record of half an even index: half a record is as much as an address can be scaled by.
#[inline(always)]
pub(super) unsafe fn twice(base: *const Record, index: *const u16) -> *const Record {
    // SAFETY: the caller promises a readable index.
    let halves = unsafe { usize::from(index.read()) };
    base.cast::<[f32; 2]>().wrapping_add(halves).cast()
}
