//! The device thread's access to a tool: a pose in, a force and a torque out.

use glam::{DQuat, DVec3, Vec3};

use super::definition::{Coupling, expanded};
use super::model::{HapticContact, WrenchModel};
use super::passivity::PassivityObserver;
use super::six::{self, Vector6};
#[cfg(doc)]
use crate::base::Error;
use crate::base::{Result, ensure};
use crate::contact::Pose;
use crate::def::finite_vector;
use crate::geometry::rotation;
use crate::sync::triple_buffer::{BufferReader, BufferWriter};

/// The largest change of the force in a tick beyond what the device's motion explains: absolute, N, and relative.
const MIN_CHANGE: f64 = 0.02;
const CHANGE: f64 = 0.02;

/// The fraction of the allowed change that is used, because of rounding.
const SAFETY: f64 = 0.99;

/// The largest rotation between proxy and device, rad. The local model is valid for small rotations.
const MAX_ROTATION: f64 = 1.0;

/// The longest time between ticks, s.
const MAX_INTERVAL: f32 = 1.0;

/// The pose of the proxy, sent to the simulation thread.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sent {
    pub pose: Pose,
    /// The time of the handle's clock, s.
    pub time: f64,
    /// The work of the proxy until then according to the local models, J.
    pub work: f64,
}

/// The result of a haptic tick.
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
/// # for _ in 0..10 {
/// #     handle.tick(pose, None, None, 0.001)?;
/// #     world.step(0.01)?;
/// # }
/// // The device is 3 mm below the surface.
/// let tick = handle.tick(pose, None, None, 0.001)?;
/// assert!(tick.force.y > 0.0);
/// assert!(tick.proxy.position.y > pose.position.y);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HapticTick {
    /// The force on the device, world axes, N.
    pub force: Vec3,
    /// The torque on the device about its position, N m.
    pub torque: Vec3,
    /// The pose that the tool moves to: the device's pose plus the extension of the spring.
    pub proxy: Pose,
    /// The number of contacts of the local model: [`HapticHandle::contacts`].
    pub contact_count: u32,
    /// The age of the local model in time of the ticks, s; infinite before the first model.
    pub age: f32,
    /// The number of local models published for the handle.
    pub version: u64,
    /// The factor on the force of the model: less than 1 after the model was stale.
    pub gain: f32,
    /// The energy dissipated by the coupling, J. Passivity control keeps it at 0 or above as far as damping can.
    pub lost: f64,
}

/// The device thread's access to a tool, created by [`World::create_haptic`](crate::World::create_haptic). One thread
/// can tick it while another steps the world.
///
/// A tick allocates nothing, takes no lock, never waits, and takes a few microseconds at most.
///
/// A spring and a damper couple the device to a proxy of the tool (virtual coupling: Colgate, Stanley, Brown 1995). The
/// massless proxy is where the spring and the tissue balance. A local model from the last step stands for the tissue:
/// the wrench on the tool and its change with the tool's motion, learned from the last motions. The difference between
/// two models fades in over the time between them. A tick changes the force by at most `stiffness * displacement +
/// damping * change of velocity`, plus 0.02 N or 2 %.
///
/// Dropping the handle ends the coupling.
///
/// ```
/// # use sinew::*;
/// # let mut world = World::new(WorldDefinition::default())?;
/// # let ball = world.create_tool(&ToolDefinition::new(Shape::Sphere { radius: 0.01 }))?;
/// let mut handle = world.create_haptic(&HapticDefinition::new(ball))?;
/// let device = std::thread::spawn(move || {
///     (0..100).try_for_each(|_| handle.tick(Pose::IDENTITY, None, None, 0.001).map(|_| ()))
/// });
/// world.step(1.0 / 60.0)?;
/// assert_eq!(device.join().expect("no tick panics"), Ok(()));
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Debug)]
pub struct HapticHandle {
    coupling: Coupling,
    models: BufferReader<WrenchModel>,
    poses: BufferWriter<Sent>,
    /// The pose and velocity of the device in the last tick.
    device: Option<(DVec3, DQuat, Vector6)>,
    clock: f64,
    /// The time when the last model arrived, s.
    arrived: f64,
    /// The remaining difference to earlier models, and the time in which it fades, s.
    remainder: Vector6,
    fades_in: f64,
    /// The time between the last two models, s.
    interval: f64,
    /// The wrench on the device before limits.
    unlimited: Vector6,
    /// The last wrench on the device.
    on_device: Vector6,
    /// The last wrench of the tissue on the proxy.
    on_proxy: Vector6,
    gain: f64,
    observer: PassivityObserver,
}

/// The motion of the device in a tick.
struct DeviceMotion {
    position: DVec3,
    orientation: DQuat,
    velocity: Vector6,
    /// The displacement since the last tick.
    displacement: Vector6,
    /// The change of velocity since the last tick.
    change: Vector6,
    dt: f64,
}

impl HapticHandle {
    pub(crate) fn new(coupling: Coupling, models: BufferReader<WrenchModel>, poses: BufferWriter<Sent>) -> Self {
        Self {
            coupling,
            models,
            poses,
            device: None,
            clock: 0.0,
            arrived: 0.0,
            remainder: six::ZERO,
            fades_in: 0.0,
            interval: 0.0,
            unlimited: six::ZERO,
            on_device: six::ZERO,
            on_proxy: six::ZERO,
            gain: 1.0,
            observer: PassivityObserver::default(),
        }
    }

    /// Returns the force on the device until the next tick, given its pose and velocity, m/s and rad/s, world axes,
    /// `dt` seconds after the last tick. With `None` the velocity is computed from the displacement since the last
    /// tick.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: a number is not finite, a coordinate is further than 1e9 m from 0, the orientation
    /// is zero, or `dt` is not above 0 and at most 1. After an error nothing has changed; apply no force to the device.
    /// A refused call allocates its message.
    pub fn tick(
        &mut self,
        pose: Pose,
        velocity: Option<Vec3>,
        angular_velocity: Option<Vec3>,
        dt: f32,
    ) -> Result<HapticTick> {
        let pose = pose.checked()?;
        velocity.map_or(Ok(()), |velocity| finite_vector("velocity", velocity))?;
        angular_velocity.map_or(Ok(()), |velocity| finite_vector("angular_velocity", velocity))?;
        ensure!(
            dt > 0.0 && dt <= MAX_INTERVAL,
            "dt is {dt}: must be above 0 and at most {MAX_INTERVAL}"
        );
        let motion = self.motion(pose, [velocity, angular_velocity], f64::from(dt));
        self.clock += motion.dt;
        self.observer.hand_moved(&self.on_device, &motion.displacement);
        let spring = expanded(self.coupling.stiffness);
        let mut tissue_wrench = self.tissue_wrench(&motion, &spring);
        if self.models.take() {
            let now = self.tissue_wrench(&motion, &spring);
            let discrepancy = six::difference(&tissue_wrench, &now);
            self.remainder = six::sum(&self.remainder, &six::scaled(&discrepancy, self.gain));
            self.interval = (self.clock - self.arrived)
                .min(self.coupling.stale_after)
                .max(motion.dt);
            self.fades_in = self.interval;
            self.arrived = self.clock;
            tissue_wrench = now;
        }
        self.ramp(motion.dt);
        self.fade(motion.dt);
        let damped = self.damped(&motion, &tissue_wrench, &spring);
        self.update_wrench(&motion, &six::sum(&tissue_wrench, &damped));
        self.account(&motion, &tissue_wrench, &spring);
        Ok(self.result(&motion, &spring))
    }

    /// Visits the contacts of the local model that the last tick used.
    pub fn contacts(&self, mut visit: impl FnMut(&HapticContact)) {
        self.models
            .read(|model| model.contacts[..model.contact_count].iter().for_each(&mut visit));
    }

    /// True if the tool or its world was destroyed. The force then fades as with a stale model.
    pub fn is_over(&self) -> bool {
        self.models.is_alone()
    }

    fn motion(&mut self, pose: Pose, [along, about]: [Option<Vec3>; 2], dt: f64) -> DeviceMotion {
        let (position, orientation) = (pose.position.as_dvec3(), pose.orientation.as_dquat().normalize());
        let lever = self.coupling.lever;
        let displacement = self.device.map_or(six::ZERO, |(from, turned_from, _)| {
            six::joined(
                position - from,
                rotation::rotation_between(turned_from, orientation) * lever,
            )
        });
        let velocity = six::joined(
            along.map_or(six::along(&displacement) / dt, |along| along.as_dvec3()),
            about.map_or(six::about(&displacement) / dt, |about| about.as_dvec3() * lever),
        );
        let last = self.device.replace((position, orientation, velocity));
        DeviceMotion {
            position,
            orientation,
            velocity,
            displacement,
            change: last.map_or(six::ZERO, |(_, _, previous)| six::difference(&velocity, &previous)),
            dt,
        }
    }

    /// The wrench of the tissue on the proxy according to the model.
    fn tissue_wrench(&self, motion: &DeviceMotion, spring: &Vector6) -> Vector6 {
        self.models.read(|model| {
            let device = model.motion_to(motion.position, motion.orientation, self.coupling.lever);
            model.wrench_at(&device, spring)
        })
    }

    /// Fades the force of a stale model out, and that of a new one in.
    fn ramp(&mut self, dt: f64) {
        let is_stale = self.age().min(self.clock) > self.coupling.stale_after;
        let step = dt / self.coupling.ramp;
        self.gain = if is_stale { self.gain - step } else { self.gain + step }.clamp(0.0, 1.0);
        if self.gain == 0.0 {
            self.observer.reset();
        }
    }

    /// Fades the difference to earlier models.
    fn fade(&mut self, dt: f64) {
        let left = (1.0 - dt / self.fades_in.max(dt)).max(0.0);
        self.fades_in = (self.fades_in - dt).max(0.0);
        self.remainder = six::scaled(&self.remainder, left);
    }

    /// The wrench of the coupling's damper, where tissue resists, and of the passivity controller.
    fn damped(&self, motion: &DeviceMotion, tissue_wrench: &Vector6, spring: &Vector6) -> Vector6 {
        let velocity = &motion.velocity;
        let lag = match *tissue_wrench == six::ZERO {
            true => six::ZERO,
            false => self.models.read(|model| model.lag(velocity)),
        };
        let coupled = six::scaled(&six::each(&expanded(self.coupling.damping), &lag), -1.0);
        let pushed = six::sum(
            &six::scaled(&six::sum(tissue_wrench, &coupled), self.gain),
            &self.remainder,
        );
        let releasable = self.models.read(|model| model.releasable_energy(&pushed, spring));
        // The current step, and the next one, may pass before a model shows the current motion.
        let delay = 2.0 * self.interval;
        let damper = self
            .observer
            .damping(velocity, &pushed, releasable, delay, &self.coupling, motion.dt);
        six::difference(&coupled, &six::scaled(velocity, damper))
    }

    /// Updates the wrench on the device: that of the model, with limited change, within all limits.
    fn update_wrench(&mut self, motion: &DeviceMotion, model_wrench: &Vector6) {
        let wanted = six::sum(&six::scaled(model_wrench, self.gain), &self.remainder);
        // Damping does not hold back a tool that leaves the tissue: contact does not pull.
        let wanted = self.models.read(|model| model.clamped(&wanted));
        let change = six::limited(&six::difference(&wanted, &self.unlimited), self.allowed(motion));
        self.unlimited = six::sum(&self.unlimited, &change);
        let wanted = six::limited(&self.unlimited, self.coupling.limits);
        let rates = self.coupling.rate_limits.map(|rate| rate * motion.dt);
        let change = six::limited(&six::difference(&wanted, &self.on_device), rates);
        self.on_device = six::sum(&self.on_device, &change);
    }

    /// Updates the work of the proxy and of the hand.
    fn account(&mut self, motion: &DeviceMotion, tissue_wrench: &Vector6, spring: &Vector6) {
        let on_proxy = six::sum(tissue_wrench, &self.remainder);
        let extension: Vector6 = std::array::from_fn(|k| (on_proxy[k] - self.on_proxy[k]) / spring[k]);
        let displacement = six::sum(&motion.displacement, &extension);
        self.observer.proxy_moved([&self.on_proxy, &on_proxy], &displacement);
        self.on_proxy = on_proxy;
        let account = self.models.read(|model| (model.work, model.sent_work));
        self.observer.balance(account, &on_proxy, &self.coupling, motion.dt);
    }

    /// The largest change of the wrench in a tick: what the spring and damper of the coupling explain, plus a small
    /// amount.
    fn allowed(&self, motion: &DeviceMotion) -> [f64; 2] {
        let parts: [fn(&Vector6) -> DVec3; 2] = [six::along, six::about];
        std::array::from_fn(|k| {
            let [displacement, change, unlimited] =
                [&motion.displacement, &motion.change, &self.unlimited].map(|six| parts[k](six).length());
            let moved = self.coupling.stiffness[k] * displacement + self.coupling.damping[k] * change;
            SAFETY * (moved + MIN_CHANGE.max(CHANGE * unlimited))
        })
    }

    fn age(&self) -> f64 {
        self.models.read(|model| match model.version {
            0 => f64::INFINITY,
            _ => self.clock - model.sent_at,
        })
    }

    /// Sends the proxy to the simulation, and returns the result of the tick.
    fn result(&mut self, motion: &DeviceMotion, spring: &Vector6) -> HapticTick {
        let extension: Vector6 = std::array::from_fn(|k| self.on_proxy[k] / spring[k]);
        let lever = self.coupling.lever;
        let turned = six::about(&extension) / lever;
        let proxy = Pose {
            position: finite(motion.position + six::along(&extension)),
            orientation: rotation::rotated(motion.orientation, turned.clamp_length_max(MAX_ROTATION)).as_quat(),
        };
        let (time, work) = (self.clock, self.observer.by_proxy);
        self.poses.write(|sent| {
            *sent = Sent {
                pose: proxy,
                time,
                work,
            }
        });
        let (version, contacts) = self.models.read(|model| (model.version, model.contact_count));
        HapticTick {
            force: finite(six::along(&self.on_device)),
            torque: finite(six::about(&self.on_device) * lever),
            proxy,
            contact_count: contacts as u32,
            age: self.age() as f32,
            version,
            gain: self.gain as f32,
            lost: self.observer.dissipated,
        }
    }
}

/// Converts to `f32`; very large values stay finite.
fn finite(exact: DVec3) -> Vec3 {
    exact.as_vec3().clamp(Vec3::MIN, Vec3::MAX)
}
