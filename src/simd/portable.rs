//! Four lanes in plain Rust. Results are bitwise identical on every processor: roots and quotients are exact, and no
//! operations are fused.

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
        // SAFETY: guaranteed by the caller.
        Self(unsafe { from.cast::<[f32; 4]>().read() })
    }

    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        // SAFETY: guaranteed by the caller.
        unsafe { to.cast::<[f32; 4]>().write(self.0) }
    }

    #[inline(always)]
    unsafe fn gather<I: Index>(base: *const f32, indices: *const I) -> Self {
        // SAFETY: guaranteed by the caller.
        Self(from_fn(|lane| unsafe {
            *base.wrapping_add((*indices.add(lane)).to_usize())
        }))
    }

    #[inline(always)]
    unsafe fn load_transposed(at: impl Fn(usize) -> *const Record) -> [Self; 4] {
        // SAFETY: guaranteed by the caller.
        from_fn(|axis| Self(from_fn(|lane| unsafe { (*at(lane)).0[axis] })))
    }

    #[inline(always)]
    unsafe fn mul_sub(self, factor: Self, subtrahend: Self) -> Self {
        Self(from_fn(|lane| self.0[lane] * factor.0[lane] - subtrahend.0[lane]))
    }

    #[inline(always)]
    unsafe fn abs(self) -> Self {
        Self(self.0.map(f32::abs))
    }

    #[inline(always)]
    unsafe fn add(self, other: Self) -> Self {
        Self(from_fn(|lane| self.0[lane] + other.0[lane]))
    }

    #[inline(always)]
    unsafe fn sub(self, other: Self) -> Self {
        Self(from_fn(|lane| self.0[lane] - other.0[lane]))
    }

    #[inline(always)]
    unsafe fn mul(self, other: Self) -> Self {
        Self(from_fn(|lane| self.0[lane] * other.0[lane]))
    }

    #[inline(always)]
    unsafe fn div(self, other: Self) -> Self {
        Self(from_fn(|lane| self.0[lane] / other.0[lane]))
    }

    #[inline(always)]
    unsafe fn mul_add(self, factor: Self, summand: Self) -> Self {
        Self(from_fn(|lane| self.0[lane] * factor.0[lane] + summand.0[lane]))
    }

    #[inline(always)]
    unsafe fn force_over_length<const N: usize>(
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
    unsafe fn mask(self, mask: u32) -> Self {
        Self(from_fn(|lane| if mask >> lane & 1 == 1 { self.0[lane] } else { 0.0 }))
    }

    #[inline(always)]
    unsafe fn min(self, other: Self) -> Self {
        let min = |lane: usize| {
            if other.0[lane] < self.0[lane] {
                other.0[lane]
            } else {
                self.0[lane]
            }
        };
        Self(from_fn(min))
    }

    #[inline(always)]
    unsafe fn max(self, other: Self) -> Self {
        let max = |lane: usize| {
            if other.0[lane] > self.0[lane] {
                other.0[lane]
            } else {
                self.0[lane]
            }
        };
        Self(from_fn(max))
    }

    #[inline(always)]
    unsafe fn any_nan(self) -> bool {
        self.0.into_iter().any(f32::is_nan)
    }
}
