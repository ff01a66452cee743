//! In how many parts a step of IMPLICIT or NEWTON is taken.

use super::step::{Formula, Substep};
use super::{End, Implicit, contact};
use crate::def::SolverReport;
use crate::solver::System;
use crate::solver::grasp::Lapse;
use crate::solver::step_request::{StepRequest, StepStart};
use crate::solver::verlet::{StepResult, Stepped, TooLong, begin};
use crate::threads::Team;

/// How often a step that has gained energy is taken again in four times as many parts.
const CUTS: u32 = 4;

/// A step is not cut into more parts than this because it has gained energy.
const PARTS: u32 = 1 << 12;

/// The part of the budget that there is for each part of a step, at least: those into which a tool or a tolerance cuts it.
const SHARE: u32 = 32;

/// In how many parts a step is tried near tools that was not solved in so many, and that may be taken in `short`.
fn shorter(parts: u32, short: u32) -> u32 {
    let next = parts.saturating_mul(4);
    if next < short / 2 { next } else { short }
}

impl Implicit {
    /// Takes the step in `substeps` equal parts, each a solved equation. Where one ends with more energy than was put in, it was
    /// not solved; then the step is taken again in shorter parts, which are easier to solve, and in the end its motion is slowed
    /// down. How many parts were taken, and what came of them; refused is what is near something and would take more parts than a step may.
    pub(super) fn run(&mut self, body: &mut System, request: &StepRequest, start: StepStart, team: &Team) -> Stepped {
        let StepStart {
            carry,
            substeps,
            middle,
        } = start;
        let mut parts = 1;
        self.report = SolverReport::BEFORE;
        self.left = (self.budget.saturating_mul(request.substeps.max(1))).min(self.allowed);
        let short = (f64::from(request.dt) / (f64::from(substeps) * contact::LONGEST))
            .ceil()
            .max(1.0);
        let short = short.min(f64::from(u32::MAX / 4 / substeps)) as u32;
        let mut is_near = contact::is_near(body);
        let is_long = contact::may_be_long(body, self, request);
        let is_bounded = self.is_bounded();
        let parts_near = match (is_long, is_bounded) {
            (false, _) => short,
            (true, false) => 1,
            // Half of the work for the parts, half for their products.
            (true, true) => (self.allowed / (2 * contact::COST_OF_A_PART)).clamp(1, short),
        };
        if is_near {
            parts = parts_near;
        }
        self.grant(substeps.saturating_mul(parts));
        let (mut cuts, mut is_final) = (0, false);
        let end = loop {
            if is_near && short > 1 && parts >= short && substeps * short > request.most_parts() {
                return Err(TooLong {
                    stable_substep: contact::LONGEST as f32,
                });
            }
            let whole = [substeps.saturating_mul(parts), middle.saturating_mul(parts)];
            // What a small budget does not solve in so many parts it does not solve in more.
            let is_spent = is_near && cuts > 0 && whole[0] / 4 > self.budget.min(self.allowed);
            let is_last_resort = is_final || cuts == CUTS || whole[0].saturating_mul(4) > PARTS || is_spent;
            let may_be_shorter = is_long && parts < short && contact::is_near(body);
            let resorts = [is_last_resort, is_final || is_bounded && is_near];
            let end = run_in_parts(body, self, request, whole, resorts, team);
            match end {
                End::Fine => break end,
                End::Near | End::Gained if is_final => break end,
                // A caller that bounds the work of a step has it taken twice, or more often where it would be refused else.
                _ if is_bounded && !is_final => {
                    is_final = true;
                    is_near |= end == End::Near;
                    parts = parts.max(parts_near);
                    self.left = self.allowed;
                    self.grant(substeps.saturating_mul(parts));
                }
                // Then there was nothing near before, and the equation knew of nothing.
                End::Near if is_long && !is_near => is_near = true,
                End::Near => {
                    is_near = true;
                    parts = if is_long {
                        shorter(parts, short)
                    } else {
                        parts.max(short)
                    };
                    self.grant(substeps.saturating_mul(parts));
                }
                End::Gained | End::NotFinite if may_be_shorter => {
                    parts = shorter(parts, short);
                    self.grant_again(substeps.saturating_mul(parts));
                }
                End::Gained | End::NotFinite if is_last_resort => break end,
                End::Gained | End::NotFinite => {
                    cuts += 1;
                    parts = parts.saturating_mul(4);
                }
            }
        };
        Ok(StepResult {
            start: StepStart::new(carry, substeps.saturating_mul(parts)),
            carry,
            finite: end == End::Fine,
        })
    }

    /// Lets a step of so many parts have its share for each.
    pub(super) fn grant(&mut self, parts: u32) {
        let share = (self.budget.min(self.allowed) / SHARE).max(1);
        self.left = self.left.max(share.saturating_mul(parts));
    }

    /// The same where longer parts were tried before: a small budget is there again.
    fn grant_again(&mut self, parts: u32) {
        self.left = self.left.max(self.budget.min(self.allowed).min(SHARE));
        self.grant(parts);
    }
}

fn run_in_parts(
    body: &mut System,
    implicit: &mut Implicit,
    request: &StepRequest,
    [substeps, middle]: [u32; 2],
    resorts: [bool; 2],
    team: &Team,
) -> End {
    begin(body, request);
    implicit.begin_anew();
    for index in 0..substeps {
        let end = take_part(body, implicit, request, [index, substeps], resorts, team);
        if end != End::Fine {
            return end;
        }
        body.state.advance();
        if index + 1 == middle
            && let Some(coarse) = &mut body.coarse
        {
            coarse.pass_middle(body.state.newest().0);
        }
    }
    End::Fine
}

/// Takes one of equal parts of a step, up to where it becomes current.
pub(super) fn take_part(
    body: &mut System,
    implicit: &mut Implicit,
    request: &StepRequest,
    [index, substeps]: [u32; 2],
    [is_last_resort, stands]: [bool; 2],
    team: &Team,
) -> End {
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
        stands,
        formula: Formula::new(order, step, f64::from(implicit.solution.last(index == 0).step)),
        team,
    };
    body.lead_grasps(request.tools, [substep.start, substep.end]);
    let is_together = request.neighbor_speed.is_some() && body.meets_tissue();
    implicit.solution.recall_pressed(substep.is_first, is_together);
    let end = substep.take_safely(body, implicit, is_last_resort);
    if end != End::Fine {
        return end;
    }
    for pin in body.pins.iter_mut() {
        pin.force_sum += pin.solved.as_dvec3();
    }
    let Formula { time, carried } = implicit.taken;
    let lapse = Lapse {
        time,
        carried,
        at: substep.end,
        moved: 1.0,
        is_next: true,
    };
    body.feel_grasps(request.tools, lapse);
    End::Fine
}

/// In how many parts a step near a tool or other tissue is to be taken at least.
pub(super) fn parts_near(dt: f32) -> u32 {
    (f64::from(dt) / contact::LONGEST)
        .ceil()
        .clamp(1.0, f64::from(u32::MAX / 4)) as u32
}
