//! The ids that callers hold, each of its own type.

/// A place, counted from 1, and which of the things that lived there is meant; all zero: none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct SlotId {
    pub index1: u32,
    pub generation: u32,
}

impl SlotId {
    /// The place, counted from 0, of what is known to live.
    pub fn index(self) -> usize {
        self.index1 as usize - 1
    }
}

/// A body of a world.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct BodyId(pub(crate) SlotId);

/// A tool of a world.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct ToolId(pub(crate) SlotId);

/// What a tool holds of a body, or a body of another.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct AttachmentId(pub(crate) SlotId);

/// A blade of a world.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct BladeId(pub(crate) SlotId);
