//! The least and the greatest of many numbers.

use super::Lanes;
use super::WithLanes;

/// The least and the greatest of some numbers; of what is NaN nothing is said.
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

/// The ranges of some numbers along each axis, for a kernel to find.
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

/// The range of `values`.
///
/// # Safety
/// The processor has the instructions of `L`.
#[inline(always)]
unsafe fn range<L: Lanes>(values: &[f32]) -> Range {
    // Two chains, because each step of one waits for the one before.
    let (pairs, rest) = values.split_at(values.len() / (2 * L::COUNT) * (2 * L::COUNT));
    let mut lanes = [f32::INFINITY; 16];
    let mut found = Range::EMPTY;
    // SAFETY: the same contract; every pair lies within the slice, and every lane within the array.
    unsafe {
        let (mut least, mut greatest) = ([L::splat(f32::INFINITY); 2], [L::splat(f32::NEG_INFINITY); 2]);
        for pair in pairs.chunks_exact(2 * L::COUNT) {
            for half in 0..2 {
                let values = L::load(pair.as_ptr().add(half * L::COUNT));
                least[half] = least[half].lesser(values);
                greatest[half] = greatest[half].greater(values);
            }
        }
        least[0].lesser(least[1]).store(lanes.as_mut_ptr());
        for &lane in &lanes[..L::COUNT] {
            found.least = if lane < found.least { lane } else { found.least };
        }
        greatest[0].greater(greatest[1]).store(lanes.as_mut_ptr());
        for &lane in &lanes[..L::COUNT] {
            found.greatest = if lane > found.greatest { lane } else { found.greatest };
        }
    }
    rest.iter().fold(found, |found, &value| found.with(value))
}
