//! Leapfrog as an integrator: how many substeps stability needs, and steps that bodies take together. A step alone is in `verlet.rs`.
//!
//! It keeps nothing of its own. What one step hands to the next is in [`Carry`] and in the state: reading velocities, sleep and changes of
//! springs need it between steps.

use super::System;
use super::energy_monitor::Account;
use super::energy_sums::TileSums;
use super::integrator::{CoupledBody, CoupledStep, Integrator, LEAPFROG};
use super::needs::{Need, first_substep, prepare, refined, substeps_needed};
use super::step_request::{Carry, StepRequest, StepStart};
use super::verlet::{Step, Stepped, TooLong, begin, check, check_beside_springs, pass, run};
use crate::codec::{Writer, saved};
use crate::geometry::Bounds;
use crate::soa::per_node;
use crate::threads::Team;

/// How often a step is begun again with shorter substeps, because its own motion made them necessary.
const ATTEMPTS: u32 = 4;

/// How often masses are made within a step for elements that its motion made stiff.
const RELIEFS: i32 = 8;

/// The integrator of VERLET.
#[derive(Debug)]
pub(super) struct Leapfrog;

saved! { Leapfrog }

per_node! { Leapfrog {} }

impl Integrator for Leapfrog {
    fn step(&mut self, body: &mut System, request: &StepRequest, again: Option<StepStart>, team: &Team) -> Stepped {
        let start = match again {
            Some(start) => start,
            None => {
                let (carry, beside_springs) = prepare(body, request, team);
                if request.substeps == 0 {
                    return run_stably(body, request, carry, beside_springs, team);
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

    fn need(&mut self, body: &mut System, request: &StepRequest, team: &Team) -> Need {
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

    fn begin(&mut self, body: &mut System, walk: &mut CoupledBody, step: &CoupledStep) -> Stepped<()> {
        let (request, substep) = (&step.request.of(body), step.substep());
        if walk.masses_for == 0.0 {
            check(&walk.start.stability, substep)?;
        }
        begin(body, request);
        walk.part = Step::of(request, step.substeps, walk.masses_for, step.team).opening(body, &mut walk.carry);
        if let Some(damping) = &mut body.damping {
            damping.prepare(substep);
        }
        Ok(())
    }

    fn substep(&mut self, body: &mut System, walk: &mut CoupledBody, step: &CoupledStep, index: u32) -> Stepped<()> {
        let request = &step.request.of(body).weighed(body);
        let CoupledBody { part, carry, .. } = walk;
        if index > 0 {
            part.go_on(request.gravity, &mut carry.gravity);
        }
        part.start = f64::from(index) / f64::from(step.substeps);
        part.end = f64::from(index + 1) / f64::from(step.substeps);
        if step.compares && index + 1 == step.substeps {
            Account::keep_velocities(body, part);
        }
        pass(body, request, part, carry, step.team);
        Ok(())
    }

    fn end(&mut self, body: &mut System, walk: &mut CoupledBody, step: &CoupledStep, given: Bounds) -> Stepped<()> {
        let (substep, team) = (step.substep(), step.team);
        body.forces.age(f64::from(substep), body.state.next_positions(), team);
        body.state.advance();
        walk.carry.gravity.velocities = given;
        Step::of(step.request, step.substeps, walk.masses_for, team).check_after(body, &mut walk.carry)
    }

    fn close(&mut self, body: &mut System, walk: &mut CoupledBody, step: &CoupledStep) -> Stepped<()> {
        let CoupledBody { part, carry, .. } = walk;
        walk.sums = step.compares.then(|| TileSums::of_open(body, part, step.team));
        let request = &step.request.of(body).weighed(body);
        part.close(request.gravity, &mut carry.gravity);
        pass(body, request, part, carry, step.team);
        check_beside_springs(body, step.substep())
    }

    fn takes_half_kicks(&self) -> bool {
        true
    }

    fn is_limited_by_stability(&self) -> bool {
        true
    }

    fn save(&self, to: &mut Writer) {
        to.put(&[LEAPFROG]);
    }
}

/// Takes the step with as many substeps as stability needs.
fn run_stably(body: &mut System, request: &StepRequest, start: Carry, beside_springs: f32, team: &Team) -> Stepped {
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
        let begun = StepStart::new(need.start, substeps);
        match run(body, request, begun, need.masses_for, team) {
            Ok(mut taken) => {
                // A guess says nothing of what the next steps need.
                taken.carry.pace = start.pace.after(known_substeps, request.dt);
                taken.start.carry = start;
                return Ok(taken);
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
