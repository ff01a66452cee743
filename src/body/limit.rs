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
        let (mut limit, mut shortest) = (self.limit_of(LimitKind::Cavity, &[]), f32::INFINITY);
        if let Some(enclosed) = &self.system.enclosed {
            shortest = enclosed.rates().limit();
        }
        if let Some((nodes, substep)) = Stability::tightest(&*self.system.springs, masses, positions)
            && substep <= shortest
        {
            shortest = substep;
            limit = self.limit_of(LimitKind::Spring, &nodes.map(|node| node as u32));
        }
        if let Some(elements) = &self.system.elements
            && let Some((nodes, substep)) = elements.tightest(&masses, positions)
            && substep <= shortest
        {
            shortest = substep;
            limit = self.limit_of(LimitKind::Element, &nodes);
        }
        if let Some(terms) = &self.system.terms
            && terms.rates().limit() < shortest
        {
            let (mut most, mut found) = (-1.0, None);
            terms.show_carried(&masses, &mut |node, stiffness| {
                let rate = stiffness * masses.inverse(node);
                if rate > most {
                    (most, found) = (rate, Some(node as u32));
                }
            });
            limit = self.limit_of(LimitKind::Term, found.as_slice());
        }
        limit
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
