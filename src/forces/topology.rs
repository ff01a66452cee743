//! What becomes of forces as nodes, springs and cells come, change and go.

use super::Forces;
use crate::base::Result;
use crate::elements::PieceOfElement;
use crate::soa::{Masses, PerNode, Region, Scale};
use crate::springs::SpringChange;
use crate::terms::Parting;

/// What a cut makes of elements and terms.
#[derive(Debug, Default)]
pub(crate) struct Parts {
    pub elements: Vec<PieceOfElement>,
    /// How many nodes have rings that fall apart, at most.
    pub ring_count: usize,
    pub terms: Parting,
}

impl PerNode for Forces {
    fn reserve_nodes(&mut self, count: usize) -> Result<()> {
        self.springs.reserve_nodes(count)?;
        self.records.reserve_nodes(count)?;
        if let Some(elements) = &mut self.elements {
            elements.reserve_nodes(count)?;
        }
        if let Some(terms) = &mut self.beside.terms {
            terms.reserve_nodes(count)?;
        }
        self.changes.records.reserve_nodes(count)?;
        let sums = self.changes.elements.as_mut();
        sums.map_or(Ok(()), |sums| sums.reserve_rings(count))
    }

    /// Springs, elements and terms grow where a cut changes them.
    fn grow(&mut self, count: usize) {
        self.records.grow(count);
        self.changes.records.grow(count);
    }
}

impl Forces {
    /// Makes room for what a cut leaves in a body of so many nodes.
    pub fn prepare_parts(&mut self, parts: &Parts, node_count: usize) -> Result<()> {
        if let Some(elements) = &mut self.elements {
            elements.reserve_pieces(&parts.elements, node_count, self.changes.elements.as_mut())?;
            elements.reserve_rings(parts.ring_count)?;
        }
        let terms = self.beside.terms.as_mut();
        terms.map_or(Ok(()), |terms| terms.prepare_parts(&parts.terms, node_count))
    }

    /// There is no cut.
    pub fn forget_parts(&mut self) {
        self.beside.laws_mut().for_each(|law| law.forget_parts());
    }

    /// Becomes what a cut leaves, for which there is room.
    pub fn take_parts(&mut self, parts: &Parts, node_count: usize) {
        if let Some(elements) = &mut self.elements {
            elements.rewire(&parts.elements, node_count, self.changes.elements.as_mut());
        }
        self.beside
            .terms
            .iter_mut()
            .for_each(|terms| terms.take_parts(node_count));
    }

    /// Makes bounds of elements those of these masses, where a cut has changed the elements, springs or masses of these nodes; given the
    /// cells at each.
    pub fn find_rates_at<Cells: Iterator<Item = u32>>(
        &mut self,
        nodes: &[u32],
        cells_at: impl Fn(u32) -> Cells,
        masses: &Masses,
    ) {
        if let Some(elements) = &mut self.elements {
            elements.find_rates_at(nodes, cells_at, &*self.springs, masses);
        }
    }

    /// Opens the cavities with any of these triangles, after masses have changed: whether any was closed.
    pub fn open_cavities(&mut self, triangles: impl Iterator<Item = [u32; 3]>) -> bool {
        let Some(cavities) = &mut self.beside.cavities else {
            return false;
        };
        let opened = triangles.filter(|&triangle| cavities.open_at(triangle)).count() > 0;
        cavities.forget_rates();
        opened
    }

    /// Takes away the elements and terms that have an edge between two nodes, and opens the cavities that have: how many.
    pub fn remove_edge(&mut self, a: u32, b: u32) -> usize {
        let of_elements = self.elements.as_mut().map_or(0, |elements| elements.remove_edge(a, b));
        let of_terms: usize = self.beside.laws_mut().map(|law| law.remove_edge(a, b)).sum();
        let cavities = self.beside.cavities.as_mut();
        of_elements + of_terms + cavities.map_or(0, |cavities| cavities.remove_edge(a, b))
    }

    /// Gives springs that there are, each once, other parameters. Changes nothing where it fails.
    pub fn set_springs(&mut self, changes: &[SpringChange]) -> Result<()> {
        self.springs.set(changes)?;
        for law in self.beside.laws_mut() {
            changes.iter().for_each(|change| law.set_spring(change));
        }
        Ok(())
    }

    /// Refuses to scale elements and terms of which something would be no number.
    pub fn check_scale(&self, region: &Region, scale: Scale) -> Result<()> {
        if let Some(elements) = &self.elements {
            elements.check_scale(region, scale)?;
        }
        self.beside.laws().try_for_each(|law| law.check_scale(region, scale))
    }

    /// Scales the elements and terms with all nodes in a region, which must not be refused: how many.
    pub fn scale(&mut self, region: &Region, scale: Scale) -> usize {
        let of_elements = self
            .elements
            .as_mut()
            .map_or(0, |elements| elements.scale(region, scale));
        let terms = self.beside.terms.as_mut();
        of_elements + terms.map_or(0, |terms| terms.scale(region, scale))
    }
}
