//! Keeps the substeps of VERLET from changing with the motion.
//!
//! Leapfrog conserves the energy of a body while the substep is constant. A substep that follows the stiffness of the
//! body changes in phase with its oscillation, and each change then moves energy in the same direction. For example, a
//! stretched block of eight nodes that alternated between two and three substeps gained half of its energy in 1.5 s.
//! Substeps are therefore no longer than the shortest that a step of the last second needed.

use crate::base::StateHasher;
use crate::codec::saved;

/// The minimum time that a shortest substep is remembered, s. The maximum is twice that.
const WINDOW: f32 = 1.0;

/// Counts of substeps that differ by less than this are equal up to `f32` rounding.
const ROUNDING: f64 = 1e-3;

/// The shortest substeps of recent steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SubstepHistory {
    /// The shortest substep of the current window and of the previous one, s.
    shortest: [f32; 2],
    /// The age of the current window, s.
    age: f32,
}

saved! { SubstepHistory { shortest, age } }

impl SubstepHistory {
    /// The history of a body that was never stepped.
    pub const UNKNOWN: Self = Self {
        shortest: [f32::INFINITY; 2],
        age: 0.0,
    };

    /// The shortest recent substep, s. Infinity if none is known.
    pub fn shortest(&self) -> f32 {
        let [one, other] = self.shortest;
        one.min(other)
    }

    /// The number of substeps for a step of `dt` seconds that needs `needed`. It exceeds `needed` up to `allowed` only.
    pub fn hold(&self, needed: u32, dt: f32, allowed: u32) -> u32 {
        let kept = (f64::from(dt) / f64::from(self.shortest()) - ROUNDING).ceil();
        needed.max((kept as u32).min(allowed))
    }

    /// Adds a step of `dt` seconds that needed `needed` substeps.
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
    use super::SubstepHistory;

    #[test]
    fn the_shortest_substep_is_kept_for_a_second_or_two() {
        let dt = 1.0 / 60.0;
        let mut substep_history = SubstepHistory::UNKNOWN;
        assert_eq!(substep_history.hold(3, dt, 1000), 3);
        substep_history = substep_history.after(300, dt);
        for step in 1..=120 {
            substep_history = substep_history.after(3, dt);
            let kept = substep_history.hold(3, dt, 1000);
            assert!(
                if step < 60 {
                    kept == 300
                } else {
                    kept == 300 || kept == 3
                },
                "{step}: {kept}"
            );
        }
        substep_history = substep_history.after(3, dt).after(3, dt);
        assert_eq!(substep_history.hold(3, dt, 1000), 3);
        // Steps of another length take equally short substeps, but no more than allowed.
        substep_history = substep_history.after(7, dt);
        assert_eq!(substep_history.hold(3, 0.5 * dt, 1000), 4);
        assert_eq!(substep_history.hold(3, dt, 5), 5);
        assert_eq!(substep_history.hold(9, dt, 5), 9);
    }
}
