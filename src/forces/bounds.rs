//! Frequency bounds of the forces besides springs, and the nodal stiffness behind them.

use super::Forces;
use crate::base::{LimitKind, Result, memory};
use crate::def::NodalStiffness;
use crate::elements::Elements;
use crate::soa::{FrequencyBound, NodalMasses, Vectors};
use crate::threads::Team;

/// Bodies with fewer tetrahedra take so little time that memory for tight bounds does not pay.
const MIN_TIGHTENED: usize = 256;

impl Forces {
    /// The nodal stiffness of elements, terms and cavities. Empty if there are none.
    pub fn non_spring_nodal_stiffness(&self, positions: &Vectors, masses: &NodalMasses) -> Result<Vec<NodalStiffness>> {
        if !self.has_non_spring_forces() {
            return Ok(Vec::new());
        }
        let mut nodal_stiffness = memory::filled(NodalStiffness::default(), positions.len())?;
        self.elements
            .iter()
            .for_each(|elements| elements.add_to(masses, &mut nodal_stiffness));
        let terms = self.auxiliary.terms.iter();
        terms.for_each(|terms| terms.add_to(masses, &mut nodal_stiffness));
        if let Some(cavities) = &self.auxiliary.cavities {
            cavities.add_to(positions, masses, &mut nodal_stiffness)?;
        }
        Ok(nodal_stiffness)
    }

    /// The longest stable substep of all forces but springs at the current state, with nodes at `positions`, s. It is
    /// infinite if there are none. `are_forces_current`: the last forces are those at these positions.
    pub fn non_spring_dt_limit(
        &mut self,
        positions: &Vectors,
        masses: &NodalMasses,
        are_forces_current: bool,
        team: &Team,
    ) -> f32 {
        let are_rates_valid = self
            .elements
            .as_mut()
            .is_none_or(|elements| elements.find_rates(&*self.springs, masses) && are_forces_current);
        if !are_rates_valid {
            self.write_records(positions, team);
        }
        if let (Some(elements), Some(records), false) = (&mut self.elements, &self.records, are_rates_valid) {
            elements.find_forces(self.kernel, records.as_slice(), team);
            elements.commit_rate_bound();
        }
        if let Some(terms) = &mut self.auxiliary.terms {
            terms.find_rates(&*self.springs, masses);
            if !are_forces_current {
                terms.commit_stiffening_at(positions);
            }
        }
        if let Some(cavities) = &mut self.auxiliary.cavities {
            let springs = (self.elements.is_none() && self.auxiliary.terms.is_none()).then_some(&*self.springs);
            if !(cavities.find_rates(springs, masses) && are_forces_current) {
                cavities.find_forces(positions, team);
                cavities.commit_rate_bound();
            }
        }
        self.rates(true).limit()
    }

    /// Allocates memory for tight bounds of elements, if there are many.
    pub fn prepare_deformed_rates(&mut self) -> Result<()> {
        match &mut self.elements {
            Some(elements) if elements.count() >= MIN_TIGHTENED => elements.prepare_deformed_rates(),
            _ => Ok(()),
        }
    }

    /// Tightens the bound of elements at `positions`. Returns the longest stable substep of all forces but springs, or
    /// `None` if that is already known.
    pub fn tightened_dt_limit(&mut self, positions: &Vectors, masses: &NodalMasses, team: &Team) -> Option<f32> {
        self.write_records(positions, team);
        let (elements, records) = (self.elements.as_mut()?, self.records.as_ref()?);
        let is_found = elements.find_deformed_rates(self.kernel, records.as_slice(), &*self.springs, masses, team);
        is_found.then(|| self.rates(true).limit())
    }

    /// True if the bound of elements can be tightened.
    pub fn can_tighten(&self) -> bool {
        self.elements().is_some_and(Elements::can_tighten)
    }

    /// Discards the tight bound of a step that is not taken.
    pub fn rollback_bounds(&mut self) {
        self.elements
            .iter_mut()
            .for_each(|elements| elements.rollback_deformed_rates());
    }

    /// True if the bound of elements is relative to a deformation.
    pub fn uses_deformed_rates(&self) -> bool {
        self.elements().is_some_and(Elements::uses_deformed_rates)
    }

    /// The longest stable substep of all forces but springs where forces were last evaluated, s.
    pub fn latest_non_spring_dt_limit(&self) -> f32 {
        self.rates(false).limit()
    }

    /// The frequency bound of all forces but springs, at the current state or where forces were last evaluated.
    fn rates(&self, at_committed: bool) -> FrequencyBound {
        let (terms, cavities) = (self.auxiliary.terms.as_ref(), self.auxiliary.cavities.as_ref());
        let element_rates = self
            .elements()
            .map_or(FrequencyBound::ZERO, |elements| elements.rates(at_committed));
        let term_rates = terms.map_or(FrequencyBound::ZERO, |terms| terms.rates(at_committed));
        let cavity_rates = cavities.map_or(FrequencyBound::ZERO, |cavities| cavities.rates(at_committed));
        element_rates.and(term_rates).and(cavity_rates)
    }

    /// The cause of the shortest stable substep where forces were last evaluated, with nodes at `positions`: its kind,
    /// its nodes, and their number. `spring` is the stiffest spring with its substep, s.
    pub fn tightest(
        &self,
        masses: &NodalMasses,
        positions: &Vectors,
        spring: Option<([usize; 2], f32)>,
    ) -> (LimitKind, [u32; 4], usize) {
        let cavities = self.auxiliary.cavities.as_ref();
        let mut shortest = cavities.map_or(f32::INFINITY, |cavities| cavities.rates(false).limit());
        let mut tightest = (LimitKind::Cavity, [0; 4], 0);
        if let Some(([a, b], substep)) = spring
            && substep <= shortest
        {
            shortest = substep;
            tightest = (LimitKind::Spring, [a as u32, b as u32, 0, 0], 2);
        }
        if let Some((nodes, substep)) = self
            .elements()
            .and_then(|elements| elements.limiting_element(masses, positions))
            && substep <= shortest
        {
            shortest = substep;
            tightest = (LimitKind::Element, nodes, 4);
        }
        if let Some(terms) = &self.auxiliary.terms
            && terms.rates(false).limit() < shortest
        {
            let mut most = -1.0;
            tightest = (LimitKind::Term, [0; 4], 0);
            terms.laws().for_each(|law| {
                law.visit_nodal_stiffness(masses, &mut |node, stiffness| {
                    let rate = stiffness * masses.inverse(node);
                    if rate > most {
                        most = rate;
                        tightest = (LimitKind::Term, [node as u32, 0, 0, 0], 1);
                    }
                })
            });
        }
        tightest
    }

    /// Calls `f` with the corners of each element and the upper bound of its stiffness at `positions` relative to rest.
    pub fn visit_stiffenings(&self, positions: &Vectors, f: &mut dyn FnMut([u32; 4], f64)) {
        self.elements
            .iter()
            .for_each(|elements| elements.relative_stiffnesses(positions, f));
    }

    /// The nodal stiffness of elements at rest for a node of this inverse mass, if the bounds at rest are known.
    pub fn nodal_stiffness_at_rest(&self, node: usize, inverse_mass: f32) -> NodalStiffness {
        let elements = self.elements();
        elements.map_or(NodalStiffness::default(), |elements| {
            elements.nodal_stiffness_at_rest(node, inverse_mass)
        })
    }

    /// Makes the state of the last force evaluation the current one for all bounds.
    pub fn commit_bounds(&mut self) {
        self.elements
            .iter_mut()
            .for_each(|elements| elements.commit_rate_bound());
        self.auxiliary
            .terms
            .iter_mut()
            .for_each(|terms| terms.commit_stiffening());
        self.auxiliary
            .cavities
            .iter_mut()
            .for_each(|cavities| cavities.commit_rate_bound());
    }

    /// Invalidates the bounds after masses, pins or springs have changed.
    pub fn forget_rates(&mut self) {
        self.elements.iter_mut().for_each(|elements| elements.forget_rates());
        self.auxiliary.terms.iter_mut().for_each(|terms| terms.forget_rates());
        self.auxiliary
            .cavities
            .iter_mut()
            .for_each(|cavities| cavities.forget_rates());
    }
}
