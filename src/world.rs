//! A world: bodies and tools that are stepped together.

mod approach;
mod attachments;
mod blade;
mod blades;
mod budget;
mod dynamic;
mod getters;
mod haptics;
mod holds;
mod profile;
mod push;
mod readers;
mod recording;
mod resistance;
mod rest;
mod settings;
mod snapshot;
mod step;
mod sutures;
mod tear;

use glam::{Quat, Vec3};

use crate::base::{AttachmentId, BodyId, Error, Profile, Result, SlotId, StateHasher, ToolId, memory, not_negative};
use crate::body::{Body, CutReport, MaterialPoint, Needs, Steps, Stroke};
use crate::contact::{Contact, ContactChange, Contacts, DynamicTool, Pose, Tool, ToolDefinition, ToolPath};
use crate::cutting::Sweep;
use crate::def::{Anchor, BodyDefinition, CollisionFilter, finite_vector};
use crate::readers::Clock;
use crate::simd::{ChosenKernel, Kernel};
use crate::slots::Slots;
use crate::solver::{Outcome, RestStateDefinition, RestStateReport};
use crate::threads::{RunTasks, Threads};
use crate::tissue::{CoupledBody, Skin, Tissue};
use attachments::{Attachment, Which};
use blade::Blade;
pub use blade::{BladeDefinition, BladeReport};
pub use budget::BudgetReport;
use budget::Pace;
pub use profile::StepProfile;
use recording::Recorder;
pub use recording::{ReplayDifference, ReplayReport};
pub use sutures::{SutureDefinition, SutureReport};

/// How long the steps of a world are taken to be before the first, s.
const FRAME: f32 = 1.0 / 60.0;

/// How a world steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorldDefinition {
    /// m/s².
    pub gravity: Vec3,
    /// 1: the caller's thread alone; 0: one per core; at most 256. What comes of a step is the same for any number.
    pub thread_count: u32,
    /// 0: as many as stability needs; n: exactly n per step, but for bodies of [`Solver::Implicit`](crate::Solver::Implicit) and
    /// [`Solver::Newton`](crate::Solver::Newton) near a tool, whose substeps are of 1 ms at most there, or attached to a body, of 0.25 ms,
    /// and where a substep of theirs gains energy: then they are cut again, to 4096 in all.
    pub substeps: u32,
    /// A step that needs more is [`Error::Unstable`]; at least 1. What is cut as above may be 4096 parts whatever this is, and one that would
    /// take more of them, 4 s near a tool or 1 s attached to a body, is [`Error::Unstable`] too.
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
    /// Those of them that are rigid bodies.
    dynamic: Vec<DynamicTool>,
    /// Contacts of tissue with tissue, where bodies ask for them.
    pub(crate) tissue: Option<Box<Tissue>>,
    /// The bodies that take their substeps together, by their places; none where none can.
    walks: Vec<Option<CoupledBody>>,
    /// How the step in progress ended for each body, at its place.
    outcomes: Vec<Option<Outcome>>,
    /// What tools hold.
    attachments: Slots<Attachment>,
    /// What of that ended with the last step.
    slipped: Vec<AttachmentId>,
    blades: Slots<Blade>,
    /// How many threads to blades there ever were.
    holds_made: u32,
    /// Tools that devices lead.
    haptics: Vec<haptics::Link>,
    /// The steps that were taken.
    clock: Clock,
    /// The most substeps of the step in progress, whatever the definition allows.
    work: u32,
    /// What steps with a budget have not simulated yet, s.
    lag: f64,
    /// How fast this machine works.
    pace: Pace,
    /// What the caller keeps with it.
    user_data: usize,
    /// What the stages of the last step took, where that is asked for.
    profile: Option<Box<Profile>>,
    /// Where steps are recorded, if they are.
    recorder: Option<Box<Recorder>>,
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
            dynamic: Vec::new(),
            tissue: None,
            walks: Vec::new(),
            outcomes: Vec::new(),
            attachments: Slots::new("attachment"),
            slipped: Vec::new(),
            blades: Slots::new("blade"),
            holds_made: 0,
            haptics: Vec::new(),
            clock: Clock::default(),
            work: u32::MAX,
            lag: 0.0,
            pace: Pace::default(),
            user_data: 0,
            profile: None,
            recorder: None,
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
        if std::mem::replace(&mut self.definition.gravity, gravity) == gravity {
            return Ok(());
        }
        self.bodies.iter_mut().for_each(|(_, body)| body.wake());
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
            steps: Steps {
                length: self.clock.mean_step().unwrap_or(FRAME),
                substeps: self.definition.substeps,
                max_substeps: self.definition.max_substeps,
            },
        };
        let mut body = Body::new(definition, needs)?;
        if let Some(contacts) = &mut body.system_mut().contacts {
            contacts.reserve_dynamic(needs.tools, self.dynamic_count())?;
        }
        self.outcomes.try_reserve(self.bodies.places() + 1)?;
        let id = self.bodies.insert(body)?;
        match self.join_tissue(id).and_then(|()| self.meet_blades(id)) {
            Ok(()) => Ok(BodyId(id)),
            Err(error) => {
                self.leave_blades(BodyId(id));
                self.bodies.take_back(id)?;
                Err(error)
            }
        }
    }

    /// Lets a body that asks for it meet tissue.
    fn join_tissue(&mut self, id: SlotId) -> Result<()> {
        let place = self.bodies.place(id)?;
        let body = self.bodies.get_mut(id)?;
        if !body.system().meets_tissue() {
            return Ok(());
        }
        body.system_mut().reserve_pressed()?;
        make_walks(&mut self.walks, place)?;
        memory::get_or_box(&mut self.tissue)?.join(place, body.system())
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
        self.leave_blades(body);
        Ok(())
    }

    /// Cuts a body where a blade's edge passed from one place to another, while its nodes are where they are.
    ///
    /// Where the blade crosses an edge of the surface, or ends within a triangle, there is a point of the surface from then on: one that is there, or
    /// on an edge that is there, if it lies within 5 % of the shortest edge of the triangle that is simulated there, in the rest shape. Between them
    /// the surface is open. What is simulated stays as well shaped as it was: a triangle whose material fell apart is copied for each piece, with nodes
    /// that are not drawn where its material is beyond the cut, and with its part of masses and stiffnesses; copies share nodes where their
    /// material hangs together (Molino, Bao, Fedkiw 2004). Springs along no edge of a triangle are taken away where the blade passed through them.
    ///
    /// Of tetrahedra the edges that the blade crosses are divided in the same way, and faces between points on its way open once one of their
    /// corners parts: at the latest when a tetrahedron's last edge is crossed. What was inside is drawn from then on. A body of springs alone loses
    /// those that the blade passed through.
    ///
    /// A sweep that begins just where the last of the body ended goes on with it: it begins where the tissue that the blade stood in has gone
    /// meanwhile. A blade that stays in tissue that moves so leaves no bridges.
    ///
    /// Nodes keep their numbers, and new ones are numbered on: copies, which move as what they copied moved, and points of the surface between nodes,
    /// which have no mass and go where their nodes go. Mass, momentum and energy stay what they were. What holds a node holds it where
    /// it is drawn; copies of it beyond the cut are free, and have the mass of their material in the mean where it had none.
    ///
    /// Terms beside springs go on in parts: home springs with those of the nodes' masses, what goes by springs with those, fibres with the tetrahedra, and hinges of
    /// bending by area, where pieces of both triangles still share the edge. A hinge whose edge is cut along is gone, with its energy, and so is what a cavity had that is cut open.
    ///
    /// Positions and triangles that were lent before are stale. [`Body::changes_since`] tells a renderer what has changed.
    ///
    /// # Errors
    /// [`Error::StaleId`]. [`Error::Unsupported`]: the body was made without [`BodyDefinition::spare_nodes`]. [`Error::InvalidArgument`]: an end of
    /// the blade is not finite. [`Error::Capacity`]: there are not as many spare nodes left, or a node has no free place in a row of fixed
    /// length. [`Error::OutOfMemory`]. Then nothing has changed.
    pub fn cut(&mut self, body: BodyId, sweep: &Sweep) -> Result<CutReport> {
        let report = self.change_topology(body, |it, skin| it.cut(sweep, skin))?;
        self.bodies.get_mut(body.0)?.show_topology();
        Ok(report)
    }

    /// The same along a stroke of its own.
    fn cut_along(&mut self, body: BodyId, sweep: &Sweep, stroke: &mut Stroke) -> Result<CutReport> {
        let report = self.change_topology(body, |it, skin| {
            it.swap_stroke(stroke);
            let report = it.cut(sweep, skin);
            it.swap_stroke(stroke);
            report
        })?;
        self.bodies.get_mut(body.0)?.show_topology();
        Ok(report)
    }

    /// Lets a body change its topology, and what is attached of it follow.
    fn change_topology<T>(
        &mut self,
        body: BodyId,
        change: impl FnOnce(&mut Body, Option<&mut Skin>) -> Result<T>,
    ) -> Result<T> {
        let place = self.bodies.place(body.0)?;
        let carried = self.attached_points(body, place)?;
        let mut moved = crate::base::memory::reserved(carried.len())?;
        let it = self.bodies.get_mut(body.0)?;
        let before = it.topology_version();
        let skin = self.tissue.as_mut().and_then(|tissue| tissue.skin_mut(place));
        let changed = change(it, skin)?;
        if it.topology_version() == before {
            return Ok(changed);
        }
        let which = Which {
            prefix: "",
            index: None,
        };
        for (anchor, point) in carried {
            let it = self.bodies.get(body.0)?;
            let now = point.and_then(|point| it.surface_point(&point, before));
            let now = now.map_or(anchor, Anchor::Point);
            // What cannot be bound anew stays bound as it was.
            if let Ok(bound) = self.bound(body, which, &now) {
                moved.push((anchor, bound));
            }
        }
        if let Some(bonds) = self.bonds_mut() {
            bonds.rebind(place, |bound| {
                let of = moved.iter().find(|(anchor, _)| Some(*anchor) == bound.anchor);
                of.map(|(_, now)| *now)
            });
        }
        Ok(changed)
    }

    /// What others are attached to of a body, points with their places in its material; there is room to bind them anew.
    fn attached_points(&mut self, body: BodyId, place: usize) -> Result<Vec<(Anchor, Option<MaterialPoint>)>> {
        let mut points = Vec::new();
        let it = self.bodies.get(body.0)?;
        let Some(tissue) = &mut self.tissue else {
            return Ok(points);
        };
        tissue.bonds.reserve_rebinding(place)?;
        for bound in tissue.bonds.points_of(place) {
            let Some(anchor) = bound.anchor else { continue };
            let at = match &anchor {
                Anchor::Point(point) => it.material_point(point),
                Anchor::Node(_) => None,
            };
            crate::base::memory::push(&mut points, (anchor, at))?;
        }
        Ok(points)
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
        let body = self.bodies.get_mut(body.0)?;
        let gravity = gravity * body.system().gravity_scale;
        body.rest_state(gravity, definition)
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
        let id = ToolId(id?);
        let index = self.tool_index(id)?;
        self.contacts_mut().for_each(|contacts| contacts.add_tool(index));
        self.wake_near(id)?;
        Ok(id)
    }

    /// What bodies keep of contacts with tools.
    fn contacts_mut(&mut self) -> impl Iterator<Item = &mut Contacts> {
        let bodies = self.bodies.iter_mut();
        bodies.filter_map(|(_, body)| body.system_mut().contacts.as_deref_mut())
    }

    /// How many tools come before this one.
    fn tool_index(&self, tool: ToolId) -> Result<usize> {
        let slot = self.tools.place(tool.0)?;
        Ok(self.tools.iter().take_while(|&(place, _)| place < slot).count())
    }

    /// Wakes what a tool meets and is near to.
    fn wake_near(&mut self, tool: ToolId) -> Result<()> {
        let path = ToolPath::new(self.tools.place(tool.0)?, self.tools.get(tool.0)?);
        let bodies = self.bodies.iter_mut();
        bodies.for_each(|(_, body)| body.system_mut().wake_near(&path));
        Ok(())
    }

    /// Removes a tool. What is attached to it is let go.
    ///
    /// # Errors
    /// [`Error::StaleId`].
    pub fn destroy_tool(&mut self, tool: ToolId) -> Result<()> {
        let (slot, index) = (self.tools.place(tool.0)?, self.tool_index(tool)?);
        self.wake_near(tool)?;
        self.tools.remove(tool.0)?;
        // They share what a mesh takes.
        self.paths.clear();
        self.leave_haptics(tool);
        self.release_all_of(tool);
        if self.tool_places() == 0 {
            self.drop_contacts();
        }
        self.contacts_mut()
            .for_each(|contacts| contacts.forget_tool(slot, index));
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
        let bodies = self.bodies.iter_mut();
        bodies.for_each(|(_, body)| body.system_mut().contacts = None);
    }

    /// Moves a tool to `position`, in metres, over the next step, and turns it to `orientation`, `None`: it stays as it
    /// is. Tissue gives way. What of its way a tool of limited force has not gone in that step is forgotten: it is sent again.
    ///
    /// # Errors
    /// [`Error::StaleId`]. [`Error::InvalidArgument`]: a number is not finite, a coordinate is further than 1e9 m from 0, or the
    /// orientation is zero, a [`HapticHandle`](crate::HapticHandle) leads the tool, or it is dynamic.
    pub fn set_pose(&mut self, tool: ToolId, position: Vec3, orientation: Option<Quat>) -> Result<()> {
        self.check_not_led(tool)?;
        self.check_kinematic(tool)?;
        let tool = self.tools.get_mut(tool.0)?;
        let pose = tool.target.unwrap_or(tool.pose);
        let target = Pose {
            position,
            orientation: orientation.unwrap_or(pose.orientation),
        };
        tool.target = Some(target.checked()?);
        Ok(())
    }

    /// Gives a tool this Coulomb coefficient of friction, at least 0, from the next step on.
    ///
    /// # Errors
    /// [`Error::StaleId`]. [`Error::InvalidArgument`]: it is below 0 or not finite.
    pub fn set_friction(&mut self, tool: ToolId, friction: f32) -> Result<()> {
        self.tools.get_mut(tool.0)?.set_friction(friction)?;
        self.wake_near(tool)
    }

    /// Has this force, N, at least 0, where 0 and infinity mean no limit, be the largest that moves a tool, from the next step on.
    ///
    /// # Errors
    /// [`Error::StaleId`]. [`Error::InvalidArgument`]: it is below 0 or not a number.
    pub fn set_force_limit(&mut self, tool: ToolId, limit: f32) -> Result<()> {
        self.tools.get_mut(tool.0)?.set_force_limit(limit)
    }

    /// Has a tool meet what this filter says, from the next step on. Tissue that lies within it then is pushed out.
    ///
    /// # Errors
    /// [`Error::StaleId`].
    pub fn set_collision_filter(&mut self, tool: ToolId, filter: CollisionFilter) -> Result<()> {
        // What it has met may be let go, and what it has not may be pushed.
        self.wake_near(tool)?;
        self.tools.get_mut(tool.0)?.filter = filter;
        self.wake_near(tool)?;
        self.contacts_mut().for_each(|contacts| contacts.look_again());
        Ok(())
    }

    /// Where a tool is.
    ///
    /// # Errors
    /// [`Error::StaleId`].
    pub fn pose(&self, tool: ToolId) -> Result<Pose> {
        Ok(self.tools.get(tool.0)?.pose)
    }

    /// Where the last step led a tool: where it is, but for one of limited force. Sent there by [`World::set_pose`] step by step, it does the same in
    /// another world: so what a [`HapticHandle`](crate::HapticHandle) did can be taken down and done again.
    ///
    /// # Errors
    /// [`Error::StaleId`].
    pub fn tool_target(&self, tool: ToolId) -> Result<Pose> {
        Ok(self.tools.get(tool.0)?.led_to)
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
                let [now, before] = content.system().contacts.as_ref()?.touched(slot);
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
        if self.lag > 0.0 {
            hasher.write_u64(self.lag.to_bits());
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
            tissue.pushes.hash(&mut hasher);
        }
        for (place, blade) in self.blades.iter() {
            hasher.write_u64(place as u64);
            blade.hash(&mut hasher);
        }
        hasher.finish()
    }
}

/// Makes room for the body at this place to take its substeps together with others.
fn make_walks(walks: &mut Vec<Option<CoupledBody>>, place: usize) -> Result<()> {
    walks.try_reserve((place + 1).saturating_sub(walks.len()))?;
    walks.resize((place + 1).max(walks.len()), None);
    Ok(())
}
