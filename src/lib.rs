//! Real-time soft-tissue simulation for programs with their own main loop.

mod base;
mod body;
pub mod capi;
mod cavities;
mod codec;
mod contact;
pub mod cutting;
mod debug_draw;
mod def;
mod deformable_contact;
pub mod detection;
mod elements;
mod embedding;
mod forces;
mod geometry;
mod haptics;
pub mod material;
pub mod mesh;
mod nodes;
mod order;
mod picture;
mod query;
#[cfg(test)]
mod random;
pub mod raster;
mod readers;
mod simd;
mod slots;
mod soa;
mod solver;
mod springs;
pub mod strain;
mod sync;
mod terms;
mod threads;
mod world;

pub use base::{AttachmentId, BladeId, BodyId, Error, LimitKind, Result, StepLimit, StepReport, SubstepLimit, ToolId};
pub use body::{Body, CutReport, NewNodeSource, NewRimEdge, Pieces, SpringState, TopologyChanges};
pub use contact::{
    BladeContactChange, BodyContactChange, Contact, ContactChange, MassProperties, Pose, Shape, ToolDefinition,
};
pub use debug_draw::{DebugCanvas, DebugDrawDefinition, Rgba};
pub use def::{
    Anchor, BodyContact, BodyDefinition, BodySettings, ChoiceReason, CollisionFilter, Detection, ElementLaw,
    EnclosedReport, Energy, Material, Model, Sleep, Solver, SolverChoice, SolverReport, SpringLaw, Storage,
    StorageReport, SurfacePoint, TearReport, Tearing, Values, Viscosity, Yielding,
};
pub use embedding::{Embedding, EmbeddingDefinition};
pub use haptics::{HapticContact, HapticDefinition, HapticHandle, HapticTick};
pub use picture::{BodyValues, PictureDefinition};
pub use query::{RayHit, SurfaceHit};
pub use readers::{BodyReader, Frame};
pub use simd::Kernel;
pub use solver::{RestStateDefinition, RestStateReport};
pub use threads::RunTasks;
pub use world::{
    BladeDefinition, BladeReport, BudgetReport, ReplayDifference, ReplayReport, StepProfile, SutureDefinition,
    SutureReport, World, WorldDefinition,
};
