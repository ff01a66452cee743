//! The way of a tool over a step.

use glam::{DQuat, DVec3, Quat, Vec3};

use super::tool::{Pose, Shape, Tool};
use crate::body::Bounds;

/// The way of a tool over a step: a straight line at constant speed, turning at a constant rate.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ToolPath {
    /// The tool's place among the world's tools.
    pub slot: usize,
    shape: Shape,
    pub friction: f32,
    start: Pose,
    end: Pose,
    /// The whole turn of the step as axis times angle, rad.
    turn: Vec3,
}

/// A tool's solid at one instant, in a body's coordinates.
#[derive(Clone, Copy, Debug)]
pub(super) enum Solid {
    /// All that is within `radius` of the segment from `a` to `b`; a sphere's segment has no length.
    Rounded { a: Vec3, b: Vec3, radius: f32 },
    /// All that lies behind the plane through `point`.
    HalfSpace { point: Vec3, normal: Vec3 },
}

/// A tool over one substep, in a body's coordinates.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion {
    pub friction: f32,
    pub from: Solid,
    pub to: Solid,
    /// The tool's position at the end.
    pub centre: Vec3,
    /// How fast its position moves, m/s.
    pub velocity: Vec3,
    /// How fast it turns, rad/s.
    pub spin: Vec3,
}

/// The axes of a tool at one instant, in a body's coordinates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame {
    /// The tool's position.
    pub centre: DVec3,
    orientation: DQuat,
}

impl Frame {
    /// Where what lies in this place of the tool's axes is.
    pub fn carried(&self, offset: DVec3) -> DVec3 {
        self.centre + self.orientation * offset
    }

    /// The place in the tool's axes of what is here.
    pub fn offset(&self, position: DVec3) -> DVec3 {
        self.orientation.conjugate() * (position - self.centre)
    }
}

impl ToolPath {
    pub fn new(slot: usize, tool: &Tool) -> Self {
        let start = tool.pose;
        let end = tool.target.unwrap_or(start);
        // The shorter way round; 0 where the orientation stays.
        let turn = if end.orientation == start.orientation {
            Vec3::ZERO
        } else {
            let change = end.orientation * start.orientation.conjugate();
            let change = if change.w < 0.0 { -change } else { change };
            change.normalize().to_scaled_axis()
        };
        Self {
            slot,
            shape: tool.shape,
            friction: tool.friction,
            start,
            end,
            turn,
        }
    }

    /// Its position after `fraction` of the step, in the coordinates of a body that begin at `origin`.
    fn centre_at(&self, fraction: f64, origin: DVec3) -> Vec3 {
        let (start, end) = (self.start.position.as_dvec3(), self.end.position.as_dvec3());
        (start.lerp(end, fraction) - origin).as_vec3()
    }

    fn orientation_at(&self, fraction: f64) -> Quat {
        if self.turn == Vec3::ZERO || fraction <= 0.0 {
            self.start.orientation
        } else if fraction >= 1.0 {
            self.end.orientation
        } else {
            Quat::from_scaled_axis(self.turn * fraction as f32) * self.start.orientation
        }
    }

    /// Its axes after `fraction` of the step, in the coordinates of a body that begin at `origin`.
    pub fn frame_at(&self, fraction: f64, origin: DVec3) -> Frame {
        let (start, end) = (self.start.position.as_dvec3(), self.end.position.as_dvec3());
        Frame {
            centre: start.lerp(end, fraction) - origin,
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
            DQuat::from_scaled_axis(self.turn.as_dvec3() * fraction) * start
        }
    }

    /// Where it is after `fraction` of the step, in the coordinates of a body that begin at `origin`.
    pub(super) fn solid_at(&self, fraction: f64, origin: DVec3) -> Solid {
        let centre = self.centre_at(fraction, origin);
        let up = self.orientation_at(fraction) * Vec3::Y;
        match self.shape {
            Shape::Sphere { radius } => Solid::Rounded {
                a: centre,
                b: centre,
                radius,
            },
            Shape::Capsule { radius, half_length } => {
                let axis = up * half_length;
                Solid::Rounded {
                    a: centre - axis,
                    b: centre + axis,
                    radius,
                }
            }
            Shape::Plane => Solid::HalfSpace {
                point: centre,
                normal: up,
            },
        }
    }

    /// Its motion between two fractions of a step of `dt` seconds.
    pub(super) fn motion(&self, start: f64, end: f64, dt: f32, origin: DVec3) -> Motion {
        Motion {
            friction: self.friction,
            from: self.solid_at(start, origin),
            to: self.solid_at(end, origin),
            centre: self.centre_at(end, origin),
            velocity: ((self.end.position.as_dvec3() - self.start.position.as_dvec3()) / f64::from(dt)).as_vec3(),
            spin: self.turn / dt,
        }
    }

    /// What it sweeps over the step; `None` for a plane, which has no end.
    pub fn sweep(&self, origin: DVec3) -> Option<Sweep> {
        let (radius, half_length) = match self.shape {
            Shape::Sphere { radius } => (radius, 0.0),
            Shape::Capsule { radius, half_length } => (radius, half_length),
            Shape::Plane => return None,
        };
        let bounds = Bounds::of([0.0, 1.0].map(|end| self.centre_at(end, origin)).into_iter());
        Some(Sweep {
            bounds: bounds.extended(radius + half_length),
            travel: self.start.position.distance(self.end.position) + self.turn.length() * half_length,
            radius,
        })
    }

    /// How fast its fastest point moves, m/s; for a plane the point at its position.
    pub(super) fn speed(&self, dt: f32) -> f32 {
        let travel = match self.sweep(DVec3::ZERO) {
            Some(sweep) => sweep.travel,
            None => self.start.position.distance(self.end.position),
        };
        travel / dt
    }
}

/// What a tool sweeps over a step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sweep {
    /// A box about all of it.
    pub bounds: Bounds,
    /// The furthest that any point of its axis goes, m.
    pub travel: f32,
    /// The tool's, m.
    pub radius: f32,
}
