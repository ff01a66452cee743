//! The tissue about a tool as the stepping thread last saw it.

use glam::{DQuat, DVec3, Vec3};

use super::six::{self, Matrix6, Vector6};
use crate::base::BodyId;
use crate::geometry::rotation;

/// Contacts that a model has room for; of more the most pressed.
pub(crate) const MOST_CONTACTS: usize = 32;

/// Tissue is taken to be at least so many times as stiff as the coupling, as long as it is not known.
const SOFTEST: f64 = 0.05;

/// Where a tool pressed a body as the model was made.
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
    /// Away from the tool, of unit length.
    pub normal: Vec3,
    /// How fast the tissue moves there, m/s.
    pub velocity: Vec3,
    /// On the tool, N.
    pub force: Vec3,
}

/// Wrenches that contact can make: tissue presses, it does not pull.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cone {
    /// The mean direction of the forces.
    pub axis: DVec3,
    /// How far a force may lean from it: the tangent of the angle.
    pub lean: f64,
    /// How large a torque may be beside the force along the axis, at the lever.
    pub arm: f64,
}

/// What a tool feels when it is moved a little: a wrench that changes with the motion.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WrenchModel {
    /// Steps that were published.
    pub version: u64,
    /// Where the tool was in the middle of the step, for which its mean wrench stands.
    pub position: DVec3,
    pub orientation: DQuat,
    /// What the tool felt there.
    pub wrench: Vector6,
    /// How much less it feels for a motion.
    pub stiffness: Matrix6,
    /// The inverse of this stiffness and the coupling's together.
    pub answer: Matrix6,
    /// None: the tool holds something, or is held between contacts, and can be pulled too.
    pub cone: Option<Cone>,
    /// What the tool has done to the tissue since the handle was made, J.
    pub work: f64,
    /// When, and with what work by the models until then, the proxy was where the step led the tool: by the handle's own account.
    pub sent_at: f64,
    pub sent_work: f64,
    pub contacts: [HapticContact; MOST_CONTACTS],
    pub contact_count: usize,
}

impl WrenchModel {
    /// Nothing is near a tool that is here, led by a spring of this stiffness.
    pub fn free(position: DVec3, orientation: DQuat, spring: &Vector6) -> Self {
        Self {
            version: 0,
            position,
            orientation,
            wrench: six::ZERO,
            stiffness: six::NOTHING,
            answer: six::inverse(&six::diagonal(spring)),
            cone: None,
            work: 0.0,
            sent_at: 0.0,
            sent_work: 0.0,
            contacts: [HapticContact::default(); MOST_CONTACTS],
            contact_count: 0,
        }
    }

    /// The motion to here from where the model was made, with turns at the lever.
    pub fn motion_to(&self, position: DVec3, orientation: DQuat, lever: f64) -> Vector6 {
        six::joined(
            position - self.position,
            rotation::turn_between(self.orientation, orientation) * lever,
        )
    }

    /// What tissue does to a proxy that a device holds on springs of this stiffness, where the device has made this motion: both are at rest
    /// with each other (Saupin, Duriez, Cotin 2008).
    pub fn wrench_at(&self, device: &Vector6, spring: &Vector6) -> Vector6 {
        let pull = six::sum(&six::each(spring, device), &self.wrench);
        let proxy = six::product(&self.answer, &pull);
        let wrench = six::difference(&self.wrench, &six::product(&self.stiffness, &proxy));
        self.possible(&wrench)
    }

    /// The nearest wrench that the tissue can press with.
    pub fn possible(&self, wrench: &Vector6) -> Vector6 {
        self.cone.map_or(*wrench, |cone| cone.nearest(wrench))
    }

    /// What tissue and springs that press with this wrench give back as they let go, J.
    pub fn gives(&self, wrench: &Vector6, spring: &Vector6) -> f64 {
        let square = six::dot(wrench, wrench);
        let stiffness = six::dot(wrench, &six::product(&self.stiffness, wrench)) / square;
        let stored: f64 = (0..6).map(|k| wrench[k] * wrench[k] / spring[k]).sum();
        0.5 * (stored + square / stiffness.max(SOFTEST * spring[0]))
    }

    /// What of a device's velocity its proxy does not share: all where tissue is hard, nothing where there is none.
    pub fn lag(&self, velocity: &Vector6) -> Vector6 {
        six::product(&self.answer, &six::product(&self.stiffness, velocity))
    }
}

impl Cone {
    /// The nearest wrench that contact can make.
    fn nearest(&self, wrench: &Vector6) -> Vector6 {
        let (force, torque) = (six::along(wrench), six::about(wrench));
        let pressure = force.dot(self.axis);
        if pressure <= 0.0 {
            return six::ZERO;
        }
        let across = force - self.axis * pressure;
        six::joined(
            self.axis * pressure + across.clamp_length_max(self.lean * pressure),
            torque.clamp_length_max(self.arm * pressure),
        )
    }
}
