//! Tools: rigid shapes that the caller moves, and the load that they feel.

use std::sync::Arc;

use glam::{Quat, Vec3};

use super::cuboid;
use super::limit::PressSearch;
use super::mesh_solid::MeshSolid;
use super::rigid::Rigid;
use super::rounded;
use crate::base::{Error, Result, StateHasher, above_zero, ensure, not_negative};
use crate::codec::{saved, saved_enum};
use crate::def::{CollisionFilter, Detection, check_reach, finite_vector};
use crate::geometry::rotation::{turn_between, turned};
use crate::mesh::FURTHEST;

/// The shape of a tool, about its own origin.
///
/// ```
/// # use glam::{Quat, Vec3};
#[doc = include_str!("../doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition::default())?;
/// # let body = world.create_body(&cloth)?;
/// # world.body_mut(body)?.transform(0.01 * Vec3::Y, Quat::IDENTITY, None)?;
/// // The cloth begins 1 cm above it.
/// world.create_tool(&ToolDefinition::new(Shape::Plane))?;
/// for _ in 0..30 {
///     world.step(1.0 / 60.0)?;
/// }
/// assert!(world.body(body)?.bounds()[0].y > -1e-5);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape<'a> {
    /// A ball.
    Sphere {
        /// Metres, above 0, at most 1e9.
        radius: f32,
    },
    /// A cylinder along y with round caps.
    Capsule {
        /// Metres, above 0, at most 1e9.
        radius: f32,
        /// Metres between the centre and a cap's centre, 0 to 1e9. What is touched is known to a ten millionth of it.
        half_length: f32,
    },
    /// The plane y = 0, with free space above it and solid below.
    Plane,
    /// A box along the axes about the origin.
    Box {
        /// Metres from the centre to each side, above 0, at most 1e9.
        half_extents: Vec3,
    },
    /// What a closed surface encloses. Corners at exactly the same place are one.
    Mesh {
        /// Metres.
        positions: &'a [Vec3],
        /// Three of the positions each, outward by the right-hand rule.
        triangles: &'a [[u32; 3]],
    },
}

/// Where a tool is and how it is turned.
///
/// ```
/// # use glam::{Quat, Vec3};
/// # use sinew::*;
/// # let mut world = World::new(WorldDefinition::default())?;
/// # let ball = world.create_tool(&ToolDefinition::new(Shape::Sphere { radius: 0.01 }))?;
/// let orientation = Quat::from_rotation_x(0.5);
/// world.set_pose(ball, 0.1 * Vec3::Y, Some(orientation))?;
/// world.step(1.0 / 60.0)?;
/// assert_eq!(world.pose(ball)?, Pose { position: 0.1 * Vec3::Y, orientation });
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Metres, each within 1e9 of 0.
    pub position: Vec3,
    /// A unit quaternion.
    pub orientation: Quat,
}

saved! { Pose { position, orientation } }

impl Pose {
    /// At the origin, not turned.
    pub const IDENTITY: Self = Self {
        position: Vec3::ZERO,
        orientation: Quat::IDENTITY,
    };

    /// The shorter way round from this orientation to that one, as axis times angle, rad; 0 where they are the same.
    pub(super) fn turn_to(&self, other: &Self) -> Vec3 {
        if other.orientation == self.orientation {
            return Vec3::ZERO;
        }
        turn_between(self.orientation.as_dquat(), other.orientation.as_dquat()).as_vec3()
    }

    /// Where something is after a part of the way from here to there, 0 to 1.
    fn on_way_to(&self, other: &Self, part: f32) -> Self {
        let turn = self.turn_to(other).as_dvec3() * f64::from(part);
        Self {
            position: self.position.lerp(other.position, part),
            orientation: turned(self.orientation.as_dquat(), turn).as_quat(),
        }
    }

    /// Adds the bits of a pose and of where it is to go.
    pub(crate) fn hash(&self, target: Option<Self>, hasher: &mut StateHasher) {
        hasher.write_u64(u64::from(target.is_some()));
        for pose in [Some(*self), target].into_iter().flatten() {
            hasher.write_floats(&pose.position.to_array());
            hasher.write_floats(&pose.orientation.to_array());
        }
    }

    /// The pose at another position, and turned, `None`: as it is; checked.
    pub(crate) fn moved(self, position: Vec3, orientation: Option<Quat>) -> Result<Self> {
        let orientation = orientation.unwrap_or(self.orientation);
        Self { position, orientation }.checked()
    }

    /// The pose with its orientation normalised; refused where it has no direction, is not finite or too far away.
    pub(crate) fn checked(self) -> Result<Self> {
        finite_vector("position", self.position)?;
        ensure!(
            self.position.abs().max_element() <= FURTHEST,
            "position is {}: must be within {FURTHEST:e} m of the origin along each axis",
            self.position
        );
        let [x, y, z, w] = self.orientation.to_array();
        // In f64, so that neither large nor small quaternions overflow on the way.
        let exact = glam::DQuat::from_xyzw(x.into(), y.into(), z.into(), w.into());
        let length = exact.length();
        ensure!(
            length > 0.0 && length.is_finite(),
            "orientation is {x} {y} {z} {w}: must be finite and not zero"
        );
        let orientation = if (length - 1.0).abs() < 1e-7 {
            self.orientation
        } else {
            (exact / length).as_quat()
        };
        Ok(Self { orientation, ..self })
    }
}

/// What a tool is. Plain data, used only during [`World::create_tool`](crate::World::create_tool).
///
/// ```
/// # use glam::Vec3;
#[doc = include_str!("../doctest/block.txt")]
/// # let mut world = World::new(WorldDefinition { gravity: Vec3::ZERO, ..WorldDefinition::default() })?;
/// # world.create_body(&block)?;
/// let mut ball = ToolDefinition::new(Shape::Sphere { radius: 0.01 });
/// ball.pose.position = 0.03 * Vec3::Y;
/// let ball = world.create_tool(&ball)?;
/// world.set_pose(ball, 0.028 * Vec3::Y, None)?;
/// world.step(1.0 / 60.0)?;
/// assert!(world.wrench(ball)?.0.y > 0.0);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToolDefinition<'a> {
    /// Its shape.
    pub shape: Shape<'a>,
    /// How it finds what it touches.
    pub detection: Detection,
    /// How fine an image or a distance field is, m: the side of a pixel or a cell; 0: a 256th or a 96th of the mesh's longest extent, or a
    /// fourth of the least where that is less. Refused where no ray or sample would lie within the mesh.
    pub resolution: f32,
    /// The Coulomb coefficient of friction, at least 0.
    pub friction: f32,
    /// The largest force that moves it, N, at least 0; 0 or infinite: it goes wherever it is sent. Where tissue resists with more it stops short of
    /// its pose: see [`World::pose`](crate::World::pose).
    pub force_limit: f32,
    /// Which bodies it meets.
    pub filter: CollisionFilter,
    /// Where it is at first.
    pub pose: Pose,
}

impl<'a> ToolDefinition<'a> {
    /// A tool of this shape at the origin, without friction, that meets everything.
    pub fn new(shape: Shape<'a>) -> Self {
        Self {
            shape,
            detection: Detection::Exact,
            resolution: 0.0,
            force_limit: f32::INFINITY,
            filter: CollisionFilter::default(),
            friction: 0.0,
            pose: Pose::IDENTITY,
        }
    }
}

/// A shape as a tool keeps it.
#[derive(Clone, Debug)]
pub(crate) enum Form {
    /// All that is within `radius` of a segment along y; a sphere's has no length.
    Rounded { radius: f32, half_length: f32 },
    /// All that lies below y = 0.
    HalfSpace,
    /// What a closed surface encloses.
    Mesh(Arc<MeshSolid>),
}

saved_enum!(Form { 0 => Rounded { radius, half_length }, 1 => HalfSpace, 2 => Mesh(solid) });

/// How many tools contacts need room for, and whether some are meshes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ToolPlaces {
    pub count: usize,
    pub has_meshes: bool,
}

/// A tool of a world.
#[derive(Clone, Debug)]
pub(crate) struct Tool {
    pub form: Form,
    pub friction: f32,
    pub force_limit: f32,
    pub filter: CollisionFilter,
    pub pose: Pose,
    /// Where the next step moves it.
    pub target: Option<Pose>,
    /// Where the last step was to move it.
    pub led_to: Pose,
    /// How much of that way the step in progress takes, where it has a limit of force.
    pub reach: Option<PressSearch>,
    /// Mean force on it over the last step, N.
    pub force: Vec3,
    /// Mean torque about its position over the last step, N m.
    pub torque: Vec3,
    /// By how much, at most, equations of the last step had that force off, N.
    pub force_error: f32,
    /// Its mass and motion, where forces move it.
    pub rigid: Option<Box<Rigid>>,
    /// What the caller keeps with it.
    pub user_data: usize,
}

saved! { Tool {
    form, friction, force_limit, filter, pose, target, led_to, reach, force, torque, force_error, rigid,
} leaves { user_data: 0 } }

/// A longer capsule, as a part of its radius, has no caps among triangles with corners in `f32`.
const SLENDEREST: f32 = 1e4;

impl Tool {
    pub fn is_mesh(&self) -> bool {
        matches!(self.form, Form::Mesh(_))
    }

    pub fn new(definition: &ToolDefinition) -> Result<Self> {
        let positive = |name: &str, value: f32| {
            above_zero(name, value)?;
            check_reach(name, value)
        };
        not_negative("friction", definition.friction)?;
        not_negative("resolution", definition.resolution)?;
        let force_limit = force_limit(definition.force_limit)?;
        let pose = definition.pose.checked()?;
        let (detection, resolution) = (definition.detection, definition.resolution);
        let is_refused = match definition.shape {
            Shape::Box { .. } | Shape::Mesh { .. } => false,
            Shape::Plane => detection != Detection::Exact,
            Shape::Sphere { .. } | Shape::Capsule { .. } => detection == Detection::DistanceField,
        };
        ensure!(
            !is_refused,
            Error::Unsupported(format!(
                "detection is {detection:?}: distance fields are for meshes, and images for what has an end"
            ))
        );
        let rounded = |radius, half_length| match detection {
            Detection::ImageSpace => {
                let (positions, triangles) = rounded::surface(radius, half_length)?;
                MeshSolid::shared(&positions, &triangles, detection, resolution).map(Form::Mesh)
            }
            _ => Ok(Form::Rounded { radius, half_length }),
        };
        let form = match definition.shape {
            Shape::Sphere { radius } => {
                positive("radius", radius)?;
                rounded(radius, 0.0)?
            }
            Shape::Capsule { radius, half_length } => {
                positive("radius", radius)?;
                not_negative("half_length", half_length)?;
                check_reach("half_length", half_length)?;
                check_reach("radius + half_length", radius + half_length)?;
                ensure!(
                    detection != Detection::ImageSpace || half_length <= SLENDEREST * radius,
                    "half_length is {half_length}: at most {SLENDEREST} times the radius is possible in an image"
                );
                rounded(radius, half_length)?
            }
            Shape::Plane => Form::HalfSpace,
            Shape::Box { half_extents } => {
                for (axis, half_extent) in half_extents.to_array().into_iter().enumerate() {
                    positive(&format!("half_extents[{axis}]"), half_extent)?;
                }
                let (positions, triangles) = cuboid::surface(half_extents);
                Form::Mesh(MeshSolid::shared(&positions, &triangles, detection, resolution)?)
            }
            Shape::Mesh { positions, triangles } => {
                Form::Mesh(MeshSolid::shared(positions, triangles, detection, resolution)?)
            }
        };
        Ok(Self {
            form,
            friction: definition.friction,
            force_limit,
            filter: definition.filter,
            pose,
            target: None,
            led_to: pose,
            reach: None,
            force: Vec3::ZERO,
            torque: Vec3::ZERO,
            force_error: 0.0,
            rigid: None,
            user_data: 0,
        })
    }
}

/// The limit of force that a number means: 0 is unlimited, like infinity.
fn force_limit(limit: f32) -> Result<f32> {
    if limit >= 0.0 {
        return Ok(if limit == 0.0 { f32::INFINITY } else { limit });
    }
    Err(Error::invalid(format!("force_limit is {limit}: must be at least 0")))
}

impl Tool {
    /// Gives it this friction from the next step on.
    pub fn set_friction(&mut self, friction: f32) -> Result<()> {
        not_negative("friction", friction)?;
        self.friction = friction;
        Ok(())
    }

    /// Has this force, N, be the largest that moves it from the next step on.
    pub fn set_force_limit(&mut self, limit: f32) -> Result<()> {
        self.force_limit = force_limit(limit)?;
        Ok(())
    }

    /// Whether it is a plane.
    pub fn is_plane(&self) -> bool {
        matches!(self.form, Form::HalfSpace)
    }

    /// Where the step in progress takes it.
    pub fn aim(&self) -> Pose {
        let target = self.target.unwrap_or(self.pose);
        match self.reach {
            Some(reach) if reach.part < 1.0 => self.pose.on_way_to(&target, reach.part),
            _ => target,
        }
    }

    /// Begins a step: all of its way, until it is known what resists.
    pub fn set_out(&mut self) {
        let goes = self.target.is_some_and(|target| target != self.pose);
        let is_limited = self.force_limit < f32::INFINITY && goes;
        self.reach = is_limited.then(|| PressSearch::new(self.force.length(), self.force_limit));
    }

    /// Adds the bits that the next step depends on.
    pub fn hash_state(&self, hasher: &mut StateHasher) {
        match &self.form {
            Form::Rounded { radius, half_length } => hasher.write_floats(&[1.0, *radius, *half_length]),
            Form::HalfSpace => hasher.write_floats(&[2.0]),
            Form::Mesh(solid) => hasher.write_u64(solid.hash()),
        }
        hasher.write_floats(&[self.friction, self.force_limit]);
        if self.force_limit.is_finite() {
            // The search for how far it gets begins with it.
            hasher.write_floats(&self.force.to_array());
        }
        if let Some(rigid) = &self.rigid {
            rigid.hash(hasher);
        }
        self.filter.hash(hasher);
        self.pose.hash(self.target, hasher);
    }
}
