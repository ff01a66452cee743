//! Nodes of a body: state, pins, damping and bound points.

mod bindings;
mod damping;
mod pins;
mod state;

pub(crate) use bindings::{Bindings, NewNode, NodeBinding, vector, weighted_nodes};
pub(crate) use damping::{Mobility, NodeDamping};
pub(crate) use pins::{Pin, Pins};
pub(crate) use state::{State, current_and_next};
