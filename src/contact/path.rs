//! The way of a tool over a step.

use glam::{DQuat, DVec3, Quat, Vec3};

use super::mesh_solid::MeshSolid;
use super::tool::{Form, Pose, Tool};
use crate::codec::saved;
use crate::def::CollisionFilter;
use crate::geometry::Bounds;
use crate::geometry::rotation::turned;

/// The way of a tool over a step: a straight line at constant speed, turning at a constant rate.
#[derive(Clone, Debug)]
pub(crate) struct ToolPath {
    /// The tool's place among the world's tools.
    pub slot: usize,
    form: Form,
    pub friction: f32,
    pub filter: CollisionFilter,
    /// Whether tissue that is pinned all about presses it.
    pub meets_pinned: bool,
    start: Pose,
    end: Pose,
    /// The whole turn of the step as axis times angle, rad.
    turn: Vec3,
    /// At what fraction of the step it starts: 0 but for a dynamic tool that contact has led elsewhere.
    begun: f64,
    /// How far it may leave that line, m: a dynamic tool becomes faster on its way.
    strays: f32,
}

/// A tool's solid at one instant, in a body's coordinates.
#[derive(Clone, Copy, Debug)]
pub(super) enum Solid {
    /// All that is within `radius` of the segment from `a` to `b`; a sphere's segment has no length.
    Rounded { a: Vec3, b: Vec3, radius: f32 },
    /// All that lies behind the plane through `point`.
    HalfSpace { point: Vec3, normal: Vec3 },
    /// What a closed surface encloses.
    Mesh(Placement),
}

/// Where a mesh is and how it is turned, in a body's coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Placement {
    pub centre: Vec3,
    pub orientation: Quat,
}

saved! { Placement { centre, orientation } }

impl Placement {
    /// A point in the mesh's own frame.
    pub fn own(&self, point: Vec3) -> Vec3 {
        self.orientation.conjugate() * (point - self.centre)
    }

    /// A point of the mesh's own frame in the body's coordinates.
    pub fn placed(&self, own: Vec3) -> Vec3 {
        self.centre + self.orientation * own
    }
}

/// A tool over one substep, in a body's coordinates.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion<'a> {
    /// What a mesh encloses, in its own frame.
    pub mesh: Option<&'a MeshSolid>,
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
        let end = tool.aim();
        let turn = start.turn_to(&end);
        Self {
            slot,
            form: tool.form.clone(),
            friction: tool.friction,
            filter: tool.filter,
            meets_pinned: true,
            start,
            end,
            turn,
            begun: 0.0,
            strays: 0.0,
        }
    }

    /// Has it lead from here to there, turning by so much, rad, from this fraction of the step on, and stray from that by no more than
    /// `strays`, m.
    pub fn lead(&mut self, [start, end]: [Pose; 2], turn: Vec3, begun: f64, strays: f32) {
        (self.start, self.end, self.turn, self.begun, self.strays) = (start, end, turn, begun, strays);
    }

    /// The fraction of the step at which it starts.
    pub(super) fn begun(&self) -> f64 {
        self.begun
    }

    /// What part of it lies behind at a fraction of the step.
    fn part(&self, fraction: f64) -> f64 {
        (fraction - self.begun) / (1.0 - self.begun)
    }

    /// How long it takes in a step of `dt` seconds, s.
    fn lasts(&self, dt: f32) -> f64 {
        f64::from(dt) * (1.0 - self.begun)
    }

    /// Whether it comes to within `margin` of something in these bounds in the step, as far as boxes tell.
    pub fn is_near(&self, bounds: &Bounds, origin: DVec3, margin: f32) -> bool {
        let bounds = bounds.extended(margin);
        if let Some(sweep) = self.sweep(origin) {
            return sweep.bounds.overlaps(&bounds);
        }
        [self.begun, 1.0]
            .into_iter()
            .any(|fraction| match self.solid_at(fraction, origin) {
                Solid::HalfSpace { point, normal } => {
                    let lowest = Vec3::select(normal.cmpge(Vec3::ZERO), bounds.min, bounds.max);
                    (lowest - point).dot(normal) <= 0.0
                }
                _ => true,
            })
    }

    /// Whether it is elsewhere, or turned otherwise, after the step.
    pub fn moves(&self) -> bool {
        self.start != self.end || self.strays > 0.0
    }

    /// How far its position moves in the step, m, and how far it turns, as axis times angle, rad.
    pub fn travel(&self) -> [DVec3; 2] {
        let way = self.end.position.as_dvec3() - self.start.position.as_dvec3();
        [way, self.turn.as_dvec3()]
    }

    /// Where the step leaves it.
    pub fn end(&self) -> Pose {
        self.end
    }

    /// Its position after `fraction` of the step, in the coordinates of a body that begin at `origin`.
    fn centre_at(&self, fraction: f64, origin: DVec3) -> Vec3 {
        let (start, end) = (self.start.position.as_dvec3(), self.end.position.as_dvec3());
        (start.lerp(end, self.part(fraction)) - origin).as_vec3()
    }

    fn orientation_at(&self, fraction: f64) -> Quat {
        let fraction = self.part(fraction);
        if self.turn == Vec3::ZERO || fraction <= 0.0 {
            self.start.orientation
        } else if fraction >= 1.0 {
            self.end.orientation
        } else {
            self.exact_orientation_at(fraction).as_quat()
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
            turned(start, self.turn.as_dvec3() * fraction)
        }
    }

    /// Where it is after `fraction` of the step, in the coordinates of a body that begin at `origin`.
    pub(super) fn solid_at(&self, fraction: f64, origin: DVec3) -> Solid {
        let centre = self.centre_at(fraction, origin);
        let orientation = self.orientation_at(fraction);
        let up = || orientation * Vec3::Y;
        match self.form {
            Form::Rounded {
                radius,
                half_length: 0.0,
            } => Solid::Rounded {
                a: centre,
                b: centre,
                radius,
            },
            Form::Rounded { radius, half_length } => {
                let axis = up() * half_length;
                Solid::Rounded {
                    a: centre - axis,
                    b: centre + axis,
                    radius,
                }
            }
            Form::HalfSpace => Solid::HalfSpace {
                point: centre,
                normal: up(),
            },
            Form::Mesh(_) => Solid::Mesh(Placement { centre, orientation }),
        }
    }

    /// The least radius that its surface is curved with outward, m, where it is round.
    pub(super) fn radius(&self) -> Option<f32> {
        match self.form {
            Form::Rounded { radius, .. } => Some(radius),
            _ => None,
        }
    }

    /// What its mesh encloses, where it is one.
    pub(super) fn mesh(&self) -> Option<&MeshSolid> {
        match &self.form {
            Form::Mesh(solid) => Some(solid),
            _ => None,
        }
    }

    /// Its motion between two fractions of a step of `dt` seconds.
    pub(super) fn motion(&self, start: f64, end: f64, dt: f32, origin: DVec3) -> Motion<'_> {
        Motion {
            mesh: self.mesh(),
            friction: self.friction,
            from: self.solid_at(start, origin),
            to: self.solid_at(end, origin),
            centre: self.centre_at(end, origin),
            velocity: ((self.end.position.as_dvec3() - self.start.position.as_dvec3()) / self.lasts(dt)).as_vec3(),
            spin: self.turn / self.lasts(dt) as f32,
        }
    }

    /// What it sweeps over the step; `None` for a plane, which has no end.
    pub fn sweep(&self, origin: DVec3) -> Option<ToolSweep> {
        let centres = Bounds::of([self.begun, 1.0].map(|end| self.centre_at(end, origin)).into_iter());
        let (bounds, reach, thickness) = match &self.form {
            Form::HalfSpace => return None,
            Form::Rounded { radius, half_length } => (centres.extended(radius + half_length), *half_length, *radius),
            Form::Mesh(solid) => {
                // Between its ends a corner that turns goes outside their box by no more than the height of its arc.
                let ends = [self.begun, 1.0].map(|end| (self.centre_at(end, origin), self.orientation_at(end)));
                let corners = ends
                    .into_iter()
                    .flat_map(|(centre, orientation)| solid.corners().map(|corner| centre + orientation * corner));
                let half_turn = 0.5 * self.turn.length();
                let height = solid.reach() * (1.0 - libm::cosf(half_turn.min(std::f32::consts::PI)));
                (Bounds::of(corners).extended(height), solid.reach(), solid.thickness())
            }
        };
        Some(ToolSweep {
            bounds: bounds.extended(self.strays),
            travel: self.start.position.distance(self.end.position) + self.turn.length() * reach + self.strays,
            thickness,
        })
    }

    /// How far any point of a mesh can be from where it is at one end of the step, when it stands there instead, m.
    pub(super) fn furthest_from(&self, standing: &Placement, origin: DVec3) -> f32 {
        let Form::Mesh(solid) = &self.form else {
            return 0.0;
        };
        let far = |end: f64| {
            let turn = self.orientation_at(end).angle_between(standing.orientation);
            self.centre_at(end, origin).distance(standing.centre) + turn * solid.reach()
        };
        far(self.begun).max(far(1.0)) + self.strays
    }

    /// How fast its fastest point moves, m/s; for a plane the point at its position.
    pub(super) fn speed(&self, dt: f32) -> f32 {
        let travel = match self.sweep(DVec3::ZERO) {
            Some(sweep) => sweep.travel,
            None => self.start.position.distance(self.end.position),
        };
        travel / self.lasts(dt) as f32
    }
}

/// What a tool sweeps over a step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ToolSweep {
    /// A box about all of it.
    pub bounds: Bounds,
    /// The furthest that any point of its axis or its mesh goes, m.
    pub travel: f32,
    /// Half of the tool's least extent, m.
    pub thickness: f32,
}
