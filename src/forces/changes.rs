//! The product of the tangent and displacements, and the parts of the tangent for preconditioners.

use glam::DMat3;

use super::{ForceSum, Forces};
use crate::base::Result;
use crate::cavities;
use crate::codec::saved;
use crate::elements::{self, Sums};
use crate::soa::{Records, Vectors};
use crate::terms::TangentBlocks;
use crate::threads::Team;

/// Force changes that are not computed tile by tile.
#[derive(Debug, Default)]
pub(crate) struct ForceChanges {
    /// The displacements as records, for elements and for springs that gather them.
    pub records: Option<Records>,
    pub(super) elements: Option<Sums>,
    cavities: Option<cavities::PressureDifferentials>,
}

saved! { ForceChanges { records, elements, cavities } }

impl Forces {
    /// Allocates the memory for force changes.
    pub fn make_room_for_changes(&mut self) -> Result<()> {
        let records = self.records.as_ref();
        let records = records.map(|records| Records::zeros(records.as_slice().len()));
        let cavities = self.auxiliary.cavities.as_ref();
        self.changes = ForceChanges {
            records: records.transpose()?,
            elements: self
                .elements()
                .map(|elements| elements.new_differentials())
                .transpose()?,
            cavities: cavities.map(|cavities| cavities.new_differentials()).transpose()?,
        };
        Ok(())
    }

    /// Computes the first-order force changes that are not computed tile by tile. Records of positions and
    /// displacements must be up to date.
    pub fn find_changes(&self, displacements: &Vectors, changes: &mut ForceChanges, team: &Team) {
        if let (Some(elements), Some(sums)) = (&self.elements, &mut changes.elements)
            && let (Some(positions), Some(displacements)) = (&self.records, &changes.records)
        {
            elements.find_differentials(
                self.kernel,
                [positions.as_slice(), displacements.as_slice()],
                sums,
                team,
            );
        }
        if let (Some(cavities), Some(changes)) = (&self.auxiliary.cavities, &mut changes.cavities) {
            cavities.find_differentials(displacements, changes, team);
        }
    }

    /// The sum of these changes with those of springs and terms.
    pub fn sum_of<'a>(&'a self, changes: &'a ForceChanges) -> ForceSum<'a> {
        let (elements, cavities) = (self.elements(), self.auxiliary.cavities.as_ref());
        ForceSum {
            elements: elements.map(|elements| elements.node_forces(changes.elements.as_ref())),
            cavities: cavities.map(|cavities| cavities.node_forces(changes.cavities.as_ref())),
            ..self.sum()
        }
    }

    /// Calls `f` with each element's corners, shape-function gradients and deformation at `positions`. Nodal-pressure
    /// terms are included as if each element had this share of them alone.
    pub fn visit_deformed(&self, positions: &Vectors, ring_share: f32, f: &mut elements::VisitDeformed) {
        let elements = self.elements.iter();
        elements.for_each(|elements| elements.visit_deformed(positions, ring_share, f));
    }

    /// Calls `f` with each term's nodes and its positive semidefinite blocks at `positions`.
    pub fn visit_term_blocks(&self, positions: &Vectors, f: &mut dyn FnMut(&[u32], &TangentBlocks)) {
        let at = |node: usize| positions.get(node).as_dvec3();
        self.auxiliary.visit_blocks(&at, false, f);
    }

    /// Calls `f` with the diagonal blocks of cavities at `positions`, N/m.
    pub fn visit_cavity_diagonal(&self, positions: &Vectors, f: &mut dyn FnMut(usize, DMat3)) {
        let at = |node: usize| positions.get(node).as_dvec3();
        let cavities = self.auxiliary.cavities.iter();
        cavities.for_each(|cavities| cavities.visit_diagonal(&at, f));
    }

    /// Calls `f` for each cavity with kappa divided by its rest volume, Pa/m³, and the volume gradients of its
    /// triangles.
    pub fn visit_cavity_factors(&self, positions: &Vectors, f: &mut dyn FnMut(f64, cavities::VolumeGradients)) {
        let at = |node: usize| positions.get(node).as_dvec3();
        let cavities = self.auxiliary.cavities.iter();
        cavities.for_each(|cavities| cavities.visit_factors(&at, f));
    }
}
