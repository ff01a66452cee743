//! Sleep settings, and the settings of a body that can change later.

use crate::base::{Result, above_zero, not_negative};
use crate::codec::saved;

/// The conditions under which tissue at rest falls asleep.
///
/// ```
/// # use glam::Vec3;
#[doc = include_str!("../doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition { gravity: Vec3::ZERO, ..WorldDefinition::default() })?;
/// let sleep = Sleep { speed: 1e-3, time: 0.1 };
/// let body = world.create_body(&BodyDefinition { sleep, ..cloth })?;
/// for _ in 0..20 {
///     world.step(1.0 / 60.0)?;
/// }
/// assert_eq!(world.body(body)?.awake_share(), 0.0);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sleep {
    /// The speed below which tissue is at rest (m/s), at least 0. 0: the body never sleeps, and has no cost for it.
    pub speed: f32,
    /// The time at rest before tissue falls asleep (s), above 0. Choose a few times the settling time of the tissue.
    pub time: f32,
}

saved! { Sleep { speed, time } }

/// The settings of a body that can change after its creation.
///
/// ```
#[doc = include_str!("../doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition::default())?;
/// # let body = world.create_body(&cloth)?;
/// let settings = world.body(body)?.settings();
/// world.set_body_settings(body, BodySettings { thickness: 0.002, ..settings })?;
/// assert_eq!(world.body(body)?.settings().thickness, 0.002);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodySettings {
    /// [`BodyContact::thickness`](super::BodyContact::thickness).
    pub thickness: f32,
    /// [`BodyContact::friction`](super::BodyContact::friction).
    pub friction: f32,
    /// [`BodyContact::with_bodies`](super::BodyContact::with_bodies).
    pub with_bodies: bool,
    /// [`BodyContact::with_itself`](super::BodyContact::with_itself).
    pub with_itself: bool,
    /// The sleep settings.
    pub sleep: Sleep,
}

impl Default for Sleep {
    /// No sleep; the time is half a second.
    fn default() -> Self {
        Self { speed: 0.0, time: 0.5 }
    }
}

impl Sleep {
    pub(crate) fn check(&self) -> Result<()> {
        not_negative("sleep_speed", self.speed)?;
        above_zero("sleep_time", self.time)?;
        Ok(())
    }
}
