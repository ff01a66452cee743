//! Takes a step of a body by itself, and again where that fails.

use glam::DVec3;

use super::System;
use super::implicit;
use super::needs::{Need, first_substep, prepare, refined, substeps_needed};
use super::step_request::{Carry, Outcome, StepRequest};
use super::verlet::{self, StepResult, TooLong};
use crate::base::StateHasher;
use crate::contact::{Meeting, ToolPath};
use crate::def::SolverReport;
use crate::nodes::Mobility;
use crate::threads::Team;

/// How often a step is begun again with shorter substeps, because its own motion made them necessary.
const ATTEMPTS: u32 = 4;

/// How often masses are made within a step for elements that its motion made stiff.
const RELIEFS: i32 = 8;

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
    /// The longest stable substep with the nodes where a step has led them, s, where it is known.
    pub fn newest_limit(&self, carry: &Carry) -> Option<f32> {
        carry
            .limit()
            .map(|limit| limit.min(self.forces.newest_limit_beside_springs()))
    }

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

    /// Has what is pinned press the tools that a step, tried in so many substeps, of so many seconds, leads into it.
    pub fn press_pinned(&mut self, tools: &[ToolPath], (substeps, dt): (u32, f32)) {
        let Some(contacts) = &mut self.contacts else {
            return;
        };
        let state = self.state.substep();
        let meeting = Meeting {
            kernel: self.kernel,
            tools,
            origin: self.origin,
            dt,
            start: 0.0,
            end: 1.0,
            substep: dt,
            drifts: false,
            slack: 0.0,
            neighbor_speed: None,
            thickness: contacts.thickness,
            fastest: 0.0,
            mobility: Mobility {
                inverse_masses: &self.inverse_masses,
                damping: None,
                substep: dt,
                half: false,
                asleep: None,
            },
            positions: state.positions,
            velocities: state.velocities,
            next_positions: state.next_positions,
            pins: &mut self.pins,
            bindings: self.bindings.as_ref(),
            profile: None,
        };
        let forces = &self.forces;
        contacts.press_pinned(meeting, substeps, |node| forces.stiffness_at(node, 0.0));
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
        let stable_substep = body.newest_limit(&carry).unwrap_or(f32::INFINITY);
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
    let limit = body.newest_limit(carry).unwrap_or(f32::INFINITY);
    let time = (0.5 * limit).min(request.dt);
    body.coarse
        .as_mut()
        .map_or(0.0, |coarse| coarse.pass_end(positions, velocities, time))
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
