//! What is asked of a step, what a body takes from one to the next, and how an attempt ended.

use glam::Vec3;

use super::System;
use super::closing::ClosingKick;
use super::energy_account::EnergyAccount;
use super::gravity::GravityKicks;
use super::pace::Pace;
use super::stability::{RESERVE, Stability};
use super::verlet::TooLong;
use crate::base::Profile;
use crate::codec::saved;
use crate::contact::{DynamicTool, ToolPath};

/// Near tools and other tissue a step of IMPLICIT or NEWTON is cut into as many parts as this, whatever is allowed otherwise: 4 s of them.
const MOST_PARTS: u32 = 1 << 12;

/// What is asked of a step.
#[derive(Clone, Copy)]
pub(crate) struct StepRequest<'a> {
    /// Seconds, above 0.
    pub dt: f32,
    pub gravity: Vec3,
    /// 0: as many as stability needs.
    pub substeps: u32,
    pub max_substeps: u32,
    /// Metres; 0: off.
    pub tolerance: f32,
    pub tools: &'a [ToolPath],
    /// Those of them that are rigid bodies.
    pub dynamic: &'a [DynamicTool],
    /// How fast nodes of the bodies are that take their substeps together, m/s; `None`: each body steps by itself.
    pub neighbor_speed: Option<f32>,
    /// Where the stages are timed, if they are.
    pub profile: Option<&'a Profile>,
    /// How many products there may be in all where equations are solved; `u32::MAX`: as many as the definition allows.
    pub work: u32,
    /// Whether mass may be added where more substeps are needed than are allowed.
    pub relieves: bool,
}

impl StepRequest<'_> {
    /// That of a step without gravity or tools.
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
            relieves: false,
            profile: None,
            dynamic: &[],
        }
    }

    /// The same with the gravity that acts on a body.
    pub fn of(&self, body: &System) -> Self {
        Self {
            gravity: body.pull(self.gravity),
            ..*self
        }
    }

    /// The same with the gravity that acts on all of a body's mass, as it is scaled now.
    pub fn weighed(&self, body: &System) -> Self {
        Self {
            gravity: self.gravity * body.weight_share().unwrap_or(1.0),
            ..*self
        }
    }

    /// In how many parts a step is taken at most that is cut because something is near: what is longer would take as long as it
    /// liked.
    pub fn most_parts(&self) -> u32 {
        MOST_PARTS.max(match self.substeps {
            0 => self.max_substeps,
            fixed => fixed,
        })
    }
}

/// How a step is taken.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StepStart {
    /// What it begins with.
    pub carry: Carry,
    pub substeps: u32,
    /// After so many of them a world with a tolerance looks at it.
    pub middle: u32,
}

impl StepStart {
    /// In so many substeps, looked at far from simple fractions of the step, where steps that have lost the phase of an oscillation may agree.
    pub fn new(carry: Carry, substeps: u32) -> Self {
        Self {
            carry,
            substeps,
            middle: (f64::from(substeps) * 0.618).ceil() as u32,
        }
    }
}

/// What one step hands to the next beside the state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Carry {
    pub stability: Stability,
    pub gravity: GravityKicks,
    /// What the velocities lack to be those at the time of the positions.
    pub closing: Option<ClosingKick>,
    /// The substep that masses are made for, s; 0: they are as they are, and `stability` is that of the current positions.
    pub masses_for: f32,
    pub energy: EnergyAccount,
    pub pace: Pace,
}

saved! { Carry { stability, gravity, closing, masses_for, energy, pace } }

impl Carry {
    /// A change from outside: the body has another energy, and may need fewer substeps.
    pub fn forget(&mut self) {
        self.energy.forget();
        self.pace = Pace::UNKNOWN;
    }

    /// The longest substep that keeps the energy of a body that is stable in substeps of `limit` seconds: those of the last second were no longer.
    pub fn limit_by_energy(&self, limit: f32) -> f32 {
        limit.min(self.pace.shortest() / RESERVE) / self.energy.refinement() as f32
    }

    /// The longest stable substep with the masses in use, s, where it is known.
    pub fn limit(&self) -> Option<f32> {
        if self.masses_for > 0.0 {
            Some(self.masses_for)
        } else {
            self.stability.limit()
        }
    }
}

/// How an attempted step ended. Nothing is current before [`System::commit`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Outcome {
    /// The step is ready to be committed.
    Done { substeps: u32, carry: Carry, error: f32 },
    /// All of the body sleeps: nothing of it changes.
    Asleep,
    /// The step would have ended in infinity or NaN.
    NotFinite,
    /// More substeps would be needed than are allowed.
    Unstable {
        /// s
        stable_substep: f32,
        /// What was reached where a tolerance needs more, m, infinite where not even twice the substeps are allowed; 0 where it is
        /// stability that does.
        error: f32,
    },
}

impl From<TooLong> for Outcome {
    fn from(TooLong { stable_substep }: TooLong) -> Self {
        Outcome::Unstable {
            stable_substep,
            error: 0.0,
        }
    }
}
