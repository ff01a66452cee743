//! How stiff tissue is as a tool feels it: learnt from how its wrench changed as it moved.

use glam::{DQuat, DVec3};

use super::six::{self, Matrix6, Vector6};
use crate::geometry::rotation;

/// The tool has to move by this part of its lever before anything is learnt: less is lost in what tissue does by itself.
const LEAST_WAY: f64 = 0.02;

/// Tissue is at most so many times as stiff as the coupling: more makes no difference to the hand.
const STIFFEST: f64 = 3.0;

/// What is felt in so many seconds is taken together, so that short steps do not teach what nodes do between them, s.
const WINDOW: f64 = 0.01;

/// The time in which the stiffness of what a tool holds loses half of what it was at most, s.
const FORGOTTEN: f64 = 1.0;

/// Where a tool was, and what it felt there, in the mean of some steps.
#[derive(Clone, Copy, Debug)]
struct WrenchSample {
    position: DVec3,
    orientation: DQuat,
    wrench: Vector6,
}

/// The stiffness that explains the last ways of a tool with the least change (Powell's symmetric form of Broyden's update, 1970).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Secant {
    last: Option<WrenchSample>,
    /// What has been felt since then, the mean of so many seconds.
    next: Option<(WrenchSample, f64)>,
    stiffness: Matrix6,
    /// The largest along a way of late, N/m.
    largest: f64,
}

impl Secant {
    pub fn new() -> Self {
        Self {
            last: None,
            next: None,
            stiffness: six::NOTHING,
            largest: 0.0,
        }
    }

    /// The stiffness as it is known, N/m.
    pub fn stiffness(&self) -> &Matrix6 {
        &self.stiffness
    }

    /// Learns from what a tool felt here in a step of `dt` seconds, with turns at the lever, m, beside a coupling of this stiffness, N/m; where it
    /// touches nothing what was learnt is forgotten. What it holds swings on: it seems soft as it comes back, and a tool that gave way to that
    /// would feed it. So it is no softer than it was of late.
    pub fn learn(
        &mut self,
        (position, orientation): (DVec3, DQuat),
        wrench: &Vector6,
        dt: f64,
        lever: f64,
        (coupling, holds): (f64, bool),
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
        let (mean, lasts) = match self.next {
            Some((mean, lasts)) => (mean.and(&sample, dt / (lasts + dt)), lasts + dt),
            None => (sample, dt),
        };
        self.next = Some((mean, lasts));
        if lasts < WINDOW * (1.0 - 1e-3) {
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
        let way = six::joined(
            position - last.position,
            rotation::turn_between(last.orientation, orientation) * lever,
        );
        let square = six::dot(&way, &way);
        if !(square.sqrt() >= LEAST_WAY * lever) {
            return;
        }
        let resisted = six::difference(&last.wrench, &wrench);
        let missing = six::difference(&resisted, &six::product(&self.stiffness, &way));
        let along = six::dot(&missing, &way) / square;
        for i in 0..6 {
            for j in 0..6 {
                let change = missing[i] * way[j] + way[i] * missing[j] - along * way[i] * way[j];
                self.stiffness[i][j] += change / square;
            }
        }
        let stiffest = STIFFEST * coupling;
        let along = (six::dot(&resisted, &way) / square).abs();
        self.largest = along.max(self.largest / (1.0 + lasts / FORGOTTEN)).min(stiffest);
        let softest = if holds { self.largest } else { 0.0 };
        self.stiffness = six::clamped(&self.stiffness, [softest, stiffest]);
        self.last = Some(mean);
    }
}

impl WrenchSample {
    /// With a part of another: the mean of both.
    fn and(&self, other: &Self, part: f64) -> Self {
        Self {
            position: self.position.lerp(other.position, part),
            orientation: rotation::turned(
                self.orientation,
                part * rotation::turn_between(self.orientation, other.orientation),
            ),
            wrench: std::array::from_fn(|k| self.wrench[k] + part * (other.wrench[k] - self.wrench[k])),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_learns_a_stiffness_from_six_ways() {
        // Turned and scaled along its axes: symmetric and positive definite.
        let mut truth = six::NOTHING;
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
                let turned = rotation::turned(DQuat::IDENTITY, six::about(&motion) / lever);
                secant.learn((six::along(&motion), turned), &wrench, 0.016, lever, (1000.0, false));
            }
        }
        for (learnt, row) in secant.stiffness().iter().zip(&truth) {
            for (learnt, entry) in learnt.iter().zip(row) {
                assert!((learnt - entry).abs() < 15.0, "{:?}", secant.stiffness());
            }
        }
    }
}
