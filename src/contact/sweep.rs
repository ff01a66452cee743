//! When a moving node, edge or face first touches a moving tool: conservative advancement along the direction between the closest points (Mirtich 1996).

use glam::{Vec3, Vec3A};

use super::closest::Closest;
use super::distance::{closest_of_segments, closest_on_segment, closest_on_triangle};
use super::mesh_solid::MeshSolid;
use super::nearest_plane::LastMet;

/// A gap of this part of the tool's radius, or of half its least extent, counts as touching.
pub(super) const TOUCHING: f32 = 1e-4;

/// The same of tissue, as a part of what it keeps off. When the touch is found says only which way it presses: how far apart the sides are is taken
/// as the substep begins.
const TISSUE_TOUCHING: f32 = 1e-2;

/// What rounding does to places along a direction, as a part of them; the direction of an offset that is this part of them is known well enough.
const ROUNDING: f32 = 1e-6;
const SHORT: f32 = 1e-5;

/// A way of this part of half a mesh's least extent is not searched: it is too short to pass anything.
pub(super) const FLAT: f32 = 0.01;

/// Advances of one search. A search that takes more grazes the tool, and ends where it is, still clear of it.
const ADVANCES: u32 = 32;

/// The corners of a node, edge or face over a substep.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Corners {
    pub points: [Vec3A; 3],
    pub steps: [Vec3A; 3],
    pub count: usize,
}

/// The segment within a rounded tool over a substep.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Segment {
    pub ends: [Vec3A; 2],
    pub steps: [Vec3A; 2],
    pub radius: f32,
}

/// A box about points, which is soon compared with others.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Extent {
    min: Vec3A,
    max: Vec3A,
}

/// The closest points of a feature and a tool's segment.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Separation {
    /// From the segment to the feature.
    pub offset: Vec3A,
    /// The feature's point, as weights of its corners.
    pub weights: [f32; 3],
    /// The segment's point, 0 to 1.
    pub along: f32,
    /// Whether the feature's point lies within it, and not at its border, where a smaller feature is met instead.
    pub inside: bool,
}

impl Extent {
    pub fn of(mut points: impl Iterator<Item = Vec3A>) -> Self {
        let first = points.next().unwrap_or(Vec3A::INFINITY);
        let all = Self { min: first, max: first };
        points.fold(all, |Self { min, max }, point| Self {
            min: min.min(point),
            max: max.max(point),
        })
    }

    /// The square of how far it is from another; 0 where they overlap.
    pub fn distance_squared(&self, other: &Self) -> f32 {
        let apart = (self.min - other.max).max(other.min - self.max);
        apart.max(Vec3A::ZERO).length_squared()
    }
}

impl Segment {
    /// One without thickness that stays where it is.
    pub fn still(ends: [Vec3A; 2]) -> Self {
        Self {
            ends,
            steps: [Vec3A::ZERO; 2],
            radius: 0.0,
        }
    }

    /// One of its ends alone.
    pub fn end(&self, index: usize) -> Self {
        Self {
            ends: [self.ends[index]; 2],
            steps: [self.steps[index]; 2],
            ..*self
        }
    }

    /// Where a point of it is, first and last.
    pub fn at(&self, share: f32) -> [Vec3A; 2] {
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

/// Where the corners of a feature and the ends of a segment are along one direction, m, and how far they go along it in a substep, m. Both are
/// convex: along the direction between their closest points they are no closer than these are, now or later.
struct Along {
    corners: [(f32, f32); 3],
    ends: [(f32, f32); 2],
    /// How much nearer rounding may have them be, m.
    rounding: f32,
}

impl Along {
    /// How far they are apart along it at least until after this part of a substep: now or then, as what is least of straight ways.
    fn least_until(&self, time: f32) -> f32 {
        let apart = |time: f32| {
            let at = |&(place, step): &(f32, f32)| place + step * time;
            let nearest = self.corners.iter().map(at).fold(f32::INFINITY, f32::min);
            nearest - self.ends.iter().map(at).fold(f32::NEG_INFINITY, f32::max)
        };
        apart(0.0).min(apart(time)) - self.rounding
    }

    /// After which part of a substep the first of them come as close as `radius`, at the earliest.
    fn time_to(&self, radius: f32) -> f32 {
        let radius = radius + self.rounding;
        let mut first = f32::INFINITY;
        for corner in &self.corners {
            for end in &self.ends {
                let (gap, closing) = (corner.0 - end.0 - radius, end.1 - corner.1);
                // Where rounding has the direction be another, they may be that close along it now.
                if gap <= 0.0 {
                    return 0.0;
                }
                if closing > 0.0 {
                    first = first.min(gap / closing);
                }
            }
        }
        first
    }
}

impl Separation {
    /// Whether two edges come closest between their ends.
    pub fn is_across(&self) -> bool {
        self.inside && self.along > 0.0 && self.along < 1.0
    }

    /// Whether two edges that are `edges` from end to end come closest further than `margin` from all ends, m.
    pub fn is_across_beyond(&self, margin: f32, edges: [Vec3A; 2]) -> bool {
        let shares = [self.along, self.weights[1]].map(|share| share.min(1.0 - share));
        let is_beyond = |(edge, share): (Vec3A, f32)| (edge * share).length_squared() > margin * margin;
        self.is_across() && edges.into_iter().zip(shares).all(is_beyond)
    }
}

impl Corners {
    /// Of what begins at these places and goes so far, three at most.
    #[inline]
    pub fn of(ways: impl Iterator<Item = (Vec3A, Vec3A)>) -> Self {
        let mut corners = Self {
            points: [Vec3A::ZERO; 3],
            steps: [Vec3A::ZERO; 3],
            count: 0,
        };
        for (point, step) in ways.take(3) {
            (corners.points[corners.count], corners.steps[corners.count]) = (point, step);
            corners.count += 1;
        }
        corners
    }

    /// Of what stays where it is.
    pub fn still(points: impl Iterator<Item = Vec3A>) -> Self {
        Self::of(points.map(|point| (point, Vec3A::ZERO)))
    }

    /// The box about them as the substep begins.
    pub fn bounds(&self) -> Extent {
        Extent::of(self.points.into_iter().take(self.count))
    }

    /// The box about their ways.
    pub fn way(&self) -> Extent {
        let ends = self.points.iter().zip(&self.steps).map(|(&point, &step)| point + step);
        let all = self.points.into_iter().take(self.count);
        Extent::of(all.chain(ends.take(self.count)))
    }

    /// Of a node.
    pub fn of_node(point: Vec3, step: Vec3) -> Self {
        Self {
            points: [point.into(); 3],
            steps: [step.into(); 3],
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

    /// What is along the direction of this offset at `time`; `None` where rounding decides that. A face is compared with the segment's first end
    /// alone.
    fn along(&self, segment: &Segment, offset: Vec3A, time: f32) -> Option<Along> {
        let distance = offset.length();
        let normal = offset / distance;
        let mut size = Vec3A::ZERO;
        let mut along = |place: Vec3A, step: Vec3A| {
            let place = place - segment.ends[0];
            size = size.max(place.abs() + step.abs());
            let step_along = step.dot(normal);
            (place.dot(normal) + step_along * time, step_along)
        };
        let last_end = usize::from(self.count < 3);
        let ends = [0, last_end].map(|end| along(segment.ends[end], segment.steps[end]));
        let corners = [0, 1, 2].map(|index| {
            let corner = index.min(self.count - 1);
            along(self.points[corner], self.steps[corner])
        });
        let size = size.max_element();
        (distance > SHORT * size).then_some(Along {
            corners,
            ends,
            rounding: ROUNDING * size,
        })
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
        let touching = TOUCHING * segment.radius;
        let start = self.separation(segment, 0.0);
        self.approach_from(
            start,
            (segment, self.closing(segment)),
            [touching, margin.max(touching)],
        )
    }

    /// The same, where the separation as the substep begins is known, how much closer they can come, and what gap counts as touching, m, no more than
    /// the margin.
    fn approach_from(
        &self,
        start: Separation,
        (segment, closing): (&Segment, f32),
        [touching, margin]: [f32; 2],
    ) -> Option<Separation> {
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
            // Whether they touch that are so close is for rounding to say.
            let Some(along) = self.along(segment, separation.offset, time) else {
                return Some(separation);
            };
            if along.least_until(1.0 - time) > segment.radius + margin {
                return None;
            }
            time += (gap / closing).max(along.time_to(segment.radius));
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
        let gap = start.offset.length() - segment.radius;
        let touching = TISSUE_TOUCHING * segment.radius;
        if gap <= touching {
            return Some((start, false));
        }
        let closing = self.closing(segment);
        if !(gap <= closing + ahead) {
            return None;
        }
        if let Some(touch) = self.approach_from(start, (segment, closing), [touching; 2]) {
            return Some((touch, false));
        }
        if gap <= ahead {
            return Some((start, true));
        }
        let wider = Segment {
            radius: segment.radius + ahead,
            ..*segment
        };
        self.approach_from(start, (&wider, closing), [touching; 2])
            .map(|found| (found, true))
    }

    /// The same for what a mesh encloses, in whose own frame the corners are: also when that is, a fraction of the substep. They touch
    /// where they are `clearance` apart. `last` is how they met the tool at this place in the world last.
    pub(super) fn approach_mesh(
        &self,
        solid: &MeshSolid,
        clearance: f32,
        margin: f32,
        is_pinned: bool,
        last: Option<(usize, &mut LastMet)>,
    ) -> Option<(Closest, f32)> {
        let closest_at =
            |time: f32, within: f32| solid.closest(&self.at(time).map(Vec3::from)[..self.count], within, is_pinned);
        let closing = self.steps[..self.count]
            .iter()
            .fold(0.0, |closing: f32, step| closing.max(step.length()));
        let touching = TOUCHING * solid.thickness();
        let within = clearance + margin.max(touching);
        let mut time = 0.0;
        let mut closest = match last {
            Some((slot, last)) => {
                let points = self.points.map(Vec3::from);
                last.closest((slot, solid), &points[..self.count], within + closing, is_pinned)?
            }
            None => closest_at(0.0, within + closing)?,
        };
        for _ in 0..ADVANCES {
            let gap = closest.distance - clearance;
            // So short a way sees the solid as flat.
            if gap <= touching || closing * (1.0 - time) <= solid.flat() {
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
    pub fn at(&self, time: f32) -> [Vec3A; 3] {
        [0, 1, 2].map(|corner| self.points[corner] + self.steps[corner] * time)
    }
}
