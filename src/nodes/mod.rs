//! The nodes of a body: how they move, what holds them, and the points that are bound to them.

mod bindings;
mod damping;
mod pins;
mod state;

pub(crate) use bindings::{Bindings, Bound, NewNode, parts, vector};
pub(crate) use damping::{Mobility, NodeDamping};
pub(crate) use pins::{Pin, Pins};
pub(crate) use state::{State, current_and_next};
