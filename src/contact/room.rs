//! Where a feature has to come in a slice to meet a tool: what its corners alone tell saves looking at most of what is near.

use glam::{Vec3, Vec3A};

use super::distance::closest_on_segment;
use super::meeting::{Meeting, Slice};
use super::path::{Motion, Solid};
use super::sweep::{Segment, TOUCHING};
use crate::geometry::Bounds;

/// All that a tool may meet in a slice.
#[derive(Clone, Copy, Debug)]
pub(super) struct Room {
    bounds: Bounds,
    /// For a rounded tool: what is within it, and how far from that a contact may be, m.
    rounded: Option<(Segment, f32)>,
}

impl Motion<'_> {
    /// The room of the tool over the slice, of a box; `None` for a plane.
    pub fn room(&self, meeting: &Meeting, slice: &Slice) -> Option<Room> {
        let margin = meeting.slack + meeting.thickness;
        match (self.from, self.to) {
            (Solid::Rounded { radius, .. }, _) => {
                let segment = self.segment(meeting.drifts);
                let reach = radius * (1.0 + TOUCHING) + segment.travel() + margin;
                let ends = [0.0, 1.0]
                    .map(|share| segment.at(share).map(Vec3::from))
                    .into_iter()
                    .flatten();
                Some(Room {
                    bounds: Bounds::of(ends).extended(reach),
                    rounded: Some((segment, reach)),
                })
            }
            (Solid::Mesh(from), Solid::Mesh(to)) => {
                let solid = self.mesh?;
                let corners = [from, to].map(|placement| solid.corners().map(|corner| placement.placed(corner)));
                // A corner that turns goes outside the box of its ends by less than its way.
                let travel = from.centre.distance(to.centre) + self.spin.length() * slice.duration * solid.reach();
                let touching = TOUCHING * solid.thickness();
                Some(Room {
                    bounds: Bounds::of(corners.into_iter().flatten()).extended(2.0 * travel + touching + margin),
                    rounded: None,
                })
            }
            _ => None,
        }
    }
}

impl Room {
    /// On which sides of the room something stays that goes a straight step from `start`, a bit for each: what has no edge longer than
    /// `longest`, m, and all of its corners on a side does not come there.
    #[inline]
    pub fn sides(&self, start: Vec3, step: Vec3, longest: f32) -> u32 {
        let sides = sides_of(&self.bounds, start) & sides_of(&self.bounds, start + step);
        let Some((segment, reach)) = self.rounded.filter(|_| sides == 0) else {
            return sides;
        };
        let [a, b] = segment.ends;
        let own = Vec3A::from(start);
        let distance = own.distance(a.lerp(b, closest_on_segment(own, a, b)));
        let nearest = distance - step.length() - segment.travel();
        // A point with weights w of corners p is at a squared distance from c of Σ w |p - c|² - Σ w w' |p - p'|², and the weights' products
        // are a third in sum at most.
        if nearest > 0.0 && nearest * nearest > reach * reach + longest * longest / 3.0 {
            FAR
        } else {
            0
        }
    }
}

/// The side of what is further than a rounded tool reaches.
const FAR: u32 = 1 << 6;

/// On which sides of a box it is, a bit for each.
#[inline]
pub(super) fn sides_of(bounds: &Bounds, place: Vec3) -> u32 {
    let below = place.cmplt(bounds.min).bitmask();
    below | (place.cmpgt(bounds.max).bitmask()) << 3
}
