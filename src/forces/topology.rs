//! Updates of the forces when nodes, springs and cells are added, changed or removed.

use super::Forces;
use crate::base::Result;
use crate::elements::ElementPiece;
use crate::soa::{NodalMasses, PerNode, Region, Scale};
use crate::springs::SpringChange;
use crate::terms::TermPieces;

/// The pieces of elements and terms that a cut creates.
#[derive(Debug, Default)]
pub(crate) struct ForcePieces {
    pub elements: Vec<ElementPiece>,
    /// The maximum number of nodes whose element rings are separated.
    pub ring_count: usize,
    pub terms: TermPieces,
}

impl PerNode for Forces {
    fn reserve_nodes(&mut self, count: usize) -> Result<()> {
        self.springs.reserve_nodes(count)?;
        self.records.reserve_nodes(count)?;
        if let Some(elements) = &mut self.elements {
            elements.reserve_nodes(count)?;
        }
        if let Some(terms) = &mut self.auxiliary.terms {
            terms.reserve_nodes(count)?;
        }
        self.changes.records.reserve_nodes(count)?;
        let sums = self.changes.elements.as_mut();
        sums.map_or(Ok(()), |sums| sums.reserve_pressures(count))
    }

    /// Springs, elements and terms grow when a cut changes them.
    fn grow(&mut self, count: usize) {
        self.records.grow(count);
        self.changes.records.grow(count);
    }
}

impl Forces {
    /// Reserves memory for the state after a cut, in a body with then `node_count` nodes.
    pub fn prepare_cut(&mut self, pieces: &ForcePieces, node_count: usize) -> Result<()> {
        if let Some(elements) = &mut self.elements {
            elements.reserve_pieces(&pieces.elements, node_count, self.changes.elements.as_mut())?;
            elements.reserve_pressure_offsets(pieces.ring_count)?;
        }
        let terms = self.auxiliary.terms.as_mut();
        terms.map_or(Ok(()), |terms| terms.prepare_cut(&pieces.terms, node_count))
    }

    /// Discards the prepared cut.
    pub fn discard_cut(&mut self) {
        self.auxiliary.laws_mut().for_each(|law| law.discard_cut());
    }

    /// Applies the prepared cut.
    pub fn apply_cut(&mut self, pieces: &ForcePieces, node_count: usize) {
        if let Some(elements) = &mut self.elements {
            elements.rewire(&pieces.elements, node_count, self.changes.elements.as_mut());
        }
        self.auxiliary
            .terms
            .iter_mut()
            .for_each(|terms| terms.apply_cut(node_count));
    }

    /// Updates the bounds of elements at these nodes after a cut has changed their elements, springs or masses.
    /// `cells_at` lists the cells at a node.
    pub fn find_rates_at<Cells: Iterator<Item = u32>>(
        &mut self,
        nodes: &[u32],
        cells_at: impl Fn(u32) -> Cells,
        masses: &NodalMasses,
    ) {
        if let Some(elements) = &mut self.elements {
            elements.find_rates_at(nodes, cells_at, &*self.springs, masses);
        }
    }

    /// Opens the cavities with any of these triangles, after masses have changed. Returns true if any was closed.
    pub fn open_cavities(&mut self, triangles: impl Iterator<Item = [u32; 3]>) -> bool {
        let Some(cavities) = &mut self.auxiliary.cavities else {
            return false;
        };
        let opened = triangles.filter(|&triangle| cavities.open_at(triangle)).count() > 0;
        cavities.forget_rates();
        opened
    }

    /// Removes the elements and terms with an edge between two nodes, and opens the cavities with that edge. Returns
    /// their number.
    pub fn remove_edge(&mut self, a: u32, b: u32) -> usize {
        let element_count = self.elements.as_mut().map_or(0, |elements| elements.remove_edge(a, b));
        let term_count: usize = self.auxiliary.laws_mut().map(|law| law.remove_edge(a, b)).sum();
        let cavities = self.auxiliary.cavities.as_mut();
        element_count + term_count + cavities.map_or(0, |cavities| cavities.remove_edge(a, b))
    }

    /// Sets the parameters of existing springs, each listed once. Changes nothing on failure.
    pub fn set_springs(&mut self, changes: &[SpringChange]) -> Result<()> {
        self.springs.set(changes)?;
        for law in self.auxiliary.laws_mut() {
            changes.iter().for_each(|change| law.set_spring(change));
        }
        Ok(())
    }

    /// Returns an error if scaling elements or terms gives a number that is not finite.
    pub fn check_scale(&self, region: &Region, scale: Scale) -> Result<()> {
        if let Some(elements) = &self.elements {
            elements.check_scale(region, scale)?;
        }
        self.auxiliary.laws().try_for_each(|law| law.check_scale(region, scale))
    }

    /// Scales the elements and terms with all nodes in a region, after a successful check. Returns their number.
    pub fn scale(&mut self, region: &Region, scale: Scale) -> usize {
        let element_count = self
            .elements
            .as_mut()
            .map_or(0, |elements| elements.scale(region, scale));
        let terms = self.auxiliary.terms.as_mut();
        element_count + terms.map_or(0, |terms| terms.scale(region, scale))
    }
}
