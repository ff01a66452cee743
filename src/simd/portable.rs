//! Four lanes in plain Rust, with the same bits on every processor: exact roots and quotients, no fused operations.

use std::array::from_fn;

use super::Lanes;
use super::Record;
use super::lanes::Index;

#[derive(Clone, Copy)]
pub(super) struct PortableLanes([f32; 4]);

impl Lanes for PortableLanes {
    const COUNT: usize = 4;

    #[inline(always)]
    unsafe fn splat(value: f32) -> Self {
        Self([value; 4])
    }

    #[inline(always)]
    unsafe fn load(from: *const f32) -> Self {
        // SAFETY: the caller's promise.
        Self(unsafe { from.cast::<[f32; 4]>().read() })
    }

    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        // SAFETY: the caller's promise.
        unsafe { to.cast::<[f32; 4]>().write(self.0) }
    }

    #[inline(always)]
    unsafe fn gather<I: Index>(base: *const f32, indices: *const I) -> Self {
        // SAFETY: the caller's promise.
        Self(from_fn(|lane| unsafe {
            *base.wrapping_add((*indices.add(lane)).place())
        }))
    }

    #[inline(always)]
    unsafe fn transposed(at: impl Fn(usize) -> *const Record) -> [Self; 4] {
        // SAFETY: the caller's promise.
        from_fn(|axis| Self(from_fn(|lane| unsafe { (*at(lane)).0[axis] })))
    }

    #[inline(always)]
    unsafe fn multiply_subtract(self, factor: Self, subtrahend: Self) -> Self {
        Self(from_fn(|lane| self.0[lane] * factor.0[lane] - subtrahend.0[lane]))
    }

    #[inline(always)]
    unsafe fn size(self) -> Self {
        Self(self.0.map(f32::abs))
    }

    #[inline(always)]
    unsafe fn add(self, other: Self) -> Self {
        Self(from_fn(|lane| self.0[lane] + other.0[lane]))
    }

    #[inline(always)]
    unsafe fn subtract(self, other: Self) -> Self {
        Self(from_fn(|lane| self.0[lane] - other.0[lane]))
    }

    #[inline(always)]
    unsafe fn multiply(self, other: Self) -> Self {
        Self(from_fn(|lane| self.0[lane] * other.0[lane]))
    }

    #[inline(always)]
    unsafe fn divide(self, other: Self) -> Self {
        Self(from_fn(|lane| self.0[lane] / other.0[lane]))
    }

    #[inline(always)]
    unsafe fn multiply_add(self, factor: Self, summand: Self) -> Self {
        Self(from_fn(|lane| self.0[lane] * factor.0[lane] + summand.0[lane]))
    }

    #[inline(always)]
    unsafe fn pulls<const N: usize>(
        squares: [Self; N],
        stiffnesses: [Self; N],
        half_tensions: [Self; N],
    ) -> ([Self; N], [Self; N]) {
        let inverses = squares.map(|square| square.0.map(|square| 1.0 / square.sqrt()));
        let pull = |n: usize, lane: usize| {
            let tension = 2.0 * half_tensions[n].0[lane];
            stiffnesses[n].0[lane] - tension * inverses[n][lane]
        };
        (from_fn(|n| Self(from_fn(|lane| pull(n, lane)))), inverses.map(Self))
    }

    #[inline(always)]
    unsafe fn where_set(self, mask: u32) -> Self {
        Self(from_fn(|lane| if mask >> lane & 1 == 1 { self.0[lane] } else { 0.0 }))
    }

    #[inline(always)]
    unsafe fn lesser(self, other: Self) -> Self {
        let lesser = |lane: usize| {
            if other.0[lane] < self.0[lane] {
                other.0[lane]
            } else {
                self.0[lane]
            }
        };
        Self(from_fn(lesser))
    }

    #[inline(always)]
    unsafe fn greater(self, other: Self) -> Self {
        let greater = |lane: usize| {
            if other.0[lane] > self.0[lane] {
                other.0[lane]
            } else {
                self.0[lane]
            }
        };
        Self(from_fn(greater))
    }

    #[inline(always)]
    unsafe fn any_nan(self) -> bool {
        self.0.into_iter().any(f32::is_nan)
    }
}
