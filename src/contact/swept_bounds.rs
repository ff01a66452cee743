//! Conservative bounds of a tool over a slice. They cull features by their corners before the exact test.

use glam::{Vec3, Vec3A};

use super::contact_input::{ContactInput, SubSlice};
use super::distance::closest_on_segment;
use super::path::{PosedShape, ToolMotion};
use super::time_of_impact::{Segment, TOUCHING};
use crate::geometry::Aabb;

/// The region in which a feature may touch a tool in a slice.
#[derive(Clone, Copy, Debug)]
pub(super) struct SliceBounds {
    bounds: Aabb,
    /// For a rounded tool: its segment, and the maximum distance of a contact from the segment, m.
    rounded: Option<(Segment, f32)>,
}

impl ToolMotion<'_> {
    /// The bounds of the tool over the slice. `None` for a plane.
    pub fn slice_bounds(&self, input: &ContactInput, slice: &SubSlice) -> Option<SliceBounds> {
        let margin = input.slack + input.thickness;
        match (self.from, self.to) {
            (PosedShape::Rounded { radius, .. }, _) => {
                let segment = self.segment(input.drifts);
                let reach = radius * (1.0 + TOUCHING) + segment.travel() + margin;
                let ends = [0.0, 1.0]
                    .map(|share| segment.at(share).map(Vec3::from))
                    .into_iter()
                    .flatten();
                Some(SliceBounds {
                    bounds: Aabb::of(ends).extended(reach),
                    rounded: Some((segment, reach)),
                })
            }
            (PosedShape::Mesh(from), PosedShape::Mesh(to)) => {
                let solid = self.mesh?;
                let corners = [from, to].map(|placement| solid.corners().map(|corner| placement.local_to_body(corner)));
                // A rotating corner leaves the box of its end positions by less than the length of its path.
                let travel = from.center.distance(to.center) + self.spin.length() * slice.duration * solid.reach();
                let touching = TOUCHING * solid.thickness();
                Some(SliceBounds {
                    bounds: Aabb::of(corners.into_iter().flatten()).extended(2.0 * travel + touching + margin),
                    rounded: None,
                })
            }
            _ => None,
        }
    }
}

impl SliceBounds {
    /// The sides of the bounds on which a point stays during a straight step from `start`, one bit per side. A feature
    /// with all corners on one side, and no edge longer than `longest`, m, stays outside.
    #[inline]
    pub fn sides(&self, start: Vec3, step: Vec3, longest: f32) -> u32 {
        let sides = outer_sides(&self.bounds, start) & outer_sides(&self.bounds, start + step);
        let Some((segment, reach)) = self.rounded.filter(|_| sides == 0) else {
            return sides;
        };
        let [a, b] = segment.ends;
        let point = Vec3A::from(start);
        let distance = point.distance(a.lerp(b, closest_on_segment(point, a, b)));
        let nearest = distance - step.length() - segment.travel();
        // A point with weights w of the corners p has the squared distance Σ w |p - c|² - Σ w w' |p - p'|² from c. The
        // products of the weights add up to a third at most.
        if nearest > 0.0 && nearest * nearest > reach * reach + longest * longest / 3.0 {
            FAR_SIDE
        } else {
            0
        }
    }
}

/// The side of points beyond the reach of a rounded tool.
const FAR_SIDE: u32 = 1 << 6;

/// The sides of a box on which a point lies, one bit per side.
#[inline]
pub(super) fn outer_sides(bounds: &Aabb, position: Vec3) -> u32 {
    let below = position.cmplt(bounds.min).bitmask();
    below | (position.cmpgt(bounds.max).bitmask()) << 3
}
