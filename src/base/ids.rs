//! The ids that callers hold, each of its own type.

use std::sync::atomic::{AtomicU32, Ordering};

/// A place, counted from 1, and which of the things that lived there is meant; all zero: none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct SlotId {
    pub index1: u32,
    /// How many things have lived there, below the tag of the world.
    pub generation: u32,
}

impl SlotId {
    /// The place, counted from 0, of what is known to live.
    pub fn index(self) -> usize {
        self.index1 as usize - 1
    }
}

impl std::fmt::Display for SlotId {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{{{}, {}}}", self.index1, self.generation)
    }
}

/// What tells the ids of a world from those of others: the upper bits of every generation in it.
///
/// A slot is used a million times, and then another. A world that is loaded keeps the tag of the one that was saved, and so its ids.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct WorldTag(u32);

impl WorldTag {
    /// So many bits of a generation count what has lived in a slot.
    const BITS: u32 = 20;

    pub const COUNT: u32 = (1 << Self::BITS) - 1;

    /// Tags are 1 to this one: no id of small numbers has one, nor one of which all bits are set.
    const LAST: u32 = (!Self::COUNT >> Self::BITS) - 1;

    /// That of a new world, which the 4093 before it in this process do not have.
    pub fn next() -> Self {
        static WORLDS: AtomicU32 = AtomicU32::new(0);
        let before = WORLDS.fetch_add(1, Ordering::Relaxed);
        Self(before % Self::LAST + 1)
    }

    /// That of a generation, if some world gives such.
    pub fn of(generation: u32) -> Option<Self> {
        let tag = generation >> Self::BITS;
        (1..=Self::LAST).contains(&tag).then_some(Self(tag))
    }

    /// The generation of a slot that nothing had yet.
    pub fn generation(self) -> u32 {
        self.0 << Self::BITS
    }
}

/// A body of a world.
///
/// ```
#[doc = include_str!("../doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition::default())?;
/// let body = world.create_body(&cloth)?;
/// world.destroy_body(body)?;
/// assert!(!world.has_body(body));
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct BodyId(pub(crate) SlotId);

/// A tool of a world.
///
/// ```
/// # use sinew::*;
/// # let mut world = World::new(WorldDefinition::default())?;
/// let ball = world.create_tool(&ToolDefinition::new(Shape::Sphere { radius: 0.01 }))?;
/// assert!(world.has_tool(ball));
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct ToolId(pub(crate) SlotId);

/// What a tool holds of a body, or a body of another.
///
/// ```
#[doc = include_str!("../doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition::default())?;
/// # let body = world.create_body(&cloth)?;
/// # let ball = world.create_tool(&ToolDefinition::new(Shape::Sphere { radius: 0.01 }))?;
/// let held = world.attach_node(body, 12, ball, 0.0)?;
/// world.release(held)?;
/// assert!(!world.has_attachment(held));
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct AttachmentId(pub(crate) SlotId);

/// A blade of a world.
///
/// ```
/// # use glam::Vec3;
/// # use sinew::*;
/// # let mut world = World::new(WorldDefinition::default())?;
/// let blade = world.create_blade(&BladeDefinition::new([Vec3::NEG_Y, Vec3::Y]))?;
/// assert!(world.has_blade(blade));
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct BladeId(pub(crate) SlotId);
