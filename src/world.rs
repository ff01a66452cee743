//! A world: bodies and tools that are stepped together.

use glam::{Quat, Vec3};

use crate::body::{Body, BodyDefinition, Needs, finite_vector, not_negative};
use crate::contact::{Pose, Tool, ToolDefinition, ToolPath};
use crate::diagnostics::StateHasher;
use crate::error::{Error, Result};
use crate::slots::{SlotId, Slots};
use crate::solver::{Outcome, StepRequest, attempt};
use crate::springs::{ChosenKernel, Kernel};

/// How a world steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorldDefinition {
    /// m/s².
    pub gravity: Vec3,
    /// 1: the caller's thread alone.
    pub thread_count: u32,
    /// 0: as many as stability needs; n: exactly n per step.
    pub substeps: u32,
    /// A step that needs more is [`Error::Unstable`]; at least 1.
    pub max_substeps: u32,
    /// Metres; 0: off; above 0, with `substeps` 0: a step's own position error stays below it.
    pub tolerance: f32,
    /// The instructions that springs and nodes are worked on with.
    pub kernel: Kernel,
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
    /// How far a position of this step may be off, m; 0 where the tolerance is off.
    pub error_estimate: f32,
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
    bodies: Slots<Body>,
    tools: Slots<Tool>,
    /// The ways of the tools in the step in progress.
    paths: Vec<ToolPath>,
    /// How the step in progress ended for each body.
    outcomes: Vec<Outcome>,
}

impl World {
    /// An empty world.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: a number is out of its range. [`Error::Unsupported`]: more than one thread.
    pub fn new(definition: WorldDefinition) -> Result<Self> {
        finite_vector("gravity", definition.gravity)?;
        not_negative("tolerance", definition.tolerance)?;
        if definition.max_substeps == 0 {
            return Err(Error::invalid("max_substeps is 0: must be at least 1"));
        }
        if definition.thread_count != 1 {
            return Err(Error::Unsupported(format!(
                "thread_count is {}: this version steps on the caller's thread alone, 1",
                definition.thread_count
            )));
        }
        Ok(Self {
            kernel: definition.kernel.choose()?,
            definition,
            bodies: Slots::new("body"),
            tools: Slots::new("tool"),
            paths: Vec::new(),
            outcomes: Vec::new(),
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
            tools: self.tools.iter().count(),
            kernel: self.kernel,
        };
        let body = Body::new(definition, needs)?;
        self.outcomes.try_reserve(self.bodies.places() + 1)?;
        Ok(BodyId(self.bodies.insert(body)?))
    }

    /// Removes a body.
    ///
    /// # Errors
    /// [`Error::StaleId`].
    pub fn destroy_body(&mut self, body: BodyId) -> Result<()> {
        self.bodies.remove(body.0).map(drop)
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

    /// All bodies.
    pub fn bodies(&self) -> impl Iterator<Item = &Body> {
        self.bodies.iter().map(|(_, body)| body)
    }

    /// Adds a tool.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: something in the definition is out of its range. [`Error::Unsupported`]: this version
    /// does not offer its detection. [`Error::OutOfMemory`].
    pub fn create_tool(&mut self, definition: &ToolDefinition) -> Result<ToolId> {
        let tool = Tool::new(definition)?;
        let count = self.tools.iter().count() + 1;
        self.paths.try_reserve(count)?;
        let made = self
            .bodies
            .iter_mut()
            .try_for_each(|(_, body)| body.make_contacts(count));
        let id = made.and_then(|()| self.tools.insert(tool));
        if id.is_err() && count == 1 {
            self.drop_contacts();
        }
        Ok(ToolId(id?))
    }

    /// Removes a tool.
    ///
    /// # Errors
    /// [`Error::StaleId`].
    pub fn destroy_tool(&mut self, tool: ToolId) -> Result<()> {
        self.tools.remove(tool.0)?;
        if self.tools.iter().next().is_none() {
            self.drop_contacts();
        }
        Ok(())
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
        self.plan_tools();
        self.attempt_bodies(dt);
        let report = self.report();
        if self
            .outcomes
            .iter()
            .any(|outcome| matches!(outcome, Outcome::Unstable { .. }))
        {
            return Err(Error::Unstable {
                report,
                allowed: match self.definition.substeps {
                    0 => self.definition.max_substeps,
                    fixed => fixed,
                },
            });
        }
        self.commit_bodies();
        self.commit_tools(dt);
        Ok(report)
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
        hasher.finish()
    }

    fn plan_tools(&mut self) {
        self.paths.clear();
        for (place, tool) in self.tools.iter() {
            self.paths.push(ToolPath::new(place, tool));
        }
    }

    fn attempt_bodies(&mut self, dt: f32) {
        let request = StepRequest {
            dt,
            gravity: self.definition.gravity,
            substeps: self.definition.substeps,
            max_substeps: self.definition.max_substeps,
            tolerance: self.definition.tolerance,
            tools: &self.paths,
        };
        self.outcomes.clear();
        for (_, body) in self.bodies.iter_mut() {
            self.outcomes.push(attempt(body, &request));
        }
    }

    fn report(&self) -> StepReport {
        let mut report = StepReport {
            substeps: 0,
            stable_substep: f32::INFINITY,
            bodies_restored: 0,
            error_estimate: 0.0,
        };
        for (outcome, (_, body)) in self.outcomes.iter().zip(self.bodies.iter()) {
            let stable_substep = match *outcome {
                Outcome::Done { substeps, carry, error } => {
                    report.substeps = report.substeps.max(substeps);
                    report.error_estimate = report.error_estimate.max(error);
                    carry.stability.limit
                }
                Outcome::NotFinite => {
                    report.bodies_restored += 1;
                    body.carry.stability.limit
                }
                Outcome::Unstable { stable_substep, error } => {
                    report.error_estimate = report.error_estimate.max(error);
                    Some(stable_substep)
                }
            };
            report.stable_substep = report.stable_substep.min(stable_substep.unwrap_or(f32::INFINITY));
        }
        report
    }

    fn commit_bodies(&mut self) {
        for (outcome, (_, body)) in self.outcomes.iter().zip(self.bodies.iter_mut()) {
            match *outcome {
                Outcome::Done { substeps, carry, .. } => body.commit(substeps, carry),
                Outcome::NotFinite | Outcome::Unstable { .. } => body.clear_pending(),
            }
        }
    }

    fn commit_tools(&mut self, dt: f32) {
        let dt = f64::from(dt);
        for (index, (_, tool)) in self.tools.iter_mut().enumerate() {
            let mut force = glam::DVec3::ZERO;
            let mut torque = glam::DVec3::ZERO;
            for (outcome, (_, body)) in self.outcomes.iter().zip(self.bodies.iter()) {
                if let (Outcome::Done { .. }, Some(contacts)) = (outcome, &body.contacts) {
                    force += contacts.loads()[index].impulse / dt;
                    torque += contacts.loads()[index].angular_impulse / dt;
                }
            }
            // Finite, whatever the step's length.
            tool.force = force.as_vec3().clamp(Vec3::MIN, Vec3::MAX);
            tool.torque = torque.as_vec3().clamp(Vec3::MIN, Vec3::MAX);
            if let Some(target) = tool.target.take() {
                tool.pose = target;
            }
        }
    }
}
