//! Minimum and maximum of many numbers.

use super::Lanes;
use super::WithLanes;

/// Minimum and maximum. The result is unspecified if a number is NaN.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Range {
    pub least: f32,
    pub greatest: f32,
}

impl Range {
    const EMPTY: Self = Self {
        least: f32::INFINITY,
        greatest: f32::NEG_INFINITY,
    };

    fn with(self, value: f32) -> Self {
        Self {
            least: if value < self.least { value } else { self.least },
            greatest: if value > self.greatest { value } else { self.greatest },
        }
    }
}

/// Numbers along each axis, whose ranges a kernel computes.
pub(super) struct Ranges<'a>(pub [&'a [f32]; 3]);

impl WithLanes for Ranges<'_> {
    type Output = [Range; 3];

    #[inline(always)]
    unsafe fn run<L: Lanes>(self) -> [Range; 3] {
        let [x, y, z] = self.0;
        // SAFETY: the same contract.
        unsafe { [range::<L>(x), range::<L>(y), range::<L>(z)] }
    }
}

/// Range of `values`.
///
/// # Safety
/// The processor must have the instructions of `L`.
#[inline(always)]
unsafe fn range<L: Lanes>(values: &[f32]) -> Range {
    // Two accumulators shorten the dependency chain.
    let (pairs, rest) = values.split_at(values.len() / (2 * L::COUNT) * (2 * L::COUNT));
    let mut lanes = [f32::INFINITY; 16];
    let mut range = Range::EMPTY;
    // SAFETY: the same contract. Every pair is within the slice, and every lane within the array.
    unsafe {
        let (mut least, mut greatest) = ([L::splat(f32::INFINITY); 2], [L::splat(f32::NEG_INFINITY); 2]);
        for pair in pairs.chunks_exact(2 * L::COUNT) {
            for half in 0..2 {
                let values = L::load(pair.as_ptr().add(half * L::COUNT));
                least[half] = least[half].min(values);
                greatest[half] = greatest[half].max(values);
            }
        }
        least[0].min(least[1]).store(lanes.as_mut_ptr());
        for &lane in &lanes[..L::COUNT] {
            range.least = if lane < range.least { lane } else { range.least };
        }
        greatest[0].max(greatest[1]).store(lanes.as_mut_ptr());
        for &lane in &lanes[..L::COUNT] {
            range.greatest = if lane > range.greatest { lane } else { range.greatest };
        }
    }
    rest.iter().fold(range, |range, &value| range.with(value))
}
