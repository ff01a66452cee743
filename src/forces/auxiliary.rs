//! Terms and cavities, evaluated one by one in `f64` for the exact solvers.

use glam::{DMat3, DVec3};

use crate::cavities::{Cavities, PositionVectors};
use crate::codec::saved;
use crate::terms::{TangentBlocks, Term, Terms};

/// The forces besides springs and elements. A solver may borrow them while it solves.
#[derive(Debug, Default)]
pub(crate) struct AuxiliaryForces {
    pub terms: Option<Box<Terms>>,
    /// For bodies whose surface encloses a volume with a stiffness or pressure.
    pub(super) cavities: Option<Box<Cavities>>,
}

saved! { AuxiliaryForces { terms, cavities } }

impl AuxiliaryForces {
    /// True if there are terms or cavities.
    pub fn is_any(&self) -> bool {
        self.terms.is_some() || self.cavities.is_some()
    }

    /// The terms of each law.
    pub(super) fn laws(&self) -> impl Iterator<Item = &dyn Term> {
        self.terms.iter().flat_map(|terms| terms.laws())
    }

    /// The terms of each law, mutable.
    pub(super) fn laws_mut(&mut self) -> impl Iterator<Item = &mut Box<dyn Term>> {
        self.terms.iter_mut().flat_map(|terms| terms.laws_mut())
    }

    /// True if a term anchors a node to the world.
    pub fn holds(&self, node: usize) -> bool {
        self.laws().any(|law| law.anchors(node))
    }

    /// True if any node is anchored to the world.
    pub fn holds_any(&self) -> bool {
        self.terms.as_ref().is_some_and(|terms| terms.anchors_any)
    }

    /// Calls `f` with the nodes of each term and each triangle of a cavity, and true if these are joined. Terms of
    /// stiffness 0 join no nodes.
    pub fn visit_nodes(&self, f: &mut dyn FnMut(&[u32], bool)) {
        self.laws()
            .for_each(|law| law.visit_nodes(&mut |nodes, stiffness| f(nodes, stiffness > 0.0)));
        let cavities = self.cavities.iter();
        cavities.for_each(|cavities| cavities.visit_triangles(&mut |corners| f(&corners, true)));
    }

    /// Calls `f` with each node of each term and cavity and the force on it, N.
    pub fn visit_forces(&self, at: PositionVectors, f: &mut dyn FnMut(usize, DVec3)) {
        self.laws().for_each(|law| law.visit_forces(at, f));
        self.cavities.iter().for_each(|cavities| cavities.visit_forces(at, f));
    }

    /// Calls `f` with the energy change of each term and cavity for these displacements, J.
    pub fn visit_changes(&self, at: PositionVectors, displacement: PositionVectors, f: &mut dyn FnMut(f64)) {
        self.laws().for_each(|law| law.visit_changes(at, displacement, f));
        let cavities = self.cavities.iter();
        cavities.for_each(|cavities| cavities.visit_changes(at, displacement, f));
    }

    /// Calls `f` with the nodes and blocks of each term: the exact second derivatives or a positive semidefinite
    /// approximation.
    pub fn visit_blocks(&self, at: PositionVectors, is_exact: bool, f: &mut dyn FnMut(&[u32], &TangentBlocks)) {
        self.laws().for_each(|law| law.visit_blocks(at, is_exact, f));
    }

    /// Calls `f` with each pair of nodes of a cavity's triangle, and the negative derivative of the pressure force on
    /// one by the position of the other, N/m.
    pub fn visit_pressure_blocks(&self, at: PositionVectors, f: &mut dyn FnMut([u32; 2], DMat3)) {
        self.cavities.iter().for_each(|cavities| cavities.visit_blocks(at, f));
    }

    /// Calls `f` with each node and the contribution of cavity volumes to the product of the matrix and `vectors`.
    pub fn visit_products(&self, at: PositionVectors, vectors: &[DVec3], f: &mut dyn FnMut(usize, DVec3)) {
        let cavities = self.cavities.iter();
        cavities.for_each(|cavities| cavities.visit_products(at, vectors, f));
    }

    /// The energies of terms and of cavities, and the work of constant pressures, J.
    pub fn energy(&self, at: PositionVectors) -> [f64; 3] {
        let term_energy = self.terms.as_ref().map_or(0.0, |terms| terms.energy(at));
        let [stored, work] = self.energy_of_cavities(at);
        [term_energy, stored, work]
    }

    /// The energy of cavities, and the work of constant pressures, J.
    pub(super) fn energy_of_cavities(&self, at: PositionVectors) -> [f64; 2] {
        self.cavities.as_ref().map_or([0.0; 2], |cavities| cavities.energy(at))
    }
}
