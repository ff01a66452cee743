//! What a world says about itself: energy, memory, a hash of its state.

mod energy;
mod hash;

pub use energy::Energy;
pub(crate) use hash::StateHasher;

/// How much memory the springs of a body take.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StorageReport {
    /// Nodes of the body.
    pub node_count: usize,
    /// Springs of the body, each counted once.
    pub spring_count: usize,
    /// Bytes taken by the springs that exist.
    pub bytes_used: usize,
    /// Bytes held from the allocator, with what is spare.
    pub bytes_reserved: usize,
}

/// How a body's solver took the last step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SolverReport {
    /// Products with the matrix of the step's equation; 0 for bodies that are moved explicitly.
    pub iterations: u32,
    /// How far nodes may be from where the step's equation has them, root mean square by mass, m; 0 for bodies that are moved
    /// explicitly. What a shorter step would change is not in it.
    pub error: f32,
    /// By how much mass scaling makes nodes heavier in all, kg; see
    /// [`BodyDefinition::mass_scaling`](crate::BodyDefinition::mass_scaling).
    pub added_mass: f64,
}
