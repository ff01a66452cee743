//! Sixteen lanes of x86-64's AVX-512.

use std::arch::x86_64::*;

use glam::Vec3;

use super::Lanes;
use super::Record;
use super::avx2::{Avx2Lanes, add_record, force_over_length_by_newton, four_at, record};
use super::lanes::{Index, common_instructions, instructions};
use super::link_batches::{BatchInput, LinkBatch};

#[derive(Clone, Copy)]
pub(super) struct Avx512Lanes(__m512);

// SAFETY of every block: the caller guarantees the instructions and valid pointers. Loads and stores need only the
// alignment of a number.
#[allow(clippy::undocumented_unsafe_blocks)]
impl Lanes for Avx512Lanes {
    const COUNT: usize = 16;

    common_instructions!(
        _mm512_set1_ps,
        _mm512_loadu_ps,
        _mm512_storeu_ps,
        _mm512_min_ps,
        _mm512_max_ps
    );

    #[inline(always)]
    unsafe fn gather<I: Index>(base: *const f32, indices: *const I) -> Self {
        unsafe {
            Self(sixteen(
                four_at(base, indices),
                four_at(base, indices.add(4)),
                four_at(base, indices.add(8)),
                four_at(base, indices.add(12)),
            ))
        }
    }

    #[inline(always)]
    unsafe fn load_transposed(at: impl Fn(usize) -> *const Record) -> [Self; 4] {
        // Transposes four records at a time in each quarter.
        unsafe {
            let a = sixteen(record(at(0)), record(at(4)), record(at(8)), record(at(12)));
            let b = sixteen(record(at(1)), record(at(5)), record(at(9)), record(at(13)));
            let c = sixteen(record(at(2)), record(at(6)), record(at(10)), record(at(14)));
            let d = sixteen(record(at(3)), record(at(7)), record(at(11)), record(at(15)));
            let (low_ab, high_ab) = (_mm512_unpacklo_ps(a, b), _mm512_unpackhi_ps(a, b));
            let (low_cd, high_cd) = (_mm512_unpacklo_ps(c, d), _mm512_unpackhi_ps(c, d));
            [
                Self(_mm512_shuffle_ps::<0b0100_0100>(low_ab, low_cd)),
                Self(_mm512_shuffle_ps::<0b1110_1110>(low_ab, low_cd)),
                Self(_mm512_shuffle_ps::<0b0100_0100>(high_ab, high_cd)),
                Self(_mm512_shuffle_ps::<0b1110_1110>(high_ab, high_cd)),
            ]
        }
    }

    #[inline(always)]
    unsafe fn scatter_add_records(sums: *mut Record, indices: *const u16, vectors: [Self; 3]) {
        unsafe {
            let [Self(x), Self(y), Self(z)] = vectors;
            let none = _mm512_setzero_ps();
            let (low_xy, high_xy) = (_mm512_unpacklo_ps(x, y), _mm512_unpackhi_ps(x, y));
            let (low_z, high_z) = (_mm512_unpacklo_ps(z, none), _mm512_unpackhi_ps(z, none));
            let quarters = [
                _mm512_shuffle_ps::<0b0100_0100>(low_xy, low_z),
                _mm512_shuffle_ps::<0b1110_1110>(low_xy, low_z),
                _mm512_shuffle_ps::<0b0100_0100>(high_xy, high_z),
                _mm512_shuffle_ps::<0b1110_1110>(high_xy, high_z),
            ];
            for (lane, quarter) in quarters.into_iter().enumerate() {
                add_record(sums, indices.add(lane), _mm512_castps512_ps128(quarter));
                add_record(sums, indices.add(lane + 4), _mm512_extractf32x4_ps::<1>(quarter));
                add_record(sums, indices.add(lane + 8), _mm512_extractf32x4_ps::<2>(quarter));
                add_record(sums, indices.add(lane + 12), _mm512_extractf32x4_ps::<3>(quarter));
            }
        }
    }

    instructions! {
        mul_sub(factor, subtrahend) = _mm512_fmsub_ps;
        abs() = _mm512_abs_ps;
        add(other) = _mm512_add_ps;
        sub(other) = _mm512_sub_ps;
        mul(other) = _mm512_mul_ps;
        div(other) = _mm512_div_ps;
        mul_add(factor, summand) = _mm512_fmadd_ps;
    }

    force_over_length_by_newton!(_mm512_rsqrt14_ps, _mm512_mul_ps, _mm512_fnmadd_ps, _mm512_set1_ps);

    #[inline(always)]
    unsafe fn pull_batch(input: BatchInput, links: &LinkBatch) -> Option<Vec3> {
        // AVX-512 includes AVX2.
        unsafe { Avx2Lanes::pull_batch(input, links) }
    }

    #[inline(always)]
    unsafe fn mask(self, mask: u32) -> Self {
        Self(unsafe { _mm512_maskz_mov_ps(mask as __mmask16, self.0) })
    }

    #[inline(always)]
    unsafe fn any_nan(self) -> bool {
        unsafe { _mm512_cmp_ps_mask::<_CMP_UNORD_Q>(self.0, self.0) != 0 }
    }
}

#[inline(always)]
unsafe fn sixteen(a: __m128, b: __m128, c: __m128, d: __m128) -> __m512 {
    // SAFETY: the caller guarantees the instructions.
    unsafe {
        let lanes = _mm512_castps128_ps512(a);
        let lanes = _mm512_insertf32x4::<1>(lanes, b);
        let lanes = _mm512_insertf32x4::<2>(lanes, c);
        _mm512_insertf32x4::<3>(lanes, d)
    }
}
