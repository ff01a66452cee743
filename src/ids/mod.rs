//! Generational ids, and lists of what they name.

mod named;
mod slots;

pub use named::{AttachmentId, BladeId, BodyId, ToolId};
pub(crate) use slots::{SlotId, Slots};
