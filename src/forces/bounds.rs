//! What bounds the frequencies of a body beside its springs, and what each node carries of that.

use super::Forces;
use crate::base::{LimitKind, Result, memory};
use crate::def::Carried;
use crate::soa::{Masses, Rates, Vectors};
use crate::threads::Team;

impl Forces {
    /// What each node carries of elements, terms and cavities; of no nodes where there are none.
    pub fn carried_beside_springs(&self, positions: &Vectors, masses: &Masses) -> Result<Vec<Carried>> {
        if !self.are_more_than_springs() {
            return Ok(Vec::new());
        }
        let mut carried = memory::filled(Carried::default(), positions.len())?;
        self.elements
            .iter()
            .for_each(|elements| elements.add_to(masses, &mut carried));
        let terms = self.beside.terms.iter();
        terms.for_each(|terms| terms.add_to(masses, &mut carried));
        if let Some(cavities) = &self.beside.cavities {
            cavities.add_to(positions, masses, &mut carried)?;
        }
        Ok(carried)
    }

    /// The longest substep that all but springs allow at the current state, with nodes at `positions`, s; infinity where there is
    /// nothing else. `is_found`: forces are those of these positions.
    pub fn limit_beside_springs(&mut self, positions: &Vectors, masses: &Masses, is_found: bool, team: &Team) -> f32 {
        let known = self
            .elements
            .as_mut()
            .is_none_or(|elements| elements.find_rates(&*self.springs, masses) && is_found);
        if !known {
            self.write_records(positions, team);
        }
        if let (Some(elements), Some(records), false) = (&mut self.elements, &self.records, known) {
            elements.find_forces(self.kernel, records.as_slice(), team);
            elements.settle();
        }
        if let Some(terms) = &mut self.beside.terms {
            terms.find_rates(&*self.springs, masses);
            if !is_found {
                terms.settle_at(positions);
            }
        }
        if let Some(cavities) = &mut self.beside.cavities {
            let springs = (self.elements.is_none() && self.beside.terms.is_none()).then_some(&*self.springs);
            if !(cavities.find_rates(springs, masses) && is_found) {
                cavities.find_forces(positions, team);
                cavities.settle();
            }
        }
        self.rates(true).limit()
    }

    /// The same with the nodes where forces were last worked out.
    pub fn newest_limit_beside_springs(&self) -> f32 {
        self.rates(false).limit()
    }

    /// What bounds frequencies beside springs, with the nodes at the current state or where forces were last worked out.
    fn rates(&self, is_settled: bool) -> Rates {
        let (terms, cavities) = (self.beside.terms.as_ref(), self.beside.cavities.as_ref());
        let of_elements = self
            .elements()
            .map_or(Rates::ZERO, |elements| elements.rates(is_settled));
        let of_terms = terms.map_or(Rates::ZERO, |terms| terms.rates(is_settled));
        let of_cavities = cavities.map_or(Rates::ZERO, |cavities| cavities.rates(is_settled));
        of_elements.and(of_terms).and(of_cavities)
    }

    /// What allows the shortest substep where forces were last worked out, with nodes at `positions`: its kind, its nodes, and how many
    /// these are. `spring` is what does so of the springs, with its substep, s.
    pub fn tightest(
        &self,
        masses: &Masses,
        positions: &Vectors,
        spring: Option<([usize; 2], f32)>,
    ) -> (LimitKind, [u32; 4], usize) {
        let cavities = self.beside.cavities.as_ref();
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
            .and_then(|elements| elements.tightest(masses, positions))
            && substep <= shortest
        {
            shortest = substep;
            tightest = (LimitKind::Element, nodes, 4);
        }
        if let Some(terms) = &self.beside.terms
            && terms.rates(false).limit() < shortest
        {
            let mut most = -1.0;
            tightest = (LimitKind::Term, [0; 4], 0);
            terms.laws().for_each(|law| {
                law.show_carried(masses, &mut |node, stiffness| {
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

    /// Shows the corners of each element, and how many times as stiff it is as at rest with nodes at `positions`, at most.
    pub fn show_stiffenings(&self, positions: &Vectors, see: &mut dyn FnMut([u32; 4], f64)) {
        self.elements
            .iter()
            .for_each(|elements| elements.stiffenings(positions, see));
    }

    /// What a node of this inverse mass carries of elements at rest, where bounds at rest are known.
    pub fn carried_at_rest(&self, node: usize, inverse_mass: f32) -> Carried {
        let elements = self.elements();
        elements.map_or(Carried::default(), |elements| {
            elements.carried_at_rest(node, inverse_mass)
        })
    }

    /// Where forces were worked out last is the current state.
    pub fn settle(&mut self) {
        self.elements.iter_mut().for_each(|elements| elements.settle());
        self.beside.terms.iter_mut().for_each(|terms| terms.settle());
        self.beside.cavities.iter_mut().for_each(|cavities| cavities.settle());
    }

    /// Masses, pins or springs have changed.
    pub fn forget_rates(&mut self) {
        self.elements.iter_mut().for_each(|elements| elements.forget_rates());
        self.beside.terms.iter_mut().for_each(|terms| terms.forget_rates());
        self.beside
            .cavities
            .iter_mut()
            .for_each(|cavities| cavities.forget_rates());
    }
}
