//! Where a feature of a body first meets a tool.

use glam::{Vec3, Vec3A};

use super::constraint::Constraint;
use super::features::Feature;
use super::meeting::{Meeting, Slice};
use super::nearest_plane::LastMet;
use super::path::{Motion, Placement, Solid};
use super::supports::{MOST, Supports};
use super::sweep::{Corners, Segment, Separation};

/// How a feature meets a tool over a slice.
#[derive(Clone, Copy, Debug)]
pub(super) struct ContactGeometry {
    /// The feature's point, as weights of its corners.
    pub weights: [f32; 3],
    /// Away from the tool, of unit length.
    pub normal: Vec3,
    /// Velocity of the tool's surface there, m/s.
    pub surface_velocity: Vec3,
    /// From the tool's position to the contact, m.
    pub arm: Vec3,
    /// Between the tool and the feature's point as the slice begins, m; below 0 inside.
    pub gap: f32,
    /// For a rounded tool: the ends of its segment when the slice ends, and the radius at which it is met.
    pub rounded: Option<([Vec3; 2], f32)>,
}

/// What contacts that are solved together may leave open between a node and a plane that touch, as a part of the way
/// that they would come nearer in a slice.
const LEFT: f32 = 5e-5;

/// What rounding may leave open between a node and a plane that touch, as a part of the largest coordinate.
const ROUNDING: f32 = 1e-6;

impl Motion<'_> {
    /// The segment within a rounded tool over a slice; with the last half kick of a step it has come to its end.
    pub fn segment(&self, drifts: bool) -> Segment {
        let (
            Solid::Rounded { a, b, radius },
            Solid::Rounded {
                a: last_a, b: last_b, ..
            },
        ) = (self.from, self.to)
        else {
            return Segment {
                ends: [Vec3A::INFINITY; 2],
                steps: [Vec3A::ZERO; 2],
                radius: 0.0,
            };
        };
        let steps = if drifts {
            [last_a - a, last_b - b].map(Vec3A::from)
        } else {
            [Vec3A::ZERO; 2]
        };
        Segment {
            ends: [a, b].map(Vec3A::from),
            steps,
            radius,
        }
    }

    /// How fast the tool's matter at `point` moves, m/s.
    fn velocity_at(&self, point: Vec3) -> Vec3 {
        self.velocity + self.spin.cross(point - self.centre)
    }
}

/// How a node meets a plane over the slice.
pub(super) fn meet_plane(meeting: &Meeting, slice: &Slice, motion: &Motion, node: usize) -> Option<ContactGeometry> {
    let (Solid::HalfSpace { point, normal: first }, Solid::HalfSpace { normal, .. }) = (motion.from, motion.to) else {
        return None;
    };
    let position = meeting.position(slice, node);
    let gap = (position - point).dot(first);
    let foot = position - first * gap;
    let surface_velocity = motion.velocity_at(foot);
    let closing = (surface_velocity - meeting.vector(meeting.velocities, node))
        .dot(normal)
        .max(0.0);
    let ahead = if meeting.drifts {
        (closing + surface_velocity.length()) * slice.duration + meeting.slack
    } else {
        let closing = closing.max(meeting.neighbor_speed.unwrap_or(0.0));
        LEFT * closing * slice.duration + ROUNDING * position.abs().max(point.abs()).max_element()
    };
    (gap <= meeting.thickness + ahead).then_some(ContactGeometry {
        weights: [1.0, 0.0, 0.0],
        normal,
        surface_velocity,
        arm: foot - motion.centre,
        gap,
        rounded: None,
    })
}

/// How a feature meets a rounded tool, or one tip of it, over the slice.
pub(super) fn meet_rounded(
    meeting: &Meeting,
    slice: &Slice,
    motion: &Motion,
    corners: &Corners,
    segment: &Segment,
) -> Option<ContactGeometry> {
    let around = Segment {
        radius: segment.radius + meeting.thickness,
        ..*segment
    };
    let separation = corners.approach(&around, segment.travel() + meeting.slack)?;
    if !separation.inside {
        return None;
    }
    let points = corners.points.iter().zip(separation.weights);
    let matter: Vec3A = points.map(|(point, weight)| *point * weight).sum();
    Some(round_geometry(
        meeting,
        slice,
        motion,
        segment,
        (&separation, matter.into()),
    ))
}

/// The contact of a round tool with a point of a feature, which is separated from it so.
#[inline]
pub(super) fn round_geometry(
    meeting: &Meeting,
    slice: &Slice,
    motion: &Motion,
    segment: &Segment,
    (separation, matter): (&Separation, Vec3),
) -> ContactGeometry {
    let [step, start] = [segment.steps, segment.ends].map(|[a, b]| Vec3::from(a.lerp(b, separation.along)));
    let axis_velocity = if meeting.drifts {
        step / slice.duration
    } else {
        motion.velocity_at(start)
    };
    // A feature through the middle of the tool has no side of its own: it is carried ahead of the tool.
    let normal = Vec3::from(separation.offset)
        .try_normalize()
        .or_else(|| axis_velocity.try_normalize())
        .unwrap_or(Vec3::Y);
    let surface = normal * segment.radius;
    let ends = [0, 1].map(|end| (segment.ends[end] + segment.steps[end]).into());
    ContactGeometry {
        weights: separation.weights,
        normal,
        surface_velocity: axis_velocity + motion.spin.cross(surface),
        arm: start + step + surface - motion.centre,
        gap: (matter - start).dot(normal) - segment.radius,
        rounded: Some((ends, segment.radius + meeting.thickness)),
    }
}

/// How a feature meets what a mesh encloses over the slice; `last` is how it met the tool at this place in the world last.
pub(super) fn meet_mesh(
    meeting: &Meeting,
    slice: &Slice,
    motion: &Motion,
    (feature, corners): (Feature, &Corners),
    [from, to]: [&Placement; 2],
    last: Option<(usize, &mut LastMet)>,
) -> Option<ContactGeometry> {
    let solid = motion.mesh?;
    let count = corners.count;
    // In the mesh's own frame, where it stands still.
    let mut own = *corners;
    let mut travel = 0.0_f32;
    for corner in 0..count {
        let [point, step] = [corners.points[corner], corners.steps[corner]].map(Vec3::from);
        let own_point = from.own(point);
        own.points[corner] = own_point.into();
        if meeting.drifts {
            travel = travel.max(to.placed(own_point).distance(point));
            own.steps[corner] = (to.own(point + step) - own_point).into();
        }
    }
    let supports = Supports::of(feature, meeting.bindings);
    let mut nodes = supports.nodes().iter();
    let is_pinned = nodes.any(|&node| meeting.mobility.of(node as usize) == 0.0);
    let (closest, time) = own.approach_mesh(solid, meeting.thickness, travel + meeting.slack, is_pinned, last)?;
    if !closest.inside {
        return None;
    }
    let weights = closest.weights;
    let weighted = |corners: [Vec3A; 3]| -> Vec3 {
        let corners = corners.iter().zip(weights).take(count);
        corners.map(|(corner, weight)| *corner * weight).sum::<Vec3A>().into()
    };
    let surface = weighted(own.at(time)) - closest.normal * closest.distance;
    let gap = (weighted(own.points) - surface).dot(closest.normal);
    let orientation = if meeting.drifts {
        from.orientation.lerp(to.orientation, time)
    } else {
        from.orientation
    };
    let normal = orientation * closest.normal;
    Some(mesh_geometry(
        meeting,
        slice,
        motion,
        [from, to],
        (surface, normal, gap, weights),
    ))
}

/// The contact of a mesh, at a point of its surface in its own frame, with the point of a feature of these weights.
pub(super) fn mesh_geometry(
    meeting: &Meeting,
    slice: &Slice,
    motion: &Motion,
    [from, to]: [&Placement; 2],
    (surface, normal, gap, weights): (Vec3, Vec3, f32, [f32; 3]),
) -> ContactGeometry {
    let [start, end] = [from, to].map(|placement| placement.placed(surface));
    let (surface_velocity, met) = if meeting.drifts {
        ((end - start) / slice.duration, end)
    } else {
        (motion.velocity_at(start), start)
    };
    ContactGeometry {
        weights,
        normal,
        surface_velocity,
        arm: met - motion.centre,
        gap,
        rounded: None,
    }
}

impl Meeting<'_> {
    /// The contact of a feature that meets a tool thus, which answers impulses so; `None` where neither can move along the normal.
    pub(super) fn constraint(
        &self,
        slice: &Slice,
        feature: Feature,
        geometry: &ContactGeometry,
        friction: f32,
        recoil: [f32; 2],
    ) -> Option<Constraint> {
        let supports = Supports::of(feature, self.bindings);
        let mut starts = [Vec3::ZERO; MOST];
        for (start, &node) in starts.iter_mut().zip(supports.nodes()) {
            *start = self.position(slice, node as usize);
        }
        let held = self.held_axes(&supports);
        let (weights, normal) = (geometry.weights, geometry.normal);
        let nodes = (&self.mobility, held);
        let mut constraint = Constraint::new((feature, weights), &supports, starts, normal, nodes, recoil)?;
        constraint.surface_velocity = geometry.surface_velocity;
        constraint.arm = geometry.arm;
        constraint.friction = friction;
        constraint.rounded = geometry.rounded;
        constraint.allow_gap(geometry.gap - self.thickness, slice.duration);
        Some(constraint)
    }
}
