//! Time of impact of a moving node, edge or face and a moving tool, by conservative advancement along the direction
//! between the closest points (Mirtich 1996).

use glam::{Vec3, Vec3A};

use super::closest::Closest;
use super::distance::{closest_of_segments, closest_on_segment, closest_on_triangle};
use super::mesh_solid::MeshSolid;
use super::nearest_plane::LastDistance;

/// Gap that counts as touching, as a fraction of the tool's radius or of half its least extent.
pub(super) const TOUCHING: f32 = 1e-4;

/// Gap that counts as touching between tissues, as a fraction of the contact thickness. It may be coarse: the time of
/// impact determines only the normal, and the gap is taken when the substep begins.
const TISSUE_TOUCHING: f32 = 1e-2;

/// Rounding error of positions along a direction, relative to their size. An offset has an accurate direction if its
/// relative length is at least `MIN_OFFSET`.
const ROUNDING: f32 = 1e-6;
const MIN_OFFSET: f32 = 1e-5;

/// Displacement that is not swept, as a fraction of half a mesh's least extent. It is too short to pass through
/// anything.
pub(super) const FLAT: f32 = 0.01;

/// Maximum number of advances of a search. A longer search grazes the tool and ends at its last time, still clear of
/// the tool.
const MAX_ADVANCES: u32 = 32;

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

/// Bounding box of points, in a form that is fast to compare.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Extent {
    min: Vec3A,
    max: Vec3A,
}

/// The closest points of a feature and a tool's segment.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Separation {
    /// Vector from the segment to the feature.
    pub offset: Vec3A,
    /// Barycentric weights of the feature's point.
    pub weights: [f32; 3],
    /// Parameter of the segment's point, 0 to 1.
    pub along: f32,
    /// True if the feature's point lies in its interior. At its border a smaller feature touches instead.
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

    /// Squared distance from another box; 0 if they overlap.
    pub fn distance_squared(&self, other: &Self) -> f32 {
        let apart = (self.min - other.max).max(other.min - self.max);
        apart.max(Vec3A::ZERO).length_squared()
    }
}

impl Segment {
    /// A segment at rest, without thickness.
    pub fn still(ends: [Vec3A; 2]) -> Self {
        Self {
            ends,
            steps: [Vec3A::ZERO; 2],
            radius: 0.0,
        }
    }

    /// One end of the segment as a point.
    pub fn end(&self, index: usize) -> Self {
        Self {
            ends: [self.ends[index]; 2],
            steps: [self.steps[index]; 2],
            ..*self
        }
    }

    /// Positions of the point with parameter `share`, at the start and at the end.
    pub fn at(&self, share: f32) -> [Vec3A; 2] {
        let position = self.ends[0].lerp(self.ends[1], share);
        [position, position + self.steps[0].lerp(self.steps[1], share)]
    }

    pub fn is_point(&self) -> bool {
        self.ends[0] == self.ends[1] && self.steps[0] == self.steps[1]
    }

    /// Longest displacement of an end.
    pub fn travel(&self) -> f32 {
        self.steps[0].length().max(self.steps[1].length())
    }
}

/// Projections of a feature's corners and a segment's ends onto one direction: positions and displacements over a
/// substep, m. Both shapes are convex. So their distance is never less than that of their projections.
struct AxisProjection {
    corners: [(f32, f32); 3],
    ends: [(f32, f32); 2],
    /// Bound on the error of the distance by rounding, m.
    rounding: f32,
}

impl AxisProjection {
    /// Lower bound of the distance along the direction during the next `time`, a fraction of the substep. On straight
    /// paths the minimum is at the start or the end.
    fn min_gap_until(&self, time: f32) -> f32 {
        let apart = |time: f32| {
            let at = |&(position, step): &(f32, f32)| position + step * time;
            let nearest = self.corners.iter().map(at).fold(f32::INFINITY, f32::min);
            nearest - self.ends.iter().map(at).fold(f32::NEG_INFINITY, f32::max)
        };
        apart(0.0).min(apart(time)) - self.rounding
    }

    /// Earliest time, as a fraction of the substep, after which a corner and an end are `radius` apart.
    fn earliest_touch(&self, radius: f32) -> f32 {
        let radius = radius + self.rounding;
        let mut first = f32::INFINITY;
        for corner in &self.corners {
            for end in &self.ends {
                let (gap, closing) = (corner.0 - end.0 - radius, end.1 - corner.1);
                // With rounding errors in the direction, they may be this close already.
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
    /// True if two edges are closest between their ends.
    pub fn is_across(&self) -> bool {
        self.inside && self.along > 0.0 && self.along < 1.0
    }

    /// True if two edges with the vectors `edges` are closest at points further than `margin` from all ends, m.
    pub fn is_across_beyond(&self, margin: f32, edges: [Vec3A; 2]) -> bool {
        let shares = [self.along, self.weights[1]].map(|share| share.min(1.0 - share));
        let is_beyond = |(edge, share): (Vec3A, f32)| (edge * share).length_squared() > margin * margin;
        self.is_across() && edges.into_iter().zip(shares).all(is_beyond)
    }
}

impl Corners {
    /// At most three corners with these positions and displacements.
    #[inline]
    pub fn moving(motions: impl Iterator<Item = (Vec3A, Vec3A)>) -> Self {
        let mut corners = Self {
            points: [Vec3A::ZERO; 3],
            steps: [Vec3A::ZERO; 3],
            count: 0,
        };
        for (point, step) in motions.take(3) {
            (corners.points[corners.count], corners.steps[corners.count]) = (point, step);
            corners.count += 1;
        }
        corners
    }

    /// Corners at rest.
    pub fn still(points: impl Iterator<Item = Vec3A>) -> Self {
        Self::moving(points.map(|point| (point, Vec3A::ZERO)))
    }

    /// Bounding box when the substep begins.
    pub fn bounds(&self) -> Extent {
        Extent::of(self.points.into_iter().take(self.count))
    }

    /// Bounding box of the paths of the corners.
    pub fn swept_bounds(&self) -> Extent {
        let ends = self.points.iter().zip(&self.steps).map(|(&point, &step)| point + step);
        let all = self.points.into_iter().take(self.count);
        Extent::of(all.chain(ends.take(self.count)))
    }

    /// The single corner of a node.
    pub fn of_node(point: Vec3, step: Vec3) -> Self {
        Self {
            points: [point.into(); 3],
            steps: [step.into(); 3],
            count: 1,
        }
    }

    /// The closest points at `time`, a fraction of the substep. A face is tested against the segment's first end only:
    /// its interior is closest to an end, and the edges cover its border.
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

    /// Projects the corners and the segment onto the direction of `offset` at `time`. `None` if rounding errors
    /// dominate the direction. A face is tested against the segment's first end only.
    fn project(&self, segment: &Segment, offset: Vec3A, time: f32) -> Option<AxisProjection> {
        let distance = offset.length();
        let normal = offset / distance;
        let mut size = Vec3A::ZERO;
        let mut project = |position: Vec3A, step: Vec3A| {
            let position = position - segment.ends[0];
            size = size.max(position.abs() + step.abs());
            let step_along = step.dot(normal);
            (position.dot(normal) + step_along * time, step_along)
        };
        let last_end = usize::from(self.count < 3);
        let ends = [0, last_end].map(|end| project(segment.ends[end], segment.steps[end]));
        let corners = [0, 1, 2].map(|index| {
            let corner = index.min(self.count - 1);
            project(self.points[corner], self.steps[corner])
        });
        let size = size.max_element();
        (distance > MIN_OFFSET * size).then_some(AxisProjection {
            corners,
            ends,
            rounding: ROUNDING * size,
        })
    }

    /// Bound on the approach over the whole substep.
    pub fn closing(&self, segment: &Segment) -> f32 {
        let mut closing = 0.0_f32;
        for step in &self.steps[..self.count] {
            for end in &segment.steps {
                closing = closing.max(step.distance_squared(*end));
            }
        }
        closing.sqrt()
    }

    /// The separation at the time of impact, or at the end of the substep without impact. `None` if they do not touch
    /// and stay further apart than the radius plus `margin`.
    pub fn approach(&self, segment: &Segment, margin: f32) -> Option<Separation> {
        let touching = TOUCHING * segment.radius;
        let start = self.separation(segment, 0.0);
        self.approach_from(
            start,
            (segment, self.closing(segment)),
            [touching, margin.max(touching)],
        )
    }

    /// Continues [`Self::approach`] from the separation when the substep begins. `closing` bounds the approach;
    /// `touching` is the gap that counts as touching, m, at most `margin`.
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
        for _ in 0..MAX_ADVANCES {
            if gap <= touching {
                return Some(separation);
            }
            // Rounding errors decide whether features this close touch. They count as touching.
            let Some(projection) = self.project(segment, separation.offset, time) else {
                return Some(separation);
            };
            if projection.min_gap_until(1.0 - time) > segment.radius + margin {
                return None;
            }
            time += (gap / closing).max(projection.earliest_touch(segment.radius));
            if !(time < 1.0) {
                let last = self.separation(segment, 1.0);
                return (last.offset.length() - segment.radius <= margin).then_some(last);
            }
            separation = self.separation(segment, time);
            gap = separation.offset.length() - segment.radius;
        }
        Some(separation)
    }

    /// The separation at the time of impact, or without impact at the time when the gap falls below `ahead`, m. The
    /// flag is true without impact. `None` if the gap stays larger.
    pub fn first_contact(&self, start: Separation, segment: &Segment, ahead: f32) -> Option<(Separation, bool)> {
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

    /// The closest point of a mesh at the time of impact, and that time as a fraction of the substep. The corners are
    /// in the mesh's frame. They touch the mesh at a distance of `clearance`. `last` is their last distance from the
    /// tool in this slot of the world.
    pub(super) fn approach_mesh(
        &self,
        solid: &MeshSolid,
        clearance: f32,
        margin: f32,
        is_pinned: bool,
        last: Option<(usize, &mut LastDistance)>,
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
        for _ in 0..MAX_ADVANCES {
            let gap = closest.distance - clearance;
            // Over so short a displacement the solid counts as flat.
            if gap <= touching || closing * (1.0 - time) <= solid.flat() {
                break;
            }
            time += gap / closing;
            if !(time < 1.0) {
                let last = closest_at(1.0, within)?;
                return Some((last, 1.0));
            }
            // If the mesh is further away, the remaining approach cannot close the gap.
            let remaining = closing * (1.0 - time);
            closest = closest_at(time, within + remaining)?;
        }
        Some((closest, time))
    }

    /// Positions of the corners at `time`.
    pub fn at(&self, time: f32) -> [Vec3A; 3] {
        [0, 1, 2].map(|corner| self.points[corner] + self.steps[corner] * time)
    }
}
