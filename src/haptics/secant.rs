//! Estimates the stiffness of the tissue at a tool from the changes of its wrench.

use glam::{DQuat, DVec3};

use super::six::{self, Matrix6, Vector6};
use crate::geometry::rotation;

/// The least motion that updates the estimate, relative to the lever arm. Smaller ones are hidden by the tissue's own
/// motion.
const MIN_DISPLACEMENT: f64 = 0.02;

/// The largest stiffness relative to the coupling. A larger one makes no difference to the user.
const MAX_STIFFNESS_RATIO: f64 = 3.0;

/// Wrenches are averaged over this time, so that short steps do not resolve the vibration of single nodes, s.
const WINDOW: f64 = 0.01;

/// The half-life of the largest stiffness of held tissue, s.
const HALF_LIFE: f64 = 1.0;

/// The mean pose and wrench of a tool over several steps.
#[derive(Clone, Copy, Debug)]
struct WrenchSample {
    position: DVec3,
    orientation: DQuat,
    wrench: Vector6,
}

/// A secant estimate of the stiffness: Powell's symmetric form of Broyden's update (1970).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Secant {
    last: Option<WrenchSample>,
    /// The mean since then, and its duration, s.
    next: Option<(WrenchSample, f64)>,
    stiffness: Matrix6,
    /// The largest recent stiffness along a displacement, N/m.
    largest: f64,
}

impl Secant {
    pub fn new() -> Self {
        Self {
            last: None,
            next: None,
            stiffness: six::ZERO_MATRIX,
            largest: 0.0,
        }
    }

    /// The current estimate, N/m.
    pub fn stiffness(&self) -> &Matrix6 {
        &self.stiffness
    }

    /// Updates the estimate with the wrench at a pose in a step of `dt` seconds. `lever` scales rotations, m;
    /// `coupling` is the coupling's stiffness, N/m. A free tool resets the estimate. Held tissue oscillates and seems
    /// soft as it swings back; yielding to that would feed the oscillation. The estimate for held tissue therefore
    /// stays at the largest recent value.
    pub fn update(
        &mut self,
        (position, orientation): (DVec3, DQuat),
        wrench: &Vector6,
        dt: f64,
        lever: f64,
        (coupling, is_holding): (f64, bool),
    ) {
        let sample = WrenchSample {
            position,
            orientation,
            wrench: *wrench,
        };
        if *wrench == six::ZERO {
            *self = Self::new();
            self.last = Some(sample);
            return;
        }
        let (mean, duration) = match self.next {
            Some((mean, duration)) => (mean.lerp(&sample, dt / (duration + dt)), duration + dt),
            None => (sample, dt),
        };
        self.next = Some((mean, duration));
        if duration < WINDOW * (1.0 - 1e-3) {
            return;
        }
        let Some(last) = self.last else {
            self.last = Some(mean);
            self.next = None;
            return;
        };
        let WrenchSample {
            position,
            orientation,
            wrench,
        } = mean;
        self.next = None;
        let displacement = six::joined(
            position - last.position,
            rotation::rotation_between(last.orientation, orientation) * lever,
        );
        let square = six::dot(&displacement, &displacement);
        if !(square.sqrt() >= MIN_DISPLACEMENT * lever) {
            return;
        }
        let resisted = six::difference(&last.wrench, &wrench);
        let missing = six::difference(&resisted, &six::product(&self.stiffness, &displacement));
        let along = six::dot(&missing, &displacement) / square;
        for i in 0..6 {
            for j in 0..6 {
                let change = missing[i] * displacement[j] + displacement[i] * missing[j]
                    - along * displacement[i] * displacement[j];
                self.stiffness[i][j] += change / square;
            }
        }
        let stiffest = MAX_STIFFNESS_RATIO * coupling;
        let along = (six::dot(&resisted, &displacement) / square).abs();
        self.largest = along.max(self.largest / (1.0 + duration / HALF_LIFE)).min(stiffest);
        let softest = if is_holding { self.largest } else { 0.0 };
        self.stiffness = six::clamped(&self.stiffness, [softest, stiffest]);
        self.last = Some(mean);
    }
}

impl WrenchSample {
    /// Interpolates to another sample.
    fn lerp(&self, other: &Self, part: f64) -> Self {
        Self {
            position: self.position.lerp(other.position, part),
            orientation: rotation::rotated(
                self.orientation,
                part * rotation::rotation_between(self.orientation, other.orientation),
            ),
            wrench: std::array::from_fn(|k| self.wrench[k] + part * (other.wrench[k] - self.wrench[k])),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_learns_a_stiffness_from_six_directions() {
        // Turned and scaled along its axes: symmetric and positive definite.
        let mut truth = six::ZERO_MATRIX;
        for (i, row) in truth.iter_mut().enumerate() {
            for (j, entry) in row.iter_mut().enumerate() {
                *entry = if i == j { 200.0 + 50.0 * i as f64 } else { 20.0 };
            }
        }
        let lever = 0.01;
        let mut secant = Secant::new();
        let base: Vector6 = [1.0, 0.5, 0.0, 0.2, 0.0, 0.1];
        for round in 0..60 {
            for axis in 0..6 {
                let mut motion = six::ZERO;
                // Small enough that turns add up.
                motion[axis] = 0.25e-3 * f64::from(round % 2 + 1);
                let wrench = six::difference(&base, &six::product(&truth, &motion));
                let turned = rotation::rotated(DQuat::IDENTITY, six::about(&motion) / lever);
                secant.update((six::along(&motion), turned), &wrench, 0.016, lever, (1000.0, false));
            }
        }
        for (learnt, row) in secant.stiffness().iter().zip(&truth) {
            for (learnt, entry) in learnt.iter().zip(row) {
                assert!((learnt - entry).abs() < 15.0, "{:?}", secant.stiffness());
            }
        }
    }
}
