//! The number of substeps that a step of VERLET needs.

use super::System;
use super::stability::{RESERVE, Stability};
use super::step_request::{IntegratorState, StepRequest};
use crate::threads::Team;

/// The used fraction of the substep that is stable at all positions. Motion cannot invalidate this limit.
const RESERVE_ANYWHERE: f32 = 0.9;

/// A step with more substeps estimates the limit at the current positions. An estimate costs about as much as this many
/// substeps.
const WORTH_ESTIMATING: f32 = 8.0;

/// From this number of substeps on, the bound of elements is tightened at the start of each step. That costs about as
/// much as eight substeps.
const WORTH_TIGHTENING: f64 = 24.0;

/// The maximum ratio of substeps to those at rest for tissue that resists blades, as far as mass can be added.
const BLADE_SUBSTEP_RATIO: f64 = 1.25;

/// Returns the state that a step of VERLET begins with, and the longest stable substep (s) of all forces except
/// springs.
///
/// `may_tighten`: the body steps alone. Coupled bodies do not tighten bounds again within a step, so they would have to
/// repeat it more often.
pub(super) fn prepare(
    body: &mut System,
    request: &StepRequest,
    may_tighten: bool,
    team: &Team,
) -> (IntegratorState, f32) {
    if body.forces.has_non_spring_forces() {
        // The limits of elements, terms and cavities depend on the masses of the step.
        let ends = body.scaling.as_mut().is_some_and(|scaling| scaling.end_stiffened());
        let scaling_substep = fewer_substeps(body, request, 0.0).map_or(0.0, |(_, scaling_substep)| scaling_substep);
        if ends {
            body.scale_masses(scaling_substep);
        }
        body.scale_masses_for(scaling_substep);
    }
    // The mass of tissue that resists blades follows the looser bound.
    let may_tighten = may_tighten && !resists_blades(body) && body.forces.can_tighten();
    if !may_tighten && body.forces.uses_deformed_rates() {
        body.forces.forget_rates();
    }
    let mut non_spring_limit = body.non_spring_dt_limit(team);
    let is_worth_tightening =
        body.forces.uses_deformed_rates() || substeps_needed(request, non_spring_limit) > WORTH_TIGHTENING;
    if is_worth_tightening && may_tighten {
        non_spring_limit = body.tightened_dt_limit(false, team).unwrap_or(non_spring_limit);
    }
    if substeps_needed(request, non_spring_limit) > f64::from(max_unscaled_substeps(body, request)) {
        non_spring_limit = body
            .scale_for_deformation(request, false, 1, team)
            .unwrap_or(non_spring_limit);
    }
    let previous = body.carry.stability;
    let are_scaled = body.carry.scaling_substep > 0.0;
    let is_worth_estimating = || {
        let substeps = request.dt / (RESERVE * previous.limit_anywhere());
        request.substeps == 0
            && !are_scaled
            && previous.is_coarse()
            && previous.is_worth_estimating()
            && substeps > WORTH_ESTIMATING
    };
    if previous.limit().is_none() {
        body.find_critical_nodes();
    }
    // With added mass the estimate belongs to earlier positions, but it still predicts the saving.
    let is_earlier = are_scaled && fewer_substeps(body, request, previous.limit().unwrap_or(f32::INFINITY)).is_none();
    let stability = if previous.limit().is_none() || is_earlier || is_worth_estimating() {
        body.estimate(body.state.positions())
    } else {
        previous
    };
    let start = IntegratorState {
        stability,
        ..body.carry
    };
    (start, non_spring_limit)
}

/// The substeps and masses of a body for a step.
pub(crate) struct StepPlan {
    pub start: IntegratorState,
    pub substeps: u32,
    pub scaling_substep: f32,
}

impl StepPlan {
    /// Plans a step from `start`, given the longest stable substep and that of all forces except springs, s.
    pub fn new(
        body: &System,
        request: &StepRequest,
        start: IntegratorState,
        stable_substep: f32,
        non_spring_limit: f32,
    ) -> Self {
        match fewer_substeps(body, request, stable_substep) {
            Some((substeps, scaling_substep)) => Self {
                start: with_limit(start, stable_substep),
                // Masses are sufficient for springs in `substeps`, and the limit of other forces depends on the masses.
                substeps: if body.forces.springs.spring_count() == 0 {
                    as_count(substeps_needed(request, non_spring_limit))
                } else {
                    substeps.max(as_count(substeps_needed(request, non_spring_limit)))
                },
                scaling_substep,
            },
            None => Self {
                start,
                substeps: as_count(substeps_needed(request, stable_substep)),
                scaling_substep: 0.0,
            },
        }
    }
}

/// Converts to a count of at least 1.
fn as_count(substeps: f64) -> u32 {
    substeps.clamp(1.0, f64::from(u32::MAX)) as u32
}

/// Returns `start` with the stable substep of springs limited to `stable_substep`, s.
fn with_limit(start: IntegratorState, stable_substep: f32) -> IntegratorState {
    let stability = start.stability.shortened_to(stable_substep);
    IntegratorState { stability, ..start }
}

/// Multiplies the substeps by the refinement of the energy account, up to the allowed maximum.
pub(super) fn refined(substeps: u32, start: &IntegratorState, request: &StepRequest) -> u32 {
    substeps
        .saturating_mul(start.energy.refinement())
        .min(request.max_substeps.max(substeps))
}

/// The longest stable substep that is known before the step, s.
pub(super) fn first_substep(body: &System, start: &IntegratorState, non_spring_limit: f32) -> f32 {
    let is_anywhere = start.stability.is_coarse() || is_better_anywhere(body, &start.stability);
    let of_springs = if is_anywhere {
        reduced_reserve_anywhere(&start.stability)
    } else {
        start.stability.limit().unwrap_or(f32::INFINITY)
    };
    of_springs.min(non_spring_limit)
}

/// True if the limit at all positions is cheaper than repeated estimates for slightly longer substeps. The speed of the
/// body is not tested: its bound is an axis-aligned box, so that the result would depend on orientation.
fn is_better_anywhere(body: &System, stability: &Stability) -> bool {
    let limit = stability.limit().unwrap_or(0.0);
    body.critical_nodes.other_limit() < limit && !stability.is_worth_estimating()
}

/// Returns the substep of which `RESERVE` equals `RESERVE_ANYWHERE` of the limit at all positions, at most the last
/// estimate, s.
fn reduced_reserve_anywhere(stability: &Stability) -> f32 {
    (RESERVE_ANYWHERE / RESERVE * stability.limit_anywhere()).min(stability.last_estimate())
}

/// The number of substeps of a step with this stable substep, s.
pub(crate) fn substeps_needed(request: &StepRequest, stable_substep: f32) -> f64 {
    (f64::from(request.dt) / f64::from(RESERVE * stable_substep)).ceil()
}

/// The smallest number of substeps with added mass, and the substep that masses are computed for, s. `None` if mass
/// must not be added or saves too little.
pub(super) fn fewer_substeps(body: &System, request: &StepRequest, stable_substep: f32) -> Option<(u32, f32)> {
    // A tolerance does not measure the error of added mass.
    if request.substeps > 0 || request.tolerance > 0.0 {
        return None;
    }
    let (masses, inverse_masses) = (&body.masses, &body.inverse_masses);
    let scaling = body.scaling.as_ref()?;
    let needed = if body.forces.has_non_spring_forces() {
        scaling.needed_at_rest(request.dt, max_unscaled_substeps(body, request))
    } else {
        substeps_needed(request, stable_substep)
    };
    scaling.fewer_substeps((request.dt, request.max_substeps), needed, masses, inverse_masses)
}

/// Adds mass for elements as an attempted step has deformed them, if it needs more substeps than
/// `max_unscaled_substeps` allows. Returns the substeps and the substep that masses are computed for.
pub(crate) fn scale_for_compression(
    body: &mut System,
    request: &StepRequest,
    stable_substep: f32,
    team: &Team,
) -> Option<(u32, f32)> {
    let needs_mass = substeps_needed(request, stable_substep) > f64::from(max_unscaled_substeps(body, request));
    if !needs_mass {
        return None;
    }
    let limit = body.scale_for_deformation(request, true, 1, team)?;
    let (substeps, scaling_substep) = fewer_substeps(body, request, 0.0)?;
    Some((substeps.max(as_count(substeps_needed(request, limit))), scaling_substep))
}

fn resists_blades(body: &System) -> bool {
    body.cut_properties.is_some_and(|cut| cut.toughness > 0.0)
}

/// The maximum number of substeps before mass is added for deformed elements. Blades compress the elements at their
/// edges. Tissue that resists blades is therefore limited to `BLADE_SUBSTEP_RATIO` times the substeps at rest.
fn max_unscaled_substeps(body: &System, request: &StepRequest) -> u32 {
    match body.scaling.as_ref().filter(|_| resists_blades(body)) {
        Some(scaling) => as_count(BLADE_SUBSTEP_RATIO * scaling.unscaled_at_rest(request.dt)).min(request.max_substeps),
        None => request.max_substeps,
    }
}
