//! What a haptic handle is to be.

use crate::base::{Error, Result, ToolId, above_zero, ensure, not_negative};

use super::six::Vector6;

/// Turning is at least so many times as stiff, at the lever, as going along: less is lost in rounding where both are solved for at once.
const SOFTEST: f64 = 1e-6;

/// How a device is coupled to a tool. Plain data, used only during [`World::create_haptic`](crate::World::create_haptic).
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
    /// The tool that the device leads.
    pub tool: ToolId,
    /// Of the spring between device and tool, N/m, above 0. A device should stand it with its own sampling: about half of its damping, N s/m, by
    /// the time between ticks, or less.
    pub stiffness: f32,
    /// The same for turning, N m/rad, at least a millionth of the stiffness at the lever, which is half of the tool's length; 0: that stiffness.
    pub angular_stiffness: f32,
    /// Of the damper beside that spring, which acts where tissue resists: 1 damps `device_mass` on the spring critically. 0: what the loop makes of
    /// energy is still damped away, but less surely.
    pub damping_ratio: f32,
    /// What the hand moves of the device, kg, above 0.
    pub device_mass: f32,
    /// The largest force, N, at least 0; 0 or infinity: no limit.
    pub force_limit: f32,
    /// The largest torque, N m, at least 0; 0 or infinity: no limit.
    pub torque_limit: f32,
    /// How fast the force may change, N/s, at least 0; 0 or infinity: no limit. A force that such a limit makes late gives a hand more than it took: the loop is kept
    /// passive where it is not reached.
    pub force_rate_limit: f32,
    /// How fast the torque may change, N m/s, at least 0; 0 or infinity: no limit.
    pub torque_rate_limit: f32,
    /// A model that is older, s, above 0, is stale: force and torque go to 0 until there is a newer one.
    pub stale_after: f32,
    /// The time in which they do, or come back, s, above 0.
    pub ramp: f32,
}

impl HapticDefinition {
    /// 1000 N/m, critically damped for 50 g, without limits, stale after 0.1 s, with a ramp of 0.1 s.
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

    /// As a coupling at this lever, m.
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
        let turning = match self.angular_stiffness {
            0.0 => stiffness,
            angular => f64::from(angular) / (lever * lever),
        };
        ensure!(
            turning >= SOFTEST * stiffness,
            "angular_stiffness is {}: must be 0 or at least {:e}",
            self.angular_stiffness,
            SOFTEST * stiffness * lever * lever
        );
        let critical = |stiffness: f64| 2.0 * (stiffness * mass).sqrt();
        let damping = |stiffness: f64| f64::from(self.damping_ratio) * critical(stiffness);
        Ok(Coupling {
            lever,
            stiffness: [stiffness, turning],
            damping: [damping(stiffness), damping(turning)],
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

/// A spring and a damper between device and proxy; what is given twice is for what goes along and for what turns, at the lever.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Coupling {
    /// m.
    pub lever: f64,
    /// N/m.
    pub stiffness: [f64; 2],
    /// N s/m.
    pub damping: [f64; 2],
    /// What damps the device critically, whatever the coupling does, N s/m.
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

/// A pair, of what goes along and what turns, as six numbers.
pub(crate) fn spread([along, about]: [f64; 2]) -> Vector6 {
    [along, along, along, about, about, about]
}
