//! What instruments do to tissue, and tissue to them.

#[cfg(test)]
mod bound_tests;
mod candidates;
pub(crate) mod closest;
mod constraint;
mod contacts;
mod distance;
pub(crate) mod distance_field;
mod edges;
pub(crate) mod exact;
mod features;
mod filter;
mod gauge;
mod holds;
pub(crate) mod image_space;
mod impulses;
mod limit;
mod meet;
mod mesh_solid;
pub(crate) mod nearest;
mod path;
pub(crate) mod predicates;
mod report;
mod rounded;
mod supports;
mod surface;
mod sweep;
mod tissue;
mod tool;
pub(crate) mod tree;

pub(crate) use contacts::{Contacts, Meeting};
pub use filter::{BodyContact, CollisionFilter};
pub(crate) use holds::Holds;
pub(crate) use limit::TRIES;
pub(crate) use path::{Frame, ToolPath};
pub use report::{Contact, ContactChange};
pub(crate) use surface::SurfaceChange;
pub(crate) use tissue::{Bonds, Corner, Moment, Tissue};
pub use tool::{Detection, Pose, Shape, ToolDefinition};
pub(crate) use tool::{Form, Tool};
