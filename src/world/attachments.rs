//! Attachments of bodies to tools and to each other, by their ids.

use std::fmt::from_fn;

use glam::{DVec3, Vec3};

use super::{World, reserve_coupling};
use crate::base::{AttachmentId, BodyId, Error, Result, ToolId, ensure, memory};
use crate::codec::{saved, saved_enum};
use crate::def::{Anchor, SurfacePoint};
use crate::deformable_contact::{AttachmentPoint, PointAttachments, SutureThread, are_one};
use crate::solver::AttachPoint;
use crate::solver::Outcome;

/// The two ends of an attachment.
#[derive(Clone, Copy, Debug)]
pub(super) struct Attachment {
    body: BodyId,
    holder: Holder,
}

saved! { Attachment { body, holder } }

/// What a body is attached to.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Holder {
    Tool(ToolId),
    /// The same body or another one.
    Body(BodyId),
}

saved_enum!(Holder { 0 => Tool(it), 1 => Body(it) });

/// Names an argument in error messages: an element of an array, or a single value. `prefix` begins its name.
#[derive(Clone, Copy)]
pub(super) struct Which<'a> {
    pub prefix: &'a str,
    pub index: Option<usize>,
}

impl Which<'_> {
    pub const ONLY: Self = Self {
        prefix: "",
        index: None,
    };

    fn name(&self, one: &str, many: &str) -> String {
        match self.index {
            Some(index) => format!("{}{many}[{index}]", self.prefix),
            None => format!("{}{one}", self.prefix),
        }
    }
}

/// The sum of a point's weights may differ from 1 by this much.
const WEIGHT_TOLERANCE: f32 = 1e-3;

impl World {
    /// Attaches one node of a body to a tool, as [`World::attach_nodes`] does for several.
    ///
    /// # Errors
    /// Those of [`World::attach_nodes`].
    pub fn attach_node(&mut self, body: BodyId, node: u32, tool: ToolId, force_limit: f32) -> Result<AttachmentId> {
        self.check_nodes(body, &[node], tool, |_| "node".into())?;
        Ok(self.attach(body, tool, [AttachPoint::of_node(node)].into_iter(), force_limit)?[0])
    }

    /// Attaches nodes of a body to a tool, with one attachment for each node. The nodes move rigidly with the tool from
    /// their current positions, with every solver, until [`World::release`]. In the next step they take the tool's
    /// velocity.
    ///
    /// The force on the nodes, with their inertia and damping, is part of the tool's wrench. The tool no longer
    /// collides with these nodes, nor with edges and faces that contain one of them. An attachment breaks in a step
    /// whose mean force exceeds `force_limit`, N; the node keeps its velocity ([`World::slipped`]). With 0 or infinity
    /// it never breaks.
    ///
    /// An attached node cannot be pinned. If its position is set, it stays attached at the new position. A tool can
    /// hold a node several times; the attachments then share the force. Destroying the body or the tool destroys the
    /// attachment.
    ///
    /// # Errors
    /// [`Error::StaleId`]. [`Error::InvalidArgument`]: a node does not exist, is pinned, massless or held by another
    /// tool, or the limit is negative or not a number. [`Error::OutOfMemory`]. After an error nothing is attached.
    pub fn attach_nodes(
        &mut self,
        body: BodyId,
        nodes: &[u32],
        tool: ToolId,
        force_limit: f32,
    ) -> Result<Vec<AttachmentId>> {
        self.check_nodes(body, nodes, tool, |index| format!("nodes[{index}]"))?;
        self.attach(body, tool, nodes.iter().copied().map(AttachPoint::of_node), force_limit)
    }

    /// Attaches points of a body's surface to a tool, with one attachment for each point. An attachment holds the
    /// corners of the point's triangle as [`World::attach_nodes`] does, except corners of weight 0. The triangle
    /// therefore cannot rotate relative to the tool. A point on an edge holds the edge; a point at a corner holds the
    /// node.
    ///
    /// The force of an attachment is the force on all its corners. Attachments that share a corner share its force by
    /// their weights.
    ///
    /// # Errors
    /// Those of [`World::attach_nodes`]. [`Error::InvalidArgument`] also if a triangle does not exist, or if weights
    /// are negative, not finite or do not sum to 1.
    pub fn attach_points(
        &mut self,
        body: BodyId,
        points: &[SurfacePoint],
        tool: ToolId,
        force_limit: f32,
    ) -> Result<Vec<AttachmentId>> {
        let surface = self.bodies.get(body.0)?.surface();
        let mut grips = memory::reserved(points.len())?;
        for (index, point) in points.iter().enumerate() {
            let index = Some(index);
            grips.push(grip_of(surface, Which { prefix: "", index }, point)?);
        }
        for (index, grip) in grips.iter().enumerate() {
            let held = grip.corners.into_iter().zip(grip.weights);
            for (corner, _) in held.filter(|(_, weight)| *weight > 0.0) {
                let name = |_| format!("a corner of triangles[{index}]");
                self.check_nodes(body, &[corner], tool, name)?;
            }
        }
        self.attach(body, tool, grips.into_iter(), force_limit)
    }

    /// Refuses nodes that this tool cannot hold. `name` names a node in the message.
    fn check_nodes(&self, body: BodyId, nodes: &[u32], tool: ToolId, name: impl Fn(usize) -> String) -> Result<()> {
        let body = self.bodies.get(body.0)?;
        self.check_kinematic(tool)?;
        for (index, &node) in nodes.iter().enumerate() {
            let name = from_fn(|to| to.write_str(&name(index)));
            body.check_node(&name, node)?;
            body.system().check_attachable(&name, node, tool.0.index())?;
        }
        Ok(())
    }

    /// Attaches points that have been checked.
    fn attach(
        &mut self,
        body: BodyId,
        tool: ToolId,
        grips: impl ExactSizeIterator<Item = AttachPoint>,
        force_limit: f32,
    ) -> Result<Vec<AttachmentId>> {
        self.check_kinematic(tool)?;
        let held = self.bodies.get_mut(body.0)?;
        check_limit(force_limit)?;
        let mut ids = memory::reserved(grips.len())?;
        // All can break in one step.
        let count = self.attachments.count() + grips.len();
        self.slipped.try_reserve(count)?;
        if grips.len() == 0 {
            return Ok(ids);
        }
        let holder = Holder::Tool(tool);
        let count = grips.len();
        let answer = held
            .system_mut()
            .reserve_tool_attachments(count)
            .and_then(|()| self.name(Attachment { body, holder }, count, &mut ids))
            .and_then(|()| {
                let named = ids.iter().map(|id| id.0).zip(grips);
                let system = self.bodies.get_mut(body.0)?.system_mut();
                system.attach_to_tool(tool.0.index(), named, force_limit)
            });
        if let Err(error) = answer {
            for AttachmentId(id) in ids.into_iter().rev() {
                self.attachments.undo_insert(id)?;
            }
            self.bodies.get_mut(body.0)?.system_mut().release_unused_attachments();
            return Err(error);
        }
        Ok(ids)
    }

    /// Creates the ids of `count` attachments; `ids` has room for them.
    fn name(&mut self, attachment: Attachment, count: usize, ids: &mut Vec<AttachmentId>) -> Result<()> {
        for _ in 0..count {
            match self.attachments.insert(attachment) {
                Ok(id) => ids.push(AttachmentId(id)),
                Err(error) => {
                    for AttachmentId(id) in ids.drain(..).rev() {
                        self.attachments.undo_insert(id)?;
                    }
                    return Err(error);
                }
            }
        }
        Ok(())
    }

    /// Attaches points of a body to points of another body, or of the same one, with one attachment for each pair. A
    /// point is a node or a point of the surface. From the next step on the two points coincide, with every solver.
    /// Points that are apart are drawn together within a few hundredths of a second, but at 0.25 m/s at most. Each body
    /// can rotate about the point; three attachments prevent rotation.
    ///
    /// The bodies take their substeps together. Those of [`Solver::Implicit`](crate::Solver::Implicit) and
    /// [`Solver::Newton`](crate::Solver::Newton) are 0.25 ms at most and first-order accurate. Momentum is conserved;
    /// so is angular momentum once the points coincide. Along an axis in which pins or tools hold both points the
    /// attachment does nothing. Features that share an attached pair do not collide with each other.
    ///
    /// An attachment breaks in a step whose mean force exceeds `force_limit`, N ([`World::slipped`]); with 0 or
    /// infinity it never breaks. [`World::attachment_force`] returns the force on `body`. Destroying either body
    /// destroys the attachment.
    ///
    /// The method is sequential impulses (Catto 2005). Between bodies of [`Solver::Verlet`](crate::Solver::Verlet) this
    /// is SHAKE (Ryckaert, Ciccotti, Berendsen 1977), with the other solvers a projection (Chorin 1968).
    ///
    /// # Errors
    /// [`Error::StaleId`]. [`Error::InvalidArgument`]: a node or triangle does not exist, weights are negative, not
    /// finite or do not sum to 1, the two points are the same, the two lists differ in length, or the limit is negative
    /// or not a number. [`Error::OutOfMemory`]. After an error nothing is attached.
    pub fn attach_to_body(
        &mut self,
        body: BodyId,
        anchors: &[Anchor],
        other: BodyId,
        other_anchors: &[Anchor],
        force_limit: f32,
    ) -> Result<Vec<AttachmentId>> {
        self.bodies.get(body.0)?;
        self.bodies.get(other.0)?;
        crate::def::expect_count("other_anchors", other_anchors.len(), anchors.len())?;
        check_limit(force_limit)?;
        let mut pairs = memory::reserved(anchors.len())?;
        for (index, (first, second)) in anchors.iter().zip(other_anchors).enumerate() {
            let index = Some(index);
            let [own, others] = ["", "other_"].map(|prefix| Which { prefix, index });
            let pair = [self.bound(body, own, first)?, self.bound(other, others, second)?];
            refuse_one_point(&pair, [own, others])?;
            pairs.push(pair);
        }
        self.bind([body, other], &pairs, force_limit, None)
    }

    /// Joins pairs of points that have been checked: by sutures like `thread`, or as one point.
    pub(super) fn bind(
        &mut self,
        bodies: [BodyId; 2],
        pairs: &[[AttachmentPoint; 2]],
        force_limit: f32,
        thread: Option<SutureThread>,
    ) -> Result<Vec<AttachmentId>> {
        let places = [self.bodies.slot(bodies[0].0)?, self.bodies.slot(bodies[1].0)?];
        let mut ids = memory::reserved(pairs.len())?;
        if pairs.is_empty() {
            return Ok(ids);
        }
        self.slipped.try_reserve(self.attachments.count() + pairs.len())?;
        for place in places {
            reserve_coupling(&mut self.coupled, place)?;
        }
        memory::get_or_box(&mut self.deformable_contact)?.reserve_attachments(places, pairs.len())?;
        for id in bodies {
            self.bodies.get_mut(id.0)?.system_mut().reserve_tissue_attachments()?;
        }
        let [body, other] = bodies;
        let holder = Holder::Body(other);
        self.name(Attachment { body, holder }, pairs.len(), &mut ids)?;
        for id in bodies {
            self.bodies.get_mut(id.0)?.system_mut().begin_tissue_attachments();
        }
        if let Some(point_attachments) = self.point_attachments_mut() {
            for (&AttachmentId(id), &pair) in ids.iter().zip(pairs) {
                point_attachments.add(id, pair, force_limit, thread)?;
            }
            point_attachments.rebuild_nodes();
        }
        Ok(ids)
    }

    /// A point of a body as a weighted mean of simulation nodes.
    pub(super) fn bound(&self, id: BodyId, which: Which, anchor: &Anchor) -> Result<AttachmentPoint> {
        let body = self.bodies.get(id.0)?;
        let grip = match anchor {
            Anchor::Node(node) => {
                body.check_node(&from_fn(|to| to.write_str(&which.name("node", "nodes"))), *node)?;
                AttachPoint::of_node(*node)
            }
            Anchor::Point(point) => grip_of(body.surface(), which, point)?,
        };
        let sum: f32 = grip.weights.iter().sum();
        // All corners of a triangle belong to one cell, so that four nodes are enough.
        let mut nodes = [(0, 0.0); 4];
        for (&corner, weight) in grip.corners.iter().zip(grip.weights) {
            for (node, part) in body.system().weighted_nodes_of(corner) {
                let is_its = |(known, share): &&mut (u32, f32)| *known == node || *share == 0.0;
                if weight * part != 0.0
                    && let Some(place) = nodes.iter_mut().find(is_its)
                {
                    *place = (node, place.1 + weight / sum * part);
                }
            }
        }
        Ok(AttachmentPoint {
            body: self.bodies.slot(id.0)?,
            anchor: Some(*anchor),
            nodes,
        })
    }

    /// A point inside a cell of a body. The nodes have the caller's numbers.
    pub(super) fn bound_inside(&self, id: BodyId, nodes: [u32; 4], weights: [f64; 4]) -> Result<AttachmentPoint> {
        let body = self.bodies.get(id.0)?;
        let sum: f64 = weights.iter().sum();
        let own = |node: u32| body.system().weighted_nodes_of(node).next().map_or(0, |(own, _)| own);
        Ok(AttachmentPoint {
            body: self.bodies.slot(id.0)?,
            anchor: None,
            nodes: std::array::from_fn(|k| (own(nodes[k]), (weights[k] / sum) as f32)),
        })
    }

    pub(super) fn point_attachments_mut(&mut self) -> Option<&mut PointAttachments> {
        self.deformable_contact
            .as_mut()
            .map(|deformable_contact| &mut deformable_contact.attachments)
    }

    /// Refuses a body that is attached to another.
    pub(super) fn check_not_attached(&self, body: BodyId) -> Result<()> {
        let place = self.bodies.slot(body.0)?;
        ensure!(
            !self
                .deformable_contact
                .as_ref()
                .is_some_and(|deformable_contact| deformable_contact.attachments.has_body(place)),
            "body is attached to a body: what holds it there moves with that one"
        );
        Ok(())
    }

    /// Destroys an attachment. The nodes keep the velocity that they had in the last step.
    ///
    /// # Errors
    /// [`Error::StaleId`]: it was already released or broken, or a body or the tool was destroyed.
    pub fn release(&mut self, attachment: AttachmentId) -> Result<()> {
        let Attachment { body, holder } = self.attachments.remove(attachment.0)?;
        match (holder, &mut self.deformable_contact) {
            (Holder::Body(_), Some(deformable_contact)) => {
                deformable_contact.attachments.remove(&mut self.bodies, attachment.0)
            }
            _ => self.bodies.get_mut(body.0)?.system_mut().detach(attachment.0),
        }
        Ok(())
    }

    /// The force of an attachment on its body, world axes, mean over the last step, N; 0 before the first step.
    /// After a body that tools hold was set to its static equilibrium, this is the force that holds it there.
    ///
    /// # Errors
    /// [`Error::StaleId`].
    pub fn attachment_force(&self, attachment: AttachmentId) -> Result<Vec3> {
        let Attachment { body, holder } = self.attachments.get(attachment.0)?;
        if let (Holder::Body(_), Some(deformable_contact)) = (holder, &self.deformable_contact) {
            return Ok(deformable_contact.attachments.force_of(attachment.0));
        }
        let body = self.bodies.get(body.0)?;
        let grasp = body
            .system()
            .tool_attachments
            .as_ref()
            .and_then(|tool_attachments| tool_attachments.get(attachment.0));
        Ok(grasp.map_or(Vec3::ZERO, |grasp| grasp.force))
    }

    /// Visits both ends of each attachment, m: a tool and a node, or two points of bodies.
    pub(crate) fn visit_attachments(&self, mut visit: impl FnMut([Vec3; 2])) {
        for (_, body) in self.bodies.iter() {
            for (node, tool) in body
                .system()
                .tool_attachments
                .iter()
                .flat_map(|tool_attachments| tool_attachments.attached_nodes())
            {
                if let Some(tool) = self.tools.at(tool) {
                    visit([tool.pose.position, body.positions()[body.system().caller_index(node)]]);
                }
            }
        }
        if let Some(deformable_contact) = &self.deformable_contact {
            deformable_contact
                .attachments
                .visit_points(&self.bodies, |ends| visit(ends.map(|end| end.as_vec3())));
        }
    }

    /// The attachments that broke in the last step because their force exceeded their limit. Their ids are stale.
    pub fn slipped(&self) -> &[AttachmentId] {
        &self.slipped
    }

    /// The total force on several tools, such as the two jaws of a forceps, and their torque about a point, world axes,
    /// mean over the last step, N and N m.
    ///
    /// # Errors
    /// [`Error::StaleId`]. [`Error::InvalidArgument`]: a tool is named more than once, or the point is not finite.
    pub fn wrench_about(&self, tools: &[ToolId], point: Vec3) -> Result<(Vec3, Vec3)> {
        crate::def::finite_vector("point", point)?;
        let (mut force, mut torque) = (DVec3::ZERO, DVec3::ZERO);
        for (index, tool) in tools.iter().enumerate() {
            ensure!(!tools[..index].contains(tool), "tools[{index}] is named before");
            let tool = self.tools.get(tool.0)?;
            let arm = tool.pose.position.as_dvec3() - point.as_dvec3();
            force += tool.force.as_dvec3();
            torque += tool.torque.as_dvec3() + arm.cross(tool.force.as_dvec3());
        }
        let finite = |sum: DVec3| sum.as_vec3().clamp(Vec3::MIN, Vec3::MAX);
        Ok((finite(force), finite(torque)))
    }

    /// Removes the attachments of a destroyed body.
    pub(super) fn forget_attachments_of(&mut self, body: BodyId) {
        self.attachments
            .retain(|attachment| attachment.body != body && attachment.holder != Holder::Body(body));
    }

    /// A tool is gone: lets go of what is attached to it.
    pub(super) fn release_all_of(&mut self, tool: ToolId) {
        self.attachments
            .retain(|attachment| attachment.holder != Holder::Tool(tool));
        for (_, body) in self.bodies.iter_mut() {
            body.system_mut().detach_tool(tool.0.index());
        }
    }

    /// Destroys the attachments that broke in the last step.
    pub(super) fn remove_broken_attachments(&mut self) {
        self.slipped.clear();
        let mut end = |id| {
            if self.attachments.remove(id).is_ok() {
                self.slipped.push(AttachmentId(id));
            }
        };
        for (place, body) in self.bodies.iter_mut() {
            if let Some(Outcome::Done { .. }) = self.outcomes[place] {
                body.system_mut().break_overloaded(&mut end);
            }
        }
        if let Some(deformable_contact) = &mut self.deformable_contact {
            deformable_contact.attachments.remove_broken(&mut self.bodies, end);
        }
    }
}

pub(super) fn check_limit(force_limit: f32) -> Result<()> {
    ensure!(force_limit >= 0.0, "force_limit is {force_limit}: must be at least 0");
    Ok(())
}

/// Refuses a pair of points that are the same point of one body.
pub(super) fn refuse_one_point(pair: &[AttachmentPoint; 2], [first, second]: [Which; 2]) -> Result<()> {
    if !are_one(pair) {
        return Ok(());
    }
    let [one, many] = match pair[0].anchor {
        Some(Anchor::Point(_)) => ["triangle", "triangles"],
        Some(Anchor::Node(_)) | None => ["node", "nodes"],
    };
    Err(Error::invalid(format!(
        "{} and {} are one point of one body",
        first.name(one, many),
        second.name(one, many)
    )))
}

/// The corners and weights of a checked point of a surface.
fn grip_of(surface: &[[u32; 3]], which: Which, point: &SurfacePoint) -> Result<AttachPoint> {
    let SurfacePoint { triangle, weights } = *point;
    let Some(&corners) = surface.get(triangle as usize) else {
        return Err(Error::invalid(format!(
            "{} is {triangle}: the surface has {} triangles",
            which.name("triangle", "triangles"),
            surface.len()
        )));
    };
    let sum: f32 = weights.iter().sum();
    ensure!(
        weights.iter().all(|&weight| weight >= 0.0) && (sum - 1.0).abs() <= WEIGHT_TOLERANCE,
        "{} are {weights:?}: must be at least 0, and 1 in sum",
        which.name("weights", "weights")
    );
    Ok(AttachPoint { corners, weights })
}
