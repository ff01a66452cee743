//! A kilohertz hand on a world of sixty steps a second.
//!
//! The stepping thread leaves a *model* of the tissue about a tool (`model.rs`, `secant.rs`), the device's thread feels it through a virtual coupling
//! (`handle.rs`), which an observer of energy keeps passive (`observer.rs`). They hand each other models and poses over without waiting.

mod definition;
mod handle;
mod model;
mod observer;
mod secant;
mod six;

pub use definition::HapticDefinition;
pub use handle::{HapticHandle, HapticTick};
pub use model::HapticContact;

pub(crate) use definition::{Coupling, spread};
pub(crate) use handle::Sent;
pub(crate) use model::{Cone, MOST_CONTACTS, WrenchModel};
pub(crate) use secant::Secant;
pub(crate) use six::{Vector6, ZERO, about, along, difference, inverse, joined, product, scaled, sum};
