//! Keeps the substeps of VERLET from becoming longer and shorter with the motion.
//!
//! Leapfrog keeps the energy of a body while the substep stays the same. A substep that follows how stiff the body is changes in phase with its
//! oscillation, and each change then moves energy the same way: a stretched block of eight nodes that took two and three substeps by turns gained half
//! of its energy in 1.5 s. So substeps are no longer than the shortest that a step of the last second needed.

use crate::base::StateHasher;
use crate::codec::saved;

/// How long it is known that a step needed short substeps, s: at least so long, and at most twice.
const WINDOW: f32 = 1.0;

/// Counts of substeps that differ by less than this are the same: `f32` rounds.
const ROUNDING: f64 = 1e-3;

/// The shortest substeps of late.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pace {
    /// Since the time that `age` counts from, and in as long before that, s.
    shortest: [f32; 2],
    /// s
    age: f32,
}

saved! { Pace { shortest, age } }

impl Pace {
    /// That of a body that has not been stepped.
    pub const UNKNOWN: Self = Self {
        shortest: [f32::INFINITY; 2],
        age: 0.0,
    };

    /// The shortest of the last second, s; infinity: none is known.
    pub fn shortest(&self) -> f32 {
        let [one, other] = self.shortest;
        one.min(other)
    }

    /// How many substeps a step of `dt` seconds takes that needs so many, as far as more are `allowed`.
    pub fn keep(&self, needed: u32, dt: f32, allowed: u32) -> u32 {
        let kept = (f64::from(dt) / f64::from(self.shortest()) - ROUNDING).ceil();
        needed.max((kept as u32).min(allowed))
    }

    /// What is known after a step of `dt` seconds that needed so many substeps.
    pub fn after(self, needed: u32, dt: f32) -> Self {
        let [mut latest, mut earlier] = self.shortest;
        let mut age = self.age + dt;
        if age > WINDOW {
            (earlier, latest, age) = (latest, f32::INFINITY, 0.0);
        }
        Self {
            shortest: [latest.min(dt / needed as f32), earlier],
            age,
        }
    }

    pub fn hash(&self, hasher: &mut StateHasher) {
        hasher.write_floats(&[self.shortest[0], self.shortest[1], self.age]);
    }
}

#[cfg(test)]
mod tests {
    use super::Pace;

    #[test]
    fn what_a_step_needed_is_kept_for_a_second_or_two() {
        let dt = 1.0 / 60.0;
        let mut pace = Pace::UNKNOWN;
        assert_eq!(pace.keep(3, dt, 1000), 3);
        pace = pace.after(300, dt);
        for step in 1..=120 {
            pace = pace.after(3, dt);
            let kept = pace.keep(3, dt, 1000);
            assert!(
                if step < 60 {
                    kept == 300
                } else {
                    kept == 300 || kept == 3
                },
                "{step}: {kept}"
            );
        }
        pace = pace.after(3, dt).after(3, dt);
        assert_eq!(pace.keep(3, dt, 1000), 3);
        // Steps of another length take substeps as short, and no more of them than are allowed.
        pace = pace.after(7, dt);
        assert_eq!(pace.keep(3, 0.5 * dt, 1000), 4);
        assert_eq!(pace.keep(3, dt, 5), 5);
        assert_eq!(pace.keep(9, dt, 5), 9);
    }
}
