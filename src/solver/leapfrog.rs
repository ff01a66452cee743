//! Leapfrog as an integrator: substep selection and coupled steps. `verlet.rs` contains the uncoupled step.
//!
//! It has no data of its own. [`IntegratorState`] and the node state pass data from step to step, because reading
//! velocities, sleeping and spring changes need it between steps.

use super::System;
use super::energy_monitor::EnergyMonitor;
use super::energy_sums::TileSums;
use super::integrator::{CoupledBody, CoupledStep, Integrator, LEAPFROG};
use super::step_request::{IntegratorState, StepRequest, StepStart};
use super::substep_count::{StepPlan, first_substep, prepare, refined, substeps_needed};
use super::verlet::{Step, Stepped, SubstepTooLong, begin, check, check_beside_springs, run, run_kick};
use crate::base::Result;
use crate::codec::{Writer, saved};
use crate::forces::Forces;
use crate::geometry::Aabb;
use crate::soa::per_node;
use crate::threads::Team;

/// The maximum number of restarts of a step because its motion makes the substeps too long.
const MAX_ATTEMPTS: u32 = 4;

/// The maximum number of mass updates within a step for elements that its motion stiffens.
const MAX_SCALINGS: i32 = 8;

/// The integrator of VERLET.
#[derive(Debug)]
pub(super) struct Leapfrog;

saved! { Leapfrog }

impl Leapfrog {
    /// Creates the integrator, and prepares the bounds of forces for it.
    pub fn new(forces: &mut Forces) -> Result<Self> {
        forces.prepare_deformed_rates()?;
        Ok(Self)
    }
}

per_node! { Leapfrog {} }

impl Integrator for Leapfrog {
    fn step(&mut self, body: &mut System, request: &StepRequest, retry: Option<StepStart>, team: &Team) -> Stepped {
        let start = match retry {
            Some(start) => start,
            None => {
                let (carry, non_spring_limit) = prepare(body, request, true, team);
                if request.substeps == 0 {
                    return run_stably(body, request, carry, non_spring_limit, team);
                }
                StepStart {
                    carry,
                    substeps: request.substeps,
                    middle: 0,
                }
            }
        };
        run(body, request, start, 0.0, team)
    }

    fn plan_step(&mut self, body: &mut System, request: &StepRequest, team: &Team) -> StepPlan {
        let (start, non_spring_limit) = prepare(body, request, false, team);
        if request.substeps > 0 {
            return StepPlan {
                start,
                substeps: request.substeps,
                scaling_substep: 0.0,
            };
        }
        let stable_substep = first_substep(body, &start, non_spring_limit);
        let mut plan = StepPlan::new(body, request, start, stable_substep, non_spring_limit);
        plan.start.substep_history = start.substep_history.after(plan.substeps, request.dt);
        let substeps = start
            .substep_history
            .hold(plan.substeps, request.dt, request.max_substeps);
        plan.substeps = refined(substeps, &start, request);
        plan
    }

    fn begin(&mut self, body: &mut System, coupled: &mut CoupledBody, step: &CoupledStep) -> Stepped<()> {
        let (request, substep) = (&step.request.for_body(body), step.substep());
        if coupled.scaling_substep == 0.0 {
            check(&coupled.start.stability, substep)?;
        }
        begin(body, request);
        coupled.substep_kick =
            Step::of(request, step.substeps, coupled.scaling_substep, step.team).opening(body, &mut coupled.carry);
        if let Some(damping) = &mut body.damping {
            damping.prepare(substep);
        }
        Ok(())
    }

    fn substep(&mut self, body: &mut System, coupled: &mut CoupledBody, step: &CoupledStep, index: u32) -> Stepped<()> {
        let request = &step.request.for_body(body).with_scaled_gravity(body);
        let CoupledBody {
            substep_kick, carry, ..
        } = coupled;
        if index > 0 {
            substep_kick.set_full_kick(request.gravity, &mut carry.gravity);
        }
        substep_kick.start = f64::from(index) / f64::from(step.substeps);
        substep_kick.end = f64::from(index + 1) / f64::from(step.substeps);
        if step.compares && index + 1 == step.substeps {
            EnergyMonitor::store_previous_velocities(body, substep_kick);
        }
        run_kick(body, request, substep_kick, carry, step.team);
        Ok(())
    }

    fn end(
        &mut self,
        body: &mut System,
        coupled: &mut CoupledBody,
        step: &CoupledStep,
        velocities: Aabb,
    ) -> Stepped<()> {
        let (substep, team) = (step.substep(), step.team);
        body.forces
            .advance(f64::from(substep), body.state.next_positions(), team);
        body.state.advance();
        coupled.carry.gravity.velocities = velocities;
        Step::of(step.request, step.substeps, coupled.scaling_substep, team).check_after(body, &mut coupled.carry)
    }

    fn closing_half_kick(&mut self, body: &mut System, coupled: &mut CoupledBody, step: &CoupledStep) -> Stepped<()> {
        let CoupledBody {
            substep_kick, carry, ..
        } = coupled;
        coupled.sums = step
            .compares
            .then(|| TileSums::before_flush(body, substep_kick, step.team));
        let request = &step.request.for_body(body).with_scaled_gravity(body);
        substep_kick.set_closing(request.gravity, &mut carry.gravity);
        run_kick(body, request, substep_kick, carry, step.team);
        check_beside_springs(body, step.substep())
    }

    fn takes_half_kicks(&self) -> bool {
        true
    }

    fn is_limited_by_stability(&self) -> bool {
        true
    }

    fn save(&self, to: &mut Writer) {
        to.write(&[LEAPFROG]);
    }
}

/// Takes the step with as many substeps as stability requires.
fn run_stably(
    body: &mut System,
    request: &StepRequest,
    start: IntegratorState,
    non_spring_limit: f32,
    team: &Team,
) -> Stepped {
    let mut stable_substep = first_substep(body, &start, non_spring_limit);
    let mut non_spring_limit = non_spring_limit;
    let (mut attempt, mut scalings, mut was_tried, mut guess) = (0, 0, false, 1.0);
    loop {
        if attempt >= MAX_ATTEMPTS {
            let anywhere = start.stability.limit_anywhere();
            if body.forces.has_non_spring_forces() {
                // The stiffness of elements, terms and cavities is unbounded under large deformation.
                guess *= 0.5;
                stable_substep = stable_substep.min(anywhere);
            } else {
                stable_substep = anywhere;
            }
        }
        let known_plan = StepPlan::new(body, request, start, stable_substep, non_spring_limit);
        if known_plan.substeps > request.max_substeps || known_plan.substeps == u32::MAX {
            scalings += 1;
            match body.scale_for_deformation(request, was_tried, scalings, team) {
                Some(limit) if scalings <= MAX_SCALINGS => {
                    (attempt, guess, non_spring_limit) = (0, 1.0, limit);
                    stable_substep = first_substep(body, &start, limit);
                    continue;
                }
                _ => break,
            }
        }
        let known_substeps = known_plan.substeps;
        let plan = if guess < 1.0 {
            StepPlan::new(body, request, start, guess * stable_substep, guess * non_spring_limit)
        } else {
            known_plan
        };
        let is_last = plan.substeps >= request.max_substeps || attempt >= MAX_ATTEMPTS && guess == 1.0;
        (attempt, was_tried) = (attempt + 1, true);
        let substeps = plan.substeps.min(request.max_substeps);
        let substeps = start.substep_history.hold(substeps, request.dt, request.max_substeps);
        let substeps = refined(substeps, &start, request);
        let attempt_start = StepStart::new(plan.start, substeps);
        match run(body, request, attempt_start, plan.scaling_substep, team) {
            Ok(mut result) => {
                // A guess does not predict the substeps of the next steps.
                result.carry.substep_history = start.substep_history.after(known_substeps, request.dt);
                result.start.carry = start;
                return Ok(result);
            }
            Err(error) => {
                if body.forces.uses_deformed_rates() {
                    body.tightened_dt_limit(false, team);
                }
                stable_substep = stable_substep.min(error.stable_substep);
                non_spring_limit = non_spring_limit.min(error.stable_substep);
                if is_last && substeps_needed(request, stable_substep) <= f64::from(request.max_substeps) {
                    break;
                }
            }
        }
    }
    Err(SubstepTooLong { stable_substep })
}
