//! The tools of a world.

use glam::{DVec3, Quat, Vec3};

use super::World;
#[cfg(doc)]
use crate::base::Error;
use crate::base::{BladeId, BodyId, Result, ToolId};
use crate::contact::{
    BladeContactChange, BodyContactChange, Contact, ContactChange, Contacts, Pose, Tool, ToolCapacity, ToolDefinition,
    ToolPath,
};
use crate::def::CollisionFilter;

impl World {
    /// Adds a tool.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: a value of the definition is out of range. [`Error::Unsupported`]: this version
    /// does not offer its detection. [`Error::OutOfMemory`].
    pub fn create_tool(&mut self, definition: &ToolDefinition) -> Result<ToolId> {
        let tool = Tool::new(definition)?;
        let count = self.tools.slot_count() + 1;
        let has_meshes = tool.is_mesh() || self.tools.iter().any(|(_, tool)| tool.is_mesh());
        let tools = ToolCapacity { count, has_meshes };
        self.paths.try_reserve(count)?;
        let made = self
            .bodies
            .iter_mut()
            .try_for_each(|(_, body)| body.make_contacts(tools));
        let id = made.and_then(|()| self.tools.insert(tool));
        if id.is_err() && self.tool_places().is_none() {
            self.drop_contacts();
        }
        let id = ToolId(id?);
        let index = self.tool_index(id)?;
        self.contacts_mut().for_each(|contacts| contacts.add_tool(index));
        self.wake_near(id)?;
        Ok(id)
    }

    /// The tool contacts of all bodies.
    pub(super) fn contacts_mut(&mut self) -> impl Iterator<Item = &mut Contacts> {
        let bodies = self.bodies.iter_mut();
        bodies.filter_map(|(_, body)| body.system_mut().contacts.as_deref_mut())
    }

    /// The number of tools before this one.
    fn tool_index(&self, tool: ToolId) -> Result<usize> {
        let slot = self.tools.slot(tool.0)?;
        Ok(self.tools.iter().take_while(|&(other, _)| other < slot).count())
    }

    /// Wakes the tissue near a tool that collides with it.
    pub(super) fn wake_near(&mut self, tool: ToolId) -> Result<()> {
        let path = ToolPath::new(self.tools.slot(tool.0)?, self.tools.get(tool.0)?);
        let bodies = self.bodies.iter_mut();
        bodies.for_each(|(_, body)| body.system_mut().wake_near(&path));
        Ok(())
    }

    /// Removes a tool and its attachments.
    ///
    /// # Errors
    /// [`Error::StaleId`].
    pub fn destroy_tool(&mut self, tool: ToolId) -> Result<()> {
        let (slot, index) = (self.tools.slot(tool.0)?, self.tool_index(tool)?);
        self.wake_near(tool)?;
        self.tools.remove(tool.0)?;
        // The paths share the memory of a mesh.
        self.paths.clear();
        self.remove_haptics_of(tool);
        self.release_all_of(tool);
        if self.tool_places().is_none() {
            self.drop_contacts();
        }
        self.contacts_mut()
            .for_each(|contacts| contacts.forget_tool(slot, index));
        Ok(())
    }

    /// The room that contacts need for the tools; `None` without tools.
    pub(super) fn tool_places(&self) -> Option<ToolCapacity> {
        self.tools.iter().next().map(|_| ToolCapacity {
            count: self.tools.slot_count(),
            has_meshes: self.tools.iter().any(|(_, tool)| tool.is_mesh()),
        })
    }

    /// Frees the tool contacts of all bodies.
    fn drop_contacts(&mut self) {
        let bodies = self.bodies.iter_mut();
        bodies.for_each(|(_, body)| body.system_mut().contacts = None);
    }

    /// Moves a tool to `position`, m, over the next step, and rotates it to `orientation`; `None` keeps its
    /// orientation. Tissue gives way. If the force limit stops the tool short, the rest of the motion is dropped; call
    /// `set_pose` again to continue.
    ///
    /// # Errors
    /// [`Error::StaleId`]. [`Error::InvalidArgument`]: a number is not finite, a coordinate is further than 1e9 m from
    /// 0, the orientation is zero, a [`HapticHandle`](crate::HapticHandle) moves the tool, or it is dynamic.
    pub fn set_pose(&mut self, tool: ToolId, position: Vec3, orientation: Option<Quat>) -> Result<()> {
        self.check_not_led(tool)?;
        self.check_kinematic(tool)?;
        let tool = self.tools.get_mut(tool.0)?;
        let pose = tool.target.unwrap_or(tool.pose);
        tool.target = Some(pose.moved(position, orientation)?);
        Ok(())
    }

    /// Sets the Coulomb friction coefficient of a tool, at least 0, from the next step on.
    ///
    /// # Errors
    /// [`Error::StaleId`]. [`Error::InvalidArgument`]: it is below 0 or not finite.
    pub fn set_friction(&mut self, tool: ToolId, friction: f32) -> Result<()> {
        self.tools.get_mut(tool.0)?.set_friction(friction)?;
        self.wake_near(tool)
    }

    /// Sets the largest force that moves a tool, N, at least 0, from the next step on. With 0 or infinity there is no
    /// limit.
    ///
    /// # Errors
    /// [`Error::StaleId`]. [`Error::InvalidArgument`]: it is below 0 or not a number.
    pub fn set_force_limit(&mut self, tool: ToolId, limit: f32) -> Result<()> {
        self.tools.get_mut(tool.0)?.set_force_limit(limit)
    }

    /// Sets which bodies a tool collides with, from the next step on. Tissue inside the tool is then pushed out.
    ///
    /// # Errors
    /// [`Error::StaleId`].
    pub fn set_collision_filter(&mut self, tool: ToolId, filter: CollisionFilter) -> Result<()> {
        // Tissue under the old filter can be released, and tissue under the new one can be pushed.
        self.wake_near(tool)?;
        self.tools.get_mut(tool.0)?.filter = filter;
        self.wake_near(tool)?;
        self.contacts_mut()
            .for_each(|contacts| contacts.invalidate_candidates());
        Ok(())
    }

    /// The pose of a tool.
    ///
    /// # Errors
    /// [`Error::StaleId`].
    pub fn pose(&self, tool: ToolId) -> Result<Pose> {
        Ok(self.tools.get(tool.0)?.pose)
    }

    /// The pose that the last step moved a tool to. It differs from the tool's pose only if a force limit has stopped
    /// the tool. Passing these poses to [`World::set_pose`] step by step repeats the motion in another world, such as
    /// the motion by a [`HapticHandle`](crate::HapticHandle).
    ///
    /// # Errors
    /// [`Error::StaleId`].
    pub fn tool_target(&self, tool: ToolId) -> Result<Pose> {
        Ok(self.tools.get(tool.0)?.last_target)
    }

    /// The force and the torque on a tool about its position, world axes, mean over the last step, N and N m.
    ///
    /// # Errors
    /// [`Error::StaleId`].
    pub fn wrench(&self, tool: ToolId) -> Result<(Vec3, Vec3)> {
        let tool = self.tools.get(tool.0)?;
        Ok((tool.force, tool.torque))
    }

    /// A bound on the error of the force on a tool from unsolved equations of the last step, N. It is 0 if only VERLET
    /// bodies press the tool. It does not include the errors of the mesh and of the step length.
    ///
    /// # Errors
    /// [`Error::StaleId`].
    pub fn force_error(&self, tool: ToolId) -> Result<f32> {
        Ok(self.tools.get(tool.0)?.force_error)
    }

    pub(crate) fn tool_ids(&self) -> impl Iterator<Item = ToolId> {
        self.tools.iter_ids().map(|(id, _)| ToolId(id))
    }

    /// The shapes and poses of all tools.
    pub(crate) fn tools(&self) -> impl Iterator<Item = &Tool> {
        self.tools.iter().map(|(_, tool)| tool)
    }

    /// The contacts of a tool with bodies at the end of the last step.
    ///
    /// # Errors
    /// [`Error::StaleId`].
    pub fn contacts(&self, tool: ToolId) -> Result<impl Iterator<Item = Contact>> {
        let slot = self.tools.slot(tool.0)?;
        let bodies = self.bodies.iter_ids();
        Ok(bodies.flat_map(move |(id, body)| body.contacts_with(slot, BodyId(id))))
    }

    /// The contacts of a body with other bodies and with itself at the end of the last step. Points belong to the other
    /// body; forces act on this one. Sleeping bodies have no contacts.
    ///
    /// # Errors
    /// [`Error::StaleId`](crate::Error::StaleId).
    pub fn tissue_contacts(&self, body: BodyId) -> Result<impl Iterator<Item = Contact>> {
        let slot = self.bodies.slot(body.0)?;
        let touches = self
            .deformable_contact
            .iter()
            .flat_map(|deformable_contact| deformable_contact.contact_reports.iter());
        Ok(touches.flat_map(move |touch| {
            let sides = [(0, 1.0), (1, -1.0)].into_iter();
            sides.filter_map(move |(own, sign)| {
                let other = &touch.sides[1 - own];
                if touch.sides[own].body != slot {
                    return None;
                }
                let (id, content) = (self.bodies.id_at(other.body)?, self.bodies.at(other.body)?);
                // A snapshot can contain any number.
                let are_there = other.nodes.iter().all(|&node| (node as usize) < content.node_count());
                are_there.then(|| Contact {
                    normal: touch.normal * -sign,
                    force: touch.force * sign,
                    ..content.contact_at(BodyId(id), other.nodes, other.weights)
                })
            })
        }))
    }

    /// The bodies that a blade pressed in the last step, with the mean of their hold points and the force on the blade.
    /// They have no nodes.
    ///
    /// # Errors
    /// [`Error::StaleId`](crate::Error::StaleId).
    pub fn blade_contacts(&self, blade: BladeId) -> Result<impl Iterator<Item = Contact>> {
        let pressed = self.blades.get(blade.0)?.proxies.iter();
        let pressed = pressed.filter(|proxy| proxy.force_on_blade != DVec3::ZERO);
        Ok(pressed.map(|proxy| Contact {
            body: proxy.body,
            nodes: [u32::MAX; 3],
            weights: [0.0; 3],
            point: proxy.force_point.as_vec3(),
            normal: Vec3::ZERO,
            force: proxy.force_on_blade.as_vec3().clamp(Vec3::MIN, Vec3::MAX),
        }))
    }

    /// The pairs of tool and body whose contact began or ended in the last step. Destroying a tool or body ends no
    /// contact.
    pub fn contact_changes(&self) -> impl Iterator<Item = ContactChange> {
        self.bodies.iter_ids().flat_map(move |(body, content)| {
            self.tools.iter_ids().filter_map(move |(tool, _)| {
                let slot = tool.index1 as usize - 1;
                let [now, before] = content.system().contacts.as_ref()?.touched(slot);
                (now != before).then_some(ContactChange {
                    tool: ToolId(tool),
                    body: BodyId(body),
                    has_begun: now,
                })
            })
        })
    }

    /// The pairs of bodies whose contact began or ended in the last step. Sleeping bodies stay in contact. Destroying a
    /// body ends no contact.
    pub fn body_contact_changes(&self) -> impl Iterator<Item = BodyContactChange> {
        let pairs = self
            .deformable_contact
            .iter()
            .flat_map(|deformable_contact| deformable_contact.touching_pairs.changes());
        pairs.filter_map(|pair| {
            let [one, other] = pair.bodies.map(|slot| self.bodies.id_at(slot).map(BodyId));
            Some(BodyContactChange {
                bodies: [one?, other?],
                has_begun: pair.touched[0],
            })
        })
    }

    /// The pairs of blade and body whose contact began or ended in the last step. Destroying a blade or body ends no
    /// contact.
    pub fn blade_contact_changes(&self) -> impl Iterator<Item = BladeContactChange> {
        self.blades.iter_ids().flat_map(|(blade, content)| {
            let changed = content
                .proxies
                .iter()
                .filter(|proxy| proxy.touched[0] != proxy.touched[1]);
            changed.map(move |proxy| BladeContactChange {
                blade: BladeId(blade),
                body: proxy.body,
                has_begun: proxy.touched[0],
            })
        })
    }
}
