//! The lowest layer: errors, ids, fallible allocation, hashing, exact signs, matrices, disjoint sets, profiling.

mod disjoint_sets;
mod error;
mod hash;
mod ids;
mod matrices;
pub(crate) mod memory;
mod profile;
mod ranges;
mod step_report;
pub(crate) mod symbolic_perturbation;

pub(crate) use disjoint_sets::DisjointSets;
pub(crate) use error::ensure;
pub use error::{Error, Result};
pub(crate) use hash::StateHasher;
pub use ids::{AttachmentId, BladeId, BodyId, ToolId};
pub(crate) use ids::{SlotId, WorldTag};
pub(crate) use matrices::{cross_matrix, outer, trace};
pub(crate) use profile::{Count, Profile, Stage, Stopwatch, check_clock};
pub(crate) use ranges::{above_zero, all_finite, finite, not_negative};
pub use step_report::{LimitKind, StepLimit, StepReport, SubstepLimit};
