//! The energy budget of a body, or of bodies that take their substeps together.

use glam::Vec3;

use super::energy_sums::Energies;
use crate::base::StateHasher;
use crate::codec::saved;

/// The minimum number of substeps between two comparisons, and the range of its variation. At even intervals,
/// comparisons could sample a mode at its turning points only. A comparison costs about as much as two substeps.
const INTERVAL: [u32; 2] = [66, 25];

/// The number of comparisons after which the kinetic energy is known. No energy is removed before.
const MIN_COMPARISONS: u32 = 3;

/// The tolerated excess as a fraction of the kinetic energy: the shadow energy of nonlinear motion fluctuates.
const TOLERANCE: f64 = 5e-4;

/// The decay time of older comparisons, s.
const MEMORY: f64 = 5.0;

/// Substeps are halved when more than this fraction of the kinetic energy was removed recently.
const MAX_REMOVED: f64 = 5e-3;

/// Substeps are doubled again when the kinetic energy drops below this fraction of its value at the halving. A body
/// that still moves as fast would gain energy again.
const COARSEN_FRACTION: f64 = 0.5;

/// The same fraction for the kinetic energy of the last second. It detects the end of a blow that set a body in motion.
const COARSEN_RECENT_FRACTION: f64 = 1.0 / 16.0;

/// The decay time of the recent kinetic energy, s. It is longer than the oscillation period of tissue.
const RECENT: f64 = 1.0;

/// The maximum refinement of substeps relative to the stability limit.
const MAX_REFINEMENT: u32 = 8;

/// The energy budget and its history.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct EnergyAccount {
    /// The energy budget at the last comparison, J. `None` after a change from outside.
    reference: Option<f64>,
    /// The work since the last comparison, J.
    work: f64,
    /// The gravity of the last step, m/s².
    gravity: Vec3,
    /// Substeps and seconds since the last comparison.
    substeps: u32,
    time: f64,
    /// The number of comparisons since a change from outside.
    comparisons: u32,
    /// The decaying maximum of the kinetic energy with decay times `MEMORY` and `RECENT`, J.
    kinetic: f64,
    recent: f64,
    /// The recently removed energy as a fraction of `kinetic`.
    removed: f64,
    /// The refinement factor of substeps relative to the stability limit.
    refinement: u32,
    /// The value of `kinetic` when `refinement` last changed, J.
    refined_at: f64,
    /// The group of bodies that share the account; 0 for a single body.
    group: u64,
}

saved! { EnergyAccount {
    reference, work, gravity, substeps, time, comparisons, kinetic, recent, removed, refinement, refined_at, group,
} }

impl EnergyAccount {
    pub const UNKNOWN: Self = Self {
        reference: None,
        work: 0.0,
        gravity: Vec3::ZERO,
        substeps: 0,
        time: 0.0,
        comparisons: 0,
        kinetic: 0.0,
        recent: 0.0,
        removed: 0.0,
        refinement: 1,
        refined_at: 0.0,
        group: 0,
    };

    /// Discards the reference after a change from outside.
    pub fn forget(&mut self) {
        (self.reference, self.comparisons) = (None, 0);
        self.reset_interval();
    }

    /// Assigns the account to a group of coupled bodies; 0 for a single body.
    pub fn set_group(&mut self, group: u64) {
        if self.group != group {
            self.forget();
            self.group = group;
        }
    }

    /// Adopts the common account of bodies that took a step together.
    pub fn adopt_common(&mut self, common: &Self) {
        *self = Self {
            gravity: self.gravity,
            ..*common
        };
    }

    /// Adds the work of another body of the same group.
    pub fn join(&mut self, other: &Self) {
        self.work += other.work;
        self.refinement = self.refinement.max(other.refinement);
        if other.reference.is_none() {
            self.forget();
        }
    }

    /// True if the next step is the first after a change from outside, and the body is not coupled.
    pub(super) fn is_new(&self) -> bool {
        self.reference.is_none() && self.substeps == 0 && self.group == 0
    }

    /// Starts the account of an uncoupled body with a kinetic and potential energy of `energy`, J.
    pub(super) fn start(&mut self, gravity: Vec3, energy: f64) {
        self.gravity = gravity;
        self.reference = energy.is_finite().then_some(energy);
        self.comparisons = MIN_COMPARISONS - 1;
        (self.kinetic, self.recent) = (0.0, 0.0);
        self.reset_interval();
    }

    /// Records a step of `dt` seconds in which `work` was done, J.
    pub(super) fn record_step(&mut self, gravity: Vec3, substeps: u32, dt: f32, work: f64) {
        if self.gravity != gravity {
            self.forget();
            self.gravity = gravity;
        }
        self.substeps = self.substeps.saturating_add(substeps);
        self.time += f64::from(dt);
        self.work += work;
    }

    /// Records `energy` that was added from outside, J. A value that is not finite discards the reference.
    pub fn gain(&mut self, energy: f64) {
        self.lose(energy.is_finite().then_some(-energy));
    }

    /// Records `energy` that was removed with mass, J. `None` discards the reference.
    pub(super) fn lose(&mut self, energy: Option<f64>) {
        match energy {
            Some(energy) => self.work -= energy,
            None => self.forget(),
        }
    }

    fn reset_interval(&mut self) {
        (self.work, self.substeps, self.time) = (0.0, 0, 0.0);
    }

    /// True if a step of `substeps` substeps ends with a comparison.
    pub(super) fn is_due(&self, substeps: u32) -> bool {
        let [min_interval, variation] = INTERVAL;
        self.substeps.saturating_add(substeps) >= min_interval + self.comparisons.wrapping_mul(11) % variation
    }

    pub(super) fn gravity(&self) -> Vec3 {
        self.gravity
    }

    /// The factor by which a step takes more substeps than stability requires.
    pub fn refinement(&self) -> u32 {
        self.refinement
    }

    /// Compares the energies with the reference. Returns the kinetic energy to remove, J.
    pub fn compare(&mut self, energies: &Energies) -> f64 {
        let Energies {
            all: energy,
            internal_kinetic: kinetic,
            rounding,
            rest_energy,
        } = *energies;
        if !(energy.is_finite() && rounding.is_finite()) {
            self.forget();
            return 0.0;
        }
        let fading = 1.0 / (1.0 + self.time / MEMORY);
        self.kinetic = kinetic.max(self.kinetic * fading);
        self.recent = kinetic.max(self.recent / (1.0 + self.time / RECENT));
        self.removed *= fading;
        // Lost energy may come back, up to the recent kinetic energy. A body at rest stays at rest.
        let allowed = self.reference.map_or(energy, |reference| reference + self.work);
        let allowed = allowed.min(energy + self.kinetic);
        self.reference = Some(allowed);
        self.reset_interval();
        self.comparisons = self.comparisons.saturating_add(1);
        if self.comparisons < MIN_COMPARISONS || kinetic <= rest_energy {
            return 0.0;
        }
        (energy - allowed - TOLERANCE * self.kinetic - rounding).max(0.0)
    }

    /// Updates the refinement after `removed` kinetic energy was taken off, J.
    pub fn refine(&mut self, removed: f64) {
        if removed > 0.0 {
            self.removed += removed / self.kinetic;
        }
        if self.removed > MAX_REMOVED && self.refinement < MAX_REFINEMENT {
            self.refinement *= 2;
        } else if self.refinement > 1
            && (self.kinetic < COARSEN_FRACTION * self.refined_at
                || self.recent < COARSEN_RECENT_FRACTION * self.refined_at)
        {
            self.refinement /= 2;
        } else {
            return;
        }
        (self.removed, self.refined_at) = (0.0, self.kinetic);
    }

    pub fn hash(&self, hasher: &mut StateHasher) {
        let reference = self.reference.unwrap_or(f64::NAN);
        hasher.write_doubles(&[
            reference,
            self.work,
            self.time,
            self.kinetic,
            self.recent,
            self.removed,
            self.refined_at,
        ]);
        hasher.write_floats(&self.gravity.to_array());
        hasher.write_u64(u64::from(self.substeps) << 32 | u64::from(self.refinement));
        hasher.write_u64(u64::from(self.comparisons));
        hasher.write_u64(self.group);
    }
}
