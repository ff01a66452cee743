//! What the spring kernel asks of a processor: some numbers side by side.

use glam::Vec3;

use super::Record;

use super::link_batches::{EightLinks, Sight, pull_one_by_one};

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
    unsafe fn gather(base: *const f32, indices: *const u32) -> Self;

    /// The same with small indices.
    unsafe fn gather_near(base: *const f32, indices: *const u16) -> Self;

    /// The three numbers of `base[indices[lane]]` for `COUNT` readable indices that lead to readable records.
    unsafe fn records(base: *const Record, indices: *const u32) -> [Self; 3];

    /// The same with small indices.
    unsafe fn records_near(base: *const Record, indices: *const u16) -> [Self; 3];

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
            let Record(sum) = unsafe { &mut *sums.wrapping_add(usize::from(*indices.add(lane) / 2)) };
            for (sum, axis) in sum.iter_mut().zip(&axes) {
                *sum += axis[lane];
            }
        }
    }

    unsafe fn add(self, other: Self) -> Self;

    /// The four numbers of `base[indices[lane] / 2]` for `COUNT` readable even indices that lead to readable records.
    unsafe fn records_twice(base: *const Record, indices: *const u16) -> [Self; 4];

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
