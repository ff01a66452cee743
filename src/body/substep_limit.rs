//! The limit of a body's explicit substeps: the spring, element or term with the highest frequency.

use super::Body;
use crate::base::{LimitKind, SubstepLimit};
use crate::solver::{Stability, masses_in_use};

impl Body {
    /// The cause of the shortest stable substep at the current positions. All forces are examined.
    pub(crate) fn substep_limit(&self) -> SubstepLimit {
        let system = &self.system;
        let masses = masses_in_use(&system.masses, &system.inverse_masses, system.scaling.as_deref());
        let positions = system.state.positions();
        let forces = &system.forces;
        let spring = Stability::tightest(&*forces.springs, masses, positions);
        let (kind, nodes, count) = forces.tightest(&masses, positions, spring);
        self.limit_at(kind, &nodes[..count])
    }

    /// A limit at up to four nodes, given by their internal indices.
    fn limit_at(&self, kind: LimitKind, nodes: &[u32]) -> SubstepLimit {
        let caller = |index: usize| nodes.get(index).map(|&node| self.system.order.caller(node));
        let last = nodes.len().saturating_sub(1);
        SubstepLimit {
            kind,
            nodes: [0, 1, 2, 3].map(|index: usize| caller(index.min(last)).unwrap_or(0)),
            node_count: nodes.len() as u32,
        }
    }
}
