//! What the device's thread has of a world: a pose in, a force and a torque out.

use glam::{DQuat, DVec3, Vec3};

use super::definition::{Coupling, spread};
use super::model::{HapticContact, WrenchModel};
use super::observer::Observer;
use super::six::{self, Vector6};
#[cfg(doc)]
use crate::base::Error;
use crate::base::{Result, ensure};
use crate::contact::Pose;
use crate::def::finite_vector;
use crate::geometry::rotation;
use crate::sync::triple_buffer::{BufferReader, BufferWriter};

/// Beside what the motion of the device explains, a tick changes the force by no more than this, N, or this part of it.
const LEAST_CHANGE: f64 = 0.02;
const CHANGE: f64 = 0.02;

/// A little less is used of what is allowed, for rounding.
const SURE: f64 = 0.99;

/// The furthest that the spring turns the proxy from the device, rad: a model of small turns says nothing of more.
const FURTHEST_TURN: f64 = 1.0;

/// The longest time between ticks, s.
const LONGEST: f32 = 1.0;

/// Where the proxy is, for the world.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sent {
    pub pose: Pose,
    /// By the handle's clock, s.
    pub time: f64,
    /// What it has done until then, by the models, J.
    pub work: f64,
}

/// What a tick comes to.
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
    /// On the device, world axes, N.
    pub force: Vec3,
    /// On the device, about its position, N m.
    pub torque: Vec3,
    /// Where the tool is to go: the device, but for what the spring between them is drawn out.
    pub proxy: Pose,
    /// Contacts of the tool as the model was made: [`HapticHandle::contacts`].
    pub contact_count: u32,
    /// How long ago the device was where the model was made, s, by the ticks; infinite as long as there was none.
    pub age: f32,
    /// The steps of the world that were published for it.
    pub version: u64,
    /// What part of the forces of the model is given: less than 1 where that was stale.
    pub gain: f32,
    /// What the coupling has lost of the energy that went through it, J: kept at 0 or above as far as damping can.
    pub lost: f64,
}

/// The device's side of a tool of a world, made by [`World::create_haptic`](crate::World::create_haptic): for one thread, which may tick while
/// another steps the world.
///
/// A tick allocates nothing, takes no lock, waits for nothing and takes a few microseconds at most, whatever the world does meanwhile.
///
/// The device is coupled to a proxy of the tool by a spring and a damper (virtual coupling: Colgate, Stanley, Brown 1995). The proxy has no mass: it is where
/// the spring and the tissue are at rest with each other. The tissue is a model that the last step left: the wrench that the tool felt, and how it
/// changes with the tool's motion, learnt from its last ways. What a new model says otherwise than the last one fades in over the time between
/// two of them, and never so fast that a tick changes the force by more than `stiffness * way + damping * change of velocity` and 0.02 N or 2 %.
///
/// When it is dropped, the tool is the world's again.
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
    /// Where the device was in the last tick, and how fast.
    device: Option<(DVec3, DQuat, Vector6)>,
    clock: f64,
    /// When the last model came.
    arrived: f64,
    /// What is felt beside what the model says, and how long that may take to fade, s.
    rest: Vector6,
    fades_in: f64,
    /// The time between the last two models, s.
    between: f64,
    /// What is felt, before limits.
    felt: Vector6,
    /// What the device was given last.
    given: Vector6,
    /// What the proxy met last.
    held: Vector6,
    gain: f64,
    observer: Observer,
}

/// What the device does in a tick.
struct DeviceMotion {
    position: DVec3,
    orientation: DQuat,
    velocity: Vector6,
    /// Since the last tick.
    way: Vector6,
    /// What the velocity has changed since then.
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
            rest: six::ZERO,
            fades_in: 0.0,
            between: 0.0,
            felt: six::ZERO,
            given: six::ZERO,
            held: six::ZERO,
            gain: 1.0,
            observer: Observer::default(),
        }
    }

    /// Takes where the device is and how fast it moves, m/s and rad/s, world axes, `dt` seconds after the last tick, and says what it is to feel
    /// until the next. `None`: as fast as its way since the last tick says.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: a number is not finite, a coordinate is further than 1e9 m from 0, the orientation is zero, or `dt` is not above 0 and at
    /// most 1. Nothing has changed then; the device should be given no force. Such a call allocates its message.
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
            dt > 0.0 && dt <= LONGEST,
            "dt is {dt}: must be above 0 and at most {LONGEST}"
        );
        let motion = self.motion(pose, [velocity, angular_velocity], f64::from(dt));
        self.clock += motion.dt;
        self.observer.hand_moved(&self.given, &motion.way);
        let spring = spread(self.coupling.stiffness);
        let mut pressed = self.pressed(&motion, &spring);
        if self.models.take() {
            let now = self.pressed(&motion, &spring);
            let otherwise = six::difference(&pressed, &now);
            self.rest = six::sum(&self.rest, &six::scaled(&otherwise, self.gain));
            self.between = (self.clock - self.arrived)
                .min(self.coupling.stale_after)
                .max(motion.dt);
            self.fades_in = self.between;
            self.arrived = self.clock;
            pressed = now;
        }
        self.ramp(motion.dt);
        self.fade(motion.dt);
        let damped = self.damped(&motion, &pressed, &spring);
        self.feel(&motion, &six::sum(&pressed, &damped));
        self.account(&motion, &pressed, &spring);
        Ok(self.result(&motion, &spring))
    }

    /// The contacts of the tool as the model was made that the last tick used.
    pub fn contacts(&self, mut see: impl FnMut(&HapticContact)) {
        self.models
            .read(|model| model.contacts[..model.contact_count].iter().for_each(&mut see));
    }

    /// Whether the tool, or its world, is gone: the last force fades as that of a stale model does.
    pub fn is_over(&self) -> bool {
        self.models.is_alone()
    }

    fn motion(&mut self, pose: Pose, [along, about]: [Option<Vec3>; 2], dt: f64) -> DeviceMotion {
        let (position, orientation) = (pose.position.as_dvec3(), pose.orientation.as_dquat().normalize());
        let lever = self.coupling.lever;
        let way = self.device.map_or(six::ZERO, |(from, turned_from, _)| {
            six::joined(
                position - from,
                rotation::turn_between(turned_from, orientation) * lever,
            )
        });
        let velocity = six::joined(
            along.map_or(six::along(&way) / dt, |along| along.as_dvec3()),
            about.map_or(six::about(&way) / dt, |about| about.as_dvec3() * lever),
        );
        let last = self.device.replace((position, orientation, velocity));
        DeviceMotion {
            position,
            orientation,
            velocity,
            way,
            change: last.map_or(six::ZERO, |(_, _, slower)| six::difference(&velocity, &slower)),
            dt,
        }
    }

    /// What tissue does to the proxy by the model.
    fn pressed(&self, motion: &DeviceMotion, spring: &Vector6) -> Vector6 {
        self.models.read(|model| {
            let device = model.motion_to(motion.position, motion.orientation, self.coupling.lever);
            model.wrench_at(&device, spring)
        })
    }

    /// Lets what a stale model says go, and come back.
    fn ramp(&mut self, dt: f64) {
        let is_stale = self.age().min(self.clock) > self.coupling.stale_after;
        let step = dt / self.coupling.ramp;
        self.gain = if is_stale { self.gain - step } else { self.gain + step }.clamp(0.0, 1.0);
        if self.gain == 0.0 {
            self.observer.forget();
        }
    }

    /// Lets what earlier models said otherwise go.
    fn fade(&mut self, dt: f64) {
        let left = (1.0 - dt / self.fades_in.max(dt)).max(0.0);
        self.fades_in = (self.fades_in - dt).max(0.0);
        self.rest = six::scaled(&self.rest, left);
    }

    /// What the dampers do, the coupling's where tissue resists, and the observer's.
    fn damped(&self, motion: &DeviceMotion, pressed: &Vector6, spring: &Vector6) -> Vector6 {
        let velocity = &motion.velocity;
        let lag = match *pressed == six::ZERO {
            true => six::ZERO,
            false => self.models.read(|model| model.lag(velocity)),
        };
        let coupled = six::scaled(&six::each(&spread(self.coupling.damping), &lag), -1.0);
        let pushed = six::sum(&six::scaled(&six::sum(pressed, &coupled), self.gain), &self.rest);
        let gives = self.models.read(|model| model.gives(&pushed, spring));
        // The step that is next to begin is told of when it is over.
        let late = 2.0 * self.between;
        let damper = self
            .observer
            .damping(velocity, &pushed, gives, late, &self.coupling, motion.dt);
        six::difference(&coupled, &six::scaled(velocity, damper))
    }

    /// What the device is given: what the model says, no more changed than may be, and within all limits.
    fn feel(&mut self, motion: &DeviceMotion, said: &Vector6) {
        let wanted = six::sum(&six::scaled(said, self.gain), &self.rest);
        // Dampers do not hold back a tool that leaves: what presses it does not pull.
        let wanted = self.models.read(|model| model.possible(&wanted));
        let change = six::limited(&six::difference(&wanted, &self.felt), self.allowed(motion));
        self.felt = six::sum(&self.felt, &change);
        let wanted = six::limited(&self.felt, self.coupling.limits);
        let rates = self.coupling.rate_limits.map(|rate| rate * motion.dt);
        let change = six::limited(&six::difference(&wanted, &self.given), rates);
        self.given = six::sum(&self.given, &change);
    }

    /// Keeps account of what the proxy and the hand have done.
    fn account(&mut self, motion: &DeviceMotion, pressed: &Vector6, spring: &Vector6) {
        let held = six::sum(pressed, &self.rest);
        let drawn: Vector6 = std::array::from_fn(|k| (held[k] - self.held[k]) / spring[k]);
        let way = six::sum(&motion.way, &drawn);
        self.observer.proxy_moved([&self.held, &held], &way);
        self.held = held;
        let account = self.models.read(|model| (model.work, model.sent_work));
        self.observer.balance(account, &held, &self.coupling, motion.dt);
    }

    /// By how much what is felt may change in a tick: as the springs and dampers of the coupling would, and a little.
    fn allowed(&self, motion: &DeviceMotion) -> [f64; 2] {
        let parts: [fn(&Vector6) -> DVec3; 2] = [six::along, six::about];
        std::array::from_fn(|k| {
            let [way, change, felt] = [&motion.way, &motion.change, &self.felt].map(|six| parts[k](six).length());
            let moved = self.coupling.stiffness[k] * way + self.coupling.damping[k] * change;
            SURE * (moved + LEAST_CHANGE.max(CHANGE * felt))
        })
    }

    fn age(&self) -> f64 {
        self.models.read(|model| match model.version {
            0 => f64::INFINITY,
            _ => self.clock - model.sent_at,
        })
    }

    /// Sends the proxy to the world, and tells the device.
    fn result(&mut self, motion: &DeviceMotion, spring: &Vector6) -> HapticTick {
        let drawn: Vector6 = std::array::from_fn(|k| self.held[k] / spring[k]);
        let lever = self.coupling.lever;
        let turned = six::about(&drawn) / lever;
        let proxy = Pose {
            position: finite(motion.position + six::along(&drawn)),
            orientation: rotation::turned(motion.orientation, turned.clamp_length_max(FURTHEST_TURN)).as_quat(),
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
            force: finite(six::along(&self.given)),
            torque: finite(six::about(&self.given) * lever),
            proxy,
            contact_count: contacts as u32,
            age: self.age() as f32,
            version,
            gain: self.gain as f32,
            lost: self.observer.lost,
        }
    }
}

/// Finite, however fast the device is said to be.
fn finite(exact: DVec3) -> Vec3 {
    exact.as_vec3().clamp(Vec3::MIN, Vec3::MAX)
}
