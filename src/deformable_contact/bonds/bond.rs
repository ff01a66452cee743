//! What attaches two points.

use glam::{DVec3, Vec3};

use super::thread::Thread;
use crate::base::SlotId;
use crate::codec::saved;
use crate::def::Anchor;
use crate::solver::Systems;

/// Nodes of a point: corners of a triangle, or of a tetrahedron.
pub(super) const OF_POINT: usize = 4;

/// Corners of both points of a bond.
pub(super) const CORNERS: usize = 2 * OF_POINT;

/// One of the points of a bond, as the caller knows it and as the solvers do.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct BondPoint {
    /// By the body's place in the world.
    pub body: usize,
    /// In the caller's numbers; `None`: what a blade stands in inside of a solid.
    pub anchor: Option<Anchor>,
    /// Nodes in the body's own numbers, with their parts in the point, 1 in sum; 0 where there is none.
    pub nodes: [(u32, f32); OF_POINT],
}

saved! { BondPoint { body, anchor, nodes } }

impl BondPoint {
    /// The sum of the parts of its nodes: 1, but for rounding; 0 of what is no point of tissue.
    pub(super) fn weight(&self) -> f64 {
        self.nodes.iter().map(|&(_, weight)| f64::from(weight)).sum()
    }
}

/// A corner of one of the points of a bond.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct BondCorner {
    /// By its place in the world.
    pub body: usize,
    pub node: u32,
    /// Its part of the point; below 0 where it is one of the second point's, 0 where there is none.
    pub weight: f32,
    /// Which of the ends it is; the bonds see to that.
    pub end: usize,
}

saved! { BondCorner { body, node, weight, end } }

/// Two points that are kept together.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Bond {
    /// Its name among the world's attachments.
    pub id: SlotId,
    /// The first point and the second.
    pub points: [BondPoint; 2],
    pub corners: [BondCorner; CORNERS],
    /// What is between them; else they are one.
    pub thread: Option<Thread>,
    /// The mean force over a step with which it just holds, N.
    pub limit: f32,
    /// The force on the first point that the next step foresees, N.
    pub foreseen: Vec3,
    /// The mean force on it over the last step, N.
    pub mean: Vec3,
    // The step in progress.
    /// Whether it is the turn of the group of its bodies.
    pub is_in_turn: bool,
    /// The force that this substep foresees, N; none where a body is not moved by VERLET.
    pub load: Vec3,
    /// What was given beside that in this substep, N s, and all in the step.
    pub impulse: Vec3,
    pub sum: DVec3,
    /// What closing the gap has put in, J.
    pub work: f64,
    /// How much impulse makes the points faster against each other, along each axis, kg; 0 where neither moves.
    pub masses: Vec3,
    /// How far the points are to be apart at the end of the substep, and how far they may miss that, m.
    pub gap: DVec3,
    pub miss: f64,
    /// Whether it acts in this moment.
    pub acts: bool,
    /// Whether a body at it is not moved by VERLET.
    pub has_equation: bool,
}

saved! { Bond {
    id, points, corners, thread, limit, foreseen, mean, is_in_turn, load, impulse, sum, work, masses, gap, miss, acts,
    has_equation,
} }

/// A node at which bonds are.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct BondEnd {
    pub body: usize,
    pub node: u32,
    /// Whether a bond is there still.
    pub is_used: bool,
    /// Whether its velocity is that of a skin.
    pub is_on_skin: bool,
    /// Whether it is the turn of the group of its body.
    pub is_in_turn: bool,
    pub velocity: Vec3,
    /// 1/kg; 0 along axes along which it is held.
    pub answer: Vec3,
    /// What was given to it in this substep, N s, or what is foreseen, N.
    pub given: Vec3,
    pub place: DVec3,
    pub shift: DVec3,
    /// What acts on it from outside in this step, N, and whether anything does on its body.
    pub pending: Vec3,
    pub is_pending: bool,
}

saved! { BondEnd {
    body, node, is_used, is_on_skin, is_in_turn, velocity, answer, given, place, shift, pending, is_pending,
} }

impl Bond {
    pub fn used(&self) -> impl Iterator<Item = BondCorner> + use<> {
        self.corners.into_iter().filter(|corner| corner.weight != 0.0)
    }

    pub fn concerns(&self, body: usize) -> bool {
        self.points.iter().any(|point| point.body == body)
    }
}

impl BondEnd {
    pub fn new(corner: &BondCorner) -> Self {
        Self {
            body: corner.body,
            node: corner.node,
            is_used: true,
            ..Self::default()
        }
    }
}

/// Where a point that is bound is now, m.
pub(super) fn place(point: &BondPoint, bodies: &impl Systems) -> Option<DVec3> {
    let body = bodies.at(point.body)?;
    let positions = body.state.positions();
    let place = |(node, weight): (u32, f32)| positions.get(node as usize).as_dvec3() * f64::from(weight);
    Some(point.nodes.into_iter().map(place).sum::<DVec3>() / point.weight() + body.origin)
}

/// The corners of two points: a node that has a part in both has the difference.
pub(super) fn corners_of(points: &[BondPoint; 2]) -> [BondCorner; CORNERS] {
    let mut corners = [BondCorner::default(); CORNERS];
    let mut count = 0;
    for (point, sign) in points.iter().zip([1.0, -1.0]) {
        for &(node, weight) in point.nodes.iter().filter(|(_, weight)| *weight != 0.0) {
            let is_known = |corner: &&mut BondCorner| (corner.body, corner.node) == (point.body, node);
            match corners[..count].iter_mut().find(is_known) {
                Some(corner) => corner.weight += sign * weight,
                None => {
                    corners[count] = BondCorner {
                        body: point.body,
                        node,
                        weight: sign * weight,
                        end: 0,
                    };
                    count += 1;
                }
            }
        }
    }
    corners
}

/// How far two points are apart now, m.
pub(crate) fn distance(bodies: &impl Systems, points: &[BondPoint; 2]) -> f64 {
    let apart: DVec3 = corners_of(points)
        .iter()
        .filter(|corner| corner.weight != 0.0)
        .filter_map(|corner| {
            let body = bodies.at(corner.body)?;
            let place = body.state.positions().get(corner.node as usize).as_dvec3() + body.origin;
            Some(place * f64::from(corner.weight))
        })
        .sum();
    apart.length()
}

/// Where a node is among ends, or would be.
pub(super) fn place_of(ends: &[BondEnd], body: usize, node: u32) -> std::result::Result<usize, usize> {
    ends.binary_search_by_key(&(body, node), |end| (end.body, end.node))
}
