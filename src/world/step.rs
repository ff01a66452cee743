//! A step of a world: plan the tools' ways, attempt every body, then commit all or nothing.

use glam::{DVec3, Vec3};

use super::World;
use super::rest::{rest_islands, rouse_groups, wake_islands};
use crate::base::{
    BodyId, Count, Error, LimitKind, Result, Stage, StepLimit, StepReport, Stopwatch, SubstepLimit, above_zero,
};
use crate::body::Body;
use crate::contact::{TRIES, ToolPath};
use crate::def::ChoiceReason;
use crate::deformable_contact::CoupledGroup;
use crate::slots::Slots;
use crate::solver::{Outcome, RESERVE, StepRequest, attempt};
use crate::threads::{Items, Team};

/// A body of so many nodes or more is shared by all threads; smaller ones are not worth the waiting.
const SHARED_FROM: usize = 8192;

/// Small bodies of fewer nodes in all are not worth waking anybody.
const WORTH_SHARING: usize = 1024;

impl World {
    /// Steps everything by `dt` seconds, above 0.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: `dt` is out of its range. [`Error::Unstable`]: some body needs more substeps than are
    /// allowed. Nothing has moved then, pending forces and poses stay pending.
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
        self.timed(Stage::Publish, |world| world.publish_to_hands(dt));
        Ok(report)
    }

    /// Does something that is timed as this stage.
    fn timed(&mut self, stage: Stage, act: impl FnOnce(&mut Self)) {
        let watch = Stopwatch::start(self.profile.as_deref());
        act(self);
        watch.stop(self.profile.as_deref(), stage);
    }

    /// The step, with the threads that help.
    fn step_with(&mut self, dt: f32, team: &Team) -> Result<StepReport> {
        self.lead_by_hand();
        self.record(|recorder, world| recorder.begin(world, dt));
        self.timed(Stage::Plan, |world| {
            world.tools.iter_mut().for_each(|(_, tool)| tool.set_out());
            world.lead_blades();
        });
        self.divide_as_before();
        let (mut left, mut rounds) = (TRIES, 0);
        let crossings = loop {
            self.timed(Stage::Plan, |world| {
                world.plan_tools();
                world.plan_flights(dt);
            });
            match self.attempt(dt, team) {
                Ok(crossings) => {
                    self.press_pinned(dt);
                    let are_within = left == 0 || self.are_within_limits(dt, left == 1);
                    if self.are_divided(rounds) && are_within {
                        break crossings;
                    }
                    rounds += 1;
                    self.put_back();
                }
                Err(report) => {
                    self.put_back();
                    self.keep_touching();
                    let limit = self.limit(dt);
                    return Err(Error::Unstable {
                        report: StepReport { limit, ..report },
                        allowed: match self.definition.substeps {
                            0 => self.definition.max_substeps.min(self.work),
                            fixed => fixed,
                        },
                    });
                }
            }
            left = left.saturating_sub(1);
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

    /// Lets every body try the step: how many edges pass through tissue then, or what the step would come to where a body cannot
    /// take it.
    fn attempt(&mut self, dt: f32, team: &Team) -> std::result::Result<u32, StepReport> {
        let Self {
            definition,
            bodies,
            paths,
            dynamic,
            outcomes,
            tissue,
            walks,
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
            relieves: *work == u32::MAX,
            // Fixed substeps are taken as they are.
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
        let Some(tissue) = tissue else {
            attempt_bodies(bodies, outcomes, &request, |_| true, team);
            return reported(bodies, outcomes).map(|()| 0);
        };
        let watch = Stopwatch::start(profile);
        rouse_groups(tissue, bodies, request.tools);
        tissue.plan(bodies, dt);
        watch.stop(profile, Stage::BroadPhase);
        let islands = &tissue.islands;
        attempt_bodies(bodies, outcomes, &request, |place| !islands.has(place), team);
        loop {
            let watch = Stopwatch::start(profile);
            wake_islands(tissue, bodies, outcomes);
            tissue.find_crossings(bodies, false);
            watch.stop(profile, Stage::NarrowPhase);
            let mut together = CoupledGroup {
                tissue,
                walks,
                request: &request,
                team,
            };
            together.attempt(bodies, outcomes);
            if !tissue.plan_again(bodies, dt) {
                break;
            }
        }
        reported(bodies, outcomes)?;
        let watch = Stopwatch::start(profile);
        let crossings = tissue.find_crossings(bodies, true);
        watch.stop(profile, Stage::NarrowPhase);
        Ok(crossings)
    }

    /// The body of which most edges pass through tissue, where any do.
    fn most_crossing(&self, crossings: u32) -> Option<BodyId> {
        let tissue = self.tissue.as_ref().filter(|_| crossings > 0)?;
        self.bodies.id_at(tissue.most_crossing()?).map(BodyId)
    }

    /// Has what is pinned press the tools that the tried step leads into it.
    fn press_pinned(&mut self, dt: f32) {
        for (place, body) in self.bodies.iter_mut() {
            if let Some(Outcome::Done { substeps, .. }) = self.outcomes[place] {
                body.system_mut().press_pinned(&self.paths, (substeps, dt));
            }
        }
    }

    /// What the step in progress failed by: of the body that needs most substeps.
    fn limit(&self, dt: f32) -> Option<StepLimit> {
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
            // Less what rounding makes of a whole number.
            needed: (dt / (RESERVE * stable_substep) * (1.0 - 1e-6)).ceil() as u32,
        })
    }

    /// Takes back what bodies have tried.
    fn put_back(&mut self) {
        self.bodies
            .iter_mut()
            .for_each(|(_, body)| body.system_mut().put_back());
    }

    /// No step was taken: bodies and blades touch what they touched.
    fn keep_touching(&mut self) {
        if let Some(tissue) = &mut self.tissue {
            tissue.touching.stay();
        }
        for proxy in self.blades.iter_mut().flat_map(|(_, blade)| &mut blade.proxies) {
            proxy.touched = [proxy.touched[0]; 2];
        }
    }

    /// Makes the step that was tried the current state.
    fn commit(&mut self, dt: f32, team: &Team) {
        self.clock.tick(dt);
        self.bodies.iter_mut().for_each(|(_, body)| body.set_clock(self.clock));
        let moved_by = (&*self.paths, self.definition.gravity);
        let islands = self.tissue.as_ref().map(|tissue| &tissue.islands);
        let goes_alone = |place: usize| islands.is_none_or(|islands| !islands.has(place));
        commit_bodies(&mut self.bodies, &self.outcomes, moved_by, (dt, goes_alone), team);
        for (index, (_, tool)) in self.tools.iter_mut().enumerate() {
            let [force, torque] = wrench(&self.bodies, &self.outcomes, (index, &self.paths[index]), dt);
            // Finite, whatever the step's length.
            tool.force = force.as_vec3().clamp(Vec3::MIN, Vec3::MAX);
            tool.torque = torque.as_vec3().clamp(Vec3::MIN, Vec3::MAX);
            tool.force_error = force_error(&self.bodies, &self.outcomes, index);
            tool.pose = self.paths[index].end();
            tool.led_to = tool.target.take().unwrap_or(tool.pose);
            tool.reach = None;
        }
        self.end_flights(dt);
        if let Some(tissue) = &mut self.tissue {
            tissue.bonds.commit(&self.outcomes, dt);
            tissue.pushes.commit();
            tissue.touches.commit();
            let is_asleep = |place: usize| matches!(self.outcomes.get(place), Some(Some(Outcome::Asleep)));
            tissue.touching.commit(is_asleep);
            let took = |place: usize| matches!(self.outcomes.get(place), Some(Some(Outcome::Done { .. })));
            rest_islands(tissue, &mut self.bodies, took);
        }
        self.end_slipped();
    }

    /// Whether no tool presses harder than it can; else those that do go less far in the next try, which may be the `last`.
    fn are_within_limits(&mut self, dt: f32, last: bool) -> bool {
        let mut are_within = true;
        for (index, (_, tool)) in self.tools.iter_mut().enumerate() {
            if let Some(reach) = &mut tool.reach {
                let [force, _] = wrench(&self.bodies, &self.outcomes, (index, &self.paths[index]), dt);
                are_within &= reach.is_allowed(force.length() as f32, tool.force_limit, last);
            }
        }
        are_within
    }

    fn plan_tools(&mut self) {
        let mut paths = std::mem::take(&mut self.paths);
        paths.clear();
        for (place, tool) in self.tools.iter() {
            let mut path = ToolPath::new(place, tool);
            // A hand that goes on with what it felt in the last step would tremble on what is so much stiffer than it holds the tool.
            path.meets_pinned = tool.force_limit < f32::INFINITY || !self.is_in_hand(place);
            paths.push(path);
        }
        self.paths = paths;
    }
}

/// The mean force and torque on a tool, by its place among the ways, in the step that was tried, N and N m.
fn wrench(
    bodies: &Slots<Body>,
    outcomes: &[Option<Outcome>],
    (index, path): (usize, &ToolPath),
    dt: f32,
) -> [DVec3; 2] {
    let mut wrench = [DVec3::ZERO; 2];
    for (place, body) in bodies.iter() {
        let system = body.system();
        let (time, [force, torque]) = match outcomes[place] {
            Some(Outcome::Asleep) => (system.last_step(), [DVec3::ZERO; 2]),
            Some(Outcome::Done { substeps, .. }) => (dt, system.pull_of(path.slot, substeps)),
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

/// By how much, at most, the force on a tool is off in the step that was tried, N.
fn force_error(bodies: &Slots<Body>, outcomes: &[Option<Outcome>], index: usize) -> f32 {
    let took = |place: usize| matches!(outcomes[place], Some(Outcome::Asleep | Outcome::Done { .. }));
    let all = bodies.iter().filter(|(place, _)| took(*place));
    let errors = all.filter_map(|(_, body)| Some(body.system().contacts.as_ref()?.loads()[index].force_error));
    errors.sum::<f64>() as f32
}

/// What the step would come to where a body cannot take it.
fn reported(bodies: &Slots<Body>, outcomes: &[Option<Outcome>]) -> std::result::Result<(), StepReport> {
    let unstable = |outcome: &Outcome| matches!(outcome, Outcome::Unstable { .. });
    if outcomes.iter().flatten().any(unstable) {
        return Err(report(bodies, outcomes, 0));
    }
    Ok(())
}

/// Whether there is work for more than one thread.
fn is_worth_sharing(bodies: &Slots<Body>) -> bool {
    let awake = || bodies.iter().filter(|(_, body)| !body.system().is_asleep());
    let sizes = || awake().map(|(_, body)| body.node_count());
    sizes().any(|size| size >= SHARED_FROM) || (sizes().count() > 1 && sizes().sum::<usize>() >= WORTH_SHARING)
}

/// Attempts the step of every body: the small ones are shared among the threads, the large ones each by all threads.
fn attempt_bodies(
    bodies: &mut Slots<Body>,
    outcomes: &mut Vec<Option<Outcome>>,
    request: &StepRequest,
    goes_alone: impl Fn(usize) -> bool + Sync,
    team: &Team,
) {
    outcomes.clear();
    outcomes.resize(bodies.places(), None);
    let small = bodies
        .iter()
        .filter(|(_, body)| body.node_count() < SHARED_FROM)
        .count();
    if small > 1 {
        let contents = Items::new(bodies.slots_mut());
        team.pass(
            outcomes.len(),
            (contents, Items::new(outcomes)),
            |place, (slot, outcome)| {
                if let Some(body) = slot.content_mut()
                    && body.node_count() < SHARED_FROM
                    && goes_alone(place)
                {
                    *outcome = Some(attempt(body.system_mut(), request, &Team::alone()));
                }
            },
        );
    }
    for (place, body) in bodies.iter_mut() {
        if outcomes[place].is_none() && goes_alone(place) {
            let alone = Team::alone();
            let team = if body.node_count() < SHARED_FROM { &alone } else { team };
            outcomes[place] = Some(attempt(body.system_mut(), request, team));
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
    for (place, body) in bodies.iter() {
        let id = || bodies.id_at(place).map(BodyId);
        let stable_substep = match outcomes[place] {
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
    (dt, goes_alone): (f32, impl Fn(usize) -> bool),
    team: &Team,
) {
    for (place, body) in bodies.iter_mut() {
        match outcomes[place] {
            Some(Outcome::Done { substeps, carry, .. }) => {
                let alone = Team::alone();
                let team = if body.node_count() < SHARED_FROM { &alone } else { team };
                body.commit((substeps, dt), carry, tools, team);
                let system = body.system_mut();
                system.fade(dt, team);
                if goes_alone(place) {
                    system.doze(dt, (tools, system.pull(gravity)), team);
                } else {
                    system.doze_together(dt);
                }
                body.find_tears(team);
            }
            Some(Outcome::Asleep) => body.system_mut().sleep_on(),
            _ => {
                body.system_mut().stay();
                body.find_tears(team);
            }
        }
    }
}
