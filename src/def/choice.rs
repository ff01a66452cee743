//! Which solver a body has, and why.

use super::Solver;
use crate::codec::{saved, saved_enum};

/// Why a body has its solver.
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
    /// The definition names it.
    #[default]
    Given,
    /// [`Solver::Auto`]: explicit substeps are few enough to cost less than the solution of an equation, or the world's are fixed.
    FewSubsteps,
    /// [`Solver::Auto`]: explicit substeps would be too many.
    ManySubsteps,
}

saved_enum!(ChoiceReason { 0 => Given, 1 => FewSubsteps, 2 => ManySubsteps });

/// The solver of a body, and what [`Solver::Auto`] chose it by.
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
    /// Never [`Solver::Auto`].
    pub solver: Solver,
    /// Why.
    pub reason: ChoiceReason,
    /// Explicit substeps that a step of `step` seconds would take at the positions of creation; 0 where the solver was given.
    pub substeps: u32,
    /// The length of a step that was assumed, s; 0 where the solver was given.
    pub step: f32,
}

saved! { SolverChoice { solver, reason, substeps, step } }

impl SolverChoice {
    /// The definition names it.
    pub(crate) fn given(solver: Solver) -> Self {
        Self {
            solver,
            reason: ChoiceReason::Given,
            substeps: 0,
            step: 0.0,
        }
    }
}
