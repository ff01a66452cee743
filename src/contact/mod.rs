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
mod holds;
pub(crate) mod nearest;
mod path;
pub(crate) mod predicates;
mod sweep;
mod tool;
#[allow(dead_code)]
pub(crate) mod tree;

pub(crate) use contacts::{Contacts, Meeting};
pub(crate) use holds::Holds;
pub(crate) use path::ToolPath;
pub(crate) use tool::Tool;
pub use tool::{Detection, Pose, Shape, ToolDefinition};
