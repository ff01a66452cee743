//! What a caller reads of a world, of its tools and blades, and keeps with them.

use super::World;
use crate::base::{AttachmentId, BladeId, BodyId, Result, ToolId};
use crate::contact::Pose;
use crate::def::CollisionFilter;

impl World {
    /// The sum of the lengths of the steps that were taken, s.
    pub fn time(&self) -> f64 {
        self.clock.time
    }

    /// How many steps were taken.
    pub fn step_count(&self) -> u64 {
        self.clock.step
    }

    /// Whether a body is there: not destroyed, and of this world as far as its id tells.
    pub fn has_body(&self, body: BodyId) -> bool {
        self.bodies.get(body.0).is_ok()
    }

    /// Whether a tool is there.
    pub fn has_tool(&self, tool: ToolId) -> bool {
        self.tools.get(tool.0).is_ok()
    }

    /// Whether a blade is there.
    pub fn has_blade(&self, blade: BladeId) -> bool {
        self.blades.get(blade.0).is_ok()
    }

    /// Whether an attachment or a suture holds: not released, broken, or gone with what it held.
    pub fn has_attachment(&self, attachment: AttachmentId) -> bool {
        self.attachments.get(attachment.0).is_ok()
    }

    /// The Coulomb coefficient of a tool.
    ///
    /// # Errors
    /// [`Error::StaleId`](crate::Error::StaleId).
    pub fn friction(&self, tool: ToolId) -> Result<f32> {
        Ok(self.tools.get(tool.0)?.friction)
    }

    /// The largest force that moves a tool, N; infinity: unlimited.
    ///
    /// # Errors
    /// [`Error::StaleId`](crate::Error::StaleId).
    pub fn force_limit(&self, tool: ToolId) -> Result<f32> {
        Ok(self.tools.get(tool.0)?.force_limit)
    }

    /// What a tool meets.
    ///
    /// # Errors
    /// [`Error::StaleId`](crate::Error::StaleId).
    pub fn collision_filter(&self, tool: ToolId) -> Result<CollisionFilter> {
        Ok(self.tools.get(tool.0)?.filter)
    }

    /// Where a blade is.
    ///
    /// # Errors
    /// [`Error::StaleId`](crate::Error::StaleId).
    pub fn blade_pose(&self, blade: BladeId) -> Result<Pose> {
        Ok(self.blades.get(blade.0)?.pose)
    }

    /// What the caller keeps with the world: 0 unless it was set, and after a snapshot.
    pub fn user_data(&self) -> usize {
        self.user_data
    }

    /// Keeps a number or a pointer of the caller's with the world; it changes no motion.
    pub fn set_user_data(&mut self, data: usize) {
        self.user_data = data;
    }

    /// What the caller keeps with a tool: 0 unless it was set, and after a snapshot.
    ///
    /// # Errors
    /// [`Error::StaleId`](crate::Error::StaleId).
    pub fn tool_user_data(&self, tool: ToolId) -> Result<usize> {
        Ok(self.tools.get(tool.0)?.user_data)
    }

    /// Keeps a number or a pointer of the caller's with a tool; it changes no motion.
    ///
    /// # Errors
    /// [`Error::StaleId`](crate::Error::StaleId).
    pub fn set_tool_user_data(&mut self, tool: ToolId, data: usize) -> Result<()> {
        self.tools.get_mut(tool.0)?.user_data = data;
        Ok(())
    }
}
