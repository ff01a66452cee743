//! Four lanes of AArch64's NEON.

use std::arch::aarch64::*;

use super::Lanes;
use super::Record;
use super::lanes::{Index, common_instructions, instructions};

#[derive(Clone, Copy)]
pub(super) struct NeonLanes(float32x4_t);

/// Sets all bits of the lanes whose bit in `mask` is set.
#[inline(always)]
unsafe fn lane_mask(mask: u32) -> uint32x4_t {
    const BITS: [u32; 4] = [1, 2, 4, 8];
    // SAFETY: every AArch64 processor has the instructions; four numbers are read.
    unsafe { vtstq_u32(vdupq_n_u32(mask), vld1q_u32(BITS.as_ptr())) }
}

// SAFETY of every block: every AArch64 processor has the instructions, and the caller guarantees valid pointers. Loads
// and stores need only the alignment of a number.
#[allow(clippy::undocumented_unsafe_blocks)]
impl Lanes for NeonLanes {
    const COUNT: usize = 4;

    common_instructions!(vdupq_n_f32, vld1q_f32, vst1q_f32, vminnmq_f32, vmaxnmq_f32);

    #[inline(always)]
    unsafe fn gather<I: Index>(base: *const f32, indices: *const I) -> Self {
        let values: [f32; 4] =
            std::array::from_fn(|lane| unsafe { *base.wrapping_add((*indices.add(lane)).to_usize()) });
        Self(unsafe { vld1q_f32(values.as_ptr()) })
    }

    #[inline(always)]
    unsafe fn load_transposed(at: impl Fn(usize) -> *const Record) -> [Self; 4] {
        unsafe {
            let [a, b, c, d] = [0, 1, 2, 3].map(|lane| vld1q_f32(at(lane).cast()));
            let (low_ac, high_ac) = (vzip1q_f32(a, c), vzip2q_f32(a, c));
            let (low_bd, high_bd) = (vzip1q_f32(b, d), vzip2q_f32(b, d));
            [
                Self(vzip1q_f32(low_ac, low_bd)),
                Self(vzip2q_f32(low_ac, low_bd)),
                Self(vzip1q_f32(high_ac, high_bd)),
                Self(vzip2q_f32(high_ac, high_bd)),
            ]
        }
    }

    #[inline(always)]
    unsafe fn mul_sub(self, factor: Self, subtrahend: Self) -> Self {
        Self(unsafe { vnegq_f32(vfmsq_f32(subtrahend.0, self.0, factor.0)) })
    }

    instructions! {
        abs() = vabsq_f32;
        add(other) = vaddq_f32;
        sub(other) = vsubq_f32;
        mul(other) = vmulq_f32;
        div(other) = vdivq_f32;
    }

    #[inline(always)]
    unsafe fn mul_add(self, factor: Self, summand: Self) -> Self {
        Self(unsafe { vfmaq_f32(summand.0, self.0, factor.0) })
    }

    #[inline(always)]
    unsafe fn force_over_length<const N: usize>(
        squares: [Self; N],
        stiffnesses: [Self; N],
        half_tensions: [Self; N],
    ) -> ([Self; N], [Self; N]) {
        unsafe {
            let inverses = squares.map(|square| vdivq_f32(vdupq_n_f32(1.0), vsqrtq_f32(square.0)));
            let pull = |n: usize| {
                let tension = vaddq_f32(half_tensions[n].0, half_tensions[n].0);
                Self(vfmsq_f32(stiffnesses[n].0, tension, inverses[n]))
            };
            (std::array::from_fn(pull), inverses.map(Self))
        }
    }

    #[inline(always)]
    unsafe fn mask(self, mask: u32) -> Self {
        Self(unsafe { vreinterpretq_f32_u32(vandq_u32(vreinterpretq_u32_f32(self.0), lane_mask(mask))) })
    }

    #[inline(always)]
    unsafe fn any_nan(self) -> bool {
        unsafe { vminvq_u32(vceqq_f32(self.0, self.0)) == 0 }
    }
}
