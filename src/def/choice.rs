//! Which solver a body has, why, and what bounds its explicit substeps.

use super::Solver;
use crate::codec::{saved, saved_enum};

/// Why a body has its solver.
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

saved!(SolverChoice {
    solver,
    reason,
    substeps,
    step
});

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

/// What bounds the substeps of a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LimitKind {
    /// The springs of a node.
    Spring,
    /// The tetrahedra of a node.
    Element,
    /// The terms of a node: anchor springs, bending, fibers, Maxwell branches and strain limits.
    Term,
    /// The pressure in a cavity.
    Cavity,
    /// How many parts a step of IMPLICIT or NEWTON may have.
    Parts,
    /// The tolerance of the world.
    Tolerance,
}

saved_enum!(LimitKind { 0 => Spring, 1 => Element, 2 => Term, 3 => Cavity, 4 => Parts, 5 => Tolerance });

impl LimitKind {
    /// What it is called in a message.
    pub(crate) fn name(self) -> &'static str {
        match self {
            LimitKind::Spring => "the springs",
            LimitKind::Element => "the element",
            LimitKind::Term => "the term",
            LimitKind::Cavity => "a cavity",
            LimitKind::Parts => "contact or attachments",
            LimitKind::Tolerance => "the tolerance",
        }
    }
}

/// The part of a body that allows the shortest substep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SubstepLimit {
    /// What it is.
    pub kind: LimitKind,
    /// Its nodes in the caller's numbers, that of the highest frequency first; the last is repeated.
    pub nodes: [u32; 4],
    /// How many of them differ; 0: it is of no nodes.
    pub node_count: u32,
}

impl SubstepLimit {
    /// One that is of no nodes.
    pub(crate) fn of_all(kind: LimitKind) -> Self {
        Self {
            kind,
            nodes: [0; 4],
            node_count: 0,
        }
    }

    /// Its nodes, each once.
    pub fn nodes(&self) -> &[u32] {
        &self.nodes[..self.node_count as usize]
    }
}

saved!(SubstepLimit {
    kind,
    nodes,
    node_count
});
