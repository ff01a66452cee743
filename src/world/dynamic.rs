//! Tools that are rigid bodies: forces, gravity and contact with tissue move them.

use glam::{DVec3, Quat, Vec3};

use super::World;
use crate::base::{Error, Result, ToolId, ensure, memory};
use crate::contact::{DynamicTool, MassProperties, Rigid};
use crate::def::finite_vector;
use crate::solver::Outcome;

/// How often a step is begun again because a tool presses more bodies than its mass was divided among.
pub(super) const DIVISIONS: u32 = 4;

impl World {
    /// The mass properties of a tool whose shape is filled evenly with this density, kg/m³, above 0.
    ///
    /// # Errors
    /// [`Error::StaleId`]. [`Error::InvalidArgument`]: the density is out of its range, or the tool is a plane.
    pub fn mass_of_density(&self, tool: ToolId, density: f32) -> Result<MassProperties> {
        MassProperties::of(&self.tools.get(tool.0)?.form, density)
    }

    /// Makes a tool dynamic, a rigid body of this mass that is at rest; `None`: kinematic, as tools are created.
    ///
    /// From the next step on gravity, [`World::apply_wrench`] and contact with bodies move a dynamic tool. It pushes tissue and is stopped by it with the
    /// same impulses, in every substep: so momentum is kept, and the step is stable however light or heavy the tool is beside the tissue. Pinned nodes
    /// stop it too. Tools do not meet each other. Bodies near it do not sleep. A new mass leaves its velocity.
    ///
    /// # Errors
    /// [`Error::StaleId`]. [`Error::InvalidArgument`]: a number is out of its range, the tool is a plane, something is attached to it, or a
    /// [`HapticHandle`](crate::HapticHandle) leads it. [`Error::OutOfMemory`].
    pub fn set_dynamic(&mut self, tool: ToolId, mass: Option<&MassProperties>) -> Result<()> {
        self.check_not_led(tool)?;
        let place = self.tools.place(tool.0)?;
        let it = self.tools.get(tool.0)?;
        let Some(mass) = mass else {
            let it = self.tools.get_mut(tool.0)?;
            it.rigid = None;
            return Ok(());
        };
        ensure!(!it.is_plane(), "tool is a plane: a plane cannot be dynamic");
        ensure!(
            !self.is_holding(place),
            "tool holds attachments: release them before it is dynamic"
        );
        let mut rigid = Rigid::new(mass, &it.pose)?;
        if let Some(before) = &it.rigid {
            let (velocity, spin) = before.velocity();
            rigid.set_velocity(velocity, spin);
        }
        let rigid = memory::boxed(rigid)?;
        self.reserve_dynamic(self.dynamic_count() + 1)?;
        let it = self.tools.get_mut(tool.0)?;
        it.rigid = Some(rigid);
        it.target = None;
        self.wake_near(tool)
    }

    /// The mass properties of a dynamic tool; `None`: the tool is kinematic.
    ///
    /// # Errors
    /// [`Error::StaleId`].
    pub fn mass_properties(&self, tool: ToolId) -> Result<Option<MassProperties>> {
        Ok(self.tools.get(tool.0)?.rigid.as_ref().map(|rigid| rigid.properties))
    }

    /// The velocity of a dynamic tool's centre of mass, m/s, and its angular velocity, rad/s, in world axes.
    ///
    /// # Errors
    /// [`Error::StaleId`]. [`Error::InvalidArgument`]: the tool is kinematic.
    pub fn tool_velocity(&self, tool: ToolId) -> Result<(Vec3, Vec3)> {
        self.tools.get(tool.0)?;
        Ok(self.rigid(tool)?.velocity())
    }

    /// Sets the velocity of a dynamic tool's centre of mass, m/s, and its angular velocity, rad/s, in world axes.
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

    /// Adds a force at a dynamic tool's centre of mass, N, and a torque about it, N m, in world axes, that act throughout the next step.
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

    /// Moves a tool at once, in metres, and turns it, `None`: as it is. Nothing is swept: what lies within it then is pushed out over the next steps.
    /// A dynamic tool keeps its velocity.
    ///
    /// # Errors
    /// [`Error::StaleId`]. [`Error::InvalidArgument`]: as in [`World::set_pose`], or something is attached to the tool.
    pub fn teleport(&mut self, tool: ToolId, position: Vec3, orientation: Option<Quat>) -> Result<()> {
        self.check_not_led(tool)?;
        let place = self.tools.place(tool.0)?;
        let pose = self.tools.get(tool.0)?.pose.moved(position, orientation)?;
        ensure!(
            !self.is_holding(place),
            "tool holds attachments: release them before it is moved at once"
        );
        self.wake_near(tool)?;
        let it = self.tools.get_mut(tool.0)?;
        (it.pose, it.led_to, it.target) = (pose, pose, None);
        if let Some(rigid) = &mut it.rigid {
            rigid.place(&pose);
        }
        for contacts in self.contacts_mut() {
            contacts.look_again();
            contacts.holds.forget_tool(place);
        }
        self.wake_near(tool)
    }

    fn rigid(&self, tool: ToolId) -> Result<&Rigid> {
        let it = self.tools.get(tool.0)?;
        it.rigid.as_deref().ok_or_else(|| kinematic(tool))
    }

    fn rigid_mut(&mut self, tool: ToolId) -> Result<&mut Rigid> {
        let it = self.tools.get_mut(tool.0)?;
        it.rigid.as_deref_mut().ok_or_else(|| kinematic(tool))
    }

    /// Refuses a dynamic tool, for what leads one.
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

    /// Makes room for so many dynamic tools.
    pub(super) fn reserve_dynamic(&mut self, count: usize) -> Result<()> {
        memory::reserve(&mut self.dynamic, count)?;
        let tools = self.tools.places();
        self.contacts_mut()
            .try_for_each(|contacts| contacts.reserve_dynamic(tools, count))
    }

    /// Begins a step: each dynamic tool is divided among the bodies that it pressed in the last.
    pub(super) fn divide_as_before(&mut self) {
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

    /// Whether each dynamic tool was divided among as many bodies as it pressed in the step that was tried; else it is in the next try. After so many
    /// `rounds` it is divided among all, which is always enough.
    pub(super) fn are_divided(&mut self, rounds: u32) -> bool {
        let mut are_divided = true;
        for tool in &mut self.dynamic {
            let taken = self.bodies.iter().filter(|&(place, _)| is_done(&self.outcomes[place]));
            let pressed = taken.filter(|(_, body)| {
                let contacts = body.system().contacts.as_ref();
                contacts.is_some_and(|contacts| contacts.loads()[tool.index].impulse != DVec3::ZERO)
            });
            let pressed = pressed.count().max(1) as u32;
            let is_divided = pressed == tool.shares || rounds > 0 && pressed < tool.shares;
            if is_divided || rounds >= DIVISIONS {
                continue;
            }
            let Some((_, it)) = self.tools.iter().nth(tool.index) else {
                continue;
            };
            let shares = if rounds + 1 < DIVISIONS {
                pressed
            } else {
                self.bodies.iter().count() as u32
            };
            if let Some(rigid) = &it.rigid {
                *tool = DynamicTool::new(tool.index, rigid, self.definition.gravity, shares);
            }
            are_divided = false;
        }
        are_divided
    }

    /// Has the ways of dynamic tools be those of a free flight.
    pub(super) fn plan_flights(&mut self, dt: f32) {
        for tool in &self.dynamic {
            tool.plan(&mut self.paths[tool.index], dt);
        }
    }

    /// Puts together where bodies moved each dynamic tool.
    pub(super) fn end_flights(&mut self, dt: f32) {
        let mut rigid = self
            .tools
            .iter_mut()
            .filter_map(|(_, tool)| Some((tool.rigid.as_deref_mut()?, &mut tool.pose, &mut tool.led_to)));
        for tool in &self.dynamic {
            let Some((rigid, pose, led_to)) = rigid.next() else {
                break;
            };
            let taken = self.bodies.iter().filter(|&(place, _)| is_done(&self.outcomes[place]));
            let ends = taken.flat_map(|(_, body)| body.system().contacts.iter());
            let ends = ends.filter_map(|contacts| contacts.dynamic_end(tool.index, dt));
            rigid.arrive(tool.joined(dt, ends));
            *pose = rigid.motion.pose(&rigid.mass);
            *led_to = *pose;
        }
    }
}

fn is_done(outcome: &Option<Outcome>) -> bool {
    matches!(outcome, Some(Outcome::Done { .. }))
}

fn kinematic(tool: ToolId) -> Error {
    Error::invalid(format!("tool is {}: it is kinematic", tool.0))
}
