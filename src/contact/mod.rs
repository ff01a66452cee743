//! What instruments do to tissue, and tissue to them.

mod candidates;
mod constraint;
mod contacts;
mod distance;
mod features;
mod gauge;
mod holds;
mod path;
mod sweep;
mod tool;

pub(crate) use contacts::{Contacts, Meeting};
pub(crate) use holds::Holds;
pub(crate) use path::ToolPath;
pub(crate) use tool::Tool;
pub use tool::{Detection, Pose, Shape, ToolDefinition};
