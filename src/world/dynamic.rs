//! Dynamic tools: rigid bodies moved by forces, gravity and contact with tissue.

use glam::{DVec3, Quat, Vec3};

use super::World;
use crate::base::{Error, Result, ToolId, ensure, memory};
use crate::contact::{DynamicTool, MassProperties, Rigid};
use crate::def::finite_vector;
use crate::solver::Outcome;

/// How often a step is repeated because a tool presses another number of bodies than its mass was divided among.
pub(super) const DIVISIONS: u32 = 4;

impl World {
    /// The mass properties of a tool of uniform density, kg/m³, above 0.
    ///
    /// # Errors
    /// [`Error::StaleId`]. [`Error::InvalidArgument`]: the density is out of its range, or the tool is a plane.
    pub fn mass_of_density(&self, tool: ToolId, density: f32) -> Result<MassProperties> {
        MassProperties::of(&self.tools.get(tool.0)?.shape, density)
    }

    /// Makes a tool dynamic: a rigid body with this mass, at rest. `None` makes it kinematic, which is the default.
    ///
    /// From the next step on gravity, [`World::apply_wrench`] and contact with bodies move a dynamic tool. In every
    /// substep the impulses on the tissue act on the tool too, so momentum is conserved and the step is stable for any
    /// ratio of masses. Pinned nodes stop the tool too. Tools do not collide with each other. Bodies near a dynamic
    /// tool do not sleep. Setting another mass keeps the velocity.
    ///
    /// # Errors
    /// [`Error::StaleId`]. [`Error::InvalidArgument`]: a number is out of range, the tool is a plane, it holds
    /// attachments, or a [`HapticHandle`](crate::HapticHandle) moves it. [`Error::OutOfMemory`].
    pub fn set_dynamic(&mut self, tool: ToolId, mass: Option<&MassProperties>) -> Result<()> {
        self.check_not_led(tool)?;
        let slot = self.tools.slot(tool.0)?;
        let content = self.tools.get(tool.0)?;
        let Some(mass) = mass else {
            let content = self.tools.get_mut(tool.0)?;
            content.rigid = None;
            return Ok(());
        };
        ensure!(!content.is_plane(), "tool is a plane: a plane cannot be dynamic");
        ensure!(
            !self.is_holding(slot),
            "tool holds attachments: release them before it is dynamic"
        );
        let mut rigid = Rigid::new(mass, &content.pose)?;
        if let Some(before) = &content.rigid {
            let (velocity, spin) = before.velocity();
            rigid.set_velocity(velocity, spin);
        }
        let rigid = memory::boxed(rigid)?;
        self.reserve_dynamic(self.dynamic_count() + 1)?;
        let content = self.tools.get_mut(tool.0)?;
        content.rigid = Some(rigid);
        content.target = None;
        self.wake_near(tool)
    }

    /// The mass properties of a dynamic tool; `None` if the tool is kinematic.
    ///
    /// # Errors
    /// [`Error::StaleId`].
    pub fn mass_properties(&self, tool: ToolId) -> Result<Option<MassProperties>> {
        Ok(self.tools.get(tool.0)?.rigid.as_ref().map(|rigid| rigid.properties))
    }

    /// The velocity of a dynamic tool's center of mass, m/s, and its angular velocity, rad/s, in world axes.
    ///
    /// # Errors
    /// [`Error::StaleId`]. [`Error::InvalidArgument`]: the tool is kinematic.
    pub fn tool_velocity(&self, tool: ToolId) -> Result<(Vec3, Vec3)> {
        self.tools.get(tool.0)?;
        Ok(self.rigid(tool)?.velocity())
    }

    /// Sets the velocity of a dynamic tool's center of mass, m/s, and its angular velocity, rad/s, in world axes.
    ///
    /// # Errors
    /// [`Error::StaleId`]. [`Error::InvalidArgument`]: a number is not finite, or the tool is kinematic.
    pub fn set_tool_velocity(&mut self, tool: ToolId, velocity: Vec3, spin: Vec3) -> Result<()> {
        self.rigid(tool)?;
        finite_vector("velocity", velocity)?;
        finite_vector("angular_velocity", spin)?;
        self.rigid_mut(tool)?.set_velocity(velocity, spin);
        Ok(())
    }

    /// Adds a force at a dynamic tool's center of mass, N, and a torque about it, N m, in world axes. Both act
    /// throughout the next step.
    ///
    /// # Errors
    /// [`Error::StaleId`]. [`Error::InvalidArgument`]: a number is not finite, or the tool is kinematic.
    pub fn apply_wrench(&mut self, tool: ToolId, force: Vec3, torque: Vec3) -> Result<()> {
        self.rigid(tool)?;
        finite_vector("force", force)?;
        finite_vector("torque", torque)?;
        let rigid = self.rigid_mut(tool)?;
        rigid.force += force.as_dvec3();
        rigid.torque += torque.as_dvec3();
        Ok(())
    }

    /// Moves a tool to a position, m, and orientation immediately; `None` keeps its orientation. The motion is not
    /// swept: tissue inside the tool is pushed out over the next steps. A dynamic tool keeps its velocity.
    ///
    /// # Errors
    /// [`Error::StaleId`]. [`Error::InvalidArgument`]: as for [`World::set_pose`], or the tool holds attachments.
    pub fn teleport(&mut self, tool: ToolId, position: Vec3, orientation: Option<Quat>) -> Result<()> {
        self.check_not_led(tool)?;
        let slot = self.tools.slot(tool.0)?;
        let pose = self.tools.get(tool.0)?.pose.moved(position, orientation)?;
        ensure!(
            !self.is_holding(slot),
            "tool holds attachments: release them before it is moved at once"
        );
        self.wake_near(tool)?;
        let content = self.tools.get_mut(tool.0)?;
        (content.pose, content.last_target, content.target) = (pose, pose, None);
        if let Some(rigid) = &mut content.rigid {
            rigid.set_pose(&pose);
        }
        for contacts in self.contacts_mut() {
            contacts.invalidate_candidates();
            contacts.multipliers.remove_tool(slot);
        }
        self.wake_near(tool)
    }

    fn rigid(&self, tool: ToolId) -> Result<&Rigid> {
        let content = self.tools.get(tool.0)?;
        content.rigid.as_deref().ok_or_else(|| kinematic(tool))
    }

    fn rigid_mut(&mut self, tool: ToolId) -> Result<&mut Rigid> {
        let content = self.tools.get_mut(tool.0)?;
        content.rigid.as_deref_mut().ok_or_else(|| kinematic(tool))
    }

    /// Refuses a dynamic tool.
    pub(super) fn check_kinematic(&self, tool: ToolId) -> Result<()> {
        ensure!(
            self.tools.get(tool.0)?.rigid.is_none(),
            "tool is {}: it is dynamic",
            tool.0
        );
        Ok(())
    }

    pub(super) fn dynamic_count(&self) -> usize {
        self.tools.iter().filter(|(_, tool)| tool.rigid.is_some()).count()
    }

    /// Reserves room for `count` dynamic tools.
    pub(super) fn reserve_dynamic(&mut self, count: usize) -> Result<()> {
        memory::reserve(&mut self.dynamic, count)?;
        let tools = self.tools.slot_count();
        self.contacts_mut()
            .try_for_each(|contacts| contacts.reserve_dynamic(tools, count))
    }

    /// Begins a step: divides the mass of each dynamic tool among the bodies that it pressed in the last step.
    pub(super) fn divide_tool_masses(&mut self) {
        self.dynamic.clear();
        for (index, (slot, tool)) in self.tools.iter().enumerate() {
            let Some(rigid) = &tool.rigid else { continue };
            let contacts = self
                .bodies
                .iter()
                .filter_map(|(_, body)| body.system().contacts.as_ref());
            let shares = contacts.filter(|contacts| contacts.touched(slot)[0]).count().max(1) as u32;
            self.dynamic
                .push(DynamicTool::new(index, rigid, self.definition.gravity, shares));
        }
    }

    /// True if each dynamic tool pressed as many bodies in the attempted step as its mass was divided among. Otherwise
    /// the next attempt uses the new number. After [`DIVISIONS`] attempts the mass is divided among all bodies, which
    /// always suffices.
    pub(super) fn are_masses_divided(&mut self, attempts: u32) -> bool {
        let mut are_masses_divided = true;
        for tool in &mut self.dynamic {
            let stepped = self.bodies.iter().filter(|&(slot, _)| is_done(&self.outcomes[slot]));
            let pressed = stepped.filter(|(_, body)| {
                let contacts = body.system().contacts.as_ref();
                contacts.is_some_and(|contacts| contacts.loads()[tool.index].impulse != DVec3::ZERO)
            });
            let pressed = pressed.count().max(1) as u32;
            let is_divided = pressed == tool.share_count || attempts > 0 && pressed < tool.share_count;
            if is_divided || attempts >= DIVISIONS {
                continue;
            }
            let Some((_, content)) = self.tools.iter().nth(tool.index) else {
                continue;
            };
            let shares = if attempts + 1 < DIVISIONS {
                pressed
            } else {
                self.bodies.iter().count() as u32
            };
            if let Some(rigid) = &content.rigid {
                *tool = DynamicTool::new(tool.index, rigid, self.definition.gravity, shares);
            }
            are_masses_divided = false;
        }
        are_masses_divided
    }

    /// Sets the paths of dynamic tools to free flight.
    pub(super) fn plan_flights(&mut self, dt: f32) {
        for tool in &self.dynamic {
            tool.set_free_flight(&mut self.paths[tool.index], dt);
        }
    }

    /// Moves each dynamic tool to the mean of the motions that its bodies computed.
    pub(super) fn end_flights(&mut self, dt: f32) {
        let mut rigid = self
            .tools
            .iter_mut()
            .filter_map(|(_, tool)| Some((tool.rigid.as_deref_mut()?, &mut tool.pose, &mut tool.last_target)));
        for tool in &self.dynamic {
            let Some((rigid, pose, last_target)) = rigid.next() else {
                break;
            };
            let stepped = self.bodies.iter().filter(|&(slot, _)| is_done(&self.outcomes[slot]));
            let ends = stepped.flat_map(|(_, body)| body.system().contacts.iter());
            let ends = ends.filter_map(|contacts| contacts.dynamic_end(tool.index, dt));
            rigid.adopt(tool.merge_copies(dt, ends));
            *pose = rigid.motion.pose(&rigid.mass);
            *last_target = *pose;
        }
    }
}

fn is_done(outcome: &Option<Outcome>) -> bool {
    matches!(outcome, Some(Outcome::Done { .. }))
}

fn kinematic(tool: ToolId) -> Error {
    Error::invalid(format!("tool is {}: it is kinematic", tool.0))
}
