//! What instruments do to tissue, and tissue to them.

mod candidates;
#[allow(dead_code)] // until the response asks
pub(crate) mod closest;
mod coarse;
mod constraint;
mod contacts;
#[allow(dead_code)] // until the response asks
pub(crate) mod continuous;
#[allow(dead_code)]
mod deepest;
mod distance;
#[allow(dead_code)] // until the response asks
pub(crate) mod distance_field;
#[allow(dead_code)] // until the response asks
pub(crate) mod exact;
pub(crate) mod exact_overlap;
#[cfg(test)]
mod exact_tests;
#[allow(dead_code)]
mod facets;
mod features;
mod filter;
mod holds;
pub(crate) mod image_space;
mod limit;
mod meet;
mod mesh_solid;
pub(crate) mod nearest;
mod path;
pub(crate) mod predicates;
mod report;
mod sweep;
mod tissue;
mod tool;
#[allow(dead_code)]
pub(crate) mod tree;

pub(crate) use contacts::{Contacts, Meeting};
pub use filter::{BodyContact, CollisionFilter};
pub(crate) use holds::Holds;
pub(crate) use limit::TRIES;
pub(crate) use path::ToolPath;
pub use report::{Contact, ContactChange};
pub(crate) use tissue::{Moment, Tissue};
pub use tool::{Detection, Pose, Shape, ToolDefinition};
pub(crate) use tool::{Form, Tool};
