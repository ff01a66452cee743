//! A step of a world: plans the motion of the tools, attempts the step of every body, and commits all bodies or none.

use glam::{DVec3, Vec3};

use super::World;
use super::rest::{put_islands_to_sleep, wake_groups_near_tools, wake_islands};
use crate::base::{
    BodyId, Count, Error, LimitKind, Result, Stage, StepLimit, StepReport, Stopwatch, SubstepLimit, above_zero,
};
use crate::body::Body;
use crate::contact::{MAX_FORCE_LIMIT_TRIES, ToolPath};
use crate::def::ChoiceReason;
use crate::deformable_contact::CoupledGroup;
use crate::slots::Slots;
use crate::solver::{Outcome, RESERVE, StepRequest, attempt};
use crate::threads::{Items, Team};

/// All threads share a body of at least this many nodes. For a smaller body, waiting for the threads costs more than it
/// saves.
const SHARED_FROM: usize = 8192;

/// The least number of nodes of all small bodies together for which other threads are woken.
const WORTH_SHARING: usize = 1024;

impl World {
    /// Advances all bodies and tools by `dt` seconds, above 0.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: `dt` is out of range. [`Error::Unstable`]: a body needs more substeps than
    /// [`max_substeps`](crate::WorldDefinition::max_substeps) allows. Nothing has moved then; pending forces and poses
    /// stay pending.
    pub fn step(&mut self, dt: f32) -> Result<StepReport> {
        above_zero("dt", dt)?;
        let watch = self.begin_profile();
        let result = self.take_step(dt);
        watch.stop(self.profile.as_deref(), Stage::Step);
        self.record(|recorder, world| recorder.end(world, result.is_err()));
        result
    }

    fn take_step(&mut self, dt: f32) -> Result<StepReport> {
        let report = if is_worth_sharing(&self.bodies) {
            let mut threads = std::mem::take(&mut self.threads);
            let result = threads.lead(|team| self.step_with(dt, team));
            self.threads = threads;
            result?
        } else {
            self.step_with(dt, &Team::alone())?
        };
        self.timed(Stage::Cutting, Self::tear);
        self.timed(Stage::Publish, |world| world.publish_haptics(dt));
        Ok(report)
    }

    /// Calls `act` and adds its time to the profile of this stage.
    fn timed(&mut self, stage: Stage, act: impl FnOnce(&mut Self)) {
        let watch = Stopwatch::start(self.profile.as_deref());
        act(self);
        watch.stop(self.profile.as_deref(), stage);
    }

    /// Takes the step with the threads of `team`.
    fn step_with(&mut self, dt: f32, team: &Team) -> Result<StepReport> {
        self.apply_haptic_poses();
        self.record(|recorder, world| recorder.begin(world, dt));
        self.timed(Stage::Plan, |world| {
            world.tools.iter_mut().for_each(|(_, tool)| tool.begin_step());
            world.move_holds();
        });
        self.divide_tool_masses();
        let (mut tries_left, mut attempts) = (MAX_FORCE_LIMIT_TRIES, 0);
        let crossings = loop {
            self.timed(Stage::Plan, |world| {
                world.plan_tools();
                world.plan_flights(dt);
            });
            match self.attempt(dt, team) {
                Ok(crossings) => {
                    self.add_pinned_forces(dt);
                    let are_within = tries_left == 0 || self.are_within_limits(dt, tries_left == 1);
                    if self.are_masses_divided(attempts) && are_within {
                        break crossings;
                    }
                    attempts += 1;
                    self.rollback();
                }
                Err(report) => {
                    self.rollback();
                    self.keep_touching();
                    let limit = self.refusal(dt);
                    return Err(Error::Unstable {
                        report: StepReport { limit, ..report },
                        allowed: match self.definition.substeps {
                            0 => self.definition.max_substeps.min(self.work),
                            fixed => fixed,
                        },
                    });
                }
            }
            tries_left = tries_left.saturating_sub(1);
        };
        let report = StepReport {
            crossing_body: self.most_crossing(crossings),
            ..report(&self.bodies, &self.outcomes, crossings)
        };
        self.timed(Stage::Publish, |world| world.commit(dt, team));
        self.count_outcomes();
        self.timed(Stage::Cutting, |world| world.move_blades(dt));
        Ok(report)
    }

    /// Attempts the step of every body. Returns the number of interpenetrating edges, or the report of a step that some
    /// body cannot take.
    fn attempt(&mut self, dt: f32, team: &Team) -> std::result::Result<u32, StepReport> {
        let Self {
            definition,
            bodies,
            paths,
            dynamic,
            outcomes,
            deformable_contact,
            coupled,
            profile,
            work,
            ..
        } = self;
        let profile = profile.as_deref();
        if let Some(profile) = profile {
            profile.count(Count::Tries, 1);
        }
        let request = StepRequest {
            dt,
            gravity: definition.gravity,
            substeps: definition.substeps,
            max_substeps: definition.max_substeps.min(*work),
            work: *work,
            may_add_mass: *work == u32::MAX,
            // With fixed substeps nothing adapts to a tolerance.
            tolerance: if definition.substeps == 0 {
                definition.tolerance
            } else {
                0.0
            },
            tools: paths,
            dynamic,
            neighbor_speed: None,
            profile,
        };
        let Some(deformable_contact) = deformable_contact else {
            attempt_bodies(bodies, outcomes, &request, |_| true, team);
            return refuse_unstable(bodies, outcomes).map(|()| 0);
        };
        let watch = Stopwatch::start(profile);
        wake_groups_near_tools(deformable_contact, bodies, request.tools);
        deformable_contact.plan(bodies, dt);
        watch.stop(profile, Stage::BroadPhase);
        let islands = &deformable_contact.islands;
        attempt_bodies(
            bodies,
            outcomes,
            &request,
            |body_index| !islands.contains(body_index),
            team,
        );
        loop {
            let watch = Stopwatch::start(profile);
            wake_islands(deformable_contact, bodies, outcomes);
            deformable_contact.find_crossings(bodies, false);
            watch.stop(profile, Stage::NarrowPhase);
            let mut group = CoupledGroup {
                contact: deformable_contact,
                coupled_bodies: coupled,
                request: &request,
                team,
            };
            group.attempt(bodies, outcomes);
            if !deformable_contact.replan(bodies, dt) {
                break;
            }
        }
        refuse_unstable(bodies, outcomes)?;
        let watch = Stopwatch::start(profile);
        let crossings = deformable_contact.find_crossings(bodies, true);
        watch.stop(profile, Stage::NarrowPhase);
        Ok(crossings)
    }

    /// The body with most interpenetrating edges, if there are any.
    fn most_crossing(&self, crossings: u32) -> Option<BodyId> {
        let deformable_contact = self.deformable_contact.as_ref().filter(|_| crossings > 0)?;
        self.bodies.id_at(deformable_contact.most_crossing()?).map(BodyId)
    }

    /// Applies the forces of pinned tissue to the tools that have moved into it in the attempted step.
    fn add_pinned_forces(&mut self, dt: f32) {
        for (body_index, body) in self.bodies.iter_mut() {
            if let Some(Outcome::Done { substeps, .. }) = self.outcomes[body_index] {
                body.system_mut().add_pinned_forces(&self.paths, (substeps, dt));
            }
        }
    }

    /// Why the attempted step failed, for the body that needs most substeps.
    fn refusal(&self, dt: f32) -> Option<StepLimit> {
        let failed = self.bodies.iter_ids().filter_map(|(id, body)| {
            let Some(Outcome::Unstable { stable_substep, error }) = self.outcomes[id.index()] else {
                return None;
            };
            Some((id, body, stable_substep, error))
        });
        let (id, body, stable_substep, error) = failed.min_by(|one, other| one.2.total_cmp(&other.2))?;
        let of = if error > 0.0 {
            SubstepLimit::of_all(LimitKind::Tolerance)
        } else if !body.system().integrator.is_limited_by_stability() {
            SubstepLimit::of_all(LimitKind::Parts)
        } else {
            body.substep_limit()
        };
        Some(StepLimit {
            body: BodyId(id),
            of,
            is_chosen: body.solver_choice().reason != ChoiceReason::Given,
            // The factor keeps rounding from adding a substep to a whole number.
            needed: (dt / (RESERVE * stable_substep) * (1.0 - 1e-6)).ceil() as u32,
        })
    }

    /// Discards the attempted step of all bodies.
    fn rollback(&mut self) {
        self.bodies
            .iter_mut()
            .for_each(|(_, body)| body.system_mut().rollback());
    }

    /// Keeps the contact events of the last step after a refused one.
    fn keep_touching(&mut self) {
        if let Some(deformable_contact) = &mut self.deformable_contact {
            deformable_contact.touching_pairs.keep_previous();
        }
        for proxy in self.blades.iter_mut().flat_map(|(_, blade)| &mut blade.proxies) {
            proxy.touched = [proxy.touched[0]; 2];
        }
    }

    /// Makes the attempted step the current state.
    fn commit(&mut self, dt: f32, team: &Team) {
        self.clock.tick(dt);
        self.bodies.iter_mut().for_each(|(_, body)| body.set_clock(self.clock));
        let motion = (&*self.paths, self.definition.gravity);
        let islands = self
            .deformable_contact
            .as_ref()
            .map(|deformable_contact| &deformable_contact.islands);
        let is_uncoupled = |body_index: usize| islands.is_none_or(|islands| !islands.contains(body_index));
        commit_bodies(&mut self.bodies, &self.outcomes, motion, (dt, is_uncoupled), team);
        for (index, (_, tool)) in self.tools.iter_mut().enumerate() {
            let [force, torque] = wrench(&self.bodies, &self.outcomes, (index, &self.paths[index]), dt);
            // A very short step must not make the force infinite.
            tool.force = force.as_vec3().clamp(Vec3::MIN, Vec3::MAX);
            tool.torque = torque.as_vec3().clamp(Vec3::MIN, Vec3::MAX);
            tool.force_error = force_error(&self.bodies, &self.outcomes, index);
            tool.pose = self.paths[index].end();
            tool.last_target = tool.target.take().unwrap_or(tool.pose);
            tool.limit_search = None;
        }
        self.end_flights(dt);
        if let Some(deformable_contact) = &mut self.deformable_contact {
            deformable_contact.attachments.commit(&self.outcomes, dt);
            deformable_contact.warm_start.commit();
            deformable_contact.contact_reports.commit();
            let is_asleep = |body_index: usize| matches!(self.outcomes.get(body_index), Some(Some(Outcome::Asleep)));
            deformable_contact.touching_pairs.commit(is_asleep);
            let was_taken =
                |body_index: usize| matches!(self.outcomes.get(body_index), Some(Some(Outcome::Done { .. })));
            put_islands_to_sleep(deformable_contact, &mut self.bodies, was_taken);
        }
        self.remove_broken_attachments();
    }

    /// True if no tool exceeds its force limit. A tool that does moves less far in the next attempt; `last` is true if
    /// that is the last one.
    fn are_within_limits(&mut self, dt: f32, last: bool) -> bool {
        let mut are_within = true;
        for (index, (_, tool)) in self.tools.iter_mut().enumerate() {
            if let Some(reach) = &mut tool.limit_search {
                let [force, _] = wrench(&self.bodies, &self.outcomes, (index, &self.paths[index]), dt);
                are_within &= reach.accept(force.length() as f32, tool.force_limit, last);
            }
        }
        are_within
    }

    fn plan_tools(&mut self) {
        let mut paths = std::mem::take(&mut self.paths);
        paths.clear();
        for (slot, tool) in self.tools.iter() {
            let mut path = ToolPath::new(slot, tool);
            // Pinned tissue is much stiffer than the coupling to a haptic device, whose force lags one step: the tool
            // would oscillate.
            path.collides_with_pinned = tool.force_limit < f32::INFINITY || !self.is_in_hand(slot);
            paths.push(path);
        }
        self.paths = paths;
    }
}

/// The mean force and torque on a tool in the attempted step, N and N m; `index` counts the tools' paths.
fn wrench(
    bodies: &Slots<Body>,
    outcomes: &[Option<Outcome>],
    (index, path): (usize, &ToolPath),
    dt: f32,
) -> [DVec3; 2] {
    let mut wrench = [DVec3::ZERO; 2];
    for (body_index, body) in bodies.iter() {
        let system = body.system();
        let (time, [force, torque]) = match outcomes[body_index] {
            Some(Outcome::Asleep) => (system.last_step(), [DVec3::ZERO; 2]),
            Some(Outcome::Done { substeps, .. }) => (dt, system.attachment_wrench(path.slot, substeps)),
            _ => continue,
        };
        if let Some(contacts) = &system.contacts {
            let load = contacts.loads()[index];
            wrench[0] += load.impulse / f64::from(time) - force;
            wrench[1] += load.angular_impulse / f64::from(time) - torque;
        }
    }
    wrench
}

/// A bound on the error of the force on a tool in the attempted step, N.
fn force_error(bodies: &Slots<Body>, outcomes: &[Option<Outcome>], index: usize) -> f32 {
    let was_taken = |body_index: usize| matches!(outcomes[body_index], Some(Outcome::Asleep | Outcome::Done { .. }));
    let all = bodies.iter().filter(|(body_index, _)| was_taken(*body_index));
    let errors = all.filter_map(|(_, body)| Some(body.system().contacts.as_ref()?.loads()[index].force_error));
    errors.sum::<f64>() as f32
}

/// The report of the attempted step as an error, if some body cannot take it.
fn refuse_unstable(bodies: &Slots<Body>, outcomes: &[Option<Outcome>]) -> std::result::Result<(), StepReport> {
    let unstable = |outcome: &Outcome| matches!(outcome, Outcome::Unstable { .. });
    if outcomes.iter().flatten().any(unstable) {
        return Err(report(bodies, outcomes, 0));
    }
    Ok(())
}

/// True if there is enough work for more than one thread.
fn is_worth_sharing(bodies: &Slots<Body>) -> bool {
    let awake = || bodies.iter().filter(|(_, body)| !body.system().is_asleep());
    let sizes = || awake().map(|(_, body)| body.node_count());
    sizes().any(|size| size >= SHARED_FROM) || (sizes().count() > 1 && sizes().sum::<usize>() >= WORTH_SHARING)
}

/// Attempts the step of every body. Each thread takes some of the small bodies; all threads share each large body.
fn attempt_bodies(
    bodies: &mut Slots<Body>,
    outcomes: &mut Vec<Option<Outcome>>,
    request: &StepRequest,
    is_uncoupled: impl Fn(usize) -> bool + Sync,
    team: &Team,
) {
    outcomes.clear();
    outcomes.resize(bodies.slot_count(), None);
    let small = bodies
        .iter()
        .filter(|(_, body)| body.node_count() < SHARED_FROM)
        .count();
    if small > 1 {
        let contents = Items::new(bodies.slots_mut());
        team.pass(
            outcomes.len(),
            (contents, Items::new(outcomes)),
            |body_index, (slot, outcome)| {
                if let Some(body) = slot.content_mut()
                    && body.node_count() < SHARED_FROM
                    && is_uncoupled(body_index)
                {
                    *outcome = Some(attempt(body.system_mut(), request, &Team::alone()));
                }
            },
        );
    }
    for (body_index, body) in bodies.iter_mut() {
        if outcomes[body_index].is_none() && is_uncoupled(body_index) {
            let alone = Team::alone();
            let team = if body.node_count() < SHARED_FROM { &alone } else { team };
            outcomes[body_index] = Some(attempt(body.system_mut(), request, team));
        }
    }
}

fn report(bodies: &Slots<Body>, outcomes: &[Option<Outcome>], crossings: u32) -> StepReport {
    let mut report = StepReport {
        substeps: 0,
        stable_substep: f32::INFINITY,
        bodies_restored: 0,
        error_estimate: 0.0,
        crossings,
        limit: None,
        substeps_body: None,
        restored_body: None,
        crossing_body: None,
    };
    for (body_index, body) in bodies.iter() {
        let id = || bodies.id_at(body_index).map(BodyId);
        let stable_substep = match outcomes[body_index] {
            Some(Outcome::Done { substeps, carry, error }) => {
                if substeps > report.substeps {
                    (report.substeps, report.substeps_body) = (substeps, id());
                }
                report.error_estimate = report.error_estimate.max(error);
                body.system().newest_limit(&carry)
            }
            Some(Outcome::Unstable { stable_substep, error }) => {
                report.error_estimate = report.error_estimate.max(error);
                Some(stable_substep)
            }
            Some(Outcome::Asleep) => body.system().carry.limit(),
            Some(Outcome::NotFinite) | None => {
                report.bodies_restored += 1;
                report.restored_body = report.restored_body.or_else(id);
                body.system().carry.limit()
            }
        };
        report.stable_substep = report.stable_substep.min(stable_substep.unwrap_or(f32::INFINITY));
    }
    report
}

fn commit_bodies(
    bodies: &mut Slots<Body>,
    outcomes: &[Option<Outcome>],
    (tools, gravity): (&[ToolPath], Vec3),
    (dt, is_uncoupled): (f32, impl Fn(usize) -> bool),
    team: &Team,
) {
    for (body_index, body) in bodies.iter_mut() {
        match outcomes[body_index] {
            Some(Outcome::Done { substeps, carry, .. }) => {
                let alone = Team::alone();
                let team = if body.node_count() < SHARED_FROM { &alone } else { team };
                body.commit((substeps, dt), carry, tools, team);
                let system = body.system_mut();
                system.fade(dt, team);
                if is_uncoupled(body_index) {
                    system.update_sleep(dt, (tools, system.body_acceleration(gravity)), team);
                } else {
                    system.update_sleep_coupled(dt);
                }
                body.find_tears(team);
            }
            Some(Outcome::Asleep) => body.system_mut().step_asleep(),
            _ => {
                body.system_mut().keep_previous();
                body.find_tears(team);
            }
        }
    }
}
