//! Chooses the number of substeps in which a step of IMPLICIT or NEWTON is taken.

use super::step::{StepFormula, Substep};
use super::{Implicit, SubstepOutcome, contact};
use crate::def::SolverReport;
use crate::solver::System;
use crate::solver::step_request::{StepRequest, StepStart};
use crate::solver::tool_attachments::ReactionInterval;
use crate::solver::verlet::{StepResult, Stepped, SubstepTooLong, begin};
use crate::threads::Team;

/// Maximum number of repetitions of a step that has gained energy, each with four times as many substeps.
const MAX_SUBDIVISIONS: u32 = 4;

/// Maximum number of substeps due to an energy gain.
const MAX_SUBSTEPS: u32 = 1 << 12;

/// Divisor of the product budget that yields the minimum share of a substep. It applies to substeps caused by a tool
/// or a tolerance.
const MIN_SHARE_DIVISOR: u32 = 32;

/// Returns the next number of substeps to try near a tool, up to `contact_parts`.
fn next_substeps(factor: u32, contact_factor: u32) -> u32 {
    let next = factor.saturating_mul(4);
    if next < contact_factor / 2 {
        next
    } else {
        contact_factor
    }
}

impl Implicit {
    /// Takes the step in `substeps` equal substeps, each a solved equation. If one gains energy, its equation was not
    /// solved: the step is repeated with shorter substeps, which are easier to solve. As a last resort the motion is
    /// slowed down. Returns the number of substeps and the result. A step near contact that needs more substeps than
    /// allowed is refused.
    pub(super) fn run(&mut self, body: &mut System, request: &StepRequest, start: StepStart, team: &Team) -> Stepped {
        let StepStart {
            carry,
            substeps,
            middle,
        } = start;
        let mut factor = 1;
        self.report = SolverReport::BEFORE;
        self.budget_left = (self.budget.saturating_mul(request.substeps.max(1))).min(self.work_limit);
        let contact_factor = (f64::from(request.dt) / (f64::from(substeps) * contact::MAX_CONTACT_STEP))
            .ceil()
            .max(1.0);
        let contact_factor = contact_factor.min(f64::from(u32::MAX / 4 / substeps)) as u32;
        let mut is_near = contact::is_near(body);
        let is_long = contact::may_be_long(body, self, request);
        let is_bounded = self.is_bounded();
        let initial_factor = match (is_long, is_bounded) {
            (false, _) => contact_factor,
            (true, false) => 1,
            // Half of the work is for the substeps, half for their products.
            (true, true) => (self.work_limit / (2 * contact::SUBSTEP_OVERHEAD)).clamp(1, contact_factor),
        };
        if is_near {
            factor = initial_factor;
        }
        self.reserve_budget(substeps.saturating_mul(factor));
        let (mut subdivisions, mut is_final) = (0, false);
        let outcome = loop {
            if is_near
                && contact_factor > 1
                && factor >= contact_factor
                && substeps * contact_factor > request.max_parts()
            {
                return Err(SubstepTooLong {
                    stable_substep: contact::MAX_CONTACT_STEP as f32,
                });
            }
            let counts = [substeps.saturating_mul(factor), middle.saturating_mul(factor)];
            // A small budget that does not solve this many substeps does not solve more.
            let is_spent = is_near && subdivisions > 0 && counts[0] / 4 > self.budget.min(self.work_limit);
            let is_last_resort =
                is_final || subdivisions == MAX_SUBDIVISIONS || counts[0].saturating_mul(4) > MAX_SUBSTEPS || is_spent;
            let may_be_shorter = is_long && factor < contact_factor && contact::is_near(body);
            let resort_flags = [is_last_resort, is_final || is_bounded && is_near];
            let outcome = run_substeps(body, self, request, counts, resort_flags, team);
            match outcome {
                SubstepOutcome::Accepted => break outcome,
                SubstepOutcome::NearContact | SubstepOutcome::EnergyGained if is_final => break outcome,
                // A caller that bounds the work of a step accepts two attempts, or more if the step would fail
                // otherwise.
                _ if is_bounded && !is_final => {
                    is_final = true;
                    is_near |= outcome == SubstepOutcome::NearContact;
                    factor = factor.max(initial_factor);
                    self.budget_left = self.work_limit;
                    self.reserve_budget(substeps.saturating_mul(factor));
                }
                // Nothing was near before this attempt, so its equation contained no contacts.
                SubstepOutcome::NearContact if is_long && !is_near => is_near = true,
                SubstepOutcome::NearContact => {
                    is_near = true;
                    factor = if is_long {
                        next_substeps(factor, contact_factor)
                    } else {
                        factor.max(contact_factor)
                    };
                    self.reserve_budget(substeps.saturating_mul(factor));
                }
                SubstepOutcome::EnergyGained | SubstepOutcome::NotFinite if may_be_shorter => {
                    factor = next_substeps(factor, contact_factor);
                    self.reserve_retry_budget(substeps.saturating_mul(factor));
                }
                SubstepOutcome::EnergyGained | SubstepOutcome::NotFinite if is_last_resort => break outcome,
                SubstepOutcome::EnergyGained | SubstepOutcome::NotFinite => {
                    subdivisions += 1;
                    factor = factor.saturating_mul(4);
                }
            }
        };
        Ok(StepResult {
            start: StepStart::new(carry, substeps.saturating_mul(factor)),
            carry,
            finite: outcome == SubstepOutcome::Accepted,
        })
    }

    /// Raises the remaining budget to the minimum share for this many substeps.
    pub(super) fn reserve_budget(&mut self, substeps: u32) {
        let share = (self.budget.min(self.work_limit) / MIN_SHARE_DIVISOR).max(1);
        self.budget_left = self.budget_left.max(share.saturating_mul(substeps));
    }

    /// Raises the remaining budget for a repetition with shorter substeps. A budget of up to 32 products is fully
    /// restored.
    fn reserve_retry_budget(&mut self, substeps: u32) {
        self.budget_left = self
            .budget_left
            .max(self.budget.min(self.work_limit).min(MIN_SHARE_DIVISOR));
        self.reserve_budget(substeps);
    }
}

fn run_substeps(
    body: &mut System,
    implicit: &mut Implicit,
    request: &StepRequest,
    [substeps, middle]: [u32; 2],
    resort_flags: [bool; 2],
    team: &Team,
) -> SubstepOutcome {
    begin(body, request);
    implicit.restart();
    for index in 0..substeps {
        let outcome = solve_substep(body, implicit, request, [index, substeps], resort_flags, team);
        if outcome != SubstepOutcome::Accepted {
            return outcome;
        }
        body.state.advance();
        if index + 1 == middle
            && let Some(coarse) = &mut body.coarse
        {
            coarse.compare_middle(body.state.newest().0);
        }
    }
    SubstepOutcome::Accepted
}

/// Takes one of equal substeps of a step, without making it current.
pub(super) fn solve_substep(
    body: &mut System,
    implicit: &mut Implicit,
    request: &StepRequest,
    [index, substeps]: [u32; 2],
    [is_last_resort, is_forced]: [bool; 2],
    team: &Team,
) -> SubstepOutcome {
    let step = f64::from(request.dt) / f64::from(substeps);
    let order = if implicit.solution.is_attached {
        1
    } else {
        implicit.order
    };
    let substep = Substep {
        request,
        step,
        start: f64::from(index) / f64::from(substeps),
        end: f64::from(index + 1) / f64::from(substeps),
        is_first: index == 0,
        equations: substeps - index,
        is_forced,
        formula: StepFormula::new(order, step, f64::from(implicit.solution.last(index == 0).step)),
        team,
    };
    body.drive_attachments(request.tools, [substep.start, substep.end]);
    let is_coupled = request.neighbor_speed.is_some() && body.collides_with_tissue();
    implicit.solution.begin_contact_forces(substep.is_first, is_coupled);
    let outcome = substep.step_with_fallbacks(body, implicit, is_last_resort);
    if outcome != SubstepOutcome::Accepted {
        return outcome;
    }
    for pin in body.pins.iter_mut() {
        pin.force_sum += pin.reaction.as_dvec3();
    }
    let StepFormula { time, carried } = implicit.last_formula;
    let lapse = ReactionInterval {
        time,
        carried,
        at: substep.end,
        moved: 1.0,
        is_next: true,
    };
    body.accumulate_reactions(request.tools, lapse);
    SubstepOutcome::Accepted
}

/// Minimum number of substeps for a step near a tool or other tissue.
pub(super) fn contact_substeps(dt: f32) -> u32 {
    (f64::from(dt) / contact::MAX_CONTACT_STEP)
        .ceil()
        .clamp(1.0, f64::from(u32::MAX / 4)) as u32
}
