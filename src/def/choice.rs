//! The solver of a body, and the reason for it.

use super::Solver;
use crate::codec::{saved, saved_enum};

/// The reason for the solver of a body.
///
/// ```
#[doc = include_str!("../doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition::default())?;
/// let body = world.create_body(&BodyDefinition { solver: Solver::Implicit, ..cloth })?;
/// assert_eq!(world.body(body)?.solver_choice().reason, ChoiceReason::Given);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ChoiceReason {
    /// The definition names the solver.
    #[default]
    Given,
    /// [`Solver::Auto`]: explicit substeps are cheaper than an implicit solve, or the world's substeps are fixed.
    FewSubsteps,
    /// [`Solver::Auto`]: there would be too many explicit substeps.
    ManySubsteps,
}

saved_enum!(ChoiceReason { 0 => Given, 1 => FewSubsteps, 2 => ManySubsteps });

/// The solver of a body, and the figures by which [`Solver::Auto`] chose it.
///
/// ```
#[doc = include_str!("../doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition::default())?;
/// let body = world.create_body(&BodyDefinition { solver: Solver::Auto, ..cloth })?;
/// let choice = world.body(body)?.solver_choice();
/// assert_eq!((choice.solver, choice.reason), (Solver::Verlet, ChoiceReason::FewSubsteps));
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolverChoice {
    /// The solver; never [`Solver::Auto`].
    pub solver: Solver,
    /// The reason for the solver.
    pub reason: ChoiceReason,
    /// The explicit substeps of a step of `step` seconds at the initial positions; 0 if the solver was given.
    pub substeps: u32,
    /// The assumed step length, s; 0 if the solver was given.
    pub step: f32,
}

saved! { SolverChoice { solver, reason, substeps, step } }

impl SolverChoice {
    /// The choice of a definition that names its solver.
    pub(crate) fn given(solver: Solver) -> Self {
        Self {
            solver,
            reason: ChoiceReason::Given,
            substeps: 0,
            step: 0.0,
        }
    }
}
