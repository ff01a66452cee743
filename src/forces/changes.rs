//! How forces change where nodes go a way, and the parts of their tangent that preconditioners are made of.

use glam::DMat3;

use super::{Forces, Sum};
use crate::base::Result;
use crate::cavities;
use crate::codec::saved;
use crate::elements::{self, Sums};
use crate::soa::{Records, Vectors};
use crate::terms::TangentBlocks;
use crate::threads::Team;

/// What forces change by along ways, as far as it is not made tile by tile.
#[derive(Debug, Default)]
pub(crate) struct Changes {
    /// The ways, for springs that gather them, and elements.
    pub records: Option<Records>,
    pub(super) elements: Option<Sums>,
    cavities: Option<cavities::PressureChanges>,
}

saved! { Changes { records, elements, cavities } }

impl Forces {
    /// Makes room for what forces change by.
    pub fn make_room_for_changes(&mut self) -> Result<()> {
        let records = self.records.as_ref();
        let records = records.map(|records| Records::zeros(records.as_slice().len()));
        let cavities = self.beside.cavities.as_ref();
        self.changes = Changes {
            records: records.transpose()?,
            elements: self
                .elements()
                .map(|elements| elements.room_for_changes())
                .transpose()?,
            cavities: cavities.map(|cavities| cavities.room_for_changes()).transpose()?,
        };
        Ok(())
    }

    /// Works out what is not made tile by tile of how forces change, to first order, where nodes go these ways; there are records of
    /// positions and ways.
    pub fn find_changes(&self, ways: &Vectors, changes: &mut Changes, team: &Team) {
        if let (Some(elements), Some(sums)) = (&self.elements, &mut changes.elements)
            && let (Some(positions), Some(ways)) = (&self.records, &changes.records)
        {
            elements.find_changes(self.kernel, [positions.as_slice(), ways.as_slice()], sums, team);
        }
        if let (Some(cavities), Some(changes)) = (&self.beside.cavities, &mut changes.cavities) {
            cavities.find_changes(ways, changes, team);
        }
    }

    /// What adds up these changes.
    pub fn sum_of<'a>(&'a self, changes: &'a Changes) -> Sum<'a> {
        let (elements, cavities) = (self.elements(), self.beside.cavities.as_ref());
        Sum {
            elements: elements.map(|elements| elements.shares(changes.elements.as_ref())),
            cavities: cavities.map(|cavities| cavities.shares(changes.cavities.as_ref())),
            ..self.sum()
        }
    }

    /// Shows each element's corners, the gradients of their functions, and how it is deformed with nodes at `positions`; what rings do is
    /// shown as if each kept this part of it by itself.
    pub fn show_deformed(&self, positions: &Vectors, part_of_rings: f32, see: &mut elements::SeeDeformed) {
        let elements = self.elements.iter();
        elements.for_each(|elements| elements.visit_deformed(positions, part_of_rings, see));
    }

    /// Shows each term's nodes with nodes at `positions`, and of its blocks what is positive semidefinite.
    pub fn show_term_blocks(&self, positions: &Vectors, see: &mut dyn FnMut(&[u32], &TangentBlocks)) {
        let at = |node: usize| positions.get(node).as_dvec3();
        self.beside.show_blocks(&at, false, see);
    }

    /// Shows the blocks of cavities on the diagonal with nodes at `positions`, N/m.
    pub fn show_cavity_diagonal(&self, positions: &Vectors, see: &mut dyn FnMut(usize, DMat3)) {
        let at = |node: usize| positions.get(node).as_dvec3();
        let cavities = self.beside.cavities.iter();
        cavities.for_each(|cavities| cavities.show_diagonal(&at, see));
    }

    /// Shows for each cavity kappa over its volume at rest, Pa/m³, and what its triangles have of how its volume grows.
    pub fn show_cavity_factors(&self, positions: &Vectors, see: &mut dyn FnMut(f64, cavities::Gradients)) {
        let at = |node: usize| positions.get(node).as_dvec3();
        let cavities = self.beside.cavities.iter();
        cavities.for_each(|cavities| cavities.show_factors(&at, see));
    }
}
