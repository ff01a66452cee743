//! Terms and cavities: one at a time and in `f64`, for solvers that work out everything so.

use glam::{DMat3, DVec3};

use crate::cavities::{At, Enclosed};
use crate::codec::saved;
use crate::terms::{TangentBlocks, Term, Terms};

/// What acts beside springs and elements. A solver may borrow it for as long as it solves.
#[derive(Debug, Default)]
pub(crate) struct Beside {
    pub terms: Option<Box<Terms>>,
    /// For bodies whose surface encloses what keeps its volume or its pressure.
    pub(super) cavities: Option<Box<Enclosed>>,
}

saved! { Beside { terms, cavities } }

impl Beside {
    /// Whether there is any.
    pub fn is_any(&self) -> bool {
        self.terms.is_some() || self.cavities.is_some()
    }

    /// The terms of each law.
    pub(super) fn laws(&self) -> impl Iterator<Item = &dyn Term> {
        self.terms.iter().flat_map(|terms| terms.laws())
    }

    /// The same, to be changed.
    pub(super) fn laws_mut(&mut self) -> impl Iterator<Item = &mut Box<dyn Term>> {
        self.terms.iter_mut().flat_map(|terms| terms.laws_mut())
    }

    /// Whether terms hold a node against the world.
    pub fn holds(&self, node: usize) -> bool {
        self.laws().any(|law| law.holds(node))
    }

    /// Whether they hold any.
    pub fn holds_any(&self) -> bool {
        self.terms.as_ref().is_some_and(|terms| terms.holds_any)
    }

    /// Shows the nodes of each term and each triangle of a cavity, and whether these are joined: terms of no stiffness join none.
    pub fn show_nodes(&self, see: &mut dyn FnMut(&[u32], bool)) {
        self.laws()
            .for_each(|law| law.show_nodes(&mut |nodes, stiffness| see(nodes, stiffness > 0.0)));
        let cavities = self.cavities.iter();
        cavities.for_each(|cavities| cavities.show_triangles(&mut |corners| see(&corners, true)));
    }

    /// Shows the force on each node of each, N.
    pub fn show_forces(&self, at: At, see: &mut dyn FnMut(usize, DVec3)) {
        self.laws().for_each(|law| law.show_forces(at, see));
        self.cavities.iter().for_each(|cavities| cavities.show_forces(at, see));
    }

    /// Shows how the energy of each changes where nodes go so much further, J.
    pub fn show_changes(&self, at: At, more: At, see: &mut dyn FnMut(f64)) {
        self.laws().for_each(|law| law.show_changes(at, more, see));
        let cavities = self.cavities.iter();
        cavities.for_each(|cavities| cavities.show_changes(at, more, see));
    }

    /// Shows each term's nodes and blocks: all second derivatives, or what is positive semidefinite of them.
    pub fn show_blocks(&self, at: At, is_exact: bool, see: &mut dyn FnMut(&[u32], &TangentBlocks)) {
        self.laws().for_each(|law| law.show_blocks(at, is_exact, see));
    }

    /// Shows for each pair of nodes of each triangle how much what pressure does to one lessens with the place of the other, N/m.
    pub fn show_pressure_blocks(&self, at: At, see: &mut dyn FnMut([u32; 2], DMat3)) {
        self.cavities.iter().for_each(|cavities| cavities.show_blocks(at, see));
    }

    /// Shows what volumes of cavities add to the product of a matrix and vectors at each node.
    pub fn show_products(&self, at: At, vectors: &[DVec3], see: &mut dyn FnMut(usize, DVec3)) {
        let cavities = self.cavities.iter();
        cavities.for_each(|cavities| cavities.show_products(at, vectors, see));
    }

    /// The energy of terms, that of cavities, and the work that a constant pressure has done, J.
    pub fn energy(&self, at: At) -> [f64; 3] {
        let of_terms = self.terms.as_ref().map_or(0.0, |terms| terms.energy(at));
        let [stored, work] = self.energy_of_cavities(at);
        [of_terms, stored, work]
    }

    /// The same without terms.
    pub(super) fn energy_of_cavities(&self, at: At) -> [f64; 2] {
        self.cavities.as_ref().map_or([0.0; 2], |cavities| cavities.energy(at))
    }
}
