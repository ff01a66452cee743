//! How many substeps a step of VERLET needs.

use super::System;
use super::stability::{RESERVE, Stability};
use super::step_request::{Carry, StepRequest};
use crate::threads::Team;

/// The part that is used of the substep that is stable wherever the nodes go: nothing is to be made up for as they move.
const RESERVE_ANYWHERE: f32 = 0.9;

/// A step with more substeps than this looks whether the positions allow longer ones: an estimate takes about as long as
/// so many.
const WORTH_ESTIMATING: f32 = 8.0;

/// Tissue that resists blades takes no more than so many times the substeps that it takes at rest, as far as mass may be added.
const SQUEEZED: f64 = 1.25;

/// What a step of VERLET begins with, and the longest stable substep as far as springs are not concerned, s.
pub(super) fn prepare(body: &mut System, request: &StepRequest, team: &Team) -> (Carry, f32) {
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
    pub fn new(body: &System, request: &StepRequest, start: Carry, stable_substep: f32, beside_springs: f32) -> Self {
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

/// A number of substeps, 1 at least.
fn as_count(substeps: f64) -> u32 {
    substeps.clamp(1.0, f64::from(u32::MAX)) as u32
}

/// What a step begins with, where springs are found to be stable in no longer substeps than this, s.
fn with_less_stability(start: Carry, stable_substep: f32) -> Carry {
    let stability = start.stability.shortened_to(stable_substep);
    Carry { stability, ..start }
}

/// As many times more substeps than stability asks for as the energy of the body does, as far as they are allowed.
pub(super) fn refined(substeps: u32, start: &Carry, request: &StepRequest) -> u32 {
    substeps
        .saturating_mul(start.energy.refinement())
        .min(request.max_substeps.max(substeps))
}

/// The longest stable substep as far as is known before the step, s.
pub(super) fn first_substep(body: &System, start: &Carry, beside_springs: f32) -> f32 {
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
pub(super) fn fewer_substeps(body: &System, request: &StepRequest, stable_substep: f32) -> Option<(u32, f32)> {
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
    if !is_squeezed {
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
