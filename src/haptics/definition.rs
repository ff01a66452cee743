//! The definition of a haptic handle.

use crate::base::{Error, Result, ToolId, above_zero, ensure, not_negative};

use super::six::Vector6;

/// The least ratio of angular stiffness (at the lever arm) to stiffness: a lower one is lost in rounding when both are
/// solved together.
const MIN_ANGULAR_RATIO: f64 = 1e-6;

/// The definition of the coupling of a haptic device to a tool. Plain data, used only during
/// [`World::create_haptic`](crate::World::create_haptic).
///
/// ```
/// # use sinew::*;
/// # let mut world = World::new(WorldDefinition::default())?;
/// # let ball = world.create_tool(&ToolDefinition::new(Shape::Sphere { radius: 0.01 }))?;
/// let definition = HapticDefinition { stiffness: 500.0, force_limit: 3.0, ..HapticDefinition::new(ball) };
/// let mut handle = world.create_haptic(&definition)?;
/// let tick = handle.tick(Pose::IDENTITY, None, None, 0.001)?;
/// assert!(tick.force.length() <= 3.0);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HapticDefinition {
    /// The tool that the device moves.
    pub tool: ToolId,
    /// The stiffness of the spring between device and tool, N/m, above 0. The device must be stable with it: use at
    /// most about half of the device's damping, N s/m, divided by the time between ticks.
    pub stiffness: f32,
    /// The angular stiffness, N m/rad; 0 for `stiffness` at a lever arm of half of the tool's length. It is at least a
    /// millionth of that.
    pub angular_stiffness: f32,
    /// The damping ratio of the coupling, which acts where tissue resists; 1 damps `device_mass` critically. Passivity
    /// control is less effective with 0.
    pub damping_ratio: f32,
    /// The mass of the moving part of the device, kg, above 0.
    pub device_mass: f32,
    /// The largest force, N, at least 0; no limit with 0 or infinity.
    pub force_limit: f32,
    /// The largest torque, N m, at least 0; no limit with 0 or infinity.
    pub torque_limit: f32,
    /// The largest rate of change of the force, N/s, at least 0; no limit with 0 or infinity. A force delayed by this
    /// limit can return more energy than the user supplied: the loop is passive only while the limit is not reached.
    pub force_rate_limit: f32,
    /// The largest rate of change of the torque, N m/s, at least 0; no limit with 0 or infinity.
    pub torque_rate_limit: f32,
    /// The age from which a local model is stale, s, above 0. With a stale model force and torque fade to 0.
    pub stale_after: f32,
    /// The time in which force and torque fade, and return, s, above 0.
    pub ramp: f32,
}

impl HapticDefinition {
    /// A coupling of 1000 N/m, critically damped for 50 g, without limits, stale after 0.1 s, with a ramp of 0.1 s.
    pub fn new(tool: ToolId) -> Self {
        Self {
            tool,
            stiffness: 1000.0,
            angular_stiffness: 0.0,
            damping_ratio: 1.0,
            device_mass: 0.05,
            force_limit: f32::INFINITY,
            torque_limit: f32::INFINITY,
            force_rate_limit: f32::INFINITY,
            torque_rate_limit: f32::INFINITY,
            stale_after: 0.1,
            ramp: 0.1,
        }
    }

    /// The coupling, checked, with this lever arm, m.
    pub(crate) fn coupling(&self, lever: f64) -> Result<Coupling> {
        let positive = |name: &str, value: f32| above_zero(name, value).map(|()| f64::from(value));
        let limit = |name: &str, value: f32| match value {
            0.0 => Ok(f64::INFINITY),
            value if value > 0.0 => Ok(f64::from(value)),
            _ => Err(Error::invalid(format!("{name} is {value}: must be at least 0"))),
        };
        let stiffness = positive("stiffness", self.stiffness)?;
        not_negative("angular_stiffness", self.angular_stiffness)?;
        not_negative("damping_ratio", self.damping_ratio)?;
        let mass = positive("device_mass", self.device_mass)?;
        let angular = match self.angular_stiffness {
            0.0 => stiffness,
            angular => f64::from(angular) / (lever * lever),
        };
        ensure!(
            angular >= MIN_ANGULAR_RATIO * stiffness,
            "angular_stiffness is {}: must be 0 or at least {:e}",
            self.angular_stiffness,
            MIN_ANGULAR_RATIO * stiffness * lever * lever
        );
        let critical = |stiffness: f64| 2.0 * (stiffness * mass).sqrt();
        let damping = |stiffness: f64| f64::from(self.damping_ratio) * critical(stiffness);
        Ok(Coupling {
            lever,
            stiffness: [stiffness, angular],
            damping: [damping(stiffness), damping(angular)],
            critical: critical(stiffness),
            limits: [
                limit("force_limit", self.force_limit)?,
                limit("torque_limit", self.torque_limit)? / lever,
            ],
            rate_limits: [
                limit("force_rate_limit", self.force_rate_limit)?,
                limit("torque_rate_limit", self.torque_rate_limit)? / lever,
            ],
            stale_after: positive("stale_after", self.stale_after)?,
            ramp: positive("ramp", self.ramp)?,
        })
    }
}

/// The spring and damper between device and proxy. Pairs are for translation and for rotation, which is scaled by the
/// lever arm.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Coupling {
    /// m.
    pub lever: f64,
    /// N/m.
    pub stiffness: [f64; 2],
    /// N s/m.
    pub damping: [f64; 2],
    /// The critical damping of the device, N s/m, without the damping ratio.
    pub critical: f64,
    /// N.
    pub limits: [f64; 2],
    /// N/s.
    pub rate_limits: [f64; 2],
    /// s.
    pub stale_after: f64,
    /// s.
    pub ramp: f64,
}

/// Expands a pair for translation and rotation to six numbers.
pub(crate) fn expanded([along, about]: [f64; 2]) -> Vector6 {
    [along, along, along, about, about, about]
}
