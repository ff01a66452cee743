//! Eight lanes of x86-64's AVX2, with fused multiply-add.

use std::arch::x86_64::*;

use glam::Vec3;

use super::Lanes;
use super::Record;
use super::lanes::{Index, common_instructions, instructions, record_at};
use super::link_batches::{BatchInput, LinkBatch};

#[derive(Clone, Copy)]
pub(super) struct Avx2Lanes(__m256);

/// Sets all bits of the lanes whose bit in `mask` is set.
#[inline(always)]
unsafe fn lane_mask(mask: u32) -> __m256 {
    // SAFETY: the caller guarantees the instructions.
    unsafe {
        let bits = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
        let set = _mm256_and_si256(_mm256_set1_epi32(mask as i32), bits);
        _mm256_castsi256_ps(_mm256_cmpeq_epi32(set, bits))
    }
}

/// `Lanes::force_over_length` from an approximate inverse square root and one Newton step.
///
/// Each stage is done for all `N` before the next one, because each is a long chain of operations. No closures: they
/// may be compiled separately, without the kernel's instructions.
macro_rules! force_over_length_by_newton {
    ($guess:ident, $multiply:ident, $subtract_product:ident, $splat:ident) => {
        #[inline(always)]
        unsafe fn force_over_length<const N: usize>(
            squares: [Self; N],
            stiffnesses: [Self; N],
            half_tensions: [Self; N],
        ) -> ([Self; N], [Self; N]) {
            unsafe {
                let mut guesses = squares;
                for guess in &mut guesses {
                    guess.0 = $guess(guess.0);
                }
                // Newton step: 1 / length = guess * correction / 2.
                let mut corrections = squares;
                for (root, guess) in corrections.iter_mut().zip(&guesses) {
                    root.0 = $multiply(root.0, guess.0);
                }
                for (root, guess) in corrections.iter_mut().zip(&guesses) {
                    root.0 = $subtract_product(root.0, guess.0, $splat(3.0));
                }
                let mut pulls = half_tensions;
                for (tension, guess) in pulls.iter_mut().zip(&guesses) {
                    tension.0 = $multiply(tension.0, guess.0);
                }
                for ((tension, correction), stiffness) in pulls.iter_mut().zip(&corrections).zip(&stiffnesses) {
                    tension.0 = $subtract_product(tension.0, correction.0, stiffness.0);
                }
                let mut inverses = guesses;
                for (guess, correction) in inverses.iter_mut().zip(&corrections) {
                    guess.0 = $multiply($multiply(guess.0, $splat(0.5)), correction.0);
                }
                (pulls, inverses)
            }
        }
    };
}

pub(super) use force_over_length_by_newton;

// SAFETY of every block: the caller guarantees the instructions and valid pointers. Loads and stores need only the
// alignment of a number.
#[allow(clippy::undocumented_unsafe_blocks)]
impl Lanes for Avx2Lanes {
    const COUNT: usize = 8;

    common_instructions!(
        _mm256_set1_ps,
        _mm256_loadu_ps,
        _mm256_storeu_ps,
        _mm256_min_ps,
        _mm256_max_ps
    );

    #[inline(always)]
    unsafe fn gather<I: Index>(base: *const f32, indices: *const I) -> Self {
        unsafe { Self(eight(four_at(base, indices), four_at(base, indices.add(4)))) }
    }

    #[inline(always)]
    unsafe fn load_transposed(at: impl Fn(usize) -> *const Record) -> [Self; 4] {
        // Transposes four records at a time in each half.
        unsafe {
            let a = eight(record(at(0)), record(at(4)));
            let b = eight(record(at(1)), record(at(5)));
            let c = eight(record(at(2)), record(at(6)));
            let d = eight(record(at(3)), record(at(7)));
            let (low_ab, high_ab) = (_mm256_unpacklo_ps(a, b), _mm256_unpackhi_ps(a, b));
            let (low_cd, high_cd) = (_mm256_unpacklo_ps(c, d), _mm256_unpackhi_ps(c, d));
            [
                Self(_mm256_shuffle_ps::<0b0100_0100>(low_ab, low_cd)),
                Self(_mm256_shuffle_ps::<0b1110_1110>(low_ab, low_cd)),
                Self(_mm256_shuffle_ps::<0b0100_0100>(high_ab, high_cd)),
                Self(_mm256_shuffle_ps::<0b1110_1110>(high_ab, high_cd)),
            ]
        }
    }

    #[inline(always)]
    unsafe fn scatter_add_records(sums: *mut Record, indices: *const u16, vectors: [Self; 3]) {
        unsafe {
            let [Self(x), Self(y), Self(z)] = vectors;
            let none = _mm256_setzero_ps();
            let (low_xy, high_xy) = (_mm256_unpacklo_ps(x, y), _mm256_unpackhi_ps(x, y));
            let (low_z, high_z) = (_mm256_unpacklo_ps(z, none), _mm256_unpackhi_ps(z, none));
            let pairs = [
                _mm256_shuffle_ps::<0b0100_0100>(low_xy, low_z),
                _mm256_shuffle_ps::<0b1110_1110>(low_xy, low_z),
                _mm256_shuffle_ps::<0b0100_0100>(high_xy, high_z),
                _mm256_shuffle_ps::<0b1110_1110>(high_xy, high_z),
            ];
            for (lane, pair) in pairs.into_iter().enumerate() {
                add_record(sums, indices.add(lane), _mm256_castps256_ps128(pair));
                add_record(sums, indices.add(lane + 4), _mm256_extractf128_ps::<1>(pair));
            }
        }
    }

    instructions! {
        mul_sub(factor, subtrahend) = _mm256_fmsub_ps;
        add(other) = _mm256_add_ps;
        sub(other) = _mm256_sub_ps;
        mul(other) = _mm256_mul_ps;
        div(other) = _mm256_div_ps;
        mul_add(factor, summand) = _mm256_fmadd_ps;
    }

    #[inline(always)]
    unsafe fn abs(self) -> Self {
        Self(unsafe { _mm256_andnot_ps(_mm256_set1_ps(-0.0), self.0) })
    }

    force_over_length_by_newton!(_mm256_rsqrt_ps, _mm256_mul_ps, _mm256_fnmadd_ps, _mm256_set1_ps);

    #[inline(always)]
    unsafe fn pull_batch(input: BatchInput, links: &LinkBatch) -> Option<Vec3> {
        let count = input.positions[0].len();
        assert!(input.positions.iter().all(|axis| axis.len() == count) && count <= i32::MAX as usize);
        let first = links.as_ptr().cast::<f32>();
        unsafe {
            // Numbers alternate between neighbor, stiffness and rest length. Blending the three loads keeps each
            // number's position free of conflicts.
            let [a, b, c] = [
                _mm256_loadu_ps(first),
                _mm256_loadu_ps(first.add(8)),
                _mm256_loadu_ps(first.add(16)),
            ];
            let neighbors = _mm256_blend_ps::<0b0010_0100>(_mm256_blend_ps::<0b1001_0010>(a, b), c);
            let stiffnesses = _mm256_blend_ps::<0b0100_1001>(_mm256_blend_ps::<0b0010_0100>(a, b), c);
            let rest_lengths = _mm256_blend_ps::<0b1001_0010>(_mm256_blend_ps::<0b0100_1001>(a, b), c);
            let stiffnesses = _mm256_permutevar8x32_ps(stiffnesses, _mm256_setr_epi32(1, 4, 7, 2, 5, 0, 3, 6));
            let rest_lengths = _mm256_permutevar8x32_ps(rest_lengths, _mm256_setr_epi32(2, 5, 0, 3, 6, 1, 4, 7));
            let (neighbors, last) = (_mm256_castps_si256(neighbors), _mm256_set1_epi32(count as i32 - 1));
            let within = _mm256_cmpeq_epi32(_mm256_max_epu32(neighbors, last), last);
            assert!(_mm256_movemask_epi8(within) == -1, "a link leads to a node");
            let [px, py, pz] = input.positions;
            let x = _mm256_sub_ps(load_neighbors(px, links), _mm256_set1_ps(input.here.x));
            let y = _mm256_sub_ps(load_neighbors(py, links), _mm256_set1_ps(input.here.y));
            let z = _mm256_sub_ps(load_neighbors(pz, links), _mm256_set1_ps(input.here.z));
            // Rounded like a single link, so that both ends of a spring compute equal forces in any storage.
            let [xx, yy, zz] = [_mm256_mul_ps(x, x), _mm256_mul_ps(y, y), _mm256_mul_ps(z, z)];
            let square = _mm256_add_ps(_mm256_add_ps(xx, yy), zz);
            let length = _mm256_sqrt_ps(square);
            let tension = _mm256_mul_ps(stiffnesses, _mm256_sub_ps(length, rest_lengths));
            let pull = _mm256_div_ps(tension, length);
            let [x, y, z] = [_mm256_mul_ps(x, pull), _mm256_mul_ps(y, pull), _mm256_mul_ps(z, pull)];
            let sum = Vec3::new(sum(x), sum(y), sum(z));
            (!sum.is_nan()).then_some(sum)
        }
    }

    #[inline(always)]
    unsafe fn mask(self, mask: u32) -> Self {
        Self(unsafe { _mm256_and_ps(self.0, lane_mask(mask)) })
    }

    #[inline(always)]
    unsafe fn any_nan(self) -> bool {
        unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_UNORD_Q>(self.0, self.0)) != 0 }
    }
}

/// Loads a record, which must be aligned.
#[inline(always)]
pub(super) unsafe fn record(address: *const Record) -> __m128 {
    // SAFETY: the caller guarantees the instructions and the record.
    unsafe { _mm_load_ps(address.cast()) }
}

/// Adds to the record at half of an even index.
#[inline(always)]
pub(super) unsafe fn add_record(sums: *mut Record, index: *const u16, record: __m128) {
    // SAFETY: the caller guarantees the instructions, a readable index and a writable record.
    unsafe {
        let address: *mut f32 = record_at(sums, index).cast_mut().cast();
        _mm_store_ps(address, _mm_add_ps(_mm_load_ps(address), record));
    }
}

/// Loads the coordinates of eight neighbors.
#[inline(always)]
unsafe fn load_neighbors(axis: &[f32], [a, b, c, d, e, f, g, h]: &LinkBatch) -> __m256 {
    let at = |link: &[u32; 3]| axis.as_ptr().wrapping_add(link[0] as usize);
    // SAFETY: the caller guarantees the instructions and readable neighbors.
    unsafe { eight(four(at(a), at(b), at(c), at(d)), four(at(e), at(f), at(g), at(h))) }
}

/// Sum of eight lanes.
#[inline(always)]
unsafe fn sum(lanes: __m256) -> f32 {
    // SAFETY: the caller guarantees the instructions.
    unsafe {
        let four = _mm_add_ps(_mm256_castps256_ps128(lanes), _mm256_extractf128_ps::<1>(lanes));
        let two = _mm_add_ps(four, _mm_movehl_ps(four, four));
        _mm_cvtss_f32(_mm_add_ss(two, _mm_movehdup_ps(two)))
    }
}

/// Loads four numbers from four addresses. On many processors this is faster than the gather instruction.
#[inline(always)]
unsafe fn four(a: *const f32, b: *const f32, c: *const f32, d: *const f32) -> __m128 {
    // SAFETY: the caller guarantees the instructions and readable addresses.
    unsafe {
        let lanes = _mm_load_ss(a);
        let lanes = _mm_insert_ps::<0x10>(lanes, _mm_load_ss(b));
        let lanes = _mm_insert_ps::<0x20>(lanes, _mm_load_ss(c));
        _mm_insert_ps::<0x30>(lanes, _mm_load_ss(d))
    }
}

/// Loads the numbers at four indices.
#[inline(always)]
pub(super) unsafe fn four_at<I: Index>(base: *const f32, indices: *const I) -> __m128 {
    // SAFETY: the same contract; the indices are readable.
    unsafe {
        let [a, b, c, d] = indices.cast::<[I; 4]>().read();
        four(
            base.wrapping_add(a.to_usize()),
            base.wrapping_add(b.to_usize()),
            base.wrapping_add(c.to_usize()),
            base.wrapping_add(d.to_usize()),
        )
    }
}

/// Joins two groups of four lanes.
#[inline(always)]
unsafe fn eight(low: __m128, high: __m128) -> __m256 {
    // SAFETY: the same contract.
    unsafe { _mm256_insertf128_ps::<1>(_mm256_castps128_ps256(low), high) }
}
