//! The tools of a world.

use glam::{DVec3, Quat, Vec3};

use super::World;
#[cfg(doc)]
use crate::base::Error;
use crate::base::{BladeId, BodyId, Result, ToolId};
use crate::contact::{
    BladeContactChange, BodyContactChange, Contact, ContactChange, Contacts, Pose, Tool, ToolDefinition, ToolPath,
    ToolPlaces,
};
use crate::def::CollisionFilter;

impl World {
    /// Adds a tool.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: something in the definition is out of its range. [`Error::Unsupported`]: this version
    /// does not offer its detection. [`Error::OutOfMemory`].
    pub fn create_tool(&mut self, definition: &ToolDefinition) -> Result<ToolId> {
        let tool = Tool::new(definition)?;
        let count = self.tools.places() + 1;
        let has_meshes = tool.is_mesh() || self.tools.iter().any(|(_, tool)| tool.is_mesh());
        let tools = ToolPlaces { count, has_meshes };
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

    /// What bodies keep of contacts with tools.
    pub(super) fn contacts_mut(&mut self) -> impl Iterator<Item = &mut Contacts> {
        let bodies = self.bodies.iter_mut();
        bodies.filter_map(|(_, body)| body.system_mut().contacts.as_deref_mut())
    }

    /// How many tools come before this one.
    fn tool_index(&self, tool: ToolId) -> Result<usize> {
        let slot = self.tools.place(tool.0)?;
        Ok(self.tools.iter().take_while(|&(place, _)| place < slot).count())
    }

    /// Wakes what a tool meets and is near to.
    pub(super) fn wake_near(&mut self, tool: ToolId) -> Result<()> {
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
        if self.tool_places().is_none() {
            self.drop_contacts();
        }
        self.contacts_mut()
            .for_each(|contacts| contacts.forget_tool(slot, index));
        Ok(())
    }

    /// What contacts need for tools; `None`: there are none.
    pub(super) fn tool_places(&self) -> Option<ToolPlaces> {
        self.tools.iter().next().map(|_| ToolPlaces {
            count: self.tools.places(),
            has_meshes: self.tools.iter().any(|(_, tool)| tool.is_mesh()),
        })
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
        tool.target = Some(pose.moved(position, orientation)?);
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

    /// How far the force on a tool may be, at most, from what the equations of the last step ask for, N; 0 where bodies of VERLET press it alone, which
    /// solve none. It says nothing of what the mesh and the step's length cost.
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

    /// Where a tool pressed bodies when the last step ended.
    ///
    /// # Errors
    /// [`Error::StaleId`].
    pub fn contacts(&self, tool: ToolId) -> Result<impl Iterator<Item = Contact>> {
        let slot = self.tools.place(tool.0)?;
        let bodies = self.bodies.iter_ids();
        Ok(bodies.flat_map(move |(id, body)| body.contacts_with(slot, BodyId(id))))
    }

    /// Where a body was pressed by other bodies, or by itself, when the last step ended, as if it were a tool: with points of the others and
    /// forces on it. Bodies that sleep have none.
    ///
    /// # Errors
    /// [`Error::StaleId`](crate::Error::StaleId).
    pub fn tissue_contacts(&self, body: BodyId) -> Result<impl Iterator<Item = Contact>> {
        let place = self.bodies.place(body.0)?;
        let touches = self.tissue.iter().flat_map(|tissue| tissue.touches.iter());
        Ok(touches.flat_map(move |touch| {
            let sides = [(0, 1.0), (1, -1.0)].into_iter();
            sides.filter_map(move |(own, sign)| {
                let other = &touch.sides[1 - own];
                if touch.sides[own].body != place {
                    return None;
                }
                let (id, content) = (self.bodies.id_at(other.body)?, self.bodies.at(other.body)?);
                // A snapshot may hold any number.
                let are_there = other.nodes.iter().all(|&node| (node as usize) < content.node_count());
                are_there.then(|| Contact {
                    normal: touch.normal * -sign,
                    force: touch.force * sign,
                    ..content.contact_at(BodyId(id), other.nodes, other.weights)
                })
            })
        }))
    }

    /// The bodies that a blade pressed in the last step: the mean of the points that it held, without nodes, and the force on the blade.
    ///
    /// # Errors
    /// [`Error::StaleId`](crate::Error::StaleId).
    pub fn blade_contacts(&self, blade: BladeId) -> Result<impl Iterator<Item = Contact>> {
        let pressed = self.blades.get(blade.0)?.proxies.iter();
        let pressed = pressed.filter(|proxy| proxy.felt != DVec3::ZERO);
        Ok(pressed.map(|proxy| Contact {
            body: proxy.body,
            nodes: [u32::MAX; 3],
            weights: [0.0; 3],
            point: proxy.felt_at.as_vec3(),
            normal: Vec3::ZERO,
            force: proxy.felt.as_vec3().clamp(Vec3::MIN, Vec3::MAX),
        }))
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
                    has_begun: now,
                })
            })
        })
    }

    /// The bodies that began or ceased to touch each other in the last step. Bodies that sleep go on touching; with one that was destroyed nothing
    /// ceases.
    pub fn body_contact_changes(&self) -> impl Iterator<Item = BodyContactChange> {
        let pairs = self.tissue.iter().flat_map(|tissue| tissue.touching.changes());
        pairs.filter_map(|pair| {
            let [one, other] = pair.bodies.map(|place| self.bodies.id_at(place).map(BodyId));
            Some(BodyContactChange {
                bodies: [one?, other?],
                has_begun: pair.touched[0],
            })
        })
    }

    /// The blades and bodies of which contact began or ceased in the last step: with a blade or body that was destroyed nothing ceases.
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
