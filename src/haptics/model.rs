//! The local model: an affine approximation of the wrench on a tool, valid between two steps.

use glam::{DQuat, DVec3, Vec3};

use super::six::{self, Matrix6, Vector6};
use crate::base::BodyId;
use crate::geometry::rotation;

/// The largest number of contacts in a model: those with the largest forces.
pub(crate) const MAX_CONTACTS: usize = 32;

/// The least assumed stiffness of tissue, relative to the coupling.
const MIN_STIFFNESS_RATIO: f64 = 0.05;

/// A contact of a tool with a body at the time of the local model.
///
/// ```
/// # use glam::{Vec3, vec3};
#[doc = include_str!("../doctest/block.txt")]
/// # let mut world = World::new(WorldDefinition { gravity: Vec3::ZERO, ..WorldDefinition::default() })?;
/// # let block = world.create_body(&block)?;
/// # let mut ball = ToolDefinition::new(Shape::Sphere { radius: 0.01 });
/// # ball.pose.position = 0.03 * Vec3::Y;
/// # let ball = world.create_tool(&ball)?;
/// # world.body_mut(block)?.pin_box(vec3(-1.0, -1.0, -1.0), vec3(1.0, -0.019, 1.0))?;
/// # let mut handle = world.create_haptic(&HapticDefinition::new(ball))?;
/// # let pose = Pose { position: 0.027 * Vec3::Y, ..Pose::IDENTITY };
/// for _ in 0..10 {
///     handle.tick(pose, None, None, 0.001)?;
///     world.step(0.01)?;
/// }
/// handle.tick(pose, None, None, 0.001)?;
/// let mut force = Vec3::ZERO;
/// handle.contacts(|contact| force += contact.force);
/// assert!(force.y > 0.0);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HapticContact {
    /// The body.
    pub body: BodyId,
    /// The point, m.
    pub point: Vec3,
    /// The unit normal, pointing away from the tool.
    pub normal: Vec3,
    /// The velocity of the tissue there, m/s.
    pub velocity: Vec3,
    /// The force on the tool, N.
    pub force: Vec3,
}

/// The set of wrenches that contact can exert: tissue presses and does not pull.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cone {
    /// The mean direction of the forces.
    pub axis: DVec3,
    /// The tangent of the largest angle between a force and the axis.
    pub max_tangent: f64,
    /// The largest torque relative to the force along the axis, at the lever arm.
    pub max_torque_ratio: f64,
}

/// The wrench on a tool as an affine function of its motion.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WrenchModel {
    /// The number of models published.
    pub version: u64,
    /// The pose of the tool in the middle of the step, where the mean wrench is valid.
    pub position: DVec3,
    pub orientation: DQuat,
    /// The wrench at that pose.
    pub wrench: Vector6,
    /// The decrease of the wrench per motion.
    pub stiffness: Matrix6,
    /// The inverse of the sum of this stiffness and the coupling's.
    pub compliance: Matrix6,
    /// The wrenches that contact can exert; `None` if attachments or opposed contacts can pull the tool.
    pub cone: Option<Cone>,
    /// The work of the tool on the tissue since the handle was created, J.
    pub work: f64,
    /// The handle's time, and its proxy's work, when it sent the pose that the step moved the tool to.
    pub sent_at: f64,
    pub sent_work: f64,
    pub contacts: [HapticContact; MAX_CONTACTS],
    pub contact_count: usize,
}

impl WrenchModel {
    /// The model of a tool without contact, coupled by a spring of this stiffness.
    pub fn free(position: DVec3, orientation: DQuat, spring: &Vector6) -> Self {
        Self {
            version: 0,
            position,
            orientation,
            wrench: six::ZERO,
            stiffness: six::ZERO_MATRIX,
            compliance: six::inverse(&six::diagonal(spring)),
            cone: None,
            work: 0.0,
            sent_at: 0.0,
            sent_work: 0.0,
            contacts: [HapticContact::default(); MAX_CONTACTS],
            contact_count: 0,
        }
    }

    /// The motion from the model's pose to this one. Rotations are scaled by the lever arm.
    pub fn motion_to(&self, position: DVec3, orientation: DQuat, lever: f64) -> Vector6 {
        six::joined(
            position - self.position,
            rotation::rotation_between(self.orientation, orientation) * lever,
        )
    }

    /// The wrench of the tissue on a proxy that is coupled by springs of this stiffness to a device at this motion, in
    /// static equilibrium (Saupin, Duriez, Cotin 2008).
    pub fn wrench_at(&self, device: &Vector6, spring: &Vector6) -> Vector6 {
        let pull = six::sum(&six::each(spring, device), &self.wrench);
        let proxy = six::product(&self.compliance, &pull);
        let wrench = six::difference(&self.wrench, &six::product(&self.stiffness, &proxy));
        self.clamped(&wrench)
    }

    /// The nearest wrench that the tissue can exert.
    pub fn clamped(&self, wrench: &Vector6) -> Vector6 {
        self.cone.map_or(*wrench, |cone| cone.nearest(wrench))
    }

    /// The elastic energy that tissue and springs release from this wrench, J.
    pub fn releasable_energy(&self, wrench: &Vector6, spring: &Vector6) -> f64 {
        let square = six::dot(wrench, wrench);
        let stiffness = six::dot(wrench, &six::product(&self.stiffness, wrench)) / square;
        let stored: f64 = (0..6).map(|k| wrench[k] * wrench[k] / spring[k]).sum();
        0.5 * (stored + square / stiffness.max(MIN_STIFFNESS_RATIO * spring[0]))
    }

    /// The part of the device's velocity that the proxy does not follow: all of it on hard tissue, none without tissue.
    pub fn lag(&self, velocity: &Vector6) -> Vector6 {
        six::product(&self.compliance, &six::product(&self.stiffness, velocity))
    }
}

impl Cone {
    /// The nearest wrench in the cone.
    fn nearest(&self, wrench: &Vector6) -> Vector6 {
        let (force, torque) = (six::along(wrench), six::about(wrench));
        let pressure = force.dot(self.axis);
        if pressure <= 0.0 {
            return six::ZERO;
        }
        let across = force - self.axis * pressure;
        six::joined(
            self.axis * pressure + across.clamp_length_max(self.max_tangent * pressure),
            torque.clamp_length_max(self.max_torque_ratio * pressure),
        )
    }
}
