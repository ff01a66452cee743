//! Path of a tool over a step.

use glam::{DQuat, DVec3, Quat, Vec3};

use super::mesh_solid::MeshSolid;
use super::tool::{Pose, Tool, ToolShape};
use crate::codec::saved;
use crate::def::CollisionFilter;
use crate::geometry::Aabb;
use crate::geometry::rotation::rotated;

/// Path of a tool over a step: a straight line at constant velocity and angular velocity.
#[derive(Clone, Debug)]
pub(crate) struct ToolPath {
    /// Index of the tool in the world.
    pub slot: usize,
    shape: ToolShape,
    pub friction: f32,
    pub filter: CollisionFilter,
    /// True if tissue that is pinned on all sides presses it.
    pub collides_with_pinned: bool,
    start: Pose,
    end: Pose,
    /// Rotation over the whole step as axis times angle, rad.
    turn: Vec3,
    /// Fraction of the step at which the path begins. Above 0 only for a dynamic tool deflected by contact.
    begin: f64,
    /// Largest distance from that line, m. A dynamic tool accelerates along its path.
    max_deviation: f32,
}

/// A tool's shape at one instant, in a body's coordinates.
#[derive(Clone, Copy, Debug)]
pub(super) enum PosedShape {
    /// All points within `radius` of the segment from `a` to `b`; for a sphere `a` equals `b`.
    Rounded { a: Vec3, b: Vec3, radius: f32 },
    /// All points behind the plane through `point`.
    HalfSpace { point: Vec3, normal: Vec3 },
    /// The inside of a closed surface.
    Mesh(MeshPose),
}

/// Pose of a mesh in a body's coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MeshPose {
    pub center: Vec3,
    pub orientation: Quat,
}

saved! { MeshPose { center, orientation } }

impl MeshPose {
    /// Transforms a point to the mesh's own frame.
    pub fn body_to_local(&self, point: Vec3) -> Vec3 {
        self.orientation.conjugate() * (point - self.center)
    }

    /// Transforms a point of the mesh's own frame to the body's coordinates.
    pub fn local_to_body(&self, point: Vec3) -> Vec3 {
        self.center + self.orientation * point
    }
}

/// Motion of a tool over one substep, in a body's coordinates.
#[derive(Clone, Copy, Debug)]
pub(super) struct ToolMotion<'a> {
    /// The mesh in its own frame.
    pub mesh: Option<&'a MeshSolid>,
    pub friction: f32,
    pub from: PosedShape,
    pub to: PosedShape,
    /// Position of the tool at the end.
    pub center: Vec3,
    /// Velocity of the position, m/s.
    pub velocity: Vec3,
    /// Angular velocity, rad/s.
    pub spin: Vec3,
}

/// Coordinate frame of a tool at one instant, in a body's coordinates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ToolFrame {
    /// Position of the tool.
    pub center: DVec3,
    orientation: DQuat,
}

impl ToolFrame {
    /// Transforms a point of the tool's frame to the body's coordinates.
    pub fn local_to_body(&self, point: DVec3) -> DVec3 {
        self.center + self.orientation * point
    }

    /// Transforms a point to the tool's frame.
    pub fn body_to_local(&self, point: DVec3) -> DVec3 {
        self.orientation.conjugate() * (point - self.center)
    }
}

impl ToolPath {
    pub fn new(slot: usize, tool: &Tool) -> Self {
        let start = tool.pose;
        let end = tool.step_target();
        let turn = start.rotation_to(&end);
        Self {
            slot,
            shape: tool.shape.clone(),
            friction: tool.friction,
            filter: tool.filter,
            collides_with_pinned: true,
            start,
            end,
            turn,
            begin: 0.0,
            max_deviation: 0.0,
        }
    }

    /// Sets the path: start and end pose, the rotation between them (rad), the fraction of the step at which it
    /// begins and the largest distance from it, m.
    pub fn set(&mut self, [start, end]: [Pose; 2], turn: Vec3, begin: f64, max_deviation: f32) {
        (self.start, self.end, self.turn, self.begin, self.max_deviation) = (start, end, turn, begin, max_deviation);
    }

    /// Returns the fraction of the step at which the path begins.
    pub(super) fn begin(&self) -> f64 {
        self.begin
    }

    /// Returns the completed fraction of the path at a fraction of the step.
    fn path_fraction(&self, fraction: f64) -> f64 {
        (fraction - self.begin) / (1.0 - self.begin)
    }

    /// Returns the duration of the path in a step of `dt` seconds, s.
    fn duration(&self, dt: f32) -> f64 {
        f64::from(dt) * (1.0 - self.begin)
    }

    /// True if the tool may come within `margin` of these bounds in the step. Conservative, by bounding
    /// boxes.
    pub fn is_near(&self, bounds: &Aabb, origin: DVec3, margin: f32) -> bool {
        let bounds = bounds.extended(margin);
        if let Some(sweep) = self.sweep(origin) {
            return sweep.bounds.overlaps(&bounds);
        }
        [self.begin, 1.0]
            .into_iter()
            .any(|fraction| match self.shape_at(fraction, origin) {
                PosedShape::HalfSpace { point, normal } => {
                    let lowest = Vec3::select(normal.cmpge(Vec3::ZERO), bounds.min, bounds.max);
                    (lowest - point).dot(normal) <= 0.0
                }
                _ => true,
            })
    }

    /// True if the pose changes in the step.
    pub fn moves(&self) -> bool {
        self.start != self.end || self.max_deviation > 0.0
    }

    /// Returns the displacement (m) and the rotation as axis times angle (rad) over the step.
    pub fn travel(&self) -> [DVec3; 2] {
        let displacement = self.end.position.as_dvec3() - self.start.position.as_dvec3();
        [displacement, self.turn.as_dvec3()]
    }

    /// Returns the pose at the end of the step.
    pub fn end(&self) -> Pose {
        self.end
    }

    /// Returns the position after `fraction` of the step, in body coordinates with this origin.
    fn center_at(&self, fraction: f64, origin: DVec3) -> Vec3 {
        let (start, end) = (self.start.position.as_dvec3(), self.end.position.as_dvec3());
        (start.lerp(end, self.path_fraction(fraction)) - origin).as_vec3()
    }

    fn orientation_at(&self, fraction: f64) -> Quat {
        let fraction = self.path_fraction(fraction);
        if self.turn == Vec3::ZERO || fraction <= 0.0 {
            self.start.orientation
        } else if fraction >= 1.0 {
            self.end.orientation
        } else {
            self.exact_orientation_at(fraction).as_quat()
        }
    }

    /// Returns the tool's frame after `fraction` of the step, in body coordinates with this origin.
    pub fn frame_at(&self, fraction: f64, origin: DVec3) -> ToolFrame {
        let (start, end) = (self.start.position.as_dvec3(), self.end.position.as_dvec3());
        ToolFrame {
            center: start.lerp(end, fraction) - origin,
            orientation: self.exact_orientation_at(fraction),
        }
    }

    fn exact_orientation_at(&self, fraction: f64) -> DQuat {
        let [start, end] = [self.start, self.end].map(|pose| pose.orientation.as_dquat().normalize());
        if self.turn == Vec3::ZERO || fraction <= 0.0 {
            start
        } else if fraction >= 1.0 {
            end
        } else {
            rotated(start, self.turn.as_dvec3() * fraction)
        }
    }

    /// Returns the shape after `fraction` of the step, in body coordinates with this origin.
    pub(super) fn shape_at(&self, fraction: f64, origin: DVec3) -> PosedShape {
        let center = self.center_at(fraction, origin);
        let orientation = self.orientation_at(fraction);
        let up = || orientation * Vec3::Y;
        match self.shape {
            ToolShape::Rounded {
                radius,
                half_length: 0.0,
            } => PosedShape::Rounded {
                a: center,
                b: center,
                radius,
            },
            ToolShape::Rounded { radius, half_length } => {
                let axis = up() * half_length;
                PosedShape::Rounded {
                    a: center - axis,
                    b: center + axis,
                    radius,
                }
            }
            ToolShape::HalfSpace => PosedShape::HalfSpace {
                point: center,
                normal: up(),
            },
            ToolShape::Mesh(_) => PosedShape::Mesh(MeshPose { center, orientation }),
        }
    }

    /// Returns the radius of a sphere or capsule, m.
    pub(super) fn radius(&self) -> Option<f32> {
        match self.shape {
            ToolShape::Rounded { radius, .. } => Some(radius),
            _ => None,
        }
    }

    /// Returns the mesh, if the tool is one.
    pub(super) fn mesh(&self) -> Option<&MeshSolid> {
        match &self.shape {
            ToolShape::Mesh(solid) => Some(solid),
            _ => None,
        }
    }

    /// Returns the motion between two fractions of a step of `dt` seconds.
    pub(super) fn motion(&self, start: f64, end: f64, dt: f32, origin: DVec3) -> ToolMotion<'_> {
        ToolMotion {
            mesh: self.mesh(),
            friction: self.friction,
            from: self.shape_at(start, origin),
            to: self.shape_at(end, origin),
            center: self.center_at(end, origin),
            velocity: ((self.end.position.as_dvec3() - self.start.position.as_dvec3()) / self.duration(dt)).as_vec3(),
            spin: self.turn / self.duration(dt) as f32,
        }
    }

    /// Returns the volume swept over the step; `None` for a plane, which is unbounded.
    pub fn sweep(&self, origin: DVec3) -> Option<ToolSweep> {
        let centers = Aabb::of([self.begin, 1.0].map(|end| self.center_at(end, origin)).into_iter());
        let (bounds, reach, thickness) = match &self.shape {
            ToolShape::HalfSpace => return None,
            ToolShape::Rounded { radius, half_length } => {
                (centers.extended(radius + half_length), *half_length, *radius)
            }
            ToolShape::Mesh(solid) => {
                // Between its ends a rotating corner leaves their box by at most the height of its arc.
                let ends = [self.begin, 1.0].map(|end| (self.center_at(end, origin), self.orientation_at(end)));
                let corners = ends
                    .into_iter()
                    .flat_map(|(center, orientation)| solid.corners().map(|corner| center + orientation * corner));
                let half_turn = 0.5 * self.turn.length();
                let height = solid.reach() * (1.0 - libm::cosf(half_turn.min(std::f32::consts::PI)));
                (Aabb::of(corners).extended(height), solid.reach(), solid.thickness())
            }
        };
        Some(ToolSweep {
            bounds: bounds.extended(self.max_deviation),
            travel: self.start.position.distance(self.end.position) + self.turn.length() * reach + self.max_deviation,
            thickness,
        })
    }

    /// Returns the largest distance of a mesh's points over the step from their positions in the pose `standing`, m.
    pub(super) fn max_distance_from(&self, standing: &MeshPose, origin: DVec3) -> f32 {
        let ToolShape::Mesh(solid) = &self.shape else {
            return 0.0;
        };
        let distance = |end: f64| {
            let turn = self.orientation_at(end).angle_between(standing.orientation);
            self.center_at(end, origin).distance(standing.center) + turn * solid.reach()
        };
        distance(self.begin).max(distance(1.0)) + self.max_deviation
    }

    /// Returns the speed of the fastest point, m/s; for a plane that of its position.
    pub fn speed(&self, dt: f32) -> f32 {
        let travel = match self.sweep(DVec3::ZERO) {
            Some(sweep) => sweep.travel,
            None => self.start.position.distance(self.end.position),
        };
        travel / self.duration(dt) as f32
    }
}

/// The volume that a tool sweeps over a step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ToolSweep {
    /// Bounding box of the volume.
    pub bounds: Aabb,
    /// Longest displacement of a point of the axis or mesh, m.
    pub travel: f32,
    /// Half of the tool's least extent, m.
    pub thickness: f32,
}
