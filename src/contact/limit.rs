//! How far a tool of limited force gets.

use crate::codec::saved;

/// How often a step is begun again for a tool that would press too hard, at most.
pub(crate) const TRIES: u32 = 16;

/// A tool that presses with this part of its limit is as far as it gets.
const NEAR: f32 = 0.98;

/// Tissue pushes a tool back by no more of its way than this in a step.
const BACK: f32 = 1.0;

/// How much further back than the force says it is looked first, so that what is looked for lies between.
const FURTHER: f32 = 1.5;

/// The search for the part of its way after which a tool presses with the most that it can: regula falsi, with a halving where that is slow
/// (the Illinois method; Dowell, Jarratt 1971), as the force is not linear. Where tissue presses too hard on a tool that stays where it is,
/// which it may long after it was pressed, that part is below 0: the tool is pushed back the way it was to go.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PressSearch {
    /// The part of its way that the step in progress takes it, -1 to 1.
    pub part: f32,
    /// A part that it gets to, and by how much less than the limit it presses there, N; at first where it stands, as the last step left it.
    low: (f32, f32),
    /// Whether that has been tried.
    is_known: bool,
    /// A part that it does not get to, and by how much more it would press, N.
    high: Option<(f32, f32)>,
}

saved! { PressSearch { part, low, is_known, high } }

impl PressSearch {
    /// For a tool that pressed with `force` in the last step and presses with `limit` at most.
    pub fn new(force: f32, limit: f32) -> Self {
        Self {
            part: 1.0,
            low: (0.0, (limit - force).max(0.0)),
            is_known: false,
            high: None,
        }
    }

    /// Whether it may go as far as it did, having pressed with `force`; else it goes less or more far in the next try. On the `last` of
    /// them it goes no further than is known to be allowed, and where nothing is, it stays.
    pub fn is_allowed(&mut self, force: f32, limit: f32, last: bool) -> bool {
        let part = self.part;
        let before = self.high;
        if force <= limit {
            if part == 1.0 || force >= NEAR * limit || last {
                return true;
            }
            if self.is_known
                && let Some(high) = &mut self.high
            {
                high.1 *= 0.5;
            }
            (self.low, self.is_known) = ((part, limit - force), true);
        } else {
            if self.is_known {
                self.low.1 *= 0.5;
            }
            self.high = Some((part, force - limit));
        }
        let Some(high) = self.high else {
            return true;
        };
        self.part = match before {
            _ if last => self.low.0,
            Some(before) if !self.is_known => back(high, before),
            _ => {
                let share = self.low.1 / (self.low.1 + high.1);
                let share = if share.is_finite() {
                    share.clamp(0.02, 0.98)
                } else {
                    0.5
                };
                self.low.0 + (high.0 - self.low.0) * share
            }
        };
        false
    }
}

/// Where the force would be less than the limit, going by two parts with which it is more.
fn back((part, more): (f32, f32), (beyond, most): (f32, f32)) -> f32 {
    let way = beyond - part;
    let further = FURTHER * more * way / (most - more);
    // As far again as the last try at least, and where the force says nothing all the way.
    let further = if further > 0.0 {
        further.max(0.5 * way.abs())
    } else {
        BACK
    };
    (part - further).max(-BACK)
}
