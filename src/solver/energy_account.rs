//! The energy that a body, or bodies that take their substeps together, may have.

use glam::Vec3;

use super::energy_sums::Energies;
use crate::base::StateHasher;
use crate::codec::saved;

/// Substeps between two comparisons, at least, and how many more there may be: at even intervals, comparisons might meet a mode in its
/// turning points alone. A comparison takes about as long as two substeps.
const PERIOD: [u32; 2] = [66, 25];

/// The number of comparisons after which the kinetic energy is known. Nothing is taken off before.
const LEARNED: u32 = 3;

/// Excess that is tolerated, as a part of the kinetic energy: the shadow energy of nonlinear motion fluctuates.
const BAND: f64 = 5e-4;

/// The time in which older comparisons lose half their weight, s.
const MEMORY: f64 = 5.0;

/// Substeps are halved when more than this part of the kinetic energy has been taken off of late.
const TOO_MUCH: f64 = 5e-3;

/// Substeps are doubled again when the kinetic energy is less than this part of that with which they were halved. A body that moves as
/// fast as before would gain energy again.
const SLOWER: f64 = 0.5;

/// The same of the kinetic energy of the last second: a blow that set a body in motion, once it is over.
const STILLER: f64 = 1.0 / 16.0;

/// The time in which that loses half its weight, s: longer than tissue takes from one swing to the next.
const SWING: f64 = 1.0;

/// How many times shorter substeps may be than stability asks for.
const FINEST: u32 = 8;

/// What is known of the energy that a body may have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct EnergyAccount {
    /// The energy that the body had when it was compared last, or might have had, J; `None` after a change from outside.
    reference: Option<f64>,
    /// The work since the last comparison, J.
    work: f64,
    /// The gravity of the last step, m/s².
    gravity: Vec3,
    /// Substeps and seconds since the last comparison.
    substeps: u32,
    time: f64,
    /// How often the energy was compared since a change from outside.
    comparisons: u32,
    /// The most kinetic energy of late, and of the last second, J.
    kinetic: f64,
    recent: f64,
    /// How much was taken off of late, as a part of that.
    removed: f64,
    /// How many times shorter substeps are than stability asks for.
    refinement: u32,
    /// The most kinetic energy of late when that changed, J.
    refined_at: f64,
    /// The bodies whose energy it is; 0: one alone.
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

    /// The energy is not what it was when the last step ended.
    pub fn forget(&mut self) {
        (self.reference, self.comparisons) = (None, 0);
        self.start_over();
    }

    /// The next step is one of these bodies together; 0: of one alone.
    pub fn share(&mut self, group: u64) {
        if self.group != group {
            self.forget();
            self.group = group;
        }
    }

    /// Goes on with the account of bodies that took a step together, the same for each.
    pub fn go_on_with(&mut self, common: &Self) {
        *self = Self {
            gravity: self.gravity,
            ..*common
        };
    }

    /// Takes in what another of the same bodies has put in.
    pub fn join(&mut self, other: &Self) {
        self.work += other.work;
        self.refinement = self.refinement.max(other.refinement);
        if other.reference.is_none() {
            self.forget();
        }
    }

    /// Whether the next step is the first after a change from outside, of a body by itself.
    pub(super) fn is_new(&self) -> bool {
        self.reference.is_none() && self.substeps == 0 && self.group == 0
    }

    /// A step begins in which gravity is this, m/s², of a body by itself that has so much kinetic and potential energy, J.
    pub(super) fn open(&mut self, gravity: Vec3, energy: f64) {
        self.gravity = gravity;
        self.reference = energy.is_finite().then_some(energy);
        self.comparisons = LEARNED - 1;
        (self.kinetic, self.recent) = (0.0, 0.0);
        self.start_over();
    }

    /// Takes in a step in so many substeps, of so many seconds, in which so much work was done, J.
    pub(super) fn take_step(&mut self, gravity: Vec3, substeps: u32, dt: f32, work: f64) {
        if self.gravity != gravity {
            self.forget();
            self.gravity = gravity;
        }
        self.substeps = self.substeps.saturating_add(substeps);
        self.time += f64::from(dt);
        self.work += work;
    }

    /// So much energy was put in from outside, J; what is not finite is not known.
    pub fn gain(&mut self, energy: f64) {
        self.lose(energy.is_finite().then_some(-energy));
    }

    /// So much energy is gone with mass that was taken away, J, or unknown.
    pub(super) fn lose(&mut self, energy: Option<f64>) {
        match energy {
            Some(energy) => self.work -= energy,
            None => self.forget(),
        }
    }

    fn start_over(&mut self) {
        (self.work, self.substeps, self.time) = (0.0, 0, 0.0);
    }

    /// Whether a step of so many substeps ends with a comparison.
    pub(super) fn is_due(&self, substeps: u32) -> bool {
        let [least, more] = PERIOD;
        self.substeps.saturating_add(substeps) >= least + self.comparisons.wrapping_mul(11) % more
    }

    pub(super) fn gravity(&self) -> Vec3 {
        self.gravity
    }

    /// How many times as many substeps are to be taken as stability asks for.
    pub fn refinement(&self) -> u32 {
        self.refinement
    }

    /// What is to be taken off the kinetic energy, J, given what there is.
    pub fn compare(&mut self, found: &Energies) -> f64 {
        let Energies {
            all: energy,
            own: kinetic,
            rounding,
            still,
        } = *found;
        if !(energy.is_finite() && rounding.is_finite()) {
            self.forget();
            return 0.0;
        }
        let fading = 1.0 / (1.0 + self.time / MEMORY);
        self.kinetic = kinetic.max(self.kinetic * fading);
        self.recent = kinetic.max(self.recent / (1.0 + self.time / SWING));
        self.removed *= fading;
        // Lost energy may come back, up to the kinetic energy of late: a body that has come to rest stays so.
        let allowed = self.reference.map_or(energy, |reference| reference + self.work);
        let allowed = allowed.min(energy + self.kinetic);
        self.reference = Some(allowed);
        self.start_over();
        self.comparisons = self.comparisons.saturating_add(1);
        if self.comparisons < LEARNED || kinetic <= still {
            return 0.0;
        }
        (energy - allowed - BAND * self.kinetic - rounding).max(0.0)
    }

    /// Decides how short substeps are, after so much kinetic energy was taken off, J.
    pub fn refine(&mut self, removed: f64) {
        if removed > 0.0 {
            self.removed += removed / self.kinetic;
        }
        if self.removed > TOO_MUCH && self.refinement < FINEST {
            self.refinement *= 2;
        } else if self.refinement > 1
            && (self.kinetic < SLOWER * self.refined_at || self.recent < STILLER * self.refined_at)
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
