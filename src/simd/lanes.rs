//! SIMD operations that the kernels need.

use glam::Vec3;

use super::Record;

use super::link_batches::{BatchInput, LinkBatch, pull_sequentially};

/// Integer type of stored indices.
pub(crate) trait Index: Copy {
    fn to_usize(self) -> usize;
}

impl Index for u32 {
    #[inline(always)]
    fn to_usize(self) -> usize {
        self as usize
    }
}

impl Index for u16 {
    #[inline(always)]
    fn to_usize(self) -> usize {
        self.into()
    }
}

/// A SIMD register of `f32` lanes.
///
/// # Safety
/// The processor must have the implementation's instructions. Functions that take a pointer have additional
/// requirements.
pub(crate) trait Lanes: Copy {
    /// Number of lanes, a divisor of 16.
    const COUNT: usize;

    /// Copies a number to all lanes.
    unsafe fn splat(value: f32) -> Self;

    /// Loads `COUNT` numbers from `from`, which must be readable and aligned to 4 bytes.
    unsafe fn load(from: *const f32) -> Self;

    /// Stores `COUNT` numbers at `to`, which must be writable and aligned to 4 bytes.
    unsafe fn store(self, to: *mut f32);

    /// Loads `base[indices[lane]]`. The `COUNT` indices must be readable, less than 2^31, and refer to readable
    /// numbers.
    unsafe fn gather<I: Index>(base: *const f32, indices: *const I) -> Self;

    /// Loads the four numbers of the record at `at(lane)`, which must be readable, for each of `COUNT` lanes.
    unsafe fn load_transposed(at: impl Fn(usize) -> *const Record) -> [Self; 4];

    /// Loads the three numbers of `base[indices[lane]]`. The `COUNT` indices must be readable and refer to readable
    /// records.
    #[inline(always)]
    unsafe fn gather_records<I: Index>(base: *const Record, indices: *const I) -> [Self; 3] {
        // SAFETY: guaranteed by the caller.
        let [x, y, z, _] =
            unsafe { Self::load_transposed(|lane| base.wrapping_add(indices.add(lane).read().to_usize())) };
        [x, y, z]
    }

    /// Loads the four numbers of `base[indices[lane] / 2]`. The `COUNT` indices must be readable, even, and refer to
    /// readable records.
    #[inline(always)]
    unsafe fn gather_records_scaled(base: *const Record, indices: *const u16) -> [Self; 4] {
        // SAFETY: guaranteed by the caller.
        unsafe { Self::load_transposed(|lane| record_at(base, indices.add(lane))) }
    }

    /// Adds one vector per lane to the three numbers of `sums[indices[lane] / 2]`, lane by lane. The `COUNT` indices
    /// must be readable, even, and refer to writable records. They may be equal.
    #[inline(always)]
    unsafe fn scatter_add_records(sums: *mut Record, indices: *const u16, vectors: [Self; 3]) {
        let mut axes = [[0.0_f32; 16]; 3];
        for (axis, vector) in axes.iter_mut().zip(vectors) {
            // SAFETY: there are at most sixteen lanes.
            unsafe { vector.store(axis.as_mut_ptr()) };
        }
        for lane in 0..Self::COUNT {
            // SAFETY: guaranteed by the caller.
            let Record(sum) = unsafe { &mut *record_at(sums, indices.add(lane)).cast_mut() };
            for (sum, axis) in sum.iter_mut().zip(&axes) {
                *sum += axis[lane];
            }
        }
    }

    unsafe fn add(self, other: Self) -> Self;

    /// `self * factor - subtrahend`
    unsafe fn mul_sub(self, factor: Self, subtrahend: Self) -> Self;

    /// Absolute values.
    unsafe fn abs(self) -> Self;

    unsafe fn sub(self, other: Self) -> Self;

    unsafe fn mul(self, other: Self) -> Self;

    unsafe fn div(self, other: Self) -> Self;

    /// `self * factor + summand`
    unsafe fn mul_add(self, factor: Self, summand: Self) -> Self;

    /// Computes spring forces over lengths, `stiffness - 2 half_tension / length`, and inverse lengths, from squared
    /// lengths. The errors are below 2^-22 of `2 half_tension / length` and of the inverse lengths, for normal numbers.
    unsafe fn force_over_length<const N: usize>(
        squares: [Self; N],
        stiffnesses: [Self; N],
        half_tensions: [Self; N],
    ) -> ([Self; N], [Self; N]);

    /// Computes [`BatchKernel::pull`](super::BatchKernel::pull).
    #[inline(always)]
    unsafe fn pull_batch(input: BatchInput, links: &LinkBatch) -> Option<Vec3> {
        pull_sequentially(input, links)
    }

    /// Sets the lanes whose bit in `mask` is not set to 0.
    unsafe fn mask(self, mask: u32) -> Self;

    /// Minimum per lane. If `other` is NaN, the result is `self`.
    unsafe fn min(self, other: Self) -> Self;

    /// Maximum per lane. If `other` is NaN, the result is `self`.
    unsafe fn max(self, other: Self) -> Self;

    /// True if any lane is NaN.
    unsafe fn any_nan(self) -> bool;
}

/// Defines functions that are one instruction each.
macro_rules! instructions {
    ($($name:ident($($operand:ident),*) = $instruction:ident;)*) => {$(
        #[inline(always)]
        unsafe fn $name(self $(, $operand: Self)*) -> Self {
            Self(unsafe { $instruction(self.0 $(, $operand.0)*) })
        }
    )*};
}

pub(super) use instructions;

/// Defines functions that differ only in the name of the instruction.
macro_rules! common_instructions {
    ($splat:ident, $load:ident, $store:ident, $min:ident, $max:ident) => {
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
        unsafe fn min(self, other: Self) -> Self {
            Self(unsafe { $min(other.0, self.0) })
        }

        #[inline(always)]
        unsafe fn max(self, other: Self) -> Self {
            Self(unsafe { $max(other.0, self.0) })
        }
    };
}

pub(super) use common_instructions;

/// Address of the record at half of an even index. Half a record is the largest scale that an address supports.
#[inline(always)]
pub(super) unsafe fn record_at(base: *const Record, index: *const u16) -> *const Record {
    // SAFETY: the caller guarantees a readable index.
    let halves = unsafe { usize::from(index.read()) };
    base.cast::<[f32; 2]>().wrapping_add(halves).cast()
}
