//! What instruments do to tissue, and tissue to them.

mod beside_tissue;
mod candidates;
pub(crate) mod closest;
mod constraint;
mod contacts;
mod cuboid;
mod distance;
pub(crate) mod distance_field;
mod driven;
mod edges;
pub(crate) mod exact;
mod features;
mod gauge;
mod grip;
mod holds;
pub(crate) mod image_space;
pub(crate) mod impulses;
mod limit;
mod meet;
mod mesh_solid;
mod node_contacts;
mod path;
mod press;
mod press_nodes;
mod report;
mod ridges;
mod rigid;
mod room;
mod rounded;
pub(crate) mod supports;
mod surface;
pub(crate) mod sweep;
#[cfg(test)]
mod sweep_tests;
mod tool;

pub(crate) use contacts::{Contacts, Meeting};
pub(crate) use driven::DynamicTool;
pub(crate) use holds::Holds;
pub(crate) use limit::TRIES;
pub(crate) use path::{Frame, ToolPath};
pub use report::{Contact, ContactChange};
pub use rigid::MassProperties;
pub(crate) use rigid::Rigid;
pub(crate) use surface::SurfaceChange;
pub(crate) use tool::{Form, Tool};
pub use tool::{Pose, Shape, ToolDefinition};
