//! Plain data that define bodies and validate themselves, and the reports of bodies.

mod anchor;
mod body;
mod choice;
mod contact;
mod element_law;
mod material;
mod report;
mod sleep;
mod spring_law;
mod springs;
mod tearing;
mod values;
mod viscosity;
mod yielding;

pub use anchor::{Anchor, SurfacePoint};
pub use body::{BodyDefinition, Solver, Storage};
pub(crate) use body::{MAX_ITERATIONS, MIN_MASS};
pub use choice::{ChoiceReason, SolverChoice};
pub(crate) use contact::check_reach;
pub use contact::{BodyContact, CollisionFilter, Detection};
pub use element_law::ElementLaw;
pub use material::{Material, Model};
pub use report::{EnclosedReport, Energy, SolverReport, StorageReport};
pub use sleep::{BodySettings, Sleep};
pub use spring_law::SpringLaw;
pub(crate) use springs::{Rounding, Spring, distance};
pub(crate) use tearing::TearRefusal;
pub use tearing::{TearReport, Tearing};
pub use values::Values;
pub(crate) use values::{check_given, check_values, expect_count, finite_vector, finite_vectors, node_indices};
pub use viscosity::Viscosity;
pub(crate) use viscosity::{NodalStiffness, RelaxationStep};
pub use yielding::Yielding;
