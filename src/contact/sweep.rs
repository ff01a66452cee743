//! When a moving node, edge or face first touches a moving tool: conservative advancement.

use glam::Vec3;

use super::closest::Closest;
use super::distance::{closest_of_segments, closest_on_segment, closest_on_triangle};
use super::mesh_solid::MeshSolid;
use crate::geometry::Bounds;

/// A gap of this part of the tool's radius, or of half its least extent, counts as touching.
pub(super) const TOUCHING: f32 = 1e-4;

/// A way of this part of half a mesh's least extent is not searched: it is too short to pass anything.
pub(super) const FLAT: f32 = 0.01;

/// Advances of one search. A search that takes more grazes the tool, and ends where it is, still clear of it.
const ADVANCES: u32 = 32;

/// The corners of a node, edge or face over a substep.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Corners {
    pub points: [Vec3; 3],
    pub steps: [Vec3; 3],
    pub count: usize,
}

/// The segment within a rounded tool over a substep.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Segment {
    pub ends: [Vec3; 2],
    pub steps: [Vec3; 2],
    pub radius: f32,
}

/// The closest points of a feature and a tool's segment.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Separation {
    /// From the segment to the feature.
    pub offset: Vec3,
    /// The feature's point, as weights of its corners.
    pub weights: [f32; 3],
    /// The segment's point, 0 to 1.
    pub along: f32,
    /// Whether the feature's point lies within it, and not at its border, where a smaller feature is met instead.
    pub inside: bool,
}

impl Segment {
    /// One of its ends alone.
    pub fn end(&self, index: usize) -> Self {
        Self {
            ends: [self.ends[index]; 2],
            steps: [self.steps[index]; 2],
            ..*self
        }
    }

    /// Where a point of it is, first and last.
    pub fn at(&self, share: f32) -> [Vec3; 2] {
        let place = self.ends[0].lerp(self.ends[1], share);
        [place, place + self.steps[0].lerp(self.steps[1], share)]
    }

    pub fn is_point(&self) -> bool {
        self.ends[0] == self.ends[1] && self.steps[0] == self.steps[1]
    }

    /// How far its ends go.
    pub fn travel(&self) -> f32 {
        self.steps[0].length().max(self.steps[1].length())
    }
}

impl Separation {
    /// Whether two edges come closest between their ends.
    pub fn is_across(&self) -> bool {
        self.inside && self.along > 0.0 && self.along < 1.0
    }
}

impl Corners {
    /// The box about them as the substep begins.
    pub fn bounds(&self) -> Bounds {
        Bounds::of(self.points[..self.count].iter().copied())
    }

    /// Of a node.
    pub fn of_node(point: Vec3, step: Vec3) -> Self {
        Self {
            points: [point; 3],
            steps: [step; 3],
            count: 1,
        }
    }

    /// The closest points at `time`, a fraction of the substep. A face is compared with the segment's first end alone:
    /// its interior is closest to one of the ends, its border is the edges' concern.
    pub fn separation(&self, segment: &Segment, time: f32) -> Separation {
        let corner = |index: usize| self.points[index] + self.steps[index] * time;
        let [a, b] = [0, 1].map(|end| segment.ends[end] + segment.steps[end] * time);
        let within = |weight: f32| weight > 0.0 && weight < 1.0;
        match self.count {
            1 => {
                let along = closest_on_segment(corner(0), a, b);
                Separation {
                    offset: corner(0) - a.lerp(b, along),
                    weights: [1.0, 0.0, 0.0],
                    along,
                    inside: true,
                }
            }
            2 => {
                let (p, q) = (corner(0), corner(1));
                let (on_edge, along) = closest_of_segments(p, q, a, b);
                Separation {
                    offset: p.lerp(q, on_edge) - a.lerp(b, along),
                    weights: [1.0 - on_edge, on_edge, 0.0],
                    along,
                    inside: within(on_edge),
                }
            }
            _ => {
                let (p, q, r) = (corner(0), corner(1), corner(2));
                let weights = closest_on_triangle(a, p, q, r);
                Separation {
                    offset: p * weights[0] + q * weights[1] + r * weights[2] - a,
                    weights,
                    along: 0.0,
                    inside: weights.iter().all(|&weight| within(weight)),
                }
            }
        }
    }

    /// How much closer they can come over the whole substep.
    pub fn closing(&self, segment: &Segment) -> f32 {
        let mut closing = 0.0_f32;
        for step in &self.steps[..self.count] {
            for end in &segment.steps {
                closing = closing.max(step.distance_squared(*end));
            }
        }
        closing.sqrt()
    }

    /// The separation when they first touch, or at the end of the substep where they do not; `None` where they stay
    /// further apart than the radius and `margin`, as far as they do not touch.
    pub fn approach(&self, segment: &Segment, margin: f32) -> Option<Separation> {
        self.approach_from(self.separation(segment, 0.0), segment, margin)
    }

    /// The same, where the separation as the substep begins is known.
    pub fn approach_from(&self, start: Separation, segment: &Segment, margin: f32) -> Option<Separation> {
        let closing = self.closing(segment);
        let touching = TOUCHING * segment.radius;
        let margin = margin.max(touching);
        let mut separation = start;
        let mut gap = separation.offset.length() - segment.radius;
        if !(gap <= closing + margin) {
            return None;
        }
        let mut time = 0.0;
        for _ in 0..ADVANCES {
            if gap <= touching {
                return Some(separation);
            }
            time += gap / closing;
            if !(time < 1.0) {
                let last = self.separation(segment, 1.0);
                return (last.offset.length() - segment.radius <= margin).then_some(last);
            }
            separation = self.separation(segment, time);
            gap = separation.offset.length() - segment.radius;
        }
        Some(separation)
    }

    /// The separation when they first touch, or else where they come closer than `ahead` beyond the radius, m, and whether they do not touch; `None`
    /// where not even that.
    pub fn meet(&self, start: Separation, segment: &Segment, ahead: f32) -> Option<(Separation, bool)> {
        let closing = self.closing(segment);
        let gap = start.offset.length() - segment.radius;
        if !(gap <= closing + ahead) {
            return None;
        }
        if let Some(touch) = self.approach_from(start, segment, 0.0) {
            return Some((touch, false));
        }
        if gap <= ahead {
            return Some((start, true));
        }
        let wider = Segment {
            radius: segment.radius + ahead,
            ..*segment
        };
        self.approach_from(start, &wider, 0.0).map(|found| (found, true))
    }

    /// The same for what a mesh encloses, in whose own frame the corners are: also when that is, a fraction of the substep. They touch
    /// where they are `clearance` apart.
    pub fn approach_mesh(
        &self,
        solid: &MeshSolid,
        clearance: f32,
        margin: f32,
        is_pinned: bool,
    ) -> Option<(Closest, f32)> {
        let closest_at = |time: f32, within: f32| solid.closest(&self.at(time)[..self.count], within, is_pinned);
        let closing = self.steps[..self.count]
            .iter()
            .fold(0.0, |closing: f32, step| closing.max(step.length()));
        let touching = TOUCHING * solid.thickness();
        let within = clearance + margin.max(touching);
        let mut time = 0.0;
        let mut closest = closest_at(0.0, within + closing)?;
        for _ in 0..ADVANCES {
            let gap = closest.distance - clearance;
            // So short a way sees the solid as flat.
            if gap <= touching || closing * (1.0 - time) <= FLAT * solid.thickness() {
                break;
            }
            time += gap / closing;
            if !(time < 1.0) {
                let last = closest_at(1.0, within)?;
                return Some((last, 1.0));
            }
            // Further away than the tool can still come to meet it.
            let left = closing * (1.0 - time);
            closest = closest_at(time, within + left)?;
        }
        Some((closest, time))
    }

    /// The corners at `time`.
    pub fn at(&self, time: f32) -> [Vec3; 3] {
        [0, 1, 2].map(|corner| self.points[corner] + self.steps[corner] * time)
    }
}
