//! Haptic rendering at 1 kHz beside a simulation at 60 Hz.
//!
//! The simulation thread publishes a *local model* of the tissue at a tool (`model.rs`, `secant.rs`). The device thread
//! renders it through a virtual coupling (`handle.rs`). A passivity observer limits its energy (`passivity.rs`). The
//! threads exchange models and poses without waiting.

mod definition;
mod handle;
mod model;
mod passivity;
mod secant;
mod six;

pub use definition::HapticDefinition;
pub use handle::{HapticHandle, HapticTick};
pub use model::HapticContact;

pub(crate) use definition::{Coupling, expanded};
pub(crate) use handle::Sent;
pub(crate) use model::{Cone, MAX_CONTACTS, WrenchModel};
pub(crate) use secant::Secant;
pub(crate) use six::{Vector6, ZERO, about, along, difference, inverse, joined, product, scaled, sum};
