//! Prevents the sides of contacts from passing each other as they turn.
//!
//! A contact limits velocities along its initial normal. Rotation and remaining solver errors bring its sides slightly
//! nearer. At small contact distances they could pass each other, and the sides of an open surface could not be told
//! apart afterwards.

use glam::Vec3A;

use super::DeformableContact;
use super::collision_surface::CollisionSurface;
use super::pair_contact::PairContact;
use super::search::shift;
use crate::contact::time_of_impact::Segment;
use crate::solver::SubstepSpan;

/// Minimum gap at the end of a substep, as a fraction of the contact distance. Nodes inside closed bodies are detected
/// and pushed out, so a smaller gap suffices there.
const MIN_GAP: f32 = 0.5;
const MIN_GAP_OF_CLOSED: f32 = 0.2;

/// Tolerance of the gap, as a fraction of the minimum thickness, and for two closed bodies as a fraction of the
/// required gap.
const TOLERANCE: f32 = 0.01;
const TOLERANCE_OF_CLOSED: f32 = 0.1;

impl DeformableContact {
    /// Raises the target velocities of contacts if any has sides that end too close at the current velocities. Returns
    /// true if it did.
    pub(super) fn prevent_tunneling(&mut self, span: &SubstepSpan) -> bool {
        let Self {
            pair_contacts,
            surfaces,
            ..
        } = self;
        let compute_end_gap = |contact: &PairContact| EndGap::of(contact, surfaces, span.duration);
        let any_too_close = span.drifts
            && pair_contacts
                .iter()
                .any(|contact| compute_end_gap(contact).is_some_and(|end_gap| end_gap.is_too_close));
        for contact in pair_contacts.iter_mut().filter(|_| any_too_close) {
            if let Some(end_gap) = compute_end_gap(contact) {
                contact.raise_target_velocity(end_gap.lost_gap, span.duration);
            }
        }
        any_too_close
    }
}

/// The gap of a contact at the end of a substep.
struct EndGap {
    /// Gap that is lost compared to motion along the normal, m.
    lost_gap: f32,
    /// True if the sides end too close.
    is_too_close: bool,
}

impl EndGap {
    fn of(contact: &PairContact, surfaces: &[Option<CollisionSurface>], duration: f32) -> Option<Self> {
        let [first, second] = &contact.sides;
        let (first_surface, second_surface) = (surfaces[first.body].as_ref()?, surfaces[second.body].as_ref()?);
        let are_closed = first.body != second.body && first_surface.is_closed && second_surface.is_closed;
        let frame = (shift(first_surface, second_surface), second_surface.center_velocity);
        let motions = [0, 1].map(|end| first_surface.relative_motion(first.nodes[end], frame, duration));
        let segment = Segment {
            ends: motions.map(|motion| motion.start),
            steps: motions.map(|motion| motion.displacement),
            radius: 0.0,
        };
        let is_edge = second.nodes[1] == second.nodes[2];
        let corners = second_surface.corners(&second.nodes[..if is_edge { 2 } else { 3 }]);
        // Gap as the contact measures it: between its points, along its normal.
        let [start_gap, predicted_gap] = [0.0, 1.0].map(|time| {
            let [from, to] = segment.at(first.weights[1]);
            let parts = corners.at(time).into_iter().zip(second.weights);
            let second_point: Vec3A = parts.map(|(at, weight)| at * weight).sum();
            (from.lerp(to, time) - second_point).dot(contact.normal.into())
        });
        // The offset leads from the segment to the corners.
        let end_separation = corners.separation(&segment, 1.0);
        let along = -end_separation.offset.dot(contact.normal.into());
        let gap = if end_separation.inside && (segment.is_point() || end_separation.is_across()) {
            along.signum() * end_separation.offset.length()
        } else {
            along
        };
        let wanted_gap = start_gap + contact.gap_velocity(duration) * duration;
        let min_thickness = first_surface.min_thickness().min(second_surface.min_thickness());
        let is_inside = are_closed && start_gap <= 0.0;
        let (min_gap, tolerance) = if are_closed {
            (
                MIN_GAP_OF_CLOSED,
                (TOLERANCE_OF_CLOSED * wanted_gap).max(TOLERANCE * min_thickness),
            )
        } else {
            (MIN_GAP, TOLERANCE * min_thickness)
        };
        Some(Self {
            lost_gap: predicted_gap - gap,
            is_too_close: !is_inside && gap < min_gap * (start_gap + contact.depth) && wanted_gap - gap > tolerance,
        })
    }
}
