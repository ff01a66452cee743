//! Attachments: what tools hold of bodies, by their names.

use glam::{DVec3, Vec3};

use super::{BodyId, ToolId, World};
use crate::error::{Error, Result};
use crate::memory;
use crate::slots::SlotId;
use crate::solver::Outcome;

/// What a tool holds of a body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct AttachmentId(pub(crate) SlotId);

/// Whose attachment it is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Attachment {
    body: BodyId,
    tool: ToolId,
}

impl World {
    /// Attaches a node of a body to a tool: [`World::attach_nodes`] for one.
    ///
    /// # Errors
    /// As there.
    pub fn attach_node(&mut self, body: BodyId, node: u32, tool: ToolId, force_limit: f32) -> Result<AttachmentId> {
        Ok(self.attach_nodes(body, &[node], tool, force_limit)?[0])
    }

    /// Attaches nodes of a body to a tool, each by an attachment of its own: where they lie they become part of the tool, which carries
    /// them along and turns them, exactly and whatever the solver, until [`World::release`]. Their velocities become the tool's in the
    /// next step.
    ///
    /// What it takes to hold them, with their mass and what damps them, is part of the tool's wrench. The tool does not touch them any
    /// more, nor edges and faces that have one of them. `force_limit`, N: an attachment ends with the step in which its mean force was
    /// larger, and the node goes on as it was led ([`World::slipped`]); 0 or infinite: it holds whatever comes.
    ///
    /// An attached node cannot be pinned, and its position can be set: then it is attached where it was put. It ends with its body and
    /// with its tool.
    ///
    /// # Errors
    /// [`Error::StaleId`]. [`Error::InvalidArgument`]: there is no such node, it is pinned, without mass, attached already or named more
    /// than once, or the limit is negative or not a number. [`Error::OutOfMemory`]. Nothing is attached then.
    pub fn attach_nodes(
        &mut self,
        body: BodyId,
        nodes: &[u32],
        tool: ToolId,
        force_limit: f32,
    ) -> Result<Vec<AttachmentId>> {
        self.tools.get(tool.0)?;
        if force_limit.is_nan() || force_limit < 0.0 {
            return Err(Error::invalid(format!(
                "force_limit is {force_limit}: must be at least 0"
            )));
        }
        let held = self.bodies.get_mut(body.0)?;
        held.check_graspable(nodes)?;
        let mut ids = memory::reserved(nodes.len())?;
        held.reserve_grasps(nodes.len())?;
        // All may slip in one step.
        let count = self.attachments.iter().count() + nodes.len();
        self.slipped.try_reserve(count)?;
        for _ in nodes {
            match self.attachments.insert(Attachment { body, tool }) {
                Ok(id) => ids.push(AttachmentId(id)),
                Err(error) => {
                    for AttachmentId(id) in ids {
                        self.attachments.remove(id)?;
                    }
                    return Err(error);
                }
            }
        }
        held.grasp(tool.0.index(), nodes, ids.iter().map(|id| id.0), force_limit)?;
        Ok(ids)
    }

    /// Lets go of what is attached: it goes on as it was led in the last step.
    ///
    /// # Errors
    /// [`Error::StaleId`]: it was let go already, or slipped, or its body or its tool is gone.
    pub fn release(&mut self, attachment: AttachmentId) -> Result<()> {
        let Attachment { body, .. } = self.attachments.remove(attachment.0)?;
        self.bodies.get_mut(body.0)?.let_go(attachment.0);
        Ok(())
    }

    /// The force by which a tool holds what is attached, on the tissue, world axes, mean over the last step, N; 0 before the first.
    /// Where the state of the body was set to one of rest it is that which holds it there.
    ///
    /// # Errors
    /// [`Error::StaleId`].
    pub fn attachment_force(&self, attachment: AttachmentId) -> Result<Vec3> {
        let Attachment { body, .. } = self.attachments.get(attachment.0)?;
        let body = self.bodies.get(body.0)?;
        let found = body.grasps().find(|grasp| grasp.id == attachment.0);
        Ok(found.map_or(Vec3::ZERO, |grasp| grasp.force))
    }

    /// The attachments that ended with the last step, because it took more to hold them than their limit. Their ids are stale.
    pub fn slipped(&self) -> &[AttachmentId] {
        &self.slipped
    }

    /// The force on some tools together, and the torque about a point, world axes, mean over the last step, N and N m: of the two jaws of
    /// a forceps, say.
    ///
    /// # Errors
    /// [`Error::StaleId`]. [`Error::InvalidArgument`]: a tool is named more than once, or the point is not finite.
    pub fn wrench_about(&self, tools: &[ToolId], point: Vec3) -> Result<(Vec3, Vec3)> {
        crate::body::finite_vector("point", point)?;
        let (mut force, mut torque) = (DVec3::ZERO, DVec3::ZERO);
        for (index, tool) in tools.iter().enumerate() {
            if tools[..index].contains(tool) {
                return Err(Error::invalid(format!("tools[{index}] is named before")));
            }
            let tool = self.tools.get(tool.0)?;
            let arm = tool.pose.position.as_dvec3() - point.as_dvec3();
            force += tool.force.as_dvec3();
            torque += tool.torque.as_dvec3() + arm.cross(tool.force.as_dvec3());
        }
        let finite = |sum: DVec3| sum.as_vec3().clamp(Vec3::MIN, Vec3::MAX);
        Ok((finite(force), finite(torque)))
    }

    /// A body is gone, and with it what is attached of it.
    pub(super) fn forget_attachments_of(&mut self, body: BodyId) {
        self.attachments.retain(|attachment| attachment.body != body);
    }

    /// A tool is gone: lets go of what is attached to it.
    pub(super) fn release_all_of(&mut self, tool: ToolId) {
        let Self {
            attachments, bodies, ..
        } = self;
        attachments.retain(|attachment| attachment.tool != tool);
        for (_, body) in bodies.iter_mut() {
            body.let_go_of(tool.0.index());
        }
    }

    /// Ends what the last step was too much for.
    pub(super) fn end_slipped(&mut self) {
        let Self {
            bodies,
            attachments,
            slipped,
            outcomes,
            ..
        } = self;
        slipped.clear();
        for (place, body) in bodies.iter_mut() {
            if let Some(Outcome::Done { .. }) = outcomes[place] {
                body.slip(|id| {
                    if attachments.remove(id).is_ok() {
                        slipped.push(AttachmentId(id));
                    }
                });
            }
        }
    }
}
