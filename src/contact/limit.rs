//! How far a tool of limited force gets.

/// How often a step is begun again for a tool that would press too hard, at most.
pub(crate) const TRIES: u32 = 8;

/// A tool that presses with this part of its limit is as far as it gets.
const NEAR: f32 = 0.98;

/// The search for the part of its way after which a tool presses with the most that it can: regula falsi, with a halving where that is slow
/// (the Illinois method; Dowell, Jarratt 1971), as the force is not linear.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reach {
    /// The part of its way that the step in progress takes it, 0 to 1.
    pub part: f32,
    /// A part that it gets to, and by how much less than the limit it presses there, N; at first where it stands, as the last step left it.
    low: (f32, f32),
    /// A part that it does not get to, and by how much more it would press, N.
    high: Option<(f32, f32)>,
}

impl Reach {
    /// For a tool that pressed with `force` in the last step and presses with `limit` at most.
    pub fn new(force: f32, limit: f32) -> Self {
        Self {
            part: 1.0,
            low: (0.0, (limit - force).max(0.0)),
            high: None,
        }
    }

    /// Whether it may go as far as it did, having pressed with `force`; else it goes less or more far in the next try. On the `last` of
    /// them it goes no further than is known to be allowed.
    pub fn is_allowed(&mut self, force: f32, limit: f32, last: bool) -> bool {
        let part = self.part;
        if force <= limit {
            if part == 1.0 || self.low.0 == part || force >= NEAR * limit || last {
                return true;
            }
            self.low = (part, limit - force);
            if let Some(high) = &mut self.high {
                high.1 *= 0.5;
            }
        } else {
            if part == 0.0 {
                return true;
            }
            if self.high.is_some() {
                self.low.1 *= 0.5;
            }
            self.high = Some((part, force - limit));
        }
        let Some(high) = self.high else {
            return true;
        };
        let share = self.low.1 / (self.low.1 + high.1);
        let share = if share.is_finite() {
            share.clamp(0.02, 0.98)
        } else {
            0.5
        };
        self.part = if last {
            self.low.0
        } else {
            self.low.0 + (high.0 - self.low.0) * share
        };
        false
    }
}
