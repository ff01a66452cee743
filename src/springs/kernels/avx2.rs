//! Eight lanes of x86-64's AVX2, with fused multiply-add.

use std::arch::x86_64::*;
use std::array::from_fn;

use super::lanes::Lanes;

#[derive(Clone, Copy)]
pub(super) struct Avx2Lanes(__m256);

/// All bits of the lanes whose bit in `mask` is set.
#[inline(always)]
unsafe fn spread(mask: u32) -> __m256 {
    // SAFETY: the caller promises the instructions.
    unsafe {
        let bits = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
        let set = _mm256_and_si256(_mm256_set1_epi32(mask as i32), bits);
        _mm256_castsi256_ps(_mm256_cmpeq_epi32(set, bits))
    }
}

// SAFETY of every block: the caller promises the instructions, and that what pointers lead to is there; no load or store
// here asks for more than the alignment of a number.
#[allow(clippy::undocumented_unsafe_blocks)]
impl Lanes for Avx2Lanes {
    const COUNT: usize = 8;

    #[inline(always)]
    unsafe fn splat(value: f32) -> Self {
        Self(unsafe { _mm256_set1_ps(value) })
    }

    #[inline(always)]
    unsafe fn load(from: *const f32) -> Self {
        Self(unsafe { _mm256_loadu_ps(from) })
    }

    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        unsafe { _mm256_storeu_ps(to, self.0) }
    }

    #[inline(always)]
    unsafe fn gather(base: *const f32, indices: *const u32) -> Self {
        unsafe { Self(_mm256_i32gather_ps::<4>(base, _mm256_loadu_si256(indices.cast()))) }
    }

    #[inline(always)]
    unsafe fn gather_near(base: *const f32, indices: *const u16) -> Self {
        unsafe {
            let indices = _mm256_cvtepu16_epi32(_mm_loadu_si128(indices.cast()));
            Self(_mm256_i32gather_ps::<4>(base, indices))
        }
    }

    #[inline(always)]
    unsafe fn subtract(self, other: Self) -> Self {
        Self(unsafe { _mm256_sub_ps(self.0, other.0) })
    }

    #[inline(always)]
    unsafe fn multiply(self, other: Self) -> Self {
        Self(unsafe { _mm256_mul_ps(self.0, other.0) })
    }

    #[inline(always)]
    unsafe fn multiply_add(self, factor: Self, summand: Self) -> Self {
        Self(unsafe { _mm256_fmadd_ps(self.0, factor.0, summand.0) })
    }

    #[inline(always)]
    unsafe fn pulls<const N: usize>(
        squares: [Self; N],
        stiffnesses: [Self; N],
        half_tensions: [Self; N],
    ) -> ([Self; N], [Self; N]) {
        unsafe {
            let guesses = squares.map(|square| _mm256_rsqrt_ps(square.0));
            let roots: [__m256; N] = from_fn(|n| _mm256_mul_ps(squares[n].0, guesses[n]));
            // Newton's step: 1 / length = guess * corrections / 2.
            let corrections: [__m256; N] = from_fn(|n| _mm256_fnmadd_ps(roots[n], guesses[n], _mm256_set1_ps(3.0)));
            let tensions: [__m256; N] = from_fn(|n| _mm256_mul_ps(half_tensions[n].0, guesses[n]));
            let pulls = from_fn(|n| Self(_mm256_fnmadd_ps(tensions[n], corrections[n], stiffnesses[n].0)));
            let halves = guesses.map(|guess| _mm256_mul_ps(guess, _mm256_set1_ps(0.5)));
            let inverses = from_fn(|n| Self(_mm256_mul_ps(halves[n], corrections[n])));
            (pulls, inverses)
        }
    }

    #[inline(always)]
    unsafe fn where_set(self, mask: u32) -> Self {
        Self(unsafe { _mm256_and_ps(self.0, spread(mask)) })
    }

    #[inline(always)]
    unsafe fn lesser(self, other: Self) -> Self {
        Self(unsafe { _mm256_min_ps(other.0, self.0) })
    }

    #[inline(always)]
    unsafe fn greater(self, other: Self) -> Self {
        Self(unsafe { _mm256_max_ps(other.0, self.0) })
    }

    #[inline(always)]
    unsafe fn any_nan(self) -> bool {
        unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_UNORD_Q>(self.0, self.0)) != 0 }
    }
}
