//! The world.
/// What a step did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepReport {
    /// placeholder
    pub stable_substep: f32,
    /// placeholder
    pub substeps_allowed: u32,
}
