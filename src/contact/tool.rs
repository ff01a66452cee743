//! Tools: rigid shapes that the caller moves, and the load that they feel.

use glam::{Quat, Vec3};

use crate::body::{finite_vector, not_negative};
use crate::diagnostics::StateHasher;
use crate::error::{Error, Result};

/// The shape of a tool, about its own origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// A ball.
    Sphere {
        /// Metres, above 0.
        radius: f32,
    },
    /// A cylinder along y with round caps.
    Capsule {
        /// Metres, above 0.
        radius: f32,
        /// Metres between the centre and a cap's centre, at least 0.
        half_length: f32,
    },
    /// The plane y = 0, with free space above it and solid below.
    Plane,
}

/// How a tool finds what it touches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Detection {
    /// Exact distances, swept over the step.
    #[default]
    Exact,
    /// Virtual rays cast through a depth buffer (CInDeR; Halic et al., section 2.1).
    ImageSpace,
    /// A sampled signed distance; for meshes alone.
    DistanceField,
}

/// Where a tool is and how it is turned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Metres.
    pub position: Vec3,
    /// A unit quaternion.
    pub orientation: Quat,
}

impl Pose {
    /// At the origin, not turned.
    pub const IDENTITY: Self = Self {
        position: Vec3::ZERO,
        orientation: Quat::IDENTITY,
    };

    /// The pose with its orientation normalised; refused where it has no direction or is not finite.
    pub(crate) fn checked(self) -> Result<Self> {
        finite_vector("position", self.position)?;
        let [x, y, z, w] = self.orientation.to_array();
        // In f64, so that neither large nor small quaternions overflow on the way.
        let exact = glam::DQuat::from_xyzw(x.into(), y.into(), z.into(), w.into());
        let length = exact.length();
        if !(length > 0.0 && length.is_finite()) {
            return Err(Error::invalid(format!(
                "orientation is {x} {y} {z} {w}: must be finite and not zero"
            )));
        }
        let orientation = if (length - 1.0).abs() < 1e-7 {
            self.orientation
        } else {
            (exact / length).as_quat()
        };
        Ok(Self { orientation, ..self })
    }
}

/// What a tool is. Plain data, used only during [`World::create_tool`](crate::World::create_tool).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToolDefinition {
    /// Its shape.
    pub shape: Shape,
    /// How it finds what it touches.
    pub detection: Detection,
    /// The Coulomb coefficient of friction, at least 0.
    pub friction: f32,
    /// Where it is at first.
    pub pose: Pose,
}

impl ToolDefinition {
    /// A tool of this shape at the origin, without friction.
    pub fn new(shape: Shape) -> Self {
        Self {
            shape,
            detection: Detection::Exact,
            friction: 0.0,
            pose: Pose::IDENTITY,
        }
    }
}

/// A tool of a world.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tool {
    pub shape: Shape,
    pub friction: f32,
    pub pose: Pose,
    /// Where the next step moves it.
    pub target: Option<Pose>,
    /// Mean force on it over the last step, N.
    pub force: Vec3,
    /// Mean torque about its position over the last step, N m.
    pub torque: Vec3,
}

impl Tool {
    pub fn new(definition: &ToolDefinition) -> Result<Self> {
        let positive = |name: &str, value: f32| {
            if value > 0.0 && value.is_finite() {
                return Ok(());
            }
            Err(Error::invalid(format!("{name} is {value}: must be above 0 and finite")))
        };
        match definition.shape {
            Shape::Sphere { radius } => positive("radius", radius)?,
            Shape::Capsule { radius, half_length } => {
                positive("radius", radius)?;
                not_negative("half_length", half_length)?;
            }
            Shape::Plane => {}
        }
        not_negative("friction", definition.friction)?;
        let pose = definition.pose.checked()?;
        if definition.detection != Detection::Exact {
            return Err(Error::Unsupported(format!(
                "detection is {:?}: this version offers Exact alone",
                definition.detection
            )));
        }
        Ok(Self {
            shape: definition.shape,
            friction: definition.friction,
            pose,
            target: None,
            force: Vec3::ZERO,
            torque: Vec3::ZERO,
        })
    }
}

impl Tool {
    /// Adds the bits that the next step depends on.
    pub fn hash_state(&self, hasher: &mut StateHasher) {
        let shape = match self.shape {
            Shape::Sphere { radius } => [0.0, radius, 0.0],
            Shape::Capsule { radius, half_length } => [1.0, radius, half_length],
            Shape::Plane => [2.0, 0.0, 0.0],
        };
        hasher.write_floats(&shape);
        hasher.write_floats(&[self.friction]);
        hasher.write_u64(u64::from(self.target.is_some()));
        for pose in [Some(self.pose), self.target].into_iter().flatten() {
            hasher.write_floats(&pose.position.to_array());
            hasher.write_floats(&pose.orientation.to_array());
        }
    }
}
