//! Tools: rigid shapes that the caller moves, and the forces on them.

use std::sync::Arc;

use glam::{Quat, Vec3};

use super::capsule;
use super::cuboid;
use super::force_limit::ForceLimitSearch;
use super::mesh_solid::MeshSolid;
use super::rigid::Rigid;
use crate::base::{Error, Result, StateHasher, above_zero, ensure, not_negative};
use crate::codec::{saved, saved_enum};
use crate::def::{CollisionFilter, Detection, check_reach, finite_vector};
use crate::geometry::rotation::{rotated, rotation_between};
use crate::mesh::MAX_COORDINATE;

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
    /// A sphere.
    Sphere {
        /// Meters, above 0, at most 1e9.
        radius: f32,
    },
    /// A cylinder along y with hemispherical caps.
    Capsule {
        /// Meters, above 0, at most 1e9.
        radius: f32,
        /// Meters from the center to a cap's center, 0 to 1e9. Contact points are accurate to 1e-7 of it.
        half_length: f32,
    },
    /// The plane y = 0, with free space above it and solid below.
    Plane,
    /// A box along the axes about the origin.
    Box {
        /// Meters from the center to each side, above 0, at most 1e9.
        half_extents: Vec3,
    },
    /// The inside of a closed surface. Corners at identical positions are merged.
    Mesh {
        /// Meters.
        positions: &'a [Vec3],
        /// Three position indices each, outward by the right-hand rule.
        triangles: &'a [[u32; 3]],
    },
}

/// Position and orientation of a tool.
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
    /// Meters, each coordinate within 1e9 of 0.
    pub position: Vec3,
    /// A unit quaternion.
    pub orientation: Quat,
}

saved! { Pose { position, orientation } }

impl Pose {
    /// The origin without rotation.
    pub const IDENTITY: Self = Self {
        position: Vec3::ZERO,
        orientation: Quat::IDENTITY,
    };

    /// Returns the shortest rotation to another orientation, as axis times angle, rad; 0 if both are equal.
    pub(super) fn rotation_to(&self, other: &Self) -> Vec3 {
        if other.orientation == self.orientation {
            return Vec3::ZERO;
        }
        rotation_between(self.orientation.as_dquat(), other.orientation.as_dquat()).as_vec3()
    }

    /// Interpolates between two poses by a fraction, 0 to 1.
    fn interpolate(&self, other: &Self, fraction: f32) -> Self {
        let turn = self.rotation_to(other).as_dvec3() * f64::from(fraction);
        Self {
            position: self.position.lerp(other.position, fraction),
            orientation: rotated(self.orientation.as_dquat(), turn).as_quat(),
        }
    }

    /// Hashes a pose and its target.
    pub(crate) fn hash(&self, target: Option<Self>, hasher: &mut StateHasher) {
        hasher.write_u64(u64::from(target.is_some()));
        for pose in [Some(*self), target].into_iter().flatten() {
            hasher.write_floats(&pose.position.to_array());
            hasher.write_floats(&pose.orientation.to_array());
        }
    }

    /// Returns the checked pose at another position; `None` keeps the orientation.
    pub(crate) fn moved(self, position: Vec3, orientation: Option<Quat>) -> Result<Self> {
        let orientation = orientation.unwrap_or(self.orientation);
        Self { position, orientation }.checked()
    }

    /// Returns the pose with a normalized orientation. Fails if a value is not finite, the position is too far away,
    /// or the orientation is 0.
    pub(crate) fn checked(self) -> Result<Self> {
        finite_vector("position", self.position)?;
        ensure!(
            self.position.abs().max_element() <= MAX_COORDINATE,
            "position is {}: must be within {MAX_COORDINATE:e} m of the origin along each axis",
            self.position
        );
        let [x, y, z, w] = self.orientation.to_array();
        // In `f64`, so that neither large nor small quaternions overflow.
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

/// Definition of a tool. Plain data, used only during [`World::create_tool`](crate::World::create_tool).
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
    /// Shape of the tool.
    pub shape: Shape<'a>,
    /// Method of contact detection.
    pub detection: Detection,
    /// Side of a pixel of an image or a cell of a distance field, m. 0 selects 1/256 or 1/96 of the mesh's longest
    /// extent, or a quarter of the least extent if that is less. Fails if no ray or sample lies inside the mesh.
    pub resolution: f32,
    /// Coulomb coefficient of friction, at least 0.
    pub friction: f32,
    /// Largest force that moves the tool, N, at least 0; 0 or infinite means unlimited. If tissue resists with more,
    /// the tool stops short of its target: see [`World::pose`](crate::World::pose).
    pub force_limit: f32,
    /// Selects the bodies that the tool collides with.
    pub filter: CollisionFilter,
    /// Initial pose.
    pub pose: Pose,
}

impl<'a> ToolDefinition<'a> {
    /// Defines a tool of this shape at the origin, without friction, that collides with everything.
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

/// A tool's shape as it is stored.
#[derive(Clone, Debug)]
pub(crate) enum ToolShape {
    /// All points within `radius` of a segment along y; a sphere's has length 0.
    Rounded { radius: f32, half_length: f32 },
    /// All points below y = 0.
    HalfSpace,
    /// The inside of a closed surface.
    Mesh(Arc<MeshSolid>),
}

saved_enum!(ToolShape { 0 => Rounded { radius, half_length }, 1 => HalfSpace, 2 => Mesh(solid) });

/// Number and kind of the tools that contacts reserve memory for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ToolCapacity {
    pub count: usize,
    pub has_meshes: bool,
}

/// A tool of a world.
#[derive(Clone, Debug)]
pub(crate) struct Tool {
    pub shape: ToolShape,
    pub friction: f32,
    pub force_limit: f32,
    pub filter: CollisionFilter,
    pub pose: Pose,
    /// Pose that the next step moves it to.
    pub target: Option<Pose>,
    /// Target of the last step.
    pub last_target: Pose,
    /// Search for the fraction of the path that respects the force limit, if there is a limit.
    pub limit_search: Option<ForceLimitSearch>,
    /// Mean force over the last step, N.
    pub force: Vec3,
    /// Mean torque about its position over the last step, N m.
    pub torque: Vec3,
    /// Error bound of the force from unconverged equations of the last step, N.
    pub force_error: f32,
    /// Mass and motion of a dynamic tool.
    pub rigid: Option<Box<Rigid>>,
    /// Data of the caller.
    pub user_data: usize,
}

saved! { Tool {
    shape, friction, force_limit, filter, pose, target, last_target, limit_search, force, torque, force_error, rigid,
} leaves { user_data: 0 } }

/// Largest half length of a capsule drawn as triangles, relative to its radius. The caps of a longer one vanish in
/// `f32` rounding.
const SLENDEREST: f32 = 1e4;

impl Tool {
    pub fn is_mesh(&self) -> bool {
        matches!(self.shape, ToolShape::Mesh(_))
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
                let (positions, triangles) = capsule::surface(radius, half_length)?;
                MeshSolid::new_shared(&positions, &triangles, detection, resolution).map(ToolShape::Mesh)
            }
            _ => Ok(ToolShape::Rounded { radius, half_length }),
        };
        let shape = match definition.shape {
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
            Shape::Plane => ToolShape::HalfSpace,
            Shape::Box { half_extents } => {
                for (axis, half_extent) in half_extents.to_array().into_iter().enumerate() {
                    positive(&format!("half_extents[{axis}]"), half_extent)?;
                }
                let (positions, triangles) = cuboid::surface(half_extents);
                ToolShape::Mesh(MeshSolid::new_shared(&positions, &triangles, detection, resolution)?)
            }
            Shape::Mesh { positions, triangles } => {
                ToolShape::Mesh(MeshSolid::new_shared(positions, triangles, detection, resolution)?)
            }
        };
        Ok(Self {
            shape,
            friction: definition.friction,
            force_limit,
            filter: definition.filter,
            pose,
            target: None,
            last_target: pose,
            limit_search: None,
            force: Vec3::ZERO,
            torque: Vec3::ZERO,
            force_error: 0.0,
            rigid: None,
            user_data: 0,
        })
    }
}

/// Returns the force limit that a value stands for: 0 means unlimited, like infinity.
fn force_limit(limit: f32) -> Result<f32> {
    if limit >= 0.0 {
        return Ok(if limit == 0.0 { f32::INFINITY } else { limit });
    }
    Err(Error::invalid(format!("force_limit is {limit}: must be at least 0")))
}

impl Tool {
    /// Sets the friction from the next step on.
    pub fn set_friction(&mut self, friction: f32) -> Result<()> {
        not_negative("friction", friction)?;
        self.friction = friction;
        Ok(())
    }

    /// Sets the force limit from the next step on, N.
    pub fn set_force_limit(&mut self, limit: f32) -> Result<()> {
        self.force_limit = force_limit(limit)?;
        Ok(())
    }

    /// Returns true for a plane.
    pub fn is_plane(&self) -> bool {
        matches!(self.shape, ToolShape::HalfSpace)
    }

    /// Returns the pose that the current step moves it to.
    pub fn step_target(&self) -> Pose {
        let target = self.target.unwrap_or(self.pose);
        match self.limit_search {
            Some(limit_search) if limit_search.fraction < 1.0 => self.pose.interpolate(&target, limit_search.fraction),
            _ => target,
        }
    }

    /// Begins a step with the whole path, until the resistance is known.
    pub fn begin_step(&mut self) {
        let moves = self.target.is_some_and(|target| target != self.pose);
        let is_limited = self.force_limit < f32::INFINITY && moves;
        self.limit_search = is_limited.then(|| ForceLimitSearch::new(self.force.length(), self.force_limit));
    }

    /// Hashes the state that the next step depends on.
    pub fn hash_state(&self, hasher: &mut StateHasher) {
        match &self.shape {
            ToolShape::Rounded { radius, half_length } => hasher.write_floats(&[1.0, *radius, *half_length]),
            ToolShape::HalfSpace => hasher.write_floats(&[2.0]),
            ToolShape::Mesh(solid) => hasher.write_u64(solid.hash()),
        }
        hasher.write_floats(&[self.friction, self.force_limit]);
        if self.force_limit.is_finite() {
            // The search under the force limit starts from it.
            hasher.write_floats(&self.force.to_array());
        }
        if let Some(rigid) = &self.rigid {
            rigid.hash(hasher);
        }
        self.filter.hash(hasher);
        self.pose.hash(self.target, hasher);
    }
}
