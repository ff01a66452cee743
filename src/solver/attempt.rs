//! How many substeps a step takes, and what becomes of a step that cannot be taken.

use glam::{DVec3, Vec3};

use super::System;
use super::closing::ClosingKick;
use super::energy_account::EnergyAccount;
use super::gravity::GravityKicks;
use super::implicit;
use super::pace::Pace;
use super::stability::Stability;
use super::verlet::{self, StepResult, TooLong};
use crate::base::{Profile, StateHasher};
use crate::codec::saved;
use crate::contact::{DynamicTool, ToolPath};
use crate::def::SolverReport;
use crate::threads::Team;

/// The part of the longest stable substep that is used.
pub(crate) const RESERVE: f32 = 0.8;

/// The part that is used of the substep that is stable wherever the nodes go: nothing is to be made up for as they move.
const RESERVE_ANYWHERE: f32 = 0.9;

/// How often a step is begun again with shorter substeps, because its own motion made them necessary.
const ATTEMPTS: u32 = 4;

/// How often masses are made within a step for elements that its motion made stiff.
const RELIEFS: i32 = 8;

/// Near tools and other tissue a step of IMPLICIT or NEWTON is cut into as many parts as this, whatever is allowed otherwise: 4 s of them.
const MOST_PARTS: u32 = 1 << 12;

/// A step with more substeps than this looks whether the positions allow longer ones: an estimate takes about as long as
/// so many.
const WORTH_ESTIMATING: f32 = 8.0;

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

saved!(Carry {
    stability,
    gravity,
    closing,
    masses_for,
    energy,
    pace
});

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

/// Tissue that resists blades takes no more than so many times the substeps that it takes at rest, as far as mass may be added.
const SQUEEZED: f64 = 1.25;

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

/// Takes a step of `body` without making it current.
pub(crate) fn attempt(body: &mut System, request: &StepRequest, team: &Team) -> Outcome {
    let request = &request.of(body);
    body.rouse(request.tools);
    if body.is_asleep() {
        return Outcome::Asleep;
    }
    if body.implicit.is_some() {
        return attempt_implicitly(body, request, team);
    }
    let (start, beside_springs) = prepare(body, request, team);
    if request.substeps > 0 {
        return match verlet::run(body, request, request.substeps, 0, start, 0.0, team) {
            Ok(taken) => finish(body, request.substeps, taken, 0.0),
            Err(too_long) => too_long.into(),
        };
    }
    match run_stably(body, request, start, beside_springs, team) {
        Err(too_long) => too_long.into(),
        Ok((substeps, taken)) if request.tolerance == 0.0 => finish(body, substeps, taken, 0.0),
        Ok((substeps, taken)) => run_to_tolerance(body, request, substeps, start, taken.carry, team),
    }
}

/// What a step of VERLET begins with, and the longest stable substep as far as springs are not concerned, s.
fn prepare(body: &mut System, request: &StepRequest, team: &Team) -> (Carry, f32) {
    if body.forces.are_more_than_springs() {
        // What else there is asks for substeps by the masses that the step is taken with.
        let ends = body.scaling.as_mut().is_some_and(|scaling| scaling.end_relief());
        let masses_for = fewer_substeps(body, request, 0.0).map_or(0.0, |(_, masses_for)| masses_for);
        if ends {
            body.scale_masses(masses_for);
        }
        body.use_masses_for(masses_for);
    }
    let mut beside_springs = body.limit_beside_springs(team);
    if substeps_needed(request, beside_springs) > f64::from(unrelieved(body, request)) {
        beside_springs = body.relieve(request, false, 1, team).unwrap_or(beside_springs);
    }
    let known = body.carry.stability;
    let are_scaled = body.carry.masses_for > 0.0;
    let is_worth_estimating = || {
        let substeps = request.dt / (RESERVE * known.limit_anywhere());
        request.substeps == 0
            && !are_scaled
            && known.is_coarse()
            && known.is_worth_estimating()
            && substeps > WORTH_ESTIMATING
    };
    if known.limit().is_none() {
        body.watch();
    }
    // While masses are made for the substep, the estimate is one of earlier positions: it still says what is saved.
    let is_earlier = are_scaled && fewer_substeps(body, request, known.limit().unwrap_or(f32::INFINITY)).is_none();
    let stability = if known.limit().is_none() || is_earlier || is_worth_estimating() {
        body.estimate(body.state.positions())
    } else {
        known
    };
    let start = Carry {
        stability,
        ..body.carry
    };
    (start, beside_springs)
}

/// What a body needs for a step.
pub(crate) struct Need {
    pub start: Carry,
    pub substeps: u32,
    pub masses_for: f32,
}

impl Need {
    /// That of a step which begins like this, with the longest stable substep and that of all but springs, s.
    fn new(body: &System, request: &StepRequest, start: Carry, stable_substep: f32, beside_springs: f32) -> Self {
        match fewer_substeps(body, request, stable_substep) {
            Some((substeps, masses_for)) => Self {
                start: with_less_stability(start, stable_substep),
                substeps: substeps.max(as_count(substeps_needed(request, beside_springs))),
                masses_for,
            },
            None => Self {
                start,
                substeps: as_count(substeps_needed(request, stable_substep)),
                masses_for: 0.0,
            },
        }
    }
}

/// What a step of VERLET needs that a body takes together with others.
pub(crate) fn needed(body: &mut System, request: &StepRequest, team: &Team) -> Need {
    let (start, beside_springs) = prepare(body, request, team);
    if request.substeps > 0 {
        return Need {
            start,
            substeps: request.substeps,
            masses_for: 0.0,
        };
    }
    let stable_substep = first_substep(body, &start, beside_springs);
    let mut need = Need::new(body, request, start, stable_substep, beside_springs);
    need.start.pace = start.pace.after(need.substeps, request.dt);
    let substeps = start.pace.keep(need.substeps, request.dt, request.max_substeps);
    need.substeps = refined(substeps, &start, request);
    need
}

/// A number of substeps, 1 at least.
fn as_count(substeps: f64) -> u32 {
    substeps.clamp(1.0, f64::from(u32::MAX)) as u32
}

/// Takes a step that is stable however long it is.
fn attempt_implicitly(body: &mut System, request: &StepRequest, team: &Team) -> Outcome {
    let start = body.carry;
    body.begin_attempt(false);
    let asked = request.substeps.max(1);
    let (substeps, taken) = match implicit::run(body, request, asked, middle(asked), start, team) {
        Ok(taken) => taken,
        Err(too_long) => return too_long.into(),
    };
    if request.tolerance == 0.0 || request.substeps > 0 {
        finish(body, substeps, taken, 0.0)
    } else {
        run_to_tolerance(body, request, substeps, start, taken.carry, team)
    }
}

impl System {
    /// Whether stability limits its substeps, as that of VERLET does.
    pub fn is_explicit(&self) -> bool {
        self.implicit.is_none()
    }

    /// Lets each step from now on take so many products at most, where it solves equations; `u32::MAX`: as many as the definition allows.
    pub fn allow(&mut self, products: u32) {
        self.implicit.iter_mut().for_each(|implicit| implicit.allow(products));
    }

    /// Begins to attempt a step, or to attempt it again. What was known before the step is known again where that is refused.
    pub fn begin_attempt(&mut self, is_again: bool) {
        match &mut self.implicit {
            Some(implicit) if is_again => implicit.put_back(),
            Some(implicit) => implicit.attempt(),
            None => {}
        }
    }

    /// How its solver took the last step.
    pub fn solver_report(&self) -> SolverReport {
        let report = self.implicit.as_ref().map(|implicit| implicit.told);
        SolverReport {
            added_mass: self.scaling.as_ref().map_or(0.0, |scaling| scaling.added_mass()),
            ..report.unwrap_or_default()
        }
    }

    /// What the next step depends on of what its solver keeps.
    pub fn hash_solver(&self, hasher: &mut StateHasher) {
        self.implicit.iter().for_each(|implicit| implicit.hash(hasher));
    }
}

/// Takes the step in so many parts, as the body's solver does.
fn run(
    body: &mut System,
    request: &StepRequest,
    substeps: u32,
    middle: u32,
    start: Carry,
    team: &Team,
) -> Result<StepResult, TooLong> {
    if body.implicit.is_some() {
        implicit::run(body, request, substeps, middle, start, team).map(|(_, taken)| taken)
    } else {
        verlet::run(body, request, substeps, middle, start, 0.0, team)
    }
}

/// Takes the step with as many substeps as stability needs: how many, and what came of them.
fn run_stably(
    body: &mut System,
    request: &StepRequest,
    start: Carry,
    beside_springs: f32,
    team: &Team,
) -> Result<(u32, StepResult), TooLong> {
    let mut stable_substep = first_substep(body, &start, beside_springs);
    let mut beside_springs = beside_springs;
    let (mut attempt, mut reliefs, mut was_tried, mut guess) = (0, 0, false, 1.0);
    loop {
        if attempt >= ATTEMPTS {
            let anywhere = start.stability.limit_anywhere();
            if body.forces.are_more_than_springs() {
                // Where elements, terms and cavities go there is no end to how stiff they may be.
                guess *= 0.5;
                stable_substep = stable_substep.min(anywhere);
            } else {
                stable_substep = anywhere;
            }
        }
        let known = Need::new(body, request, start, stable_substep, beside_springs);
        if known.substeps > request.max_substeps || known.substeps == u32::MAX {
            reliefs += 1;
            match body.relieve(request, was_tried, reliefs, team) {
                Some(limit) if reliefs <= RELIEFS => {
                    (attempt, guess, beside_springs) = (0, 1.0, limit);
                    stable_substep = first_substep(body, &start, limit);
                    continue;
                }
                _ => break,
            }
        }
        let known_substeps = known.substeps;
        let need = if guess < 1.0 {
            Need::new(body, request, start, guess * stable_substep, guess * beside_springs)
        } else {
            known
        };
        let is_last = need.substeps >= request.max_substeps || attempt >= ATTEMPTS && guess == 1.0;
        (attempt, was_tried) = (attempt + 1, true);
        let substeps = need.substeps.min(request.max_substeps);
        let substeps = start.pace.keep(substeps, request.dt, request.max_substeps);
        let substeps = refined(substeps, &start, request);
        match verlet::run(
            body,
            request,
            substeps,
            middle(substeps),
            need.start,
            need.masses_for,
            team,
        ) {
            Ok(mut taken) => {
                // A guess says nothing of what the next steps need.
                taken.carry.pace = start.pace.after(known_substeps, request.dt);
                return Ok((substeps, taken));
            }
            Err(found) => {
                stable_substep = stable_substep.min(found.stable_substep);
                beside_springs = beside_springs.min(found.stable_substep);
                if is_last && substeps_needed(request, stable_substep) <= f64::from(request.max_substeps) {
                    break;
                }
            }
        }
    }
    Err(TooLong { stable_substep })
}

/// What a step begins with, where springs are found to be stable in no longer substeps than this, s.
fn with_less_stability(start: Carry, stable_substep: f32) -> Carry {
    let stability = start.stability.shortened_to(stable_substep);
    Carry { stability, ..start }
}

/// As many times more substeps than stability asks for as the energy of the body does, as far as they are allowed.
fn refined(substeps: u32, start: &Carry, request: &StepRequest) -> u32 {
    substeps
        .saturating_mul(start.energy.refinement())
        .min(request.max_substeps.max(substeps))
}

/// The longest stable substep as far as is known before the step, s.
fn first_substep(body: &System, start: &Carry, beside_springs: f32) -> f32 {
    let is_anywhere = start.stability.is_coarse() || is_better_anywhere(body, &start.stability);
    let of_springs = if is_anywhere {
        anywhere_with_less_reserve(&start.stability)
    } else {
        start.stability.limit().unwrap_or(f32::INFINITY)
    };
    of_springs.min(beside_springs)
}

/// Whether substeps that are stable wherever the nodes are come cheaper than estimates of all nodes for slightly longer ones.
/// It is not asked how fast the body moves: what is known of that is a box along the axes, and turns with them.
fn is_better_anywhere(body: &System, stability: &Stability) -> bool {
    let found = stability.limit().unwrap_or(0.0);
    body.watched.limit_of_others() < found && !stability.is_worth_estimating()
}

/// The substep, s, of which `RESERVE` is `RESERVE_ANYWHERE` of the one that is stable anywhere, or no more than is used at the
/// positions of the last estimate.
fn anywhere_with_less_reserve(stability: &Stability) -> f32 {
    (RESERVE_ANYWHERE / RESERVE * stability.limit_anywhere()).min(stability.found())
}

/// How many substeps a step takes of which the longest stable one is this long, s.
pub(crate) fn substeps_needed(request: &StepRequest, stable_substep: f32) -> f64 {
    (f64::from(request.dt) / f64::from(RESERVE * stable_substep)).ceil()
}

/// In how few substeps the step can be taken with some mass added, and for what substep, s; `None`: it is not to be, or saves
/// too little.
pub(crate) fn fewer_substeps(body: &System, request: &StepRequest, stable_substep: f32) -> Option<(u32, f32)> {
    // What a tolerance is about would not show what added mass changes.
    if request.substeps > 0 || request.tolerance > 0.0 {
        return None;
    }
    let (masses, inverse_masses) = (&body.masses, &body.inverse_masses);
    let scaling = body.scaling.as_ref()?;
    let needed = if body.forces.are_more_than_springs() {
        scaling.needed_at_rest(request.dt, unrelieved(body, request))
    } else {
        substeps_needed(request, stable_substep)
    };
    scaling.fewer_substeps((request.dt, request.max_substeps), needed, masses, inverse_masses)
}

/// Makes masses for elements as a step that was tried has deformed them, if that needs more substeps than are taken without: how many it takes then, and
/// what masses are made for.
pub(crate) fn relieve_squeezed(
    body: &mut System,
    request: &StepRequest,
    stable_substep: f32,
    team: &Team,
) -> Option<(u32, f32)> {
    let is_squeezed = substeps_needed(request, stable_substep) > f64::from(unrelieved(body, request));
    if body.implicit.is_some() || !is_squeezed {
        return None;
    }
    let limit = body.relieve(request, true, 1, team)?;
    let (substeps, masses_for) = fewer_substeps(body, request, 0.0)?;
    Some((substeps.max(as_count(substeps_needed(request, limit))), masses_for))
}

/// In how many substeps a step may be taken before masses are made for elements as they are deformed: in as many as are allowed, but in tissue that
/// resists blades, which squeeze the cells about their edges, in no more than so many times as at rest.
fn unrelieved(body: &System, request: &StepRequest) -> u32 {
    let resists = body.may_be_cut.is_some_and(|cut| cut.toughness > 0.0);
    match body.scaling.as_ref().filter(|_| resists) {
        Some(scaling) => as_count(SQUEEZED * scaling.unscaled_at_rest(request.dt)).min(request.max_substeps),
        None => request.max_substeps,
    }
}

/// The substep after which a step is looked at on its way: far from simple fractions of the step, where steps that have
/// lost the phase of an oscillation may agree.
fn middle(substeps: u32) -> u32 {
    (f64::from(substeps) * 0.618).ceil() as u32
}

/// Doubles the substeps until that changes nothing by more than the tolerance; the finer result stands.
///
/// The difference bounds the error of the finer step whatever the order at which the step converges, from 1 on: contact
/// is of order 1, and modes that the step does not resolve are of no order at all.
fn run_to_tolerance(
    body: &mut System,
    request: &StepRequest,
    substeps: u32,
    start: Carry,
    coarse: Carry,
    team: &Team,
) -> Outcome {
    let mut substeps = substeps;
    let mut middle = middle(substeps);
    let mut carry = coarse;
    let start = Carry {
        pace: coarse.pace,
        ..start
    };
    let mut error = 0.0;
    compare(body, request, &carry);
    loop {
        let stable_substep = newest_limit(body, &carry);
        substeps = substeps.saturating_mul(2);
        middle = middle.saturating_mul(2);
        if substeps > request.max_substeps || substeps == u32::MAX {
            // What was never compared may be off by anything.
            let error = if error > 0.0 { error } else { f32::INFINITY };
            return Outcome::Unstable { stable_substep, error };
        }
        // What was not stable after all may be so with twice the substeps.
        let Ok(finer) = run(body, request, substeps, middle, start, team) else {
            continue;
        };
        carry = finer.carry;
        error = compare(body, request, &carry);
        if error <= request.tolerance || !finer.finite {
            return finish(body, substeps, finer, error);
        }
    }
}

/// How far the step just taken lies from the one before it, m.
fn compare(body: &mut System, request: &StepRequest, carry: &Carry) -> f32 {
    let (positions, velocities) = body.state.newest();
    // 1 over the highest frequency.
    let time = (0.5 * newest_limit(body, carry)).min(request.dt);
    body.coarse
        .as_mut()
        .map_or(0.0, |coarse| coarse.pass_end(positions, velocities, time))
}

/// The longest stable substep with the nodes where a step has led them, s; infinity where any is.
fn newest_limit(body: &System, carry: &Carry) -> f32 {
    let with = |limit: f32| limit.min(body.forces.newest_limit_beside_springs());
    carry.limit().map_or(f32::INFINITY, with)
}

pub(crate) fn finish(body: &System, substeps: u32, taken: StepResult, error: f32) -> Outcome {
    if taken.finite && sums_fit(body) {
        Outcome::Done {
            substeps,
            carry: taken.carry,
            error,
        }
    } else {
        Outcome::NotFinite
    }
}

/// Whether what is told of pins and tools is finite.
fn sums_fit(body: &System) -> bool {
    body.pins.iter().all(|pin| fits(pin.force_sum))
        && body.grasps.iter().all(|grasps| grasps.sums_fit(fits))
        && body
            .contacts
            .iter()
            .flat_map(|contacts| contacts.loads())
            .all(|load| fits(load.impulse) && fits(load.angular_impulse))
}

/// Whether a sum over the step is finite, and far enough from the end of `f32` to be told to the caller.
fn fits(sum: DVec3) -> bool {
    sum.abs().max_element() < f64::from(f32::MAX) * 1e-3
}
