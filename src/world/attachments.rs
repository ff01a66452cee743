//! Attachments: what tools hold of bodies, and what bodies hold of each other, by their names.

use std::fmt::from_fn;

use glam::{DVec3, Vec3};

use super::{World, make_walks};
use crate::base::{AttachmentId, BodyId, Error, Result, ToolId, ensure, memory};
use crate::codec::{saved, saved_enum};
use crate::def::{Anchor, SurfacePoint};
use crate::deformable_contact::{BondPoint, Bonds, Thread, are_one};
use crate::solver::Grip;
use crate::solver::Outcome;

/// Whose attachment it is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Attachment {
    body: BodyId,
    holder: Holder,
}

saved! { Attachment { body, holder } }

/// What it is attached to.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Holder {
    Tool(ToolId),
    /// This one, or another.
    Body(BodyId),
}

saved_enum!(Holder { 0 => Tool(it), 1 => Body(it) });

/// Which argument it is, in messages: one of an array, or the only one, with what its name begins with.
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

/// How far the sum of a point's weights may be from 1.
const SUM_OFF: f32 = 1e-3;

impl World {
    /// Attaches a node of a body to a tool: [`World::attach_nodes`] for one.
    ///
    /// # Errors
    /// As there.
    pub fn attach_node(&mut self, body: BodyId, node: u32, tool: ToolId, force_limit: f32) -> Result<AttachmentId> {
        self.check_nodes(body, &[node], tool, |_| "node".into())?;
        Ok(self.attach(body, tool, [Grip::of_node(node)].into_iter(), force_limit)?[0])
    }

    /// Attaches nodes of a body to a tool, each by an attachment of its own: where they lie they become part of the tool, which carries
    /// them along and turns them, exactly and whatever the solver, until [`World::release`]. Their velocities become the tool's in the
    /// next step.
    ///
    /// What it takes to hold them, with their mass and what damps them, is part of the tool's wrench. The tool does not touch them any
    /// more, nor edges and faces that have one of them. `force_limit`, N: an attachment ends with the step in which its mean force was
    /// larger, and the node goes on as it was led ([`World::slipped`]); 0 or infinite: it holds whatever comes.
    ///
    /// An attached node cannot be pinned. Its position can be set: then it is attached where it was put. One tool may hold a node more than
    /// once; then each attachment has its share of the force. An attachment ends with its body and with its tool.
    ///
    /// # Errors
    /// [`Error::StaleId`]. [`Error::InvalidArgument`]: there is no such node, it is pinned, without mass or held by another tool, or the
    /// limit is negative or not a number. [`Error::OutOfMemory`]. Nothing is attached then.
    pub fn attach_nodes(
        &mut self,
        body: BodyId,
        nodes: &[u32],
        tool: ToolId,
        force_limit: f32,
    ) -> Result<Vec<AttachmentId>> {
        self.check_nodes(body, nodes, tool, |index| format!("nodes[{index}]"))?;
        self.attach(body, tool, nodes.iter().copied().map(Grip::of_node), force_limit)
    }

    /// Attaches points of a body's surface to a tool, each by an attachment of its own: [`World::attach_nodes`] for the corners of the
    /// point's triangle, but those whose weight is 0. So the patch about the point is bonded to the tool, and does not turn against it; a
    /// point on an edge holds the edge, one in a corner the node.
    ///
    /// An attachment's force is that on all its corners. Points whose triangles share corners share what holds those, by their weights.
    ///
    /// # Errors
    /// As there; [`Error::InvalidArgument`] too: there is no such triangle, or weights are negative, not finite or not 1 in sum.
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

    /// Refuses nodes that cannot be held by this tool, by these names.
    fn check_nodes(&self, body: BodyId, nodes: &[u32], tool: ToolId, name: impl Fn(usize) -> String) -> Result<()> {
        let body = self.bodies.get(body.0)?;
        self.check_kinematic(tool)?;
        for (index, &node) in nodes.iter().enumerate() {
            let name = from_fn(|to| to.write_str(&name(index)));
            body.check_node(&name, node)?;
            body.system().check_graspable(&name, node, tool.0.index())?;
        }
        Ok(())
    }

    /// Attaches what was found fit for it.
    fn attach(
        &mut self,
        body: BodyId,
        tool: ToolId,
        grips: impl ExactSizeIterator<Item = Grip>,
        force_limit: f32,
    ) -> Result<Vec<AttachmentId>> {
        self.check_kinematic(tool)?;
        let held = self.bodies.get_mut(body.0)?;
        check_limit(force_limit)?;
        let mut ids = memory::reserved(grips.len())?;
        // All may slip in one step.
        let count = self.attachments.count() + grips.len();
        self.slipped.try_reserve(count)?;
        if grips.len() == 0 {
            return Ok(ids);
        }
        let holder = Holder::Tool(tool);
        let count = grips.len();
        let answer = held
            .system_mut()
            .reserve_grasps(count)
            .and_then(|()| self.name(Attachment { body, holder }, count, &mut ids))
            .and_then(|()| {
                let named = ids.iter().map(|id| id.0).zip(grips);
                let system = self.bodies.get_mut(body.0)?.system_mut();
                system.grasp(tool.0.index(), named, force_limit)
            });
        if let Err(error) = answer {
            for AttachmentId(id) in ids.into_iter().rev() {
                self.attachments.take_back(id)?;
            }
            self.bodies.get_mut(body.0)?.system_mut().drop_room_for_grasps();
            return Err(error);
        }
        Ok(ids)
    }

    /// Makes names for so many attachments, for which `ids` has room.
    fn name(&mut self, attachment: Attachment, count: usize, ids: &mut Vec<AttachmentId>) -> Result<()> {
        for _ in 0..count {
            match self.attachments.insert(attachment) {
                Ok(id) => ids.push(AttachmentId(id)),
                Err(error) => {
                    for AttachmentId(id) in ids.drain(..).rev() {
                        self.attachments.take_back(id)?;
                    }
                    return Err(error);
                }
            }
        }
        Ok(())
    }

    /// Attaches points of a body to as many points of another, or of the same, each pair by an attachment of its own: nodes, or points of
    /// the surface. From the next step on the two are one point, whatever the solvers of the bodies; what is apart comes together within
    /// some hundredths of a second, and no faster than at 0.25 m/s, however far that is. Each may turn about it as it likes: what shall not
    /// turn takes three.
    ///
    /// The bodies take their substeps together, those of [`Solver::Implicit`](crate::Solver::Implicit) and
    /// [`Solver::Newton`](crate::Solver::Newton) of 0.25 ms at most and of order 1. No momentum is made; nor is any angular momentum, once the points have
    /// come together. Where both points are held by pins or tools along an axis nothing is done along it. Features that share such a pair
    /// of points do not touch each other.
    ///
    /// `force_limit`, N: an attachment ends with the step in which its mean force was larger ([`World::slipped`]); 0 or infinite: it holds
    /// whatever comes. [`World::attachment_force`] has the force on `body`. An attachment ends with either body.
    ///
    /// Sequential impulses (Catto 2005): between bodies of [`Solver::Verlet`](crate::Solver::Verlet) SHAKE (Ryckaert, Ciccotti, Berendsen
    /// 1977), with the other solvers a projection (Chorin 1968).
    ///
    /// # Errors
    /// [`Error::StaleId`]. [`Error::InvalidArgument`]: there is no such node or triangle, weights are negative, not finite or not 1 in sum,
    /// the two are one point, there are not as many of the one as of the other, or the limit is negative or not a number.
    /// [`Error::OutOfMemory`]. Nothing is attached then.
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

    /// Joins what was found fit for it, by threads like this one or else as one point.
    pub(super) fn bind(
        &mut self,
        bodies: [BodyId; 2],
        pairs: &[[BondPoint; 2]],
        force_limit: f32,
        thread: Option<Thread>,
    ) -> Result<Vec<AttachmentId>> {
        let places = [self.bodies.place(bodies[0].0)?, self.bodies.place(bodies[1].0)?];
        let mut ids = memory::reserved(pairs.len())?;
        if pairs.is_empty() {
            return Ok(ids);
        }
        self.slipped.try_reserve(self.attachments.count() + pairs.len())?;
        for place in places {
            make_walks(&mut self.walks, place)?;
        }
        memory::get_or_box(&mut self.tissue)?.reserve_bonds(places, pairs.len())?;
        for id in bodies {
            self.bodies.get_mut(id.0)?.system_mut().reserve_bonds()?;
        }
        let [body, other] = bodies;
        let holder = Holder::Body(other);
        self.name(Attachment { body, holder }, pairs.len(), &mut ids)?;
        for id in bodies {
            self.bodies.get_mut(id.0)?.system_mut().begin_bonds();
        }
        if let Some(bonds) = self.bonds_mut() {
            for (&AttachmentId(id), &pair) in ids.iter().zip(pairs) {
                bonds.add(id, pair, force_limit, thread)?;
            }
            bonds.settle();
        }
        Ok(ids)
    }

    /// A point of a body by what its corners are there.
    pub(super) fn bound(&self, id: BodyId, which: Which, anchor: &Anchor) -> Result<BondPoint> {
        let body = self.bodies.get(id.0)?;
        let grip = match anchor {
            Anchor::Node(node) => {
                body.check_node(&from_fn(|to| to.write_str(&which.name("node", "nodes"))), *node)?;
                Grip::of_node(*node)
            }
            Anchor::Point(point) => grip_of(body.surface(), which, point)?,
        };
        let sum: f32 = grip.weights.iter().sum();
        // All corners of a triangle are bound to nodes of one cell.
        let mut nodes = [(0, 0.0); 4];
        for (&corner, weight) in grip.corners.iter().zip(grip.weights) {
            for (node, part) in body.system().parts_of(corner) {
                let is_its = |(known, share): &&mut (u32, f32)| *known == node || *share == 0.0;
                if weight * part != 0.0
                    && let Some(place) = nodes.iter_mut().find(is_its)
                {
                    *place = (node, place.1 + weight / sum * part);
                }
            }
        }
        Ok(BondPoint {
            body: self.bodies.place(id.0)?,
            anchor: Some(*anchor),
            nodes,
        })
    }

    /// A point between the nodes of a cell of a body, in the caller's numbers.
    pub(super) fn bound_inside(&self, id: BodyId, nodes: [u32; 4], weights: [f64; 4]) -> Result<BondPoint> {
        let body = self.bodies.get(id.0)?;
        let sum: f64 = weights.iter().sum();
        let own = |node: u32| body.system().parts_of(node).next().map_or(0, |(own, _)| own);
        Ok(BondPoint {
            body: self.bodies.place(id.0)?,
            anchor: None,
            nodes: std::array::from_fn(|k| (own(nodes[k]), (weights[k] / sum) as f32)),
        })
    }

    pub(super) fn bonds_mut(&mut self) -> Option<&mut Bonds> {
        self.tissue.as_mut().map(|tissue| &mut tissue.bonds)
    }

    /// Refuses a body that is attached to a body.
    pub(super) fn check_not_attached(&self, body: BodyId) -> Result<()> {
        let place = self.bodies.place(body.0)?;
        ensure!(
            !self.tissue.as_ref().is_some_and(|tissue| tissue.bonds.concern(place)),
            "body is attached to a body: what holds it there moves with that one"
        );
        Ok(())
    }

    /// Lets go of what is attached: it goes on as it was led in the last step.
    ///
    /// # Errors
    /// [`Error::StaleId`]: it was let go already, or slipped, or a body or the tool is gone.
    pub fn release(&mut self, attachment: AttachmentId) -> Result<()> {
        let Attachment { body, holder } = self.attachments.remove(attachment.0)?;
        match (holder, &mut self.tissue) {
            (Holder::Body(_), Some(tissue)) => tissue.bonds.end(&mut self.bodies, attachment.0),
            _ => self.bodies.get_mut(body.0)?.system_mut().let_go(attachment.0),
        }
        Ok(())
    }

    /// The force by which what it is attached to holds a body, on the tissue, world axes, mean over the last step, N; 0 before the first.
    /// Where the state of a body that tools hold was set to one of rest it is that which holds it there.
    ///
    /// # Errors
    /// [`Error::StaleId`].
    pub fn attachment_force(&self, attachment: AttachmentId) -> Result<Vec3> {
        let Attachment { body, holder } = self.attachments.get(attachment.0)?;
        if let (Holder::Body(_), Some(tissue)) = (holder, &self.tissue) {
            return Ok(tissue.bonds.force_of(attachment.0));
        }
        let body = self.bodies.get(body.0)?;
        let grasp = body
            .system()
            .grasps
            .as_ref()
            .and_then(|grasps| grasps.get(attachment.0));
        Ok(grasp.map_or(Vec3::ZERO, |grasp| grasp.force))
    }

    /// Shows both ends of what is attached, m: a tool and a node that it holds, or two points of tissue.
    pub(crate) fn show_attached(&self, mut see: impl FnMut([Vec3; 2])) {
        for (_, body) in self.bodies.iter() {
            for (node, tool) in body.system().grasps.iter().flat_map(|grasps| grasps.held_nodes()) {
                if let Some(tool) = self.tools.at(tool) {
                    see([tool.pose.position, body.positions()[body.system().callers(node)]]);
                }
            }
        }
        if let Some(tissue) = &self.tissue {
            tissue
                .bonds
                .show_ends(&self.bodies, |ends| see(ends.map(|end| end.as_vec3())));
        }
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

    /// A body is gone, and with it what is attached of it.
    pub(super) fn forget_attachments_of(&mut self, body: BodyId) {
        self.attachments
            .retain(|attachment| attachment.body != body && attachment.holder != Holder::Body(body));
    }

    /// A tool is gone: lets go of what is attached to it.
    pub(super) fn release_all_of(&mut self, tool: ToolId) {
        self.attachments
            .retain(|attachment| attachment.holder != Holder::Tool(tool));
        for (_, body) in self.bodies.iter_mut() {
            body.system_mut().let_go_of(tool.0.index());
        }
    }

    /// Ends what the last step was too much for.
    pub(super) fn end_slipped(&mut self) {
        self.slipped.clear();
        let mut end = |id| {
            if self.attachments.remove(id).is_ok() {
                self.slipped.push(AttachmentId(id));
            }
        };
        for (place, body) in self.bodies.iter_mut() {
            if let Some(Outcome::Done { .. }) = self.outcomes[place] {
                body.system_mut().slip(&mut end);
            }
        }
        if let Some(tissue) = &mut self.tissue {
            tissue.bonds.slip(&mut self.bodies, end);
        }
    }
}

pub(super) fn check_limit(force_limit: f32) -> Result<()> {
    ensure!(force_limit >= 0.0, "force_limit is {force_limit}: must be at least 0");
    Ok(())
}

/// Refuses two points of one body that are one.
pub(super) fn refuse_one_point(pair: &[BondPoint; 2], [first, second]: [Which; 2]) -> Result<()> {
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

/// A point of a surface.
fn grip_of(surface: &[[u32; 3]], which: Which, point: &SurfacePoint) -> Result<Grip> {
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
        weights.iter().all(|&weight| weight >= 0.0) && (sum - 1.0).abs() <= SUM_OFF,
        "{} are {weights:?}: must be at least 0, and 1 in sum",
        which.name("weights", "weights")
    );
    Ok(Grip { corners, weights })
}
