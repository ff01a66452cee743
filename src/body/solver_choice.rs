//! [`Solver::Auto`]: chooses a solver from the cost of explicit substeps.
//!
//! A substep of VERLET costs about as much as a matrix-vector product of IMPLICIT, of which a step takes 20 to 100.
//! IMPLICIT is therefore faster from 60 substeps on with springs, and from 150 with elements. Near a tool it takes
//! substeps of 1 ms, each with a linear solve, and is slower than VERLET up to about twice that number. VERLET is
//! therefore chosen up to 150 substeps.

use super::{Body, BodyContext};
use crate::base::Result;
use crate::def::{BodyDefinition, ChoiceReason, Solver, SolverChoice};
use crate::solver::StepRequest;
use crate::threads::Team;

/// The largest number of substeps per step for which VERLET is chosen.
const MAX_VERLET_SUBSTEPS: u32 = 150;

impl Body {
    pub(crate) fn new(definition: &BodyDefinition, context: BodyContext) -> Result<Self> {
        if definition.solver != Solver::Auto {
            return Self::with_solver(definition, context);
        }
        let create_with = |solver: Solver| Self::with_solver(&BodyDefinition { solver, ..*definition }, context);
        let mut body = create_with(Solver::Verlet)?;
        let substeps = body.verlet_substeps(&context);
        let allowed = match context.steps.substeps {
            0 => MAX_VERLET_SUBSTEPS.min(context.steps.max_substeps),
            // Fixed substeps are chosen for VERLET, and the length of the steps is not known.
            _ => u32::MAX,
        };
        let (solver, reason) = if substeps <= allowed {
            (Solver::Verlet, ChoiceReason::FewSubsteps)
        } else {
            body = create_with(Solver::Implicit)?;
            (Solver::Implicit, ChoiceReason::ManySubsteps)
        };
        body.solver_choice = SolverChoice {
            solver,
            reason,
            substeps,
            step: context.steps.length,
        };
        Ok(body)
    }

    /// The solver and the reason for its choice.
    pub fn solver_choice(&self) -> SolverChoice {
        self.solver_choice
    }

    /// The number of substeps of a step with VERLET, at the current positions.
    fn verlet_substeps(&mut self, context: &BodyContext) -> u32 {
        let request = StepRequest::alone(context.steps.length, context.steps.max_substeps);
        let substeps = self
            .system
            .with_integrator(|integrator, body| integrator.plan_step(body, &request, &Team::alone()))
            .substeps;
        self.system.rollback();
        substeps
    }
}
