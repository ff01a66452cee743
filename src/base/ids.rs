//! Generational ids, one type for each kind of object.

use std::sync::atomic::{AtomicU32, Ordering};

/// A slot, counted from 1, and the generation of its object; all zero names nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct SlotId {
    pub index1: u32,
    /// The number of objects that the slot has had, with the tag of the world in the upper bits.
    pub generation: u32,
}

impl SlotId {
    /// The slot, counted from 0, of an existing object.
    pub fn index(self) -> usize {
        self.index1 as usize - 1
    }
}

impl std::fmt::Display for SlotId {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{{{}, {}}}", self.index1, self.generation)
    }
}

/// Distinguishes the ids of different worlds: the upper bits of every generation.
///
/// A slot is used a million times, then it is retired. A loaded world keeps the tag of the saved one, and so its ids.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct WorldTag(u32);

impl WorldTag {
    /// The number of bits of a generation that count the objects of a slot.
    const BITS: u32 = 20;

    pub const COUNT: u32 = (1 << Self::BITS) - 1;

    /// The largest tag. Tags start at 1, so that neither small numbers nor all bits set form a valid id.
    const LAST: u32 = (!Self::COUNT >> Self::BITS) - 1;

    /// The tag of a new world. It differs from those of the previous 4093 worlds of the process.
    pub fn next() -> Self {
        static WORLDS: AtomicU32 = AtomicU32::new(0);
        let before = WORLDS.fetch_add(1, Ordering::Relaxed);
        Self(before % Self::LAST + 1)
    }

    /// The tag in a generation, if it is valid.
    pub fn of(generation: u32) -> Option<Self> {
        let tag = generation >> Self::BITS;
        (1..=Self::LAST).contains(&tag).then_some(Self(tag))
    }

    /// The generation of an unused slot.
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

/// An attachment of a body to a tool or to another body.
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
