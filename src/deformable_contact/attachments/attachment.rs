//! An attachment between two points.

use glam::{DVec3, Vec3};

use super::suture::SutureThread;
use crate::base::SlotId;
use crate::codec::saved;
use crate::def::Anchor;
use crate::solver::Systems;

/// Maximum number of nodes of a point: the corners of a triangle or tetrahedron.
pub(super) const NODES_PER_POINT: usize = 4;

/// Maximum number of corners of both points.
pub(super) const MAX_CORNERS: usize = 2 * NODES_PER_POINT;

/// A point of an attachment, as the caller specified it and as nodes.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct AttachmentPoint {
    /// Body index.
    pub body: usize,
    /// The anchor in the caller's numbers; `None` for a blade inside a solid.
    pub anchor: Option<Anchor>,
    /// Nodes in the body's own order, with weights that sum to 1. Unused entries have weight 0.
    pub nodes: [(u32, f32); NODES_PER_POINT],
}

saved! { AttachmentPoint { body, anchor, nodes } }

impl AttachmentPoint {
    /// Returns the sum of the weights: 1 but for rounding, or 0 if the point is not on tissue.
    pub(super) fn weight(&self) -> f64 {
        self.nodes.iter().map(|&(_, weight)| f64::from(weight)).sum()
    }
}

/// A corner of one of the points of an attachment.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct AttachmentCorner {
    /// Body index.
    pub body: usize,
    pub node: u32,
    /// Weight in the difference of both points: positive for the first point, negative for the second, 0 if unused.
    pub weight: f32,
    /// Index of the corner's [`AttachmentNode`], set by [`super::PointAttachments`].
    pub attached_node: usize,
}

saved! { AttachmentCorner { body, node, weight, attached_node } }

/// Two points that are held together.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PointAttachment {
    /// Id of the attachment in the world.
    pub id: SlotId,
    /// The first and the second point.
    pub points: [AttachmentPoint; 2],
    pub corners: [AttachmentCorner; MAX_CORNERS],
    /// The thread between the points. Without one, the points coincide.
    pub thread: Option<SutureThread>,
    /// Maximum mean force of a step, N. A larger force breaks the attachment.
    pub force_limit: f32,
    /// Predicted force on the first point in the next step, N.
    pub predicted_force: Vec3,
    /// Mean force on the first point in the last step, N.
    pub mean_force: Vec3,
    // State of the step in progress.
    /// True if the bodies belong to the group that steps now.
    pub is_stepping: bool,
    /// Predicted force in this substep, N; zero if VERLET does not move both bodies.
    pub substep_force: Vec3,
    /// Impulse of this substep beyond the predicted force, and the total of the step, N s.
    pub impulse: Vec3,
    pub total_impulse: DVec3,
    /// Work done by closing the gap, J.
    pub work: f64,
    /// Effective mass for each axis: impulse per change of relative velocity, kg; 0 if neither point moves.
    pub effective_mass: Vec3,
    /// Required offset of the points at the end of the substep, and its tolerance, m.
    pub target_gap: DVec3,
    pub gap_tolerance: f64,
    /// True if it acts in this span.
    pub is_active: bool,
    /// True if one of the bodies solves an equation in each substep.
    pub has_equation: bool,
}

saved! { PointAttachment {
    id, points, corners, thread, force_limit, predicted_force, mean_force, is_stepping, substep_force, impulse,
    total_impulse, work, effective_mass, target_gap, gap_tolerance, is_active, has_equation,
} }

/// A node with attachments.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct AttachmentNode {
    pub body: usize,
    pub node: u32,
    /// True if an attachment still uses it.
    pub is_used: bool,
    /// True if the collision surface stores its velocity.
    pub is_on_surface: bool,
    /// True if the body belongs to the group that steps now.
    pub is_stepping: bool,
    pub velocity: Vec3,
    /// Change of velocity per impulse, 1/kg; 0 along pinned axes.
    pub inverse_mass: Vec3,
    /// Impulse in this substep, N s, or predicted force, N.
    pub impulse: Vec3,
    pub position: DVec3,
    pub correction: DVec3,
    /// External force on the node in this step, N, and whether any external force acts on the body.
    pub external_force: Vec3,
    pub has_external_force: bool,
}

saved! { AttachmentNode {
    body, node, is_used, is_on_surface, is_stepping, velocity, inverse_mass, impulse, position, correction,
    external_force, has_external_force,
} }

impl PointAttachment {
    pub fn used_corners(&self) -> impl Iterator<Item = AttachmentCorner> + use<> {
        self.corners.into_iter().filter(|corner| corner.weight != 0.0)
    }

    pub fn involves(&self, body: usize) -> bool {
        self.points.iter().any(|point| point.body == body)
    }
}

impl AttachmentNode {
    pub fn new(corner: &AttachmentCorner) -> Self {
        Self {
            body: corner.body,
            node: corner.node,
            is_used: true,
            ..Self::default()
        }
    }
}

/// Returns the current position of a point, m.
pub(super) fn position_of_point(point: &AttachmentPoint, bodies: &impl Systems) -> Option<DVec3> {
    let body = bodies.at(point.body)?;
    let positions = body.state.positions();
    let weighted_position = |(node, weight): (u32, f32)| positions.get(node as usize).as_dvec3() * f64::from(weight);
    Some(point.nodes.into_iter().map(weighted_position).sum::<DVec3>() / point.weight() + body.origin)
}

/// Returns the corners of two points. A node of both points gets the difference of its weights.
pub(super) fn corners_of(points: &[AttachmentPoint; 2]) -> [AttachmentCorner; MAX_CORNERS] {
    let mut corners = [AttachmentCorner::default(); MAX_CORNERS];
    let mut count = 0;
    for (point, sign) in points.iter().zip([1.0, -1.0]) {
        for &(node, weight) in point.nodes.iter().filter(|(_, weight)| *weight != 0.0) {
            let is_same_node = |corner: &&mut AttachmentCorner| (corner.body, corner.node) == (point.body, node);
            match corners[..count].iter_mut().find(is_same_node) {
                Some(corner) => corner.weight += sign * weight,
                None => {
                    corners[count] = AttachmentCorner {
                        body: point.body,
                        node,
                        weight: sign * weight,
                        attached_node: 0,
                    };
                    count += 1;
                }
            }
        }
    }
    corners
}

/// Returns the current distance of two points, m.
pub(crate) fn distance(bodies: &impl Systems, points: &[AttachmentPoint; 2]) -> f64 {
    let offset: DVec3 = corners_of(points)
        .iter()
        .filter(|corner| corner.weight != 0.0)
        .filter_map(|corner| {
            let body = bodies.at(corner.body)?;
            let position = body.state.positions().get(corner.node as usize).as_dvec3() + body.origin;
            Some(position * f64::from(corner.weight))
        })
        .sum();
    offset.length()
}

/// Returns the index of a node among attached nodes, or where to insert it.
pub(super) fn find_attached_node(
    attached_nodes: &[AttachmentNode],
    body: usize,
    node: u32,
) -> std::result::Result<usize, usize> {
    attached_nodes.binary_search_by_key(&(body, node), |attached_node| (attached_node.body, attached_node.node))
}
