//! Getters of a world, its tools and blades, and user data.

use super::World;
use crate::base::{AttachmentId, BladeId, BodyId, Result, ToolId};
use crate::contact::Pose;
use crate::def::CollisionFilter;

impl World {
    /// The simulated time: the sum of all step lengths, s.
    pub fn time(&self) -> f64 {
        self.clock.time
    }

    /// The number of steps taken.
    pub fn step_count(&self) -> u64 {
        self.clock.step
    }

    /// True if the body exists in this world.
    pub fn has_body(&self, body: BodyId) -> bool {
        self.bodies.get(body.0).is_ok()
    }

    /// True if the tool exists.
    pub fn has_tool(&self, tool: ToolId) -> bool {
        self.tools.get(tool.0).is_ok()
    }

    /// True if the blade exists.
    pub fn has_blade(&self, blade: BladeId) -> bool {
        self.blades.get(blade.0).is_ok()
    }

    /// True if an attachment or suture exists: not released, broken, or destroyed with a body or tool.
    pub fn has_attachment(&self, attachment: AttachmentId) -> bool {
        self.attachments.get(attachment.0).is_ok()
    }

    /// The Coulomb friction coefficient of a tool.
    ///
    /// # Errors
    /// [`Error::StaleId`](crate::Error::StaleId).
    pub fn friction(&self, tool: ToolId) -> Result<f32> {
        Ok(self.tools.get(tool.0)?.friction)
    }

    /// The largest force that moves a tool, N; infinity without a limit.
    ///
    /// # Errors
    /// [`Error::StaleId`](crate::Error::StaleId).
    pub fn force_limit(&self, tool: ToolId) -> Result<f32> {
        Ok(self.tools.get(tool.0)?.force_limit)
    }

    /// Which bodies a tool collides with.
    ///
    /// # Errors
    /// [`Error::StaleId`](crate::Error::StaleId).
    pub fn collision_filter(&self, tool: ToolId) -> Result<CollisionFilter> {
        Ok(self.tools.get(tool.0)?.filter)
    }

    /// The pose of a blade.
    ///
    /// # Errors
    /// [`Error::StaleId`](crate::Error::StaleId).
    pub fn blade_pose(&self, blade: BladeId) -> Result<Pose> {
        Ok(self.blades.get(blade.0)?.pose)
    }

    /// The user data of the world; 0 unless set, and 0 after loading a snapshot.
    pub fn user_data(&self) -> usize {
        self.user_data
    }

    /// Sets the user data of the world: a number or pointer that the library does not use.
    pub fn set_user_data(&mut self, data: usize) {
        self.user_data = data;
    }

    /// The user data of a tool; 0 unless set, and 0 after loading a snapshot.
    ///
    /// # Errors
    /// [`Error::StaleId`](crate::Error::StaleId).
    pub fn tool_user_data(&self, tool: ToolId) -> Result<usize> {
        Ok(self.tools.get(tool.0)?.user_data)
    }

    /// Sets the user data of a tool: a number or pointer that the library does not use.
    ///
    /// # Errors
    /// [`Error::StaleId`](crate::Error::StaleId).
    pub fn set_tool_user_data(&mut self, tool: ToolId, data: usize) -> Result<()> {
        self.tools.get_mut(tool.0)?.user_data = data;
        Ok(())
    }
}
