//! What instruments do to tissue, and tissue to them.

mod candidates;
#[allow(dead_code, reason = "tools of meshes ask for it")]
mod closest;
mod constraint;
mod contacts;
mod distance;
mod features;
mod holds;
pub(crate) mod image_space;
mod path;
mod sweep;
mod tool;

pub(crate) use contacts::{Contacts, Meeting};
pub(crate) use holds::Holds;
pub(crate) use path::ToolPath;
pub(crate) use tool::Tool;
pub use tool::{Detection, Pose, Shape, ToolDefinition};
