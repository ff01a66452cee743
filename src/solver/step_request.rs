//! The input of a step, the state passed between steps, and the outcome of an attempt.

use glam::Vec3;

use super::System;
use super::deferred_half_kick::DeferredHalfKick;
use super::energy_account::EnergyAccount;
use super::gravity::GravityKicks;
use super::stability::{RESERVE, Stability};
use super::substep_history::SubstepHistory;
use super::verlet::SubstepTooLong;
use crate::base::Profile;
use crate::codec::saved;
use crate::contact::{DynamicTool, ToolPath};

/// The maximum number of parts of a step of IMPLICIT or NEWTON near tools or other tissue, regardless of other limits.
/// At 1 ms each they cover 4 s.
const MAX_PARTS: u32 = 1 << 12;

/// The input of a step.
#[derive(Clone, Copy)]
pub(crate) struct StepRequest<'a> {
    /// The step length, above 0, s.
    pub dt: f32,
    pub gravity: Vec3,
    /// The number of substeps; 0 selects as many as stability requires.
    pub substeps: u32,
    pub max_substeps: u32,
    /// The position tolerance, m; 0 disables it.
    pub tolerance: f32,
    pub tools: &'a [ToolPath],
    /// The tools that are rigid bodies.
    pub dynamic: &'a [DynamicTool],
    /// The maximum node speed of all coupled bodies, m/s. `None` for an uncoupled body.
    pub neighbor_speed: Option<f32>,
    /// Collects the times of stages, if present.
    pub profile: Option<&'a Profile>,
    /// The maximum total number of matrix-vector products; `u32::MAX` uses the limit of the definition.
    pub work: u32,
    /// True if mass may be added when a step would need more substeps than allowed.
    pub may_add_mass: bool,
}

impl StepRequest<'_> {
    /// A step without gravity and tools.
    pub fn alone(dt: f32, max_substeps: u32) -> Self {
        Self {
            dt,
            gravity: Vec3::ZERO,
            substeps: 0,
            max_substeps,
            tolerance: 0.0,
            tools: &[],
            neighbor_speed: None,
            work: u32::MAX,
            may_add_mass: false,
            profile: None,
            dynamic: &[],
        }
    }

    /// Returns the request with the acceleration that acts on a body.
    pub fn for_body(&self, body: &System) -> Self {
        Self {
            gravity: body.body_acceleration(self.gravity),
            ..*self
        }
    }

    /// Returns the request with the gravity on the scaled mass of a body.
    pub fn with_scaled_gravity(&self, body: &System) -> Self {
        Self {
            gravity: self.gravity * body.weight_share().unwrap_or(1.0),
            ..*self
        }
    }

    /// The maximum number of parts of a step that is subdivided near tools or tissue. It bounds the cost of the step.
    pub fn max_parts(&self) -> u32 {
        MAX_PARTS.max(match self.substeps {
            0 => self.max_substeps,
            fixed => fixed,
        })
    }
}

/// The start of a step and its substeps.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StepStart {
    /// The state at the start.
    pub carry: IntegratorState,
    pub substeps: u32,
    /// The number of substeps after which step doubling samples positions.
    pub middle: u32,
}

impl StepStart {
    /// Samples positions far from simple fractions of the step, where steps that have lost the phase of an oscillation
    /// may agree.
    pub fn new(carry: IntegratorState, substeps: u32) -> Self {
        Self {
            carry,
            substeps,
            middle: (f64::from(substeps) * 0.618).ceil() as u32,
        }
    }
}

/// The state that a step passes to the next, except positions and velocities.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct IntegratorState {
    pub stability: Stability,
    pub gravity: GravityKicks,
    /// The half kick that the velocities lack.
    pub deferred_kick: Option<DeferredHalfKick>,
    /// The substep that masses are computed for, s. 0: masses are unscaled, and `stability` belongs to the current
    /// positions.
    pub scaling_substep: f32,
    pub energy: EnergyAccount,
    pub substep_history: SubstepHistory,
}

saved! { IntegratorState { stability, gravity, deferred_kick, scaling_substep, energy, substep_history } }

impl IntegratorState {
    /// Resets energy and substep history after a change from outside.
    pub fn forget(&mut self) {
        self.energy.forget();
        self.substep_history = SubstepHistory::UNKNOWN;
    }

    /// The longest substep that conserves energy, for a body that is stable with substeps of `limit` seconds.
    pub fn limit_by_energy(&self, limit: f32) -> f32 {
        limit.min(self.substep_history.shortest() / RESERVE) / self.energy.refinement() as f32
    }

    /// The longest stable substep with the present masses, if it is known, s.
    pub fn limit(&self) -> Option<f32> {
        if self.scaling_substep > 0.0 {
            Some(self.scaling_substep)
        } else {
            self.stability.limit()
        }
    }
}

/// The outcome of an attempted step. [`System::commit`] makes it current.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Outcome {
    /// The step can be committed.
    Done {
        substeps: u32,
        carry: IntegratorState,
        error: f32,
    },
    /// The whole body sleeps and does not change.
    Asleep,
    /// The step would end with infinity or NaN.
    NotFinite,
    /// The step would need more substeps than allowed.
    Unstable {
        /// The longest stable substep, s.
        stable_substep: f32,
        /// The error reached under a tolerance, m. Infinite if even twice the substeps are not allowed. 0 if stability
        /// is the limit.
        error: f32,
    },
}

impl From<SubstepTooLong> for Outcome {
    fn from(SubstepTooLong { stable_substep }: SubstepTooLong) -> Self {
        Outcome::Unstable {
            stable_substep,
            error: 0.0,
        }
    }
}
