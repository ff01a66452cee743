//! What instruments do to tissue, and tissue to them.

mod candidates;
mod closest;
mod constraint;
mod contacts;
mod distance;
mod features;
mod filter;
mod holds;
pub(crate) mod image_space;
mod limit;
mod meet;
mod mesh_solid;
mod path;
mod report;
mod sweep;
mod tool;

pub(crate) use contacts::{Contacts, Meeting};
pub use filter::{BodyContact, CollisionFilter};
pub(crate) use holds::Holds;
pub(crate) use limit::TRIES;
pub(crate) use path::ToolPath;
pub use report::{Contact, ContactChange};
pub use tool::{Detection, Pose, Shape, ToolDefinition};
pub(crate) use tool::{Form, Tool};
