//! [`Solver::Auto`]: which solver a body gets, from what its explicit substeps would cost.
//!
//! A substep of VERLET costs about as much as a product with the matrix of IMPLICIT's equation, of which a step takes 20 to 100. So IMPLICIT is
//! faster from 60 substeps on with springs, and from 150 with elements. Near a tool it takes parts of 1 ms, each with an equation of its own, and is slower
//! than VERLET up to about twice that: VERLET is chosen as far as 150 substeps.

use super::{Body, Needs};
use crate::base::Result;
use crate::def::{BodyDefinition, ChoiceReason, Solver, SolverChoice};
use crate::solver::StepRequest;
use crate::threads::Team;

/// The most substeps of a step for which VERLET is chosen.
const FEW_SUBSTEPS: u32 = 150;

impl Body {
    pub(crate) fn new(definition: &BodyDefinition, needs: Needs) -> Result<Self> {
        if definition.solver != Solver::Auto {
            return Self::with_solver(definition, needs);
        }
        let with = |solver: Solver| Self::with_solver(&BodyDefinition { solver, ..*definition }, needs);
        let mut body = with(Solver::Verlet)?;
        let substeps = body.substeps_for(&needs);
        let allowed = match needs.steps.substeps {
            0 => FEW_SUBSTEPS.min(needs.steps.max_substeps),
            // Who fixes substeps has chosen them for VERLET; how long the steps will be is not known.
            _ => u32::MAX,
        };
        let (solver, reason) = if substeps <= allowed {
            (Solver::Verlet, ChoiceReason::FewSubsteps)
        } else {
            body = with(Solver::Implicit)?;
            (Solver::Implicit, ChoiceReason::ManySubsteps)
        };
        body.choice = SolverChoice {
            solver,
            reason,
            substeps,
            step: needs.steps.length,
        };
        Ok(body)
    }

    /// Its solver, and why it has it.
    pub fn solver_choice(&self) -> SolverChoice {
        self.choice
    }

    /// How many substeps it would take with VERLET in a step, with its nodes where they are.
    fn substeps_for(&mut self, needs: &Needs) -> u32 {
        let request = StepRequest::alone(needs.steps.length, needs.steps.max_substeps);
        let substeps = self
            .system
            .lend(|integrator, body| integrator.need(body, &request, &Team::alone()))
            .substeps;
        self.system.put_back();
        substeps
    }
}
