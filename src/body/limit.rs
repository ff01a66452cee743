//! What bounds the explicit substeps of a body: the spring, element or term of the highest frequency.

use super::Body;
use crate::base::{LimitKind, SubstepLimit};
use crate::soa::Masses;
use crate::solver::Stability;

impl Body {
    /// What allows the shortest substep with the nodes where they are. It looks at everything that makes forces.
    pub(crate) fn substep_limit(&self) -> SubstepLimit {
        let masses = Masses {
            masses: &self.system.masses,
            inverse_masses: &self.system.inverse_masses,
            are_heavier: self.system.scaling.as_ref().is_some_and(|scaling| scaling.step() > 0.0),
        };
        let positions = self.system.state.positions();
        let forces = &self.system.forces;
        let spring = Stability::tightest(&*forces.springs, masses, positions);
        let (kind, nodes, count) = forces.tightest(&masses, positions, spring);
        self.limit_of(kind, &nodes[..count])
    }

    /// One of these nodes of its own, at most 4.
    fn limit_of(&self, kind: LimitKind, nodes: &[u32]) -> SubstepLimit {
        let caller = |place: usize| nodes.get(place).map(|&node| self.system.order.caller(node));
        let last = nodes.len().saturating_sub(1);
        SubstepLimit {
            kind,
            nodes: [0, 1, 2, 3].map(|place: usize| caller(place.min(last)).unwrap_or(0)),
            node_count: nodes.len() as u32,
        }
    }
}
