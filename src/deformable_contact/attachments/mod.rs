//! Attachments between tissue and tissue: a point of a body is held at a point of another body, or of the same one.
//!
//! The bodies take their substeps together. In each substep, impulses equalize the mean velocities of both points
//! (sequential impulses, Catto 2005).
//!
//! Between VERLET bodies this is SHAKE (Ryckaert, Ciccotti, Berendsen 1977), and as stable as the bodies alone. The
//! impulse of the last substep acts as a predicted force in the next kick. Damping along springs then uses velocities
//! that already contain the constraint. In the equation of an implicit solver, the lag of that force would excite stiff
//! tissue and grow. There the impulses project the solution instead (Chorin 1968), and substeps are first-order
//! accurate. The equation does not contain the load, so the point is off by `force time^2 / mass` until the projection.
//! Such substeps are therefore short.
//!
//! A thread between the points has one scalar impulse along a line, which never pushes (`suture.rs`).

mod attachment;
mod substep;
mod suture;

use glam::{DVec3, Vec3};

use crate::base::{Result, SlotId, StateHasher, memory};
use crate::codec::saved;
use crate::geometry::Aabb;
use crate::solver::{Outcome, System, Systems};

use self::attachment::{
    AttachmentCorner, AttachmentNode, MAX_CORNERS, NODES_PER_POINT, PointAttachment, corners_of, find_attached_node,
    position_of_point,
};
pub(crate) use self::attachment::{AttachmentPoint, distance};
pub(crate) use self::suture::{LinearPath, SutureThread};

/// Maximum closing speed of attached points, m/s. Bodies that are far apart then follow their points.
const CLOSING_SPEED: f64 = 0.25;

/// All attachments between tissue points of a world.
#[derive(Debug, Default)]
pub(crate) struct PointAttachments {
    /// Attachments in order of creation.
    attachments: Vec<PointAttachment>,
    /// Nodes sorted by body and node.
    attached_nodes: Vec<AttachmentNode>,
    /// True before the first substep of a step, which VERLET begins with half a kick.
    is_first_substep: bool,
}

saved! { PointAttachments { attachments, attached_nodes, is_first_substep } }

/// True if two points are the same point of one body.
pub(crate) fn are_one(points: &[AttachmentPoint; 2]) -> bool {
    corners_of(points).iter().all(|corner| corner.weight == 0.0)
}

impl PointAttachments {
    /// True if any attachment acts in this span.
    pub(super) fn any_active(&self) -> bool {
        self.attachments.iter().any(|attachment| attachment.is_active)
    }

    /// True if there are no attachments.
    pub(super) fn is_empty(&self) -> bool {
        self.attachments.is_empty()
    }

    /// Returns the two body indices of each attachment, which may be equal.
    pub(super) fn bodies(&self) -> impl Iterator<Item = [usize; 2]> {
        self.attachments.iter().filter_map(|attachment| {
            let mut bodies = attachment.used_corners().map(|corner| corner.body);
            let first = bodies.next()?;
            Some([first, bodies.last().unwrap_or(first)])
        })
    }

    /// Reserves memory for this number of additional attachments.
    pub fn reserve(&mut self, count: usize) -> Result<()> {
        self.attachments.try_reserve(count)?;
        Ok(self.attached_nodes.try_reserve(count.saturating_mul(MAX_CORNERS))?)
    }

    /// Adds an attachment or a thread between two points, for which memory is reserved. Call [`Self::rebuild_nodes`]
    /// after the last one.
    pub fn add(
        &mut self,
        id: SlotId,
        points: [AttachmentPoint; 2],
        force_limit: f32,
        thread: Option<SutureThread>,
    ) -> Result<()> {
        let attachment = PointAttachment {
            id,
            points,
            corners: corners_of(&points),
            thread,
            force_limit: if force_limit > 0.0 { force_limit } else { f32::INFINITY },
            ..PointAttachment::default()
        };
        memory::push(&mut self.attachments, attachment)
    }

    /// Attaches a blade's thread to a point, for which memory is reserved. An existing attachment with this id keeps
    /// its state. Call [`Self::set_thread`] and [`Self::rebuild_nodes`] afterwards.
    pub fn attach_blade(&mut self, id: SlotId, point: AttachmentPoint) -> Result<()> {
        let no_point = AttachmentPoint {
            nodes: [(0, 0.0); NODES_PER_POINT],
            ..point
        };
        let points = [point, no_point];
        match self.attachments.iter_mut().find(|attachment| attachment.id == id) {
            Some(attachment) => {
                attachment.corners = corners_of(&points);
                attachment.points = points;
                Ok(())
            }
            None => self.add(id, points, 0.0, Some(SutureThread::new(0.0, 0.0, 0.0))),
        }
    }

    /// Sets the thread between a point and a blade.
    pub fn set_thread(&mut self, id: SlotId, mut thread: SutureThread) {
        if let Some(attachment) = self.attachments.iter_mut().find(|attachment| attachment.id == id) {
            let weight = attachment.points[0].weight();
            thread.end_path = thread.end_path.map(|end_path| end_path.scaled(weight));
            attachment.thread = Some(thread);
        }
    }

    /// Sets the path of a thread's end in the next step.
    pub fn set_end_path(&mut self, id: SlotId, path: LinearPath) {
        if let Some(attachment) = self.attachments.iter_mut().find(|attachment| attachment.id == id) {
            let weight = attachment.points[0].weight();
            if let Some(thread) = &mut attachment.thread {
                thread.end_path = Some(path.scaled(weight));
            }
        }
    }

    /// Returns the current position of an attachment's first point, m.
    pub fn first_point_position(&self, bodies: &impl Systems, id: SlotId) -> Option<DVec3> {
        let attachment = self.attachments.iter().find(|attachment| attachment.id == id)?;
        position_of_point(&attachment.points[0], bodies)
    }

    /// Calls `visit` with the current positions of both points of each attachment between tissue points, m.
    pub fn visit_points(&self, bodies: &impl Systems, mut visit: impl FnMut([DVec3; 2])) {
        for attachment in self
            .attachments
            .iter()
            .filter(|attachment| attachment.points.iter().all(|point| point.weight() > 0.0))
        {
            if let [Some(first), Some(second)] = attachment
                .points
                .each_ref()
                .map(|point| position_of_point(point, bodies))
            {
                visit([first, second]);
            }
        }
    }

    /// Reserves memory to rebind points of a body.
    pub fn reserve_rebinding(&mut self, body: usize) -> Result<()> {
        let count = self
            .attachments
            .iter()
            .filter(|attachment| attachment.involves(body))
            .count();
        Ok(self.attached_nodes.try_reserve(count.saturating_mul(MAX_CORNERS))?)
    }

    /// Returns the attached points of a body.
    pub fn points_of(&self, body: usize) -> impl Iterator<Item = &AttachmentPoint> {
        let points = self.attachments.iter().flat_map(|attachment| &attachment.points);
        points.filter(move |point| point.body == body && point.weight() > 0.0)
    }

    /// Replaces points of a body by the results of `rebound`, after their triangles were cut or copied. Points do not
    /// move if the new nodes are at the expected positions. Memory is reserved.
    pub fn rebind(&mut self, body: usize, mut rebound: impl FnMut(&AttachmentPoint) -> Option<AttachmentPoint>) {
        for attachment in &mut self.attachments {
            let is_on_body = |point: &&mut AttachmentPoint| point.body == body && point.weight() > 0.0;
            for point in attachment.points.iter_mut().filter(is_on_body) {
                *point = rebound(point).unwrap_or(*point);
            }
            attachment.corners = corners_of(&attachment.points);
        }
        self.rebuild_nodes();
    }

    /// Removes the attachments that satisfy `is_removed`. Allocates nothing.
    fn remove_where(&mut self, bodies: &mut impl Systems, mut is_removed: impl FnMut(&PointAttachment) -> bool) {
        let count = self.attachments.len();
        self.attachments.retain(|attachment| {
            let is_kept = !is_removed(attachment);
            if !is_kept {
                // The effect of a removed attachment must not count as a gain of energy.
                let bodies_of = attachment.used_corners().map(|corner| corner.body);
                bodies_of.for_each(|body_index| {
                    bodies
                        .at_mut(body_index)
                        .into_iter()
                        .for_each(System::end_tissue_attachments)
                });
            }
            is_kept
        });
        if self.attachments.len() != count {
            self.rebuild_nodes();
        }
    }

    /// Rebuilds the attached nodes from the attachments, and the indices of corners into them. Memory is reserved.
    pub fn rebuild_nodes(&mut self) {
        let Self {
            attachments,
            attached_nodes,
            ..
        } = self;
        attached_nodes
            .iter_mut()
            .for_each(|attached_node| attached_node.is_used = false);
        for corner in attachments.iter().flat_map(PointAttachment::used_corners) {
            match find_attached_node(attached_nodes, corner.body, corner.node) {
                Ok(slot) => attached_nodes[slot].is_used = true,
                Err(slot) => attached_nodes.insert(slot, AttachmentNode::new(&corner)),
            }
        }
        attached_nodes.retain(|attached_node| attached_node.is_used);
        for corner in attachments.iter_mut().flat_map(|attachment| &mut attachment.corners) {
            corner.attached_node = find_attached_node(attached_nodes, corner.body, corner.node).unwrap_or_default();
        }
    }

    /// Removes an attachment.
    pub fn remove(&mut self, bodies: &mut impl Systems, id: SlotId) {
        self.remove_where(bodies, |attachment| attachment.id == id);
    }

    /// Removes the attachments of a body that was destroyed.
    pub(super) fn remove_body(&mut self, bodies: &mut impl Systems, body: usize) {
        self.remove_where(bodies, |attachment| attachment.involves(body));
    }

    /// Removes the attachments whose force limit the last step exceeded, and calls `visit` with their ids.
    pub fn remove_broken(&mut self, bodies: &mut impl Systems, mut visit: impl FnMut(SlotId)) {
        self.remove_where(bodies, |attachment| {
            let is_broken = attachment.mean_force.length() > attachment.force_limit;
            if is_broken {
                visit(attachment.id);
            }
            is_broken
        });
    }

    /// Returns the mean force on the first point of an attachment in the last step, N.
    pub fn force_of(&self, id: SlotId) -> Vec3 {
        let attachment = self.attachments.iter().find(|attachment| attachment.id == id);
        attachment.map_or(Vec3::ZERO, |attachment| attachment.mean_force)
    }

    /// Returns the thread of an attachment.
    pub fn thread_mut(&mut self, id: SlotId) -> Option<&mut SutureThread> {
        let attachment = self.attachments.iter_mut().find(|attachment| attachment.id == id);
        attachment.and_then(|attachment| attachment.thread.as_mut())
    }

    /// Returns the thread of an attachment and the current distance of its points, m.
    pub fn thread(&self, bodies: &impl Systems, id: SlotId) -> Option<(&SutureThread, f64)> {
        let attachment = self.attachments.iter().find(|attachment| attachment.id == id)?;
        Some((attachment.thread.as_ref()?, distance(bodies, &attachment.points)))
    }

    /// True if a body has attachments.
    pub fn has_body(&self, body: usize) -> bool {
        let first = self
            .attached_nodes
            .partition_point(|attached_node| attached_node.body < body);
        self.attached_nodes
            .get(first)
            .is_some_and(|attached_node| attached_node.body == body)
    }

    /// True if an attachment joins any of these nodes of one body with any of those of the other.
    pub(super) fn join_nodes(&self, bodies: [usize; 2], nodes: [&[u32]; 2]) -> bool {
        let has_attached = |side: usize| nodes[side].iter().any(|&node| self.find(bodies[side], node).is_ok());
        if self.attachments.is_empty() || !(has_attached(0) && has_attached(1)) {
            return false;
        }
        let has = |attachment: &PointAttachment, side: usize, sign: f32| {
            let mut corners = attachment.used_corners().filter(|corner| corner.weight * sign > 0.0);
            corners.any(|corner| corner.body == bodies[side] && nodes[side].contains(&corner.node))
        };
        let joins = |attachment: &PointAttachment| {
            has(attachment, 0, 1.0) && has(attachment, 1, -1.0) || has(attachment, 0, -1.0) && has(attachment, 1, 1.0)
        };
        // Points that a thread pulls together still touch.
        self.attachments
            .iter()
            .any(|attachment| attachment.thread.is_none() && joins(attachment))
    }

    /// Extends bounds of velocities by those of the body's attached nodes.
    pub(super) fn velocity_bounds(&self, body: usize, velocity_bounds: Aabb) -> Aabb {
        let first = self
            .attached_nodes
            .partition_point(|attached_node| attached_node.body < body);
        let own_nodes = self.attached_nodes[first..]
            .iter()
            .take_while(|attached_node| attached_node.body == body);
        own_nodes.fold(velocity_bounds, |bounds, attached_node| {
            bounds.with(attached_node.velocity)
        })
    }

    pub fn hash(&self, hasher: &mut StateHasher) {
        for attachment in &self.attachments {
            for corner in attachment.used_corners() {
                hasher.write_u64((corner.body as u64) << 32 | u64::from(corner.node));
                hasher.write_floats(&[corner.weight]);
            }
            hasher.write_floats(&[attachment.force_limit]);
            hasher.write_floats(&attachment.predicted_force.to_array());
            if let Some(thread) = &attachment.thread {
                hasher.write_doubles(&[
                    thread.rest_length,
                    thread.target_length,
                    thread.compliance,
                    thread.max_force,
                ]);
                for position in thread.end_path.iter().flat_map(|path| [path.from, path.to]) {
                    hasher.write_doubles(&position.to_array());
                }
            }
        }
    }

    /// Commits the step of `dt` seconds for the bodies that took it.
    pub fn commit(&mut self, outcomes: &[Option<Outcome>], dt: f32) {
        let took = |body_index: usize| matches!(outcomes.get(body_index), Some(Some(Outcome::Done { .. })));
        for attachment in &mut self.attachments {
            if attachment.used_corners().all(|corner| took(corner.body)) {
                attachment.predicted_force = attachment.substep_force.clamp(Vec3::MIN, Vec3::MAX);
                attachment.mean_force = (attachment.total_impulse / f64::from(dt))
                    .as_vec3()
                    .clamp(Vec3::MIN, Vec3::MAX);
                if let Some(thread) = &mut attachment.thread {
                    thread.commit(dt);
                }
            } else {
                attachment.mean_force = Vec3::ZERO;
            }
        }
    }

    fn find(&self, body: usize, node: u32) -> std::result::Result<usize, usize> {
        find_attached_node(&self.attached_nodes, body, node)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::WorldTag;
    use crate::def::Anchor;
    use crate::def::SurfacePoint;
    use crate::slots::Slots;

    fn bound(body: usize, triangle: u32, nodes: &[(u32, f32)]) -> AttachmentPoint {
        let mut all = [(0, 0.0); NODES_PER_POINT];
        all[..nodes.len()].copy_from_slice(nodes);
        let anchor = Some(Anchor::Point(SurfacePoint {
            triangle,
            weights: [0.5, 0.25, 0.25],
        }));
        AttachmentPoint {
            body,
            anchor,
            nodes: all,
        }
    }

    fn ids(count: usize) -> Vec<SlotId> {
        let mut slots = Slots::new("attachment", WorldTag::next());
        (0..count).map(|_| slots.insert(()).expect("a place")).collect()
    }

    /// Returns the sorted corners of an attachment, after checking their attached nodes.
    fn corners(attachments: &PointAttachments, index: usize) -> Vec<(usize, u32, f32)> {
        let corners_found = attachments.attachments[index].used_corners().map(|corner| {
            let attached_node = &attachments.attached_nodes[corner.attached_node];
            assert_eq!((attached_node.body, attached_node.node), (corner.body, corner.node));
            (corner.body, corner.node, corner.weight)
        });
        let mut corners: Vec<_> = corners_found.collect();
        corners.sort_by_key(|corner| (corner.0, corner.1));
        corners
    }

    #[test]
    fn points_on_cut_triangles_are_rebound() {
        let mut attachments = PointAttachments::default();
        let on = |triangle, first| bound(2, triangle, &[(first, 0.5), (first + 1, 0.25), (first + 2, 0.25)]);
        let other = bound(5, 7, &[(3, 1.0)]);
        // Between two bodies, within one, and where nothing was cut.
        let pairs = [[on(4, 10), other], [on(4, 10), on(9, 11)], [other, on(9, 11)]];
        let thread = Some(SutureThread::new(1.0, 1.0, 0.0));
        attachments.reserve(pairs.len()).expect("memory");
        for ((id, pair), thread) in ids(3).into_iter().zip(pairs).zip([None, thread, thread]) {
            attachments.add(id, pair, 0.0, thread).expect("memory");
        }
        attachments.rebuild_nodes();
        assert_eq!(
            corners(&attachments, 0),
            [(2, 10, 0.5), (2, 11, 0.25), (2, 12, 0.25), (5, 3, -1.0)]
        );
        assert_eq!(corners(&attachments, 1), [(2, 10, 0.5), (2, 11, -0.25), (2, 13, -0.25)]);
        // Triangle 4 now has another index, its cell is a copy, and the point lies in a tetrahedron.
        let cut = bound(2, 40, &[(30, 0.5), (11, 0.25), (31, 0.125), (1, 0.125)]);
        let is_cut =
            |point: &AttachmentPoint| matches!(point.anchor, Some(Anchor::Point(SurfacePoint { triangle: 4, .. })));
        attachments.reserve_rebinding(2).expect("memory");
        attachments.rebind(5, |point| is_cut(point).then_some(cut));
        assert_eq!(
            corners(&attachments, 0),
            [(2, 10, 0.5), (2, 11, 0.25), (2, 12, 0.25), (5, 3, -1.0)]
        );
        attachments.rebind(2, |point| is_cut(point).then_some(cut));
        let four = [(2, 1, 0.125), (2, 11, 0.25), (2, 30, 0.5), (2, 31, 0.125)];
        assert_eq!(corners(&attachments, 0), [&four[..], &[(5, 3, -1.0)]].concat());
        let both = [
            (2, 1, 0.125),
            (2, 11, -0.25),
            (2, 12, -0.25),
            (2, 13, -0.25),
            (2, 30, 0.5),
            (2, 31, 0.125),
        ];
        assert_eq!(corners(&attachments, 1), both);
        assert_eq!(
            corners(&attachments, 2),
            [(2, 11, -0.5), (2, 12, -0.25), (2, 13, -0.25), (5, 3, 1.0)]
        );
        // Nodes without attachments are removed.
        let attached_nodes: Vec<(usize, u32)> = attachments
            .attached_nodes
            .iter()
            .map(|attached_node| (attached_node.body, attached_node.node))
            .collect();
        assert_eq!(
            attached_nodes,
            [(2, 1), (2, 11), (2, 12), (2, 13), (2, 30), (2, 31), (5, 3)]
        );
        assert!(matches!(
            attachments.attachments[0].points[0].anchor,
            Some(Anchor::Point(SurfacePoint { triangle: 40, .. }))
        ));
    }
}
