//! VERLET: the explicit integration of Halic et al. (section 3), as leapfrog with stored velocities.
//!
//! A step of n substeps is a half kick, n drifts with full kicks between them, and a half kick. It is symmetric,
//! second-order accurate, and gives the same positions as Verlet's `2 x - x' + h² a`. Each substep visits the springs
//! once. The closing half kick is deferred to the next step, which begins with the same forces. If it cannot be
//! deferred, its forces are stored for the next step. Spring damping needs velocities at the time of the positions: a
//! first visit predicts them, and a second one uses them (Heun's method, also second-order accurate).

use glam::DVec3;

use super::System;
use super::deferred_half_kick::{DeferredHalfKick, can_defer_half_kick, flush_into};
use super::energy_monitor::EnergyMonitor;
use super::energy_removal::{remove_added_energy, remove_kinetic_energy};
use super::energy_sums::TileSums;
use super::pipeline::{self, MAX_DEPTH, PipelinePlan};
use super::sleep::SleepState;
use super::stability::Stability;
use super::step_request::{IntegratorState, StepRequest, StepStart};
use super::substep::{SubstepKick, VelocityTime, kick_and_drift};
use super::tool_attachments::ReactionInterval;
use crate::base::{Stage, Stopwatch};
use crate::contact::{ContactInput, Contacts};
use crate::geometry::Aabb;
use crate::nodes::Mobility;
use crate::threads::Team;

/// How often the bound of elements is tightened within a step.
const MAX_TIGHTENINGS: u32 = 4;

/// The error that a substep is too long, at the start of a step or after its motion.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SubstepTooLong {
    /// The longest stable substep, s.
    pub stable_substep: f32,
}

/// A step that is not committed yet.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StepResult {
    pub start: StepStart,
    /// The state for the next step.
    pub carry: IntegratorState,
    /// True if its positions and velocities are finite.
    pub finite: bool,
}

/// The result of a step.
pub(super) type Stepped<T = StepResult> = Result<T, SubstepTooLong>;

/// Takes the step with exactly `start.substeps` substeps. Masses are computed for substeps of `scaling_substep`
/// seconds; 0 without added mass.
pub(super) fn run(
    body: &mut System,
    request: &StepRequest,
    start: StepStart,
    scaling_substep: f32,
    team: &Team,
) -> Stepped {
    let mut step = Step {
        middle: start.middle,
        ..Step::of(request, start.substeps, scaling_substep, team)
    };
    if scaling_substep == 0.0 {
        check(&start.carry.stability, step.substep)?;
    }
    // A pipeline cannot do work between substeps.
    if start.substeps > 2 && can_defer_half_kick(body) && !body.has_tool_attachments() && !body.any_tile_asleep() {
        step.pipeline = PipelinePlan::of(&*body.forces.springs, body.node_count());
    }
    if let Some(result) = step.take(body, start)? {
        return Ok(result);
    }
    step.pipeline = None;
    Ok(step.take(body, start)?.expect("only a pipeline goes too far"))
}

pub(super) fn check(stability: &Stability, substep: f32) -> Stepped<()> {
    match stability.limit() {
        Some(stable_substep) if substep > stable_substep => Err(SubstepTooLong { stable_substep }),
        _ => Ok(()),
    }
}

/// Checks the substep against elements, terms and cavities, at the deformation of the last force evaluation.
pub(super) fn check_beside_springs(body: &System, substep: f32) -> Stepped<()> {
    let stable_substep = body.forces.latest_non_spring_dt_limit();
    if substep <= stable_substep {
        Ok(())
    } else {
        Err(SubstepTooLong { stable_substep })
    }
}

/// Like [`check_beside_springs`], but tightens the bound of elements before it fails, up to `left` times.
fn check_tightened(body: &mut System, substep: f32, left: &mut u32, team: &Team) -> Stepped<()> {
    let mut checked = check_beside_springs(body, substep);
    if checked.is_err() && *left > 0 && body.forces.uses_deformed_rates() {
        *left -= 1;
        body.tightened_dt_limit(true, team);
        checked = check_beside_springs(body, substep);
    }
    checked
}

/// The parameters of a step.
pub(super) struct Step<'a> {
    request: &'a StepRequest<'a>,
    substeps: u32,
    /// The length of a substep, s.
    substep: f32,
    middle: u32,
    /// The substep that masses are computed for, s; 0 without added mass.
    scaling_substep: f32,
    team: &'a Team<'a>,
    pipeline: Option<PipelinePlan>,
}

impl<'a> Step<'a> {
    /// Creates a step without a pipeline.
    pub fn of(request: &'a StepRequest<'a>, substeps: u32, scaling_substep: f32, team: &'a Team<'a>) -> Self {
        Self {
            request,
            substeps,
            substep: (f64::from(request.dt) / f64::from(substeps)) as f32,
            middle: 0,
            scaling_substep,
            team,
            pipeline: None,
        }
    }

    /// Takes the step. Returns `None` if the body has moved beyond the known stability limit in a pipeline.
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
        carry.energy.set_group(0);
        let can_defer_half_kick = can_defer_half_kick(body) && !body.pins.any_moves();
        let mut substep_kick = self.opening(body, &mut carry);
        let request = &request.with_scaled_gravity(body);
        let monitor = EnergyMonitor::new(body, &carry, request, substeps);
        monitor.start(body, &mut carry, &substep_kick, team);
        if let Some(damping) = &mut body.damping {
            damping.prepare(substep);
        }
        let mut index = 0;
        let mut tightenings = MAX_TIGHTENINGS;
        while index < substeps {
            let mut substep_kicks = [substep_kick; MAX_DEPTH];
            let depth = match index {
                0 => 1,
                // The last substep before a comparison is not part of a pipeline.
                _ => self.depth(substeps - index - u32::from(monitor.compares), &carry),
            };
            // A pipeline does not detect tool contacts between its substeps.
            let depth = if depth > 1 && !self.will_stay_far(body, depth, &carry.gravity.velocities) {
                1
            } else {
                depth
            };
            for (index, substep_kick) in (index..).zip(&mut substep_kicks[..depth]) {
                if index > 0 {
                    substep_kick.set_full_kick(request.gravity, &mut carry.gravity);
                }
                substep_kick.last = can_defer_half_kick && index + 1 == substeps;
                substep_kick.start = f64::from(index) / f64::from(substeps);
                substep_kick.end = f64::from(index + 1) / f64::from(substeps);
            }
            let substep_kicks = &substep_kicks[..depth];
            substep_kick = substep_kicks[depth - 1];
            if monitor.compares && index + 1 == substeps {
                EnergyMonitor::store_previous_velocities(body, &substep_kick);
            }
            if let (2.., Some(plan)) = (depth, self.pipeline) {
                let watch = Stopwatch::start(request.profile);
                let tile_stats = pipeline::run(body, request, substep_kicks, plan, team);
                watch.stop(request.profile, Stage::Forces);
                for stats in &tile_stats[..depth - 1] {
                    if !self.is_stable_after(&mut carry.stability, &stats.velocities) {
                        match carry.stability.if_stable_anywhere(substep) {
                            Some(anywhere) => carry.stability = anywhere,
                            None => return Ok(None),
                        }
                    }
                }
                for stats in &tile_stats[..depth] {
                    if !self.has_stayed_far(body, &stats.velocities) {
                        return Ok(None);
                    }
                }
                carry.gravity.velocities = tile_stats[depth - 1].velocities;
                finite = tile_stats[depth - 1].finite;
            } else {
                finite = run_kick(body, request, &substep_kicks[0], &mut carry, team);
                body.forces
                    .advance(f64::from(substep), body.state.next_positions(), team);
            }
            for _ in substep_kicks {
                body.state.advance();
            }
            index += depth as u32;
            if index == self.middle
                && let Some(coarse) = &mut body.coarse
            {
                coarse.compare_middle(body.state.newest().0);
            }
            self.check_springs_after(body, &mut carry)?;
            check_tightened(body, substep, &mut tightenings, team)?;
        }
        let sums = monitor
            .compares
            .then(|| TileSums::before_flush(body, &substep_kick, team));
        // The half kick is not deferred if a tool is near.
        if can_defer_half_kick && body.contacts.as_deref().is_none_or(Contacts::is_clear_of_tools) {
            carry.deferred_kick = Some(DeferredHalfKick {
                substep,
                gravity: request.gravity,
            });
        } else {
            substep_kick.set_closing(request.gravity, &mut carry.gravity);
            finite = run_kick(body, request, &substep_kick, &mut carry, team);
            check_tightened(body, substep, &mut tightenings, team)?;
        }
        if let Some(energies) = monitor.record_step(body, &mut carry, sums, team) {
            let excess = carry.energy.compare(&energies);
            carry.energy.refine(remove_kinetic_energy(body, excess, false));
        }
        Ok(Some(StepResult { start, carry, finite }))
    }

    /// Returns an error if the last substep moved the nodes to positions where the substep is unstable.
    pub fn check_after(&self, body: &System, carry: &mut IntegratorState) -> Stepped<()> {
        self.check_springs_after(body, carry)?;
        check_beside_springs(body, self.substep)
    }

    fn check_springs_after(&self, body: &System, carry: &mut IntegratorState) -> Stepped<()> {
        let substep = self.substep;
        if !self.is_stable_after(&mut carry.stability, &{ carry.gravity.velocities }) {
            let stability = carry.stability.if_stable_anywhere(substep);
            carry.stability = stability.unwrap_or_else(|| body.estimate(body.state.newest().0));
            check(&carry.stability, substep)?;
        }
        Ok(())
    }

    /// True if the stability limit is valid after a substep with velocities in this box. With added mass it is valid at
    /// all positions.
    fn is_stable_after(&self, stability: &mut Stability, velocities: &Aabb) -> bool {
        self.scaling_substep > 0.0 || stability.remains_valid_after(self.substep * diagonal(velocities))
    }

    /// The first kick: the opening half kick, merged with the deferred half kick of the last step if there is one.
    pub fn opening(&self, body: &mut System, carry: &mut IntegratorState) -> SubstepKick {
        let Self {
            request, substep, team, ..
        } = *self;
        let mut substep_kick = SubstepKick::opening(substep);
        let (half, mut gravity_change) = (substep_kick.duration, DVec3::ZERO);
        let deferred = carry.deferred_kick.take();
        if deferred.is_some() {
            body.scale_masses_for(carry.scaling_substep);
        }
        let same_masses = carry.scaling_substep == self.scaling_substep;
        match deferred {
            None => {}
            Some(deferred)
                if same_masses && deferred.can_merge(body, substep, request.with_scaled_gravity(body).gravity) =>
            {
                substep_kick.merge_deferred(&deferred);
                gravity_change = deferred.gravity_change();
            }
            Some(deferred) => {
                flush_into(body, &deferred, &mut carry.gravity, team);
                substep_kick.velocity_time = VelocityTime::InProgress;
            }
        }
        body.scale_masses_for(self.scaling_substep);
        carry.scaling_substep = self.scaling_substep;
        if body.scaling.as_ref().is_some_and(|scaling| scaling.has_changed()) {
            remove_added_energy(body, &mut carry.energy);
            substep_kick.velocity_time = VelocityTime::InProgress;
        }
        gravity_change += request.with_scaled_gravity(body).gravity.as_dvec3() * f64::from(half);
        substep_kick.gravity_change = carry.gravity.next(gravity_change);
        substep_kick
    }

    /// True if no tool comes near within `depth` substeps, as long as the velocity does not double.
    fn will_stay_far(&self, body: &System, depth: usize, velocities: &Aabb) -> bool {
        let duration = depth as f32 * self.substep;
        body.contacts.as_ref().is_none_or(|contacts| {
            let StepRequest { tools, dt, .. } = *self.request;
            contacts.remains_clear_of_tools(tools, dt, duration, 2.0 * fastest(velocities))
        })
    }

    /// Accounts for a substep with velocities in this box. Returns true if no tool has come near.
    fn has_stayed_far(&self, body: &mut System, velocities: &Aabb) -> bool {
        body.contacts.as_mut().is_none_or(|contacts| {
            let StepRequest { tools, dt, .. } = *self.request;
            contacts.advance_clear_of_tools(tools, dt, self.substep, fastest(velocities))
        })
    }

    /// The number of remaining substeps to take in the next pass. If the substep is stable at all positions, it is that
    /// of the pipeline, divided evenly. Otherwise it is limited to the substeps known to be stable as long as the
    /// velocity does not double.
    fn depth(&self, left: u32, carry: &IntegratorState) -> usize {
        let Some(plan) = self.pipeline else {
            return 1;
        };
        let left = left.max(1) as usize;
        let depth = left.div_ceil(left.div_ceil(plan.depth));
        if self.scaling_substep > 0.0 || carry.stability.if_stable_anywhere(self.substep).is_some() {
            return depth;
        }
        let travel = 2.0 * self.substep * diagonal(&carry.gravity.velocities);
        let stable = carry.stability.valid_substeps(travel).min(depth as f32) as usize;
        stable.max(1)
    }
}

/// The bound of node speeds, m/s.
fn fastest(velocities: &Aabb) -> f32 {
    velocities.magnitudes().length()
}

/// The bound of the relative speed of two nodes, m/s.
fn diagonal(velocities: &Aabb) -> f32 {
    (velocities.max - velocities.min).length()
}

/// Takes one kick and drift of the step. Returns whether the result is finite, as far as it was tested.
pub(super) fn run_kick(
    body: &mut System,
    request: &StepRequest,
    substep_kick: &SubstepKick,
    carry: &mut IntegratorState,
    team: &Team,
) -> bool {
    if substep_kick.drifts {
        body.drive_attachments(request.tools, [substep_kick.start, substep_kick.end]);
    }
    let watch = Stopwatch::start(request.profile);
    let stats = kick_and_drift(body, request, substep_kick, team);
    watch.stop(request.profile, Stage::Forces);
    carry.gravity.velocities = resolve_tool_contacts(body, request, substep_kick, stats.velocities);
    body.accumulate_reactions(
        request.tools,
        ReactionInterval {
            time: f64::from(substep_kick.substep),
            carried: 0.0,
            at: substep_kick.start,
            moved: if substep_kick.drifts { 1.0 } else { 0.0 },
            is_next: false,
        },
    );
    // The effect of tools was not tested yet.
    if substep_kick.last
        && body
            .contacts
            .as_ref()
            .is_some_and(|contacts| !contacts.is_clear_of_tools())
    {
        body.state.newest_is_finite()
    } else {
        stats.finite
    }
}

/// Restarts the step from the current state.
pub(super) fn begin(body: &mut System, request: &StepRequest) {
    body.state.begin();
    body.retract_pre_kick_velocities();
    body.forces.restore();
    for pin in body.pins.iter_mut() {
        let position = body.state.positions().get(pin.node as usize);
        pin.goal = match pin.target {
            Some(target) => pin.with_held(position, (target.as_dvec3() - body.origin).as_vec3()),
            None => position,
        };
        pin.travel = pin.goal - position;
        pin.force_sum = DVec3::ZERO;
    }
    body.begin_attachments(request.tools);
    if let Some(contacts) = &mut body.contacts {
        contacts.begin((request.tools, request.dynamic), body.origin);
    }
}

/// Resolves tool contacts. Returns the bounding box of all velocities after contact, given that before it.
fn resolve_tool_contacts(
    body: &mut System,
    request: &StepRequest,
    substep_kick: &SubstepKick,
    velocities: Aabb,
) -> Aabb {
    let Some(contacts) = &mut body.contacts else {
        return velocities;
    };
    let fastest = fastest(&velocities);
    let state = body.state.substep();
    contacts.resolve(ContactInput {
        kernel: body.kernel,
        tools: request.tools,
        origin: body.origin,
        dt: request.dt,
        start: substep_kick.start,
        end: substep_kick.end,
        substep: substep_kick.substep,
        drifts: substep_kick.drifts,
        slack: substep_kick.substep * request.neighbor_speed.unwrap_or(0.0),
        neighbor_speed: request.neighbor_speed,
        thickness: contacts.thickness,
        fastest,
        mobility: Mobility {
            inverse_masses: &body.inverse_masses,
            damping: body.damping.as_ref(),
            substep: substep_kick.substep,
            half: substep_kick.half,
            asleep: body.sleep_state.as_deref().map(SleepState::asleep),
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
