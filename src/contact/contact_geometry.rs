//! Contact geometry: where a feature of a body first touches a tool.

use glam::{Vec3, Vec3A};

use super::constraint::Constraint;
use super::contact_input::{ContactInput, SubSlice};
use super::corner_weights::{FeatureNodes, MAX_FEATURE_NODES};
use super::features::Feature;
use super::nearest_plane::LastDistance;
use super::path::{MeshPose, PosedShape, ToolMotion};
use super::time_of_impact::{Corners, Segment, Separation};

/// Geometry of the contact between a feature and a tool over a slice.
#[derive(Clone, Copy, Debug)]
pub(super) struct ContactGeometry {
    /// Barycentric weights of the feature's point.
    pub weights: [f32; 3],
    /// Unit normal, away from the tool.
    pub normal: Vec3,
    /// Velocity of the tool's surface at the contact, m/s.
    pub surface_velocity: Vec3,
    /// Vector from the tool's position to the contact, m.
    pub arm: Vec3,
    /// Distance between the tool and the feature's point when the slice begins, m; negative inside.
    pub gap: f32,
    /// For a rounded tool: the ends of its segment when the slice ends, and its radius with the contact thickness.
    pub rounded: Option<([Vec3; 2], f32)>,
}

/// Gap that jointly solved contacts may leave between a node and a plane that touch, as a fraction of their approach in
/// a slice.
const PLANE_TOLERANCE: f32 = 5e-5;

/// Gap that rounding errors may leave between a node and a plane that touch, as a fraction of the largest coordinate.
const ROUNDING: f32 = 1e-6;

impl ToolMotion<'_> {
    /// The segment of a rounded tool over a slice. In the last half kick of a step it is at its end.
    pub fn segment(&self, drifts: bool) -> Segment {
        let (
            PosedShape::Rounded { a, b, radius },
            PosedShape::Rounded {
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

    /// Velocity of the tool's material at `point`, m/s.
    fn velocity_at(&self, point: Vec3) -> Vec3 {
        self.velocity + self.spin.cross(point - self.center)
    }
}

/// The contact of a node with a plane over the slice.
pub(super) fn plane_contact(
    input: &ContactInput,
    slice: &SubSlice,
    motion: &ToolMotion,
    node: usize,
) -> Option<ContactGeometry> {
    let (PosedShape::HalfSpace { point, normal: first }, PosedShape::HalfSpace { normal, .. }) =
        (motion.from, motion.to)
    else {
        return None;
    };
    let position = input.position(slice, node);
    let gap = (position - point).dot(first);
    let foot = position - first * gap;
    let surface_velocity = motion.velocity_at(foot);
    let closing = (surface_velocity - input.vector(input.velocities, node))
        .dot(normal)
        .max(0.0);
    let ahead = if input.drifts {
        (closing + surface_velocity.length()) * slice.duration + input.slack
    } else {
        let closing = closing.max(input.neighbor_speed.unwrap_or(0.0));
        PLANE_TOLERANCE * closing * slice.duration + ROUNDING * position.abs().max(point.abs()).max_element()
    };
    (gap <= input.thickness + ahead).then_some(ContactGeometry {
        weights: [1.0, 0.0, 0.0],
        normal,
        surface_velocity,
        arm: foot - motion.center,
        gap,
        rounded: None,
    })
}

/// The contact of a feature with a rounded tool, or with one of its tips, over the slice.
pub(super) fn rounded_contact(
    input: &ContactInput,
    slice: &SubSlice,
    motion: &ToolMotion,
    corners: &Corners,
    segment: &Segment,
) -> Option<ContactGeometry> {
    let inflated = Segment {
        radius: segment.radius + input.thickness,
        ..*segment
    };
    let separation = corners.approach(&inflated, segment.travel() + input.slack)?;
    if !separation.inside {
        return None;
    }
    let points = corners.points.iter().zip(separation.weights);
    let feature_point: Vec3A = points.map(|(point, weight)| *point * weight).sum();
    Some(rounded_geometry(
        input,
        slice,
        motion,
        segment,
        (&separation, feature_point.into()),
    ))
}

/// The contact geometry of a rounded tool and a point of a feature with this separation.
#[inline]
pub(super) fn rounded_geometry(
    input: &ContactInput,
    slice: &SubSlice,
    motion: &ToolMotion,
    segment: &Segment,
    (separation, feature_point): (&Separation, Vec3),
) -> ContactGeometry {
    let [step, start] = [segment.steps, segment.ends].map(|[a, b]| Vec3::from(a.lerp(b, separation.along)));
    let axis_velocity = if input.drifts {
        step / slice.duration
    } else {
        motion.velocity_at(start)
    };
    // A feature through the middle of the tool has no side. It is carried ahead of the tool.
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
        arm: start + step + surface - motion.center,
        gap: (feature_point - start).dot(normal) - segment.radius,
        rounded: Some((ends, segment.radius + input.thickness)),
    }
}

/// The contact of a feature with a mesh over the slice. `last` is the feature's last distance from the tool in this
/// slot of the world.
pub(super) fn mesh_contact(
    input: &ContactInput,
    slice: &SubSlice,
    motion: &ToolMotion,
    (feature, corners): (Feature, &Corners),
    [from, to]: [&MeshPose; 2],
    last: Option<(usize, &mut LastDistance)>,
) -> Option<ContactGeometry> {
    let solid = motion.mesh?;
    let count = corners.count;
    // In the mesh's frame the mesh is at rest.
    let mut local = *corners;
    let mut travel = 0.0_f32;
    for corner in 0..count {
        let [point, step] = [corners.points[corner], corners.steps[corner]].map(Vec3::from);
        let local_point = from.body_to_local(point);
        local.points[corner] = local_point.into();
        if input.drifts {
            travel = travel.max(to.local_to_body(local_point).distance(point));
            local.steps[corner] = (to.body_to_local(point + step) - local_point).into();
        }
    }
    let feature_nodes = FeatureNodes::new(feature, input.bindings);
    let mut nodes = feature_nodes.nodes().iter();
    let is_pinned = nodes.any(|&node| input.mobility.inverse_mass(node as usize) == 0.0);
    let (closest, time) = local.approach_mesh(solid, input.thickness, travel + input.slack, is_pinned, last)?;
    if !closest.inside {
        return None;
    }
    let weights = closest.weights;
    let weighted = |corners: [Vec3A; 3]| -> Vec3 {
        let corners = corners.iter().zip(weights).take(count);
        corners.map(|(corner, weight)| *corner * weight).sum::<Vec3A>().into()
    };
    let surface = weighted(local.at(time)) - closest.normal * closest.distance;
    let gap = (weighted(local.points) - surface).dot(closest.normal);
    let orientation = if input.drifts {
        from.orientation.lerp(to.orientation, time)
    } else {
        from.orientation
    };
    let normal = orientation * closest.normal;
    Some(mesh_geometry(
        input,
        slice,
        motion,
        [from, to],
        (surface, normal, gap, weights),
    ))
}

/// The contact geometry of a mesh, at a point of its surface in its own frame, and a feature's point with these
/// weights.
pub(super) fn mesh_geometry(
    input: &ContactInput,
    slice: &SubSlice,
    motion: &ToolMotion,
    [from, to]: [&MeshPose; 2],
    (surface, normal, gap, weights): (Vec3, Vec3, f32, [f32; 3]),
) -> ContactGeometry {
    let [start, end] = [from, to].map(|placement| placement.local_to_body(surface));
    let (surface_velocity, contact_point) = if input.drifts {
        ((end - start) / slice.duration, end)
    } else {
        (motion.velocity_at(start), start)
    };
    ContactGeometry {
        weights,
        normal,
        surface_velocity,
        arm: contact_point - motion.center,
        gap,
        rounded: None,
    }
}

impl ContactInput<'_> {
    /// The constraint of a contact with this geometry. `recoil` is the tool's velocity change per impulse. `None` if
    /// neither side can move along the normal.
    pub(super) fn constraint(
        &self,
        slice: &SubSlice,
        feature: Feature,
        geometry: &ContactGeometry,
        friction: f32,
        recoil: [f32; 2],
    ) -> Option<Constraint> {
        let feature_nodes = FeatureNodes::new(feature, self.bindings);
        let mut starts = [Vec3::ZERO; MAX_FEATURE_NODES];
        for (start, &node) in starts.iter_mut().zip(feature_nodes.nodes()) {
            *start = self.position(slice, node as usize);
        }
        let held = self.held_axes(&feature_nodes);
        let (weights, normal) = (geometry.weights, geometry.normal);
        let nodes = (&self.mobility, held);
        let mut constraint = Constraint::new((feature, weights), &feature_nodes, starts, normal, nodes, recoil)?;
        constraint.surface_velocity = geometry.surface_velocity;
        constraint.arm = geometry.arm;
        constraint.friction = friction;
        constraint.rounded = geometry.rounded;
        constraint.allow_gap(geometry.gap - self.thickness, slice.duration);
        Some(constraint)
    }
}
