//! Steps one uncoupled body and retries with shorter substeps under a tolerance.

use glam::DVec3;

use super::System;
use super::integrator::Integrator;
use super::step_request::{IntegratorState, Outcome, StepRequest};
use super::verlet::{StepResult, SubstepTooLong};
use crate::contact::{ContactInput, ToolPath};
use crate::def::SolverReport;
use crate::nodes::Mobility;
use crate::threads::Team;

/// Attempts a step of `body` without committing it.
pub(crate) fn attempt(body: &mut System, request: &StepRequest, team: &Team) -> Outcome {
    let request = &request.for_body(body);
    body.wake_near_tools(request.tools);
    if body.is_asleep() {
        return Outcome::Asleep;
    }
    let attempted = body.with_integrator(|integrator, body| {
        let result = integrator.step(body, request, None, team)?;
        Ok(if request.tolerance == 0.0 || request.substeps > 0 {
            outcome_of(body, &result, 0.0)
        } else {
            run_to_tolerance(integrator, body, request, result, team)
        })
    });
    attempted.unwrap_or_else(|too_long: SubstepTooLong| too_long.into())
}

impl System {
    /// The longest stable substep at the positions that an attempted step ended with, if known, s.
    pub fn newest_limit(&self, carry: &IntegratorState) -> Option<f32> {
        carry
            .limit()
            .map(|limit| limit.min(self.forces.latest_non_spring_dt_limit()))
    }

    /// Lets pinned surfaces press tools that an attempted step of `substeps` substeps of `dt` seconds moved into them.
    pub fn add_pinned_forces(&mut self, tools: &[ToolPath], (substeps, dt): (u32, f32)) {
        let Some(contacts) = &mut self.contacts else {
            return;
        };
        let state = self.state.substep();
        let contact_input = ContactInput {
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
        contacts.add_pinned_forces(contact_input, substeps, |node| forces.stiffness_at(node, 0.0));
    }

    /// Reports how the solver took the last step.
    pub fn solver_report(&self) -> SolverReport {
        SolverReport {
            added_mass: self.scaling.as_ref().map_or(0.0, |scaling| scaling.added_mass()),
            ..self.integrator.last_report()
        }
    }
}

/// Doubles the number of substeps until the result changes by no more than the tolerance. Returns the finer result.
///
/// The difference bounds the error of the finer step for every convergence order from 1 on. Contact converges at order
/// 1; modes that the substep does not resolve have no order at all.
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
    start.carry.substep_history = carry.substep_history;
    let mut error = 0.0;
    compare(body, request, &carry);
    loop {
        let stable_substep = body.newest_limit(&carry).unwrap_or(f32::INFINITY);
        let substeps = start.substeps.saturating_mul(2);
        (start.substeps, start.middle) = (substeps, start.middle.saturating_mul(2));
        if substeps > request.max_substeps || substeps == u32::MAX {
            // Without a comparison the error is unbounded.
            let error = if error > 0.0 { error } else { f32::INFINITY };
            return Outcome::Unstable { stable_substep, error };
        }
        // A step that turned out to be unstable may be stable with twice the substeps.
        let Ok(finer) = integrator.step(body, request, Some(start), team) else {
            continue;
        };
        carry = finer.carry;
        error = compare(body, request, &carry);
        if error <= request.tolerance || !finer.finite {
            return outcome_of(body, &finer, error);
        }
    }
}

/// The distance between the results of the last two attempts, m.
fn compare(body: &mut System, request: &StepRequest, carry: &IntegratorState) -> f32 {
    let (positions, velocities) = body.state.newest();
    // The inverse of the highest frequency.
    let limit = body.newest_limit(carry).unwrap_or(f32::INFINITY);
    let time = (0.5 * limit).min(request.dt);
    body.coarse
        .as_mut()
        .map_or(0.0, |coarse| coarse.compare_end(positions, velocities, time))
}

pub(crate) fn outcome_of(body: &System, result: &StepResult, error: f32) -> Outcome {
    if result.finite && sums_fit(body) {
        Outcome::Done {
            substeps: result.start.substeps,
            carry: result.carry,
            error,
        }
    } else {
        Outcome::NotFinite
    }
}

/// True if the reported sums of pins and tools are finite.
fn sums_fit(body: &System) -> bool {
    body.pins.iter().all(|pin| fits(pin.force_sum))
        && body
            .tool_attachments
            .iter()
            .all(|tool_attachments| tool_attachments.sums_fit(fits))
        && body
            .contacts
            .iter()
            .flat_map(|contacts| contacts.loads())
            .all(|load| fits(load.impulse) && fits(load.angular_impulse))
}

/// True if a sum over the step is finite and far enough below the largest `f32` to be reported.
fn fits(sum: DVec3) -> bool {
    sum.abs().max_element() < f64::from(f32::MAX) * 1e-3
}
