//! Viscosity: an arm beside what is elastic, a spring and a dashpot in a row (the standard linear solid; Zener 1948), or the dashpot
//! alone (Kelvin and Voigt).

use crate::base::{Error, Result, ensure, not_negative};
use crate::codec::saved;
use crate::soa::Rates;

/// How tissue resists the speed at which it is deformed. With E the stiffness at rest, of a spring or an element, a dashpot of
/// `E retardation_time` lies beside it, in a row with a spring of `E retardation_time / relaxation_time`.
///
/// After a step of strain the stress relaxes as `E (1 + retardation_time / relaxation_time exp(-t / relaxation_time))`: where E0 is
/// measured at once and E in the end, `retardation_time` is `relaxation_time (E0 / E - 1)`. Any times are stable, with VERLET for the price
/// of shorter substeps.
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
    /// The dashpot's viscosity over the stiffness, s, at least 0, at most 1e6; 0: there is none. VERLET takes substeps as short as a dashpot
    /// alone asks for, `2 / w² retardation_time` with w the highest frequency: from about a millisecond on IMPLICIT is the solver for
    /// it.
    pub retardation_time: f32,
    /// Of the dashpot and the spring in its row, s, from 1e-9 to 1e6, or 0: there is no such spring, and the dashpot acts alone (Kelvin and
    /// Voigt). Forces on tetrahedra are then of order 1 in the step, all others of order 2.
    pub relaxation_time: f32,
}

saved! { Viscosity { retardation_time, relaxation_time } }

/// The range of times, s: shorter than any step, and longer than anybody looks on.
const SHORTEST: f32 = 1e-9;
const LONGEST: f32 = 1e6;

/// What becomes of an arm in some time: its stress is the part `decay` of what it was, and `gain` times what the elastic stress changed
/// by. Exact where strain changes evenly (Taylor, Pister, Goudreau 1970).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RelaxationStep {
    pub decay: f64,
    pub gain: f64,
    /// Whether what is deformed beyond its yield strain stays so.
    pub yields: bool,
}

saved! { RelaxationStep { decay, gain, yields } }

impl RelaxationStep {
    /// None: arms hold what they held.
    pub const NOTHING: Self = Self {
        decay: 1.0,
        gain: 0.0,
        yields: false,
    };

    /// So long that arms hold nothing.
    pub const FOREVER: Self = Self {
        decay: 0.0,
        ..Self::NOTHING
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

    /// The viscosity over the stiffness of a dashpot that acts alone, s.
    pub(crate) fn dashpot(&self) -> f32 {
        if self.relaxation_time == 0.0 {
            self.retardation_time
        } else {
            0.0
        }
    }

    /// In so many seconds, above 0.
    pub(crate) fn over(&self, time: f64) -> RelaxationStep {
        let (retardation, relaxation) = (f64::from(self.retardation_time), f64::from(self.relaxation_time));
        let ratio = time / relaxation;
        RelaxationStep {
            decay: libm::exp(-ratio),
            gain: retardation / time * -libm::expm1(-ratio),
            yields: true,
        }
    }

    /// How stiff the arm's spring is against what it lies beside; `None`: there is no such spring.
    pub(crate) fn stiffening(&self) -> Option<f64> {
        (self.relaxation_time > 0.0).then(|| f64::from(self.retardation_time) / f64::from(self.relaxation_time))
    }

    /// What the rates of something become with an arm beside it. Leapfrog with steps h is stable where `h² w² (1 + 2 gain / (1 + decay))`
    /// is below 4, and the last part is at most both 2 T/h and T/tau: a dashpot, or a spring.
    pub(crate) fn rates(&self, rates: Rates) -> Rates {
        let as_dashpot = Rates {
            most_damped: rates.most_damped + self.retardation_time * rates.stiffest,
            ..rates
        };
        let Some(stiffening) = self.stiffening() else {
            return as_dashpot;
        };
        let as_spring = Rates {
            stiffest: rates.stiffest * (1.0 + stiffening) as f32,
            ..rates
        };
        if as_dashpot.limit() > as_spring.limit() {
            as_dashpot
        } else {
            as_spring
        }
    }
}

/// What a node carries of forces that are not those of springs, at rest: twice the sum over all nodes bounds their form.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Carried {
    /// N/m
    pub stiffness: f32,
    /// N s/m
    pub damping: f32,
}

saved! { Carried { stiffness, damping } }

impl Carried {
    /// Adds what forces give with this stiffness, N/m, that have such an arm beside them.
    pub fn add(&mut self, stiffness: f32, viscosity: Viscosity) {
        let stiffness = 0.5 * stiffness;
        self.stiffness += stiffness;
        match viscosity.stiffening() {
            Some(stiffening) => self.stiffness += stiffness * stiffening as f32,
            None => self.damping += stiffness * viscosity.retardation_time,
        }
    }
}
