//! Viscosity: a Maxwell branch in parallel with the elastic part, which is a spring in series with a dashpot (the
//! standard linear solid; Zener 1948), or the dashpot alone (Kelvin-Voigt).

use crate::base::{Error, Result, ensure, not_negative};
use crate::codec::saved;
use crate::soa::FrequencyBound;

/// The viscosity of tissue. In parallel with a spring or element of stiffness E is a dashpot of `E retardation_time`,
/// in series with a spring of `E retardation_time / relaxation_time`.
///
/// After a step in strain the stress relaxes as `E (1 + retardation_time / relaxation_time exp(-t / relaxation_time))`.
/// From a measured instantaneous E0 and final E, `retardation_time` is `relaxation_time (E0 / E - 1)`. All times are
/// stable; with VERLET they shorten the substeps.
///
/// ```
/// # use glam::Vec3;
/// # use sinew::*;
/// # let mut world = World::new(WorldDefinition { gravity: Vec3::ZERO, ..WorldDefinition::default() })?;
/// # let (positions, rest_lengths) = (&[Vec3::ZERO, 0.15 * Vec3::X], Some(&[0.1][..]));
/// # let (springs, masses, stiffnesses) = (Some(&[[0, 1]][..]), Values::Uniform(0.01), Values::Uniform(10.0));
/// # let spring = BodyDefinition { positions, springs, rest_lengths, masses, stiffnesses, ..BodyDefinition::default() };
/// let viscosity = Viscosity { retardation_time: 0.05, relaxation_time: 0.0 };
/// let body = world.create_body(&BodyDefinition { viscosity, ..spring })?;
/// let before = world.body(body)?.energy(Vec3::ZERO).elastic;
/// for _ in 0..60 {
///     world.step(1.0 / 60.0)?;
/// }
/// assert!(world.body(body)?.energy(Vec3::ZERO).elastic < 1e-3 * before);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Viscosity {
    /// The viscosity of the dashpot divided by the stiffness (s), at least 0, at most 1e6. 0: there is none. VERLET
    /// takes substeps as short as for a dashpot alone, `2 / w² retardation_time` with the highest frequency w. From
    /// about a millisecond on, use IMPLICIT.
    pub retardation_time: f32,
    /// The relaxation time of the Maxwell branch (s), from 1e-9 to 1e6. 0: the dashpot acts alone (Kelvin-Voigt).
    /// Forces on tetrahedra are then first-order accurate in the step, all others second-order.
    pub relaxation_time: f32,
}

saved! { Viscosity { retardation_time, relaxation_time } }

/// The range of times, s: shorter than any step, and longer than any simulation.
const SHORTEST: f32 = 1e-9;
const LONGEST: f32 = 1e6;

/// The relaxation of a Maxwell branch over a time. The new stress is `decay` times the old, plus `gain` times the
/// change of the elastic stress. It is exact for a constant strain rate (Taylor, Pister, Goudreau 1970).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RelaxationStep {
    pub decay: f64,
    pub gain: f64,
    /// True if deformation beyond the yield strain becomes permanent.
    pub yields: bool,
}

saved! { RelaxationStep { decay, gain, yields } }

impl RelaxationStep {
    /// No relaxation: branches keep their stress.
    pub const IDENTITY: Self = Self {
        decay: 1.0,
        gain: 0.0,
        yields: false,
    };

    /// Complete relaxation: branches have no stress.
    pub const RELAXED: Self = Self {
        decay: 0.0,
        ..Self::IDENTITY
    };
}

impl Viscosity {
    pub(crate) fn check(&self) -> Result<()> {
        not_negative("retardation_time", self.retardation_time)?;
        not_negative("relaxation_time", self.relaxation_time)?;
        ensure!(
            self.retardation_time <= LONGEST,
            "retardation_time is {} s: must be at most {LONGEST}",
            self.retardation_time
        );
        if self.relaxation_time > 0.0 && !(SHORTEST..=LONGEST).contains(&self.relaxation_time) {
            return Err(Error::invalid(format!(
                "relaxation_time is {} s: must be 0, or from {SHORTEST} to {LONGEST}",
                self.relaxation_time
            )));
        }
        ensure!(
            self.relaxation_time <= 0.0 || self.retardation_time != 0.0,
            "relaxation_time is {} s while retardation_time is 0: there is nothing to relax",
            self.relaxation_time
        );
        Ok(())
    }

    pub(crate) fn is_none(&self) -> bool {
        self.retardation_time == 0.0
    }

    /// The viscosity of a dashpot that acts alone, divided by the stiffness, s.
    pub(crate) fn dashpot(&self) -> f32 {
        if self.relaxation_time == 0.0 {
            self.retardation_time
        } else {
            0.0
        }
    }

    /// The relaxation over `time` seconds, above 0.
    pub(crate) fn over(&self, time: f64) -> RelaxationStep {
        let (retardation, relaxation) = (f64::from(self.retardation_time), f64::from(self.relaxation_time));
        let ratio = time / relaxation;
        RelaxationStep {
            decay: libm::exp(-ratio),
            gain: retardation / time * -libm::expm1(-ratio),
            yields: true,
        }
    }

    /// The stiffness of the branch's spring relative to the elastic part. `None`: there is no such spring.
    pub(crate) fn stiffening(&self) -> Option<f64> {
        (self.relaxation_time > 0.0).then(|| f64::from(self.retardation_time) / f64::from(self.relaxation_time))
    }

    /// The frequency bound with a Maxwell branch in parallel. Leapfrog with steps h is stable if `h² w² (1 + 2 gain /
    /// (1 + decay))` is below 4. The last term is at most 2 T/h, as of a dashpot, and T/tau, as of a spring.
    pub(crate) fn rates(&self, rates: FrequencyBound) -> FrequencyBound {
        let as_dashpot = FrequencyBound {
            damping_rate: rates.damping_rate + self.retardation_time * rates.omega_sq,
            ..rates
        };
        let Some(stiffening) = self.stiffening() else {
            return as_dashpot;
        };
        let as_spring = FrequencyBound {
            omega_sq: rates.omega_sq * (1.0 + stiffening) as f32,
            ..rates
        };
        if as_dashpot.limit() > as_spring.limit() {
            as_dashpot
        } else {
            as_spring
        }
    }
}

/// The nodal stiffness and damping of the forces besides springs, at rest. Twice its sum over all nodes bounds their
/// quadratic form.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct NodalStiffness {
    /// N/m
    pub stiffness: f32,
    /// N s/m
    pub damping: f32,
}

saved! { NodalStiffness { stiffness, damping } }

impl NodalStiffness {
    /// Adds half of a force's stiffness, N/m, with its Maxwell branch.
    pub fn add(&mut self, stiffness: f32, viscosity: Viscosity) {
        let stiffness = 0.5 * stiffness;
        self.stiffness += stiffness;
        match viscosity.stiffening() {
            Some(stiffening) => self.stiffness += stiffness * stiffening as f32,
            None => self.damping += stiffness * viscosity.retardation_time,
        }
    }
}
