//! Keeps the sides of contacts from passing each other as they turn.
//!
//! A contact asks for velocities along the normal that it was found with. What turns meanwhile, or what few sweeps leave, takes its sides nearer than
//! that by little: but where they keep apart by little too they would pass, and of an open surface nothing tells afterwards which side was which.

use glam::Vec3A;

use super::DeformableContact;
use super::link::Link;
use super::search::shift;
use super::skin::Skin;
use crate::contact::sweep::Segment;
use crate::solver::Span;

/// Sides that end nearer than this part of what they keep off are looked after. What is inside a closed body is known to be, and led out.
const NEAR: f32 = 0.5;
const NEAR_OF_CLOSED: f32 = 0.2;

/// They may end nearer than they are to by this part of the least thickness, and those of two closed bodies by a part of how near that is.
const ALLOWED: f32 = 0.01;
const ALLOWED_OF_CLOSED: f32 = 0.1;

impl DeformableContact {
    /// Asks more of contacts where any has sides that end nearer than they are to, as fast as they go now: whether any has.
    pub(super) fn hold_sides(&mut self, moment: &Span) -> bool {
        let Self { links, skins, .. } = self;
        let end_of = |link: &Link| SidesEnd::of(link, skins, moment.duration);
        let lacks = moment.drifts && links.iter().any(|link| end_of(link).is_some_and(|end| end.lacks));
        for link in links.iter_mut().filter(|_| lacks) {
            if let Some(end) = end_of(link) {
                link.turn(end.nearer, moment.duration);
            }
        }
        lacks
    }
}

/// How the sides of a contact end a substep.
struct SidesEnd {
    /// By how much they are nearer to each other than as fast as they go along the normal, m.
    nearer: f32,
    /// Whether they are too near.
    lacks: bool,
}

impl SidesEnd {
    fn of(link: &Link, skins: &[Option<Skin>], duration: f32) -> Option<Self> {
        let [first, second] = &link.sides;
        let (own, others) = (skins[first.body].as_ref()?, skins[second.body].as_ref()?);
        let are_closed = first.body != second.body && own.is_closed && others.is_closed;
        let seen = (shift(own, others), others.drift);
        let ways = [0, 1].map(|end| own.way(first.nodes[end], seen, duration));
        let segment = Segment {
            ends: ways.map(|way| way.start),
            steps: ways.map(|way| way.step),
            radius: 0.0,
        };
        let is_edge = second.nodes[1] == second.nodes[2];
        let corners = others.corners(&second.nodes[..if is_edge { 2 } else { 3 }]);
        // As the contact takes them: its points of both, along its normal.
        let [began, ended] = [0.0, 1.0].map(|time| {
            let [from, to] = segment.at(first.weights[1]);
            let parts = corners.at(time).into_iter().zip(second.weights);
            let other: Vec3A = parts.map(|(at, weight)| at * weight).sum();
            (from.lerp(to, time) - other).dot(link.normal.into())
        });
        // The offset leads from the segment to the corners.
        let end = corners.separation(&segment, 1.0);
        let along = -end.offset.dot(link.normal.into());
        let is = if end.inside && (segment.is_point() || end.is_across()) {
            along.signum() * end.offset.length()
        } else {
            along
        };
        let wanted = began + link.least_speed_found(duration) * duration;
        let least = own.least_thickness().min(others.least_thickness());
        let is_inside = are_closed && began <= 0.0;
        let (near, allowed) = if are_closed {
            (NEAR_OF_CLOSED, (ALLOWED_OF_CLOSED * wanted).max(ALLOWED * least))
        } else {
            (NEAR, ALLOWED * least)
        };
        Some(Self {
            nearer: ended - is,
            lacks: !is_inside && is < near * (began + link.depth) && wanted - is > allowed,
        })
    }
}
