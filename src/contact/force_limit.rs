//! Search for how far a tool with a force limit moves.

use crate::codec::saved;

/// Maximum number of times that a step is repeated for a tool whose force exceeds its limit.
pub(crate) const MAX_FORCE_LIMIT_TRIES: u32 = 16;

/// The search ends at this fraction of the force limit.
const ACCEPTED: f32 = 0.98;

/// Maximum fraction of its path that tissue pushes a tool back in a step.
const MAX_BACK: f32 = 1.0;

/// Factor on a backward extrapolation, so that it brackets the root.
const OVERSHOOT: f32 = 1.5;

/// Search for the fraction of its path at which a tool reaches its force limit: regula falsi in the Illinois variant
/// (Dowell, Jarratt 1971), since the force is nonlinear. The fraction is negative if the force exceeds the limit even
/// without motion: tissue then pushes the tool back along its path. This can happen long after the tool was pressed
/// in.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ForceLimitSearch {
    /// Fraction of the path in the current try, -1 to 1.
    pub fraction: f32,
    /// Lower bracket: an admissible fraction and its force margin, N. Initially the start of the path with the force
    /// of the last step.
    low: (f32, f32),
    /// True if the lower bracket has been tried.
    is_low_tried: bool,
    /// Upper bracket: an inadmissible fraction and its excess force, N.
    high: Option<(f32, f32)>,
}

saved! { ForceLimitSearch { fraction, low, is_low_tried, high } }

impl ForceLimitSearch {
    /// Begins a search for a tool that pressed with `force` in the last step, under this limit.
    pub fn new(force: f32, limit: f32) -> Self {
        Self {
            fraction: 1.0,
            low: (0.0, (limit - force).max(0.0)),
            is_low_tried: false,
            high: None,
        }
    }

    /// True if the last try is accepted, given its force. Otherwise sets the fraction of the next try. The
    /// `last` try goes no further than the lower bracket.
    pub fn accept(&mut self, force: f32, limit: f32, last: bool) -> bool {
        let fraction = self.fraction;
        let before = self.high;
        if force <= limit {
            if fraction == 1.0 || force >= ACCEPTED * limit || last {
                return true;
            }
            if self.is_low_tried
                && let Some(high) = &mut self.high
            {
                high.1 *= 0.5;
            }
            (self.low, self.is_low_tried) = ((fraction, limit - force), true);
        } else {
            if self.is_low_tried {
                self.low.1 *= 0.5;
            }
            self.high = Some((fraction, force - limit));
        }
        let Some(high) = self.high else {
            return true;
        };
        self.fraction = match before {
            _ if last => self.low.0,
            Some(before) if !self.is_low_tried => extrapolate_back(high, before),
            _ => {
                let weight = self.low.1 / (self.low.1 + high.1);
                let weight = if weight.is_finite() {
                    weight.clamp(0.02, 0.98)
                } else {
                    0.5
                };
                self.low.0 + (high.0 - self.low.0) * weight
            }
        };
        false
    }
}

/// Extrapolates back to the fraction where the force equals the limit, from two inadmissible fractions.
fn extrapolate_back((fraction, excess): (f32, f32), (beyond, beyond_excess): (f32, f32)) -> f32 {
    let interval = beyond - fraction;
    let step = OVERSHOOT * excess * interval / (beyond_excess - excess);
    // The step is at least half of the last one, and full if the extrapolation fails.
    let step = if step > 0.0 {
        step.max(0.5 * interval.abs())
    } else {
        MAX_BACK
    };
    (fraction - step).max(-MAX_BACK)
}
