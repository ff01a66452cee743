//! The ids that callers hold, each of its own type.

use super::SlotId;
use crate::codec::saved;

/// A body of a world.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct BodyId(pub(crate) SlotId);

saved!(BodyId { 0 });

/// A tool of a world.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct ToolId(pub(crate) SlotId);

saved!(ToolId { 0 });

/// What a tool holds of a body, or a body of another.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct AttachmentId(pub(crate) SlotId);

saved!(AttachmentId { 0 });

/// A blade of a world.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct BladeId(pub(crate) SlotId);
