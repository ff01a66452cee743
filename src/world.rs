//! A world: bodies and tools that are stepped together.

mod attachments;

use glam::{DVec3, Quat, Vec3};

use crate::body::{Body, BodyDefinition, Needs, finite_vector, not_negative};
use crate::contact::{Contact, ContactChange, Pose, TRIES, Tissue, Tool, ToolDefinition, ToolPath};
use crate::diagnostics::StateHasher;
use crate::error::{Error, Result};
use crate::slots::{SlotId, Slots};
use crate::solver::{Outcome, RestStateDefinition, RestStateReport, StepRequest, Together, Walk, attempt, rest_state};
use crate::springs::{ChosenKernel, Kernel};
use crate::threads::{Items, RunTasks, Team, Threads};
use attachments::Attachment;
pub use attachments::{Anchor, AttachmentId, SurfacePoint};

/// A body of so many nodes or more is shared by all threads; smaller ones are not worth the waiting.
const SHARED_FROM: usize = 8192;

/// Small bodies of fewer nodes in all are not worth waking anybody.
const WORTH_SHARING: usize = 1024;

/// How a world steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorldDefinition {
    /// m/s².
    pub gravity: Vec3,
    /// 1: the caller's thread alone; 0: one per core; at most 256. What comes of a step is the same for any number.
    pub thread_count: u32,
    /// 0: as many as stability needs; n: exactly n per step, but for bodies of [`Solver::Implicit`](crate::Solver::Implicit) and
    /// [`Solver::Newton`](crate::Solver::Newton) near a tool, whose substeps are of 1 ms at most there, and where a substep of theirs
    /// gains energy: then they are cut again, to 4096 in all.
    pub substeps: u32,
    /// A step that needs more is [`Error::Unstable`]; at least 1. What is cut as above is no such need.
    pub max_substeps: u32,
    /// Metres; 0: off; above 0, with `substeps` 0: a step's own position error stays below it.
    pub tolerance: f32,
    /// The instructions that springs and nodes are worked on with.
    pub kernel: Kernel,
    /// A job system whose threads are used instead of the world's own: it is given up to `thread_count` tasks a step.
    pub tasks: Option<RunTasks>,
}

impl Default for WorldDefinition {
    /// Earth's gravity along -y, one thread, as many substeps as stability needs up to 1000, no tolerance.
    fn default() -> Self {
        Self {
            gravity: Vec3::new(0.0, -9.81, 0.0),
            thread_count: 1,
            substeps: 0,
            max_substeps: 1000,
            tolerance: 0.0,
            kernel: Kernel::Best,
            tasks: None,
        }
    }
}

/// What a step did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepReport {
    /// The most substeps that any body took.
    pub substeps: u32,
    /// The longest explicit substep that is stable now, over all bodies, s; infinity: no limit.
    pub stable_substep: f32,
    /// Bodies that would have become non-finite: put back as they were, the others stepped.
    pub bodies_restored: u32,
    /// How far a position of this step may be off, m; 0 where the tolerance is off, infinite where the step is refused before there is
    /// anything to compare.
    pub error_estimate: f32,
    /// Edges of surfaces that pass through other tissue, or through their own body's where it meets itself: what contact could not keep
    /// apart. Those of one that is closed come out again by themselves.
    pub crossings: u32,
}

/// A body of a world.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct BodyId(pub(crate) SlotId);

/// A tool of a world.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct ToolId(pub(crate) SlotId);

/// Bodies and tools that are stepped together.
#[derive(Debug)]
pub struct World {
    definition: WorldDefinition,
    kernel: ChosenKernel,
    threads: Threads,
    bodies: Slots<Body>,
    tools: Slots<Tool>,
    /// The ways of the tools in the step in progress.
    paths: Vec<ToolPath>,
    /// Contacts of tissue with tissue, where bodies ask for them.
    tissue: Option<Box<Tissue>>,
    /// How many edges pass through tissue as the step in progress ends.
    crossings: u32,
    /// The bodies that take their substeps together, by their places; none where none can.
    walks: Vec<Option<Walk>>,
    /// How the step in progress ended for each body, at its place.
    outcomes: Vec<Option<Outcome>>,
    /// What tools hold.
    attachments: Slots<Attachment>,
    /// What of that ended with the last step.
    slipped: Vec<AttachmentId>,
}

impl World {
    /// An empty world.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: a number is out of its range. [`Error::Unsupported`]: the processor does not offer the
    /// kernel, or the system not so many threads.
    pub fn new(definition: WorldDefinition) -> Result<Self> {
        finite_vector("gravity", definition.gravity)?;
        not_negative("tolerance", definition.tolerance)?;
        if definition.max_substeps == 0 {
            return Err(Error::invalid("max_substeps is 0: must be at least 1"));
        }
        Ok(Self {
            kernel: definition.kernel.choose()?,
            threads: match definition.tasks {
                Some(tasks) => Threads::of_tasks(tasks, definition.thread_count)?,
                None => Threads::new(definition.thread_count)?,
            },
            definition,
            bodies: Slots::new("body"),
            tools: Slots::new("tool"),
            paths: Vec::new(),
            tissue: None,
            crossings: 0,
            walks: Vec::new(),
            outcomes: Vec::new(),
            attachments: Slots::new("attachment"),
            slipped: Vec::new(),
        })
    }

    /// The acceleration of everything, m/s².
    pub fn gravity(&self) -> Vec3 {
        self.definition.gravity
    }

    /// Gives everything this acceleration, m/s², from the next step on.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: it is not finite.
    pub fn set_gravity(&mut self, gravity: Vec3) -> Result<()> {
        finite_vector("gravity", gravity)?;
        self.definition.gravity = gravity;
        Ok(())
    }

    /// Adds a body.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: something in the definition is out of its range. [`Error::Unsupported`]: this version
    /// does not offer its storage or solver. [`Error::OutOfMemory`].
    pub fn create_body(&mut self, definition: &BodyDefinition) -> Result<BodyId> {
        let needs = Needs {
            tolerance: self.definition.tolerance > 0.0 && self.definition.substeps == 0,
            tools: self.tool_places(),
            kernel: self.kernel,
        };
        let body = Body::new(definition, needs)?;
        self.outcomes.try_reserve(self.bodies.places() + 1)?;
        let id = self.bodies.insert(body)?;
        match self.join_tissue(id) {
            Ok(()) => Ok(BodyId(id)),
            Err(error) => {
                self.bodies.remove(id)?;
                Err(error)
            }
        }
    }

    /// Lets a body that asks for it meet tissue.
    fn join_tissue(&mut self, id: SlotId) -> Result<()> {
        let place = self.bodies.place(id)?;
        let body = self.bodies.get_mut(id)?;
        if !body.meets_tissue() {
            return Ok(());
        }
        make_walks(&mut self.walks, place)?;
        self.tissue.get_or_insert_default().join(place, body)
    }

    /// Removes a body, and with it what is attached of it.
    ///
    /// # Errors
    /// [`Error::StaleId`].
    pub fn destroy_body(&mut self, body: BodyId) -> Result<()> {
        let place = self.bodies.place(body.0)?;
        self.bodies.remove(body.0)?;
        if let Some(tissue) = &mut self.tissue {
            tissue.leave(&mut self.bodies, place);
        }
        self.forget_attachments_of(body);
        Ok(())
    }

    /// A body, to look at.
    ///
    /// # Errors
    /// [`Error::StaleId`].
    pub fn body(&self, body: BodyId) -> Result<&Body> {
        self.bodies.get(body.0)
    }

    /// A body, to change.
    ///
    /// # Errors
    /// [`Error::StaleId`].
    pub fn body_mut(&mut self, body: BodyId) -> Result<&mut Body> {
        self.bodies.get_mut(body.0)
    }

    /// Moves the free nodes of a body, whatever its solver, to the nearest place downhill where it is at rest under gravity,
    /// its pins where they are, and the forces applied since the last step, which stay pending. Velocities become zero and what
    /// holds the pins is known. It is no step: it allocates and may take long. Tools are not taken into account.
    ///
    /// A part of a body that hangs on no pin is moved too where the forces on it cancel; how it lies and is turned as a whole is
    /// then as it happens to be.
    ///
    /// # Errors
    /// [`Error::StaleId`]. [`Error::InvalidArgument`]: the tolerance is out of its range, or a part is pulled by a net force
    /// along an axis along which no pin holds it, or the body is attached to a body. [`Error::NotConverged`]: not found in the iterations allowed. [`Error::OutOfMemory`]. Nothing has changed then.
    pub fn rest_state(&mut self, body: BodyId, definition: &RestStateDefinition) -> Result<RestStateReport> {
        self.check_not_attached(body)?;
        let gravity = self.definition.gravity;
        rest_state(self.bodies.get_mut(body.0)?, gravity, definition)
    }

    /// All bodies.
    pub fn bodies(&self) -> impl Iterator<Item = &Body> {
        self.bodies.iter().map(|(_, body)| body)
    }

    /// All bodies, with their ids.
    pub(crate) fn bodies_by_id(&self) -> impl Iterator<Item = (BodyId, &Body)> {
        self.bodies.iter_ids().map(|(id, body)| (BodyId(id), body))
    }

    /// Adds a tool.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: something in the definition is out of its range. [`Error::Unsupported`]: this version
    /// does not offer its detection. [`Error::OutOfMemory`].
    pub fn create_tool(&mut self, definition: &ToolDefinition) -> Result<ToolId> {
        let tool = Tool::new(definition)?;
        let count = self.tools.places() + 1;
        self.paths.try_reserve(count)?;
        let made = self
            .bodies
            .iter_mut()
            .try_for_each(|(_, body)| body.make_contacts(count));
        let id = made.and_then(|()| self.tools.insert(tool));
        if id.is_err() && self.tool_places() == 0 {
            self.drop_contacts();
        }
        Ok(ToolId(id?))
    }

    /// Removes a tool. What is attached to it is let go.
    ///
    /// # Errors
    /// [`Error::StaleId`].
    pub fn destroy_tool(&mut self, tool: ToolId) -> Result<()> {
        let slot = self.tools.place(tool.0)?;
        self.tools.remove(tool.0)?;
        self.release_all_of(tool);
        if self.tool_places() == 0 {
            self.drop_contacts();
        }
        for (_, body) in self.bodies.iter_mut() {
            if let Some(contacts) = &mut body.contacts {
                contacts.forget_tool(slot);
            }
        }
        Ok(())
    }

    /// How many places contacts need for tools.
    fn tool_places(&self) -> usize {
        if self.tools.iter().next().is_some() {
            self.tools.places()
        } else {
            0
        }
    }

    /// A world without tools keeps nothing for them.
    fn drop_contacts(&mut self) {
        for (_, body) in self.bodies.iter_mut() {
            body.contacts = None;
        }
    }

    /// Moves a tool to `position`, in metres, over the next step, and turns it to `orientation`, `None`: it stays as it
    /// is. Tissue gives way.
    ///
    /// # Errors
    /// [`Error::StaleId`]. [`Error::InvalidArgument`]: a number is not finite, or the orientation is zero.
    pub fn set_pose(&mut self, tool: ToolId, position: Vec3, orientation: Option<Quat>) -> Result<()> {
        let tool = self.tools.get_mut(tool.0)?;
        let pose = tool.target.unwrap_or(tool.pose);
        let target = Pose {
            position,
            orientation: orientation.unwrap_or(pose.orientation),
        };
        tool.target = Some(target.checked()?);
        Ok(())
    }

    /// Where a tool is.
    ///
    /// # Errors
    /// [`Error::StaleId`].
    pub fn pose(&self, tool: ToolId) -> Result<Pose> {
        Ok(self.tools.get(tool.0)?.pose)
    }

    /// The force and the torque on a tool about its position, world axes, mean over the last step, N and N m.
    ///
    /// # Errors
    /// [`Error::StaleId`].
    pub fn wrench(&self, tool: ToolId) -> Result<(Vec3, Vec3)> {
        let tool = self.tools.get(tool.0)?;
        Ok((tool.force, tool.torque))
    }

    pub(crate) fn tool_ids(&self) -> impl Iterator<Item = ToolId> {
        self.tools.iter_ids().map(|(id, _)| ToolId(id))
    }

    /// The shapes and poses of all tools.
    pub(crate) fn tools(&self) -> impl Iterator<Item = &Tool> {
        self.tools.iter().map(|(_, tool)| tool)
    }

    /// Steps everything by `dt` seconds, above 0.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: `dt` is out of its range. [`Error::Unstable`]: some body needs more substeps than are
    /// allowed. Nothing has moved then, pending forces and poses stay pending.
    pub fn step(&mut self, dt: f32) -> Result<StepReport> {
        if !(dt > 0.0 && dt.is_finite()) {
            return Err(Error::invalid(format!("dt is {dt}: must be above 0 and finite")));
        }
        for (_, tool) in self.tools.iter_mut() {
            tool.set_out();
        }
        for left in (0..=TRIES).rev() {
            self.plan_tools();
            if let Err(report) = self.attempt(dt) {
                self.put_back();
                return Err(Error::Unstable {
                    report,
                    allowed: match self.definition.substeps {
                        0 => self.definition.max_substeps,
                        fixed => fixed,
                    },
                });
            }
            if left == 0 || self.are_within_limits(dt, left == 1) {
                break;
            }
            self.put_back();
        }
        Ok(self.commit(dt))
    }

    /// Lets every body try the step; what it would come to where one cannot take it.
    fn attempt(&mut self, dt: f32) -> std::result::Result<(), StepReport> {
        let Self {
            definition,
            threads,
            bodies,
            paths,
            outcomes,
            tissue,
            crossings,
            walks,
            ..
        } = self;
        let request = StepRequest {
            dt,
            gravity: definition.gravity,
            substeps: definition.substeps,
            max_substeps: definition.max_substeps,
            // Fixed substeps are taken as they are.
            tolerance: if definition.substeps == 0 {
                definition.tolerance
            } else {
                0.0
            },
            tools: paths,
        };
        let Some(tissue) = tissue else {
            lead(threads, bodies, |bodies, team| {
                attempt_bodies(bodies, outcomes, &request, |_| true, team);
            });
            return reported(bodies, outcomes);
        };
        tissue.plan(bodies, dt);
        lead(threads, bodies, |bodies, team| {
            attempt_bodies(bodies, outcomes, &request, |place| tissue.group(place).is_none(), team);
            loop {
                tissue.find_crossings(bodies, false);
                let mut together = Together {
                    tissue,
                    walks,
                    request: &request,
                    team,
                };
                together.attempt(bodies, outcomes);
                if !tissue.plan_again(bodies) {
                    break;
                }
            }
        });
        reported(bodies, outcomes)?;
        *crossings = tissue.find_crossings(bodies, true);
        Ok(())
    }

    /// Takes back what bodies have tried.
    fn put_back(&mut self) {
        self.bodies.iter_mut().for_each(|(_, body)| body.put_back());
    }

    /// Makes the step that was tried the current state.
    fn commit(&mut self, dt: f32) -> StepReport {
        let Self {
            threads,
            bodies,
            paths,
            outcomes,
            ..
        } = self;
        let mut report = report(bodies, outcomes);
        report.crossings = self.crossings;
        lead(threads, bodies, |bodies, team| {
            commit_bodies(bodies, outcomes, paths, team)
        });
        self.commit_tools(dt);
        if let Some(tissue) = &mut self.tissue {
            tissue.bonds.commit(&self.outcomes, dt);
        }
        self.end_slipped();
        report
    }

    /// Whether no tool presses harder than it can; else those that do go less far in the next try, which may be the `last`.
    fn are_within_limits(&mut self, dt: f32, last: bool) -> bool {
        let mut are_within = true;
        for index in 0..self.paths.len() {
            let [force, _] = self.wrench_of(index, dt);
            if let Some((_, tool)) = self.tools.iter_mut().nth(index)
                && let Some(reach) = &mut tool.reach
            {
                are_within &= reach.is_allowed(force.length() as f32, tool.force_limit, last);
            }
        }
        are_within
    }

    /// The mean force and torque on a tool, at this place among the ways, in the step that was tried, N and N m.
    fn wrench_of(&self, index: usize, dt: f32) -> [DVec3; 2] {
        let mut wrench = [DVec3::ZERO; 2];
        for (place, body) in self.bodies.iter() {
            if let (Some(Outcome::Done { substeps, .. }), Some(contacts)) = (&self.outcomes[place], &body.contacts) {
                let load = contacts.loads()[index];
                let [force, torque] = body.pull_of(self.paths[index].slot, *substeps);
                wrench[0] += load.impulse / f64::from(dt) - force;
                wrench[1] += load.angular_impulse / f64::from(dt) - torque;
            }
        }
        wrench
    }

    /// Where a tool pressed bodies when the last step ended.
    ///
    /// # Errors
    /// [`Error::StaleId`].
    pub fn contacts(&self, tool: ToolId) -> Result<impl Iterator<Item = Contact>> {
        let slot = self.tools.place(tool.0)?;
        let bodies = self.bodies.iter_ids();
        Ok(bodies.flat_map(move |(id, body)| body.contacts_with(slot, BodyId(id))))
    }

    /// The tools and bodies that began or ceased to touch in the last step: with a tool or body that was destroyed nothing ceases.
    pub fn contact_changes(&self) -> impl Iterator<Item = ContactChange> {
        self.bodies.iter_ids().flat_map(move |(body, content)| {
            self.tools.iter_ids().filter_map(move |(tool, _)| {
                let slot = tool.index1 as usize - 1;
                let [now, before] = content.contacts.as_ref()?.touched(slot);
                (now != before).then_some(ContactChange {
                    tool: ToolId(tool),
                    body: BodyId(body),
                    begun: now,
                })
            })
        })
    }

    /// A hash over everything that the next step depends on; to be compared within one version.
    pub fn state_hash(&self) -> u64 {
        let definition = &self.definition;
        let mut hasher = StateHasher::new();
        hasher.write_floats(&definition.gravity.to_array());
        hasher.write_floats(&[definition.tolerance]);
        for count in [definition.substeps, definition.max_substeps] {
            hasher.write_u64(u64::from(count));
        }
        for (place, body) in self.bodies.iter() {
            hasher.write_u64(place as u64);
            body.hash_state(&mut hasher);
        }
        for (place, tool) in self.tools.iter() {
            hasher.write_u64(place as u64);
            tool.hash_state(&mut hasher);
        }
        if let Some(tissue) = &self.tissue {
            tissue.bonds.hash(&mut hasher);
        }
        hasher.finish()
    }

    fn plan_tools(&mut self) {
        self.paths.clear();
        for (place, tool) in self.tools.iter() {
            self.paths.push(ToolPath::new(place, tool));
        }
    }

    fn commit_tools(&mut self, dt: f32) {
        for index in 0..self.paths.len() {
            let [force, torque] = self.wrench_of(index, dt);
            let end = self.paths[index].end();
            if let Some((_, tool)) = self.tools.iter_mut().nth(index) {
                // Finite, whatever the step's length.
                tool.force = force.as_vec3().clamp(Vec3::MIN, Vec3::MAX);
                tool.torque = torque.as_vec3().clamp(Vec3::MIN, Vec3::MAX);
                tool.pose = end;
                tool.target = None;
                tool.reach = None;
            }
        }
    }
}

/// Makes room for the body at this place to take its substeps together with others.
fn make_walks(walks: &mut Vec<Option<Walk>>, place: usize) -> Result<()> {
    walks.try_reserve((place + 1).saturating_sub(walks.len()))?;
    walks.resize((place + 1).max(walks.len()), None);
    Ok(())
}

/// What the step would come to where a body cannot take it.
fn reported(bodies: &Slots<Body>, outcomes: &[Option<Outcome>]) -> std::result::Result<(), StepReport> {
    let unstable = |outcome: &Outcome| matches!(outcome, Outcome::Unstable { .. });
    if outcomes.iter().flatten().any(unstable) {
        return Err(report(bodies, outcomes));
    }
    Ok(())
}

/// Has the threads do something with bodies that are worth it, or the caller's own alone.
fn lead(threads: &mut Threads, bodies: &mut Slots<Body>, act: impl FnOnce(&mut Slots<Body>, &Team) + Send) {
    if is_worth_sharing(bodies) {
        threads.lead(|team| act(bodies, team));
    } else {
        act(bodies, &Team::alone());
    }
}

/// Whether there is work for more than one thread.
fn is_worth_sharing(bodies: &Slots<Body>) -> bool {
    let sizes = || bodies.iter().map(|(_, body)| body.node_count());
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
                    *outcome = Some(attempt(body, request, &Team::alone()));
                }
            },
        );
    }
    for (place, body) in bodies.iter_mut() {
        if outcomes[place].is_none() && goes_alone(place) {
            let alone = body.node_count() < SHARED_FROM;
            outcomes[place] = Some(if alone {
                attempt(body, request, &Team::alone())
            } else {
                attempt(body, request, team)
            });
        }
    }
}

fn report(bodies: &Slots<Body>, outcomes: &[Option<Outcome>]) -> StepReport {
    let mut report = StepReport {
        substeps: 0,
        stable_substep: f32::INFINITY,
        bodies_restored: 0,
        error_estimate: 0.0,
        crossings: 0,
    };
    for (place, body) in bodies.iter() {
        let stable_substep = match outcomes[place] {
            Some(Outcome::Done { substeps, carry, error }) => {
                report.substeps = report.substeps.max(substeps);
                report.error_estimate = report.error_estimate.max(error);
                carry.limit().map(|limit| limit.min(body.newest_limit_beside_springs()))
            }
            Some(Outcome::Unstable { stable_substep, error }) => {
                report.error_estimate = report.error_estimate.max(error);
                Some(stable_substep)
            }
            Some(Outcome::NotFinite) | None => {
                report.bodies_restored += 1;
                body.carry.limit()
            }
        };
        report.stable_substep = report.stable_substep.min(stable_substep.unwrap_or(f32::INFINITY));
    }
    report
}

fn commit_bodies(bodies: &mut Slots<Body>, outcomes: &[Option<Outcome>], tools: &[ToolPath], team: &Team) {
    for (place, body) in bodies.iter_mut() {
        match outcomes[place] {
            Some(Outcome::Done { substeps, carry, .. }) => {
                let alone = Team::alone();
                let team = if body.node_count() < SHARED_FROM { &alone } else { team };
                body.commit(substeps, carry, tools, team);
            }
            _ => {
                body.put_back();
                body.clear_pending();
            }
        }
    }
}
