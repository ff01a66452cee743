//! VERLET: the paper's explicit integration (Halic et al., section 3) as leapfrog with kept velocities.
//!
//! A step of n substeps is half a kick, n drifts with full kicks between them, and half a kick: symmetric, of order 2,
//! with the same positions as Verlet's own `2 x - x' + h² a`. Each substep visits the springs once: the half kick that
//! closes a step is left to the next, which begins with the same forces, or where it cannot be left, its forces are kept
//! for the next. Damping along springs needs velocities at the time of the positions: a first visit predicts them, a
//! second uses them (order 2 too; Heun's method).

use glam::DVec3;

use super::System;
use super::closing::{ClosingKick, close_aside, may_stay_open};
use super::energy_monitor::Account;
use super::energy_sums::TileSums;
use super::grasp::Lapse;
use super::pipeline::{self, DEEPEST, Plan};
use super::sleep::Sleeper;
use super::slow_down::{keep_energy, slow_down};
use super::stability::Stability;
use super::step_request::{Carry, StepRequest, StepStart};
use super::substep::{Part, VelocityTime, kick_and_drift};
use crate::base::{Stage, Stopwatch};
use crate::contact::{Contacts, Meeting};
use crate::geometry::Bounds;
use crate::nodes::Mobility;
use crate::threads::Team;

/// The substep asked for is longer than what is stable, or the motion made it so on the way.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TooLong {
    /// So long may it be, s.
    pub stable_substep: f32,
}

/// A step that was taken, and is not current yet.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StepResult {
    pub start: StepStart,
    /// What it carries on to the next.
    pub carry: Carry,
    /// Whether its positions and velocities are finite.
    pub finite: bool,
}

/// What came of a step, or why there is none.
pub(super) type Stepped<T = StepResult> = Result<T, TooLong>;

/// Takes the step with exactly so many substeps, with masses made for substeps of `masses_for` seconds; 0: as they are.
pub(super) fn run(body: &mut System, request: &StepRequest, start: StepStart, masses_for: f32, team: &Team) -> Stepped {
    let mut step = Step {
        middle: start.middle,
        ..Step::of(request, start.substeps, masses_for, team)
    };
    if masses_for == 0.0 {
        check(&start.carry.stability, step.substep)?;
    }
    // What must be known between substeps cannot be known in a pipeline.
    if start.substeps > 2 && may_stay_open(body) && !body.is_grasped() && !body.sleeps() {
        step.pipeline = Plan::of(&*body.forces.springs, body.node_count());
    }
    if let Some(taken) = step.take(body, start)? {
        return Ok(taken);
    }
    step.pipeline = None;
    Ok(step.take(body, start)?.expect("only a pipeline goes too far"))
}

pub(super) fn check(stability: &Stability, substep: f32) -> Stepped<()> {
    match stability.limit() {
        Some(stable_substep) if substep > stable_substep => Err(TooLong { stable_substep }),
        _ => Ok(()),
    }
}

/// The same for elements, terms and what is enclosed, as they were deformed where forces were last worked out.
pub(super) fn check_beside_springs(body: &System, substep: f32) -> Stepped<()> {
    let stable_substep = body.forces.newest_limit_beside_springs();
    if substep <= stable_substep {
        Ok(())
    } else {
        Err(TooLong { stable_substep })
    }
}

/// A step to be taken.
pub(super) struct Step<'a> {
    request: &'a StepRequest<'a>,
    substeps: u32,
    /// s
    substep: f32,
    middle: u32,
    /// The substep that masses are made for, s; 0: they are as they are.
    masses_for: f32,
    team: &'a Team<'a>,
    pipeline: Option<Plan>,
}

impl<'a> Step<'a> {
    /// In so many substeps, taken one by one.
    pub fn of(request: &'a StepRequest<'a>, substeps: u32, masses_for: f32, team: &'a Team<'a>) -> Self {
        Self {
            request,
            substeps,
            substep: (f64::from(request.dt) / f64::from(substeps)) as f32,
            middle: 0,
            masses_for,
            team,
            pipeline: None,
        }
    }

    /// Takes it; `None`: in a pipeline the body has moved further than is known to be stable.
    fn take(&self, body: &mut System, start: StepStart) -> Stepped<Option<StepResult>> {
        let Self {
            request,
            substep,
            substeps,
            team,
            ..
        } = *self;
        let mut carry = start.carry;
        let mut finite = true;
        begin(body, request);
        carry.energy.share(0);
        let may_stay_open = may_stay_open(body) && !body.pins.are_led();
        let mut part = self.opening(body, &mut carry);
        let request = &request.weighed(body);
        let account = Account::new(body, &carry, request, substeps);
        account.open(body, &mut carry, &part, team);
        if let Some(damping) = &mut body.damping {
            damping.prepare(substep);
        }
        let mut index = 0;
        while index < substeps {
            let mut parts = [part; DEEPEST];
            let depth = match index {
                0 => 1,
                // The last substep before a comparison is taken alone.
                _ => self.depth(substeps - index - u32::from(account.compares), &carry),
            };
            // Tools are not looked for between the substeps of a pipeline.
            let depth = if depth > 1 && !self.stays_far(body, depth, &carry.gravity.velocities) {
                1
            } else {
                depth
            };
            for (index, part) in (index..).zip(&mut parts[..depth]) {
                if index > 0 {
                    part.go_on(request.gravity, &mut carry.gravity);
                }
                part.last = may_stay_open && index + 1 == substeps;
                part.start = f64::from(index) / f64::from(substeps);
                part.end = f64::from(index + 1) / f64::from(substeps);
            }
            let parts = &parts[..depth];
            part = parts[depth - 1];
            if account.compares && index + 1 == substeps {
                Account::keep_velocities(body, &part);
            }
            if let (2.., Some(plan)) = (depth, self.pipeline) {
                let watch = Stopwatch::start(request.profile);
                let surveys = pipeline::run(body, request, parts, plan, team);
                watch.stop(request.profile, Stage::Forces);
                for survey in &surveys[..depth - 1] {
                    if !self.is_stable_after(&mut carry.stability, &survey.velocities) {
                        match carry.stability.for_short(substep) {
                            Some(anywhere) => carry.stability = anywhere,
                            None => return Ok(None),
                        }
                    }
                }
                for survey in &surveys[..depth] {
                    if !self.has_stayed_far(body, &survey.velocities) {
                        return Ok(None);
                    }
                }
                carry.gravity.velocities = surveys[depth - 1].velocities;
                finite = surveys[depth - 1].finite;
            } else {
                finite = pass(body, request, &parts[0], &mut carry, team);
                body.forces.age(f64::from(substep), body.state.next_positions(), team);
            }
            for _ in parts {
                body.state.advance();
            }
            index += depth as u32;
            if index == self.middle
                && let Some(coarse) = &mut body.coarse
            {
                coarse.pass_middle(body.state.newest().0);
            }
            self.check_after(body, &mut carry)?;
        }
        let sums = account.compares.then(|| TileSums::of_open(body, &part, team));
        // What a tool touches is closed with it.
        if may_stay_open && body.contacts.as_deref().is_none_or(Contacts::are_far) {
            carry.closing = Some(ClosingKick {
                substep,
                gravity: request.gravity,
            });
        } else {
            part.close(request.gravity, &mut carry.gravity);
            finite = pass(body, request, &part, &mut carry, team);
            check_beside_springs(body, substep)?;
        }
        if let Some(found) = account.settle(body, &mut carry, sums, team) {
            let excess = carry.energy.compare(&found);
            carry.energy.refine(slow_down(body, excess, false));
        }
        Ok(Some(StepResult { start, carry, finite }))
    }

    /// Refuses to go on where the substep that was just taken has led the nodes to where longer ones are stable no more.
    pub fn check_after(&self, body: &System, carry: &mut Carry) -> Stepped<()> {
        let substep = self.substep;
        if !self.is_stable_after(&mut carry.stability, &{ carry.gravity.velocities }) {
            let known = carry.stability.for_short(substep);
            carry.stability = known.unwrap_or_else(|| body.estimate(body.state.newest().0));
            check(&carry.stability, substep)?;
        }
        check_beside_springs(body, substep)
    }

    /// Whether what is known of stability still holds after a substep with velocities in this box. Masses that were made for
    /// the substep are enough wherever nodes go.
    fn is_stable_after(&self, stability: &mut Stability, velocities: &Bounds) -> bool {
        self.masses_for > 0.0 || stability.holds_after(self.substep * diagonal(velocities))
    }

    /// The first kick: the half that opens the step, together with the half that closes the last where that was left open.
    pub fn opening(&self, body: &mut System, carry: &mut Carry) -> Part {
        let Self {
            request, substep, team, ..
        } = *self;
        let mut part = Part::opening(substep);
        let (half, mut fall) = (part.duration, DVec3::ZERO);
        let closing = carry.closing.take();
        if closing.is_some() {
            body.use_masses_for(carry.masses_for);
        }
        let same_masses = carry.masses_for == self.masses_for;
        match closing {
            None => {}
            Some(closing) if same_masses && closing.joins(body, substep, request.weighed(body).gravity) => {
                part.join(&closing);
                fall = closing.fall();
            }
            Some(closing) => {
                close_aside(body, &closing, &mut carry.gravity, team);
                part.before = VelocityTime::Closed;
            }
        }
        body.use_masses_for(self.masses_for);
        carry.masses_for = self.masses_for;
        if body.scaling.as_ref().is_some_and(|scaling| scaling.has_changed()) {
            keep_energy(body, &mut carry.energy);
            part.before = VelocityTime::Closed;
        }
        fall += request.weighed(body).gravity.as_dvec3() * f64::from(half);
        part.fall = carry.gravity.next(fall);
        part
    }

    /// Whether no tool comes near within so many substeps, if the motion does not become twice as fast.
    fn stays_far(&self, body: &System, depth: usize, velocities: &Bounds) -> bool {
        let duration = depth as f32 * self.substep;
        body.contacts.as_ref().is_none_or(|contacts| {
            let StepRequest { tools, dt, .. } = *self.request;
            contacts.stay_far(tools, dt, duration, 2.0 * fastest(velocities))
        })
    }

    /// Takes a substep with velocities in this box into account: whether no tool has come near.
    fn has_stayed_far(&self, body: &mut System, velocities: &Bounds) -> bool {
        body.contacts.as_mut().is_none_or(|contacts| {
            let StepRequest { tools, dt, .. } = *self.request;
            contacts.pass_far(tools, dt, self.substep, fastest(velocities))
        })
    }

    /// How many of the substeps that are left are taken next in one go: as many as a pipeline takes, in even parts, where the substep is stable
    /// wherever the nodes are, else as the motion is known to be stable for if it does not become twice as fast.
    fn depth(&self, left: u32, carry: &Carry) -> usize {
        let Some(plan) = self.pipeline else {
            return 1;
        };
        let left = left.max(1) as usize;
        let depth = left.div_ceil(left.div_ceil(plan.depth));
        if self.masses_for > 0.0 || carry.stability.for_short(self.substep).is_some() {
            return depth;
        }
        let travel = 2.0 * self.substep * diagonal(&carry.gravity.velocities);
        let stable = carry.stability.substeps_of(travel).min(depth as f32) as usize;
        stable.max(1)
    }
}

/// No node is faster, m/s.
fn fastest(velocities: &Bounds) -> f32 {
    velocities.magnitudes().length()
}

/// How fast two nodes may be against each other, m/s.
fn diagonal(velocities: &Bounds) -> f32 {
    (velocities.max - velocities.min).length()
}

/// Takes one part of the step; whether what it leads to is finite, where it was looked at.
pub(super) fn pass(body: &mut System, request: &StepRequest, part: &Part, carry: &mut Carry, team: &Team) -> bool {
    if part.drifts {
        body.lead_grasps(request.tools, [part.start, part.end]);
    }
    let watch = Stopwatch::start(request.profile);
    let survey = kick_and_drift(body, request, part, team);
    watch.stop(request.profile, Stage::Forces);
    carry.gravity.velocities = meet_tools(body, request, part, survey.velocities);
    body.feel_grasps(
        request.tools,
        Lapse {
            time: f64::from(part.substep),
            carried: 0.0,
            at: part.start,
            moved: if part.drifts { 1.0 } else { 0.0 },
            is_next: false,
        },
    );
    // What tools have done was not looked at.
    if part.last && body.contacts.as_ref().is_some_and(|contacts| !contacts.are_far()) {
        body.state.newest_is_finite()
    } else {
        survey.finite
    }
}

/// Starts the step over, from what is current.
pub(super) fn begin(body: &mut System, request: &StepRequest) {
    body.state.begin();
    body.show_late();
    body.forces.recall();
    for pin in body.pins.iter_mut() {
        let position = body.state.positions().get(pin.node as usize);
        pin.goal = match pin.target {
            Some(target) => pin.leading(position, (target.as_dvec3() - body.origin).as_vec3()),
            None => position,
        };
        pin.travel = pin.goal - position;
        pin.force_sum = DVec3::ZERO;
    }
    body.begin_grasps(request.tools);
    if let Some(contacts) = &mut body.contacts {
        contacts.begin((request.tools, request.dynamic), body.origin);
    }
}

/// Lets tools stop the nodes that would enter them: the box of all velocities, given that of those before.
fn meet_tools(body: &mut System, request: &StepRequest, part: &Part, velocities: Bounds) -> Bounds {
    let Some(contacts) = &mut body.contacts else {
        return velocities;
    };
    let fastest = fastest(&velocities);
    let state = body.state.substep();
    contacts.resolve(Meeting {
        kernel: body.kernel,
        tools: request.tools,
        origin: body.origin,
        dt: request.dt,
        start: part.start,
        end: part.end,
        substep: part.substep,
        drifts: part.drifts,
        slack: part.substep * request.neighbor_speed.unwrap_or(0.0),
        neighbor_speed: request.neighbor_speed,
        thickness: contacts.thickness,
        fastest,
        mobility: Mobility {
            inverse_masses: &body.inverse_masses,
            damping: body.damping.as_ref(),
            substep: part.substep,
            half: part.half,
            asleep: body.sleeper.as_deref().map(Sleeper::asleep),
        },
        positions: state.positions,
        velocities: state.velocities,
        next_positions: state.next_positions,
        pins: &mut body.pins,
        bindings: body.bindings.as_ref(),
        profile: request.profile,
    });
    contacts.velocities(velocities)
}
