//! Takes a step of a body by itself, and again where that fails.

use glam::DVec3;

use super::System;
use super::integrator::Integrator;
use super::step_request::{Carry, Outcome, StepRequest};
use super::verlet::{StepResult, TooLong};
use crate::contact::{Meeting, ToolPath};
use crate::def::SolverReport;
use crate::nodes::Mobility;
use crate::threads::Team;

/// Takes a step of `body` without making it current.
pub(crate) fn attempt(body: &mut System, request: &StepRequest, team: &Team) -> Outcome {
    let request = &request.of(body);
    body.rouse(request.tools);
    if body.is_asleep() {
        return Outcome::Asleep;
    }
    let attempted = body.lend(|integrator, body| {
        let taken = integrator.step(body, request, None, team)?;
        Ok(if request.tolerance == 0.0 || request.substeps > 0 {
            finish(body, &taken, 0.0)
        } else {
            run_to_tolerance(integrator, body, request, taken, team)
        })
    });
    attempted.unwrap_or_else(|too_long: TooLong| too_long.into())
}

impl System {
    /// The longest stable substep with the nodes where a step has led them, s, where it is known.
    pub fn newest_limit(&self, carry: &Carry) -> Option<f32> {
        carry
            .limit()
            .map(|limit| limit.min(self.forces.newest_limit_beside_springs()))
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
        SolverReport {
            added_mass: self.scaling.as_ref().map_or(0.0, |scaling| scaling.added_mass()),
            ..self.integrator.told()
        }
    }
}

/// Doubles the substeps until that changes nothing by more than the tolerance; the finer result stands.
///
/// The difference bounds the error of the finer step whatever the order at which the step converges, from 1 on: contact
/// is of order 1, and modes that the step does not resolve are of no order at all.
fn run_to_tolerance(
    integrator: &mut dyn Integrator,
    body: &mut System,
    request: &StepRequest,
    coarse: StepResult,
    team: &Team,
) -> Outcome {
    let StepResult {
        mut start, mut carry, ..
    } = coarse;
    start.carry.pace = carry.pace;
    let mut error = 0.0;
    compare(body, request, &carry);
    loop {
        let stable_substep = body.newest_limit(&carry).unwrap_or(f32::INFINITY);
        let substeps = start.substeps.saturating_mul(2);
        (start.substeps, start.middle) = (substeps, start.middle.saturating_mul(2));
        if substeps > request.max_substeps || substeps == u32::MAX {
            // What was never compared may be off by anything.
            let error = if error > 0.0 { error } else { f32::INFINITY };
            return Outcome::Unstable { stable_substep, error };
        }
        // What was not stable after all may be so with twice the substeps.
        let Ok(finer) = integrator.step(body, request, Some(start), team) else {
            continue;
        };
        carry = finer.carry;
        error = compare(body, request, &carry);
        if error <= request.tolerance || !finer.finite {
            return finish(body, &finer, error);
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

pub(crate) fn finish(body: &System, taken: &StepResult, error: f32) -> Outcome {
    if taken.finite && sums_fit(body) {
        Outcome::Done {
            substeps: taken.start.substeps,
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
