//! What instruments do to tissue, and tissue to them.

mod candidates;
pub(crate) mod closest;
mod coarse;
mod constraint;
mod contacts;
#[allow(dead_code)] // for tissue against tissue
pub(crate) mod continuous;
mod deepest;
mod distance;
pub(crate) mod distance_field;
pub(crate) mod exact;
pub(crate) mod exact_overlap;
#[cfg(test)]
mod exact_tests;
mod facets;
mod features;
mod holds;
pub(crate) mod nearest;
mod path;
pub(crate) mod predicates;
mod sweep;
mod tool;
pub(crate) mod tree;

pub(crate) use contacts::{Contacts, Meeting};
pub(crate) use holds::Holds;
pub(crate) use path::ToolPath;
pub(crate) use tool::Tool;
pub use tool::{Detection, Pose, Shape, ToolDefinition};
