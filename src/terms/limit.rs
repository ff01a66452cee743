//! Strain limit: springs become far stiffer when stretched beyond it.
//!
//! Provot (1995) projects nodes of overstretched springs after each step, which creates and removes energy. As a force
//! law with its own energy, the limit conserves energy and momentum in every solver.

use glam::{DMat3, DVec3};

use super::Term;
use super::axial_terms::AxialResponse;
use super::stencils::{StencilLaw, Stencils, axial_matrix, lengthening, spring_stencils};
use crate::base::{Result, ensure, not_negative};
use crate::codec::saved;
use crate::def::{BodyDefinition, Spring};
use crate::soa::NodeOrder;

/// The law of springs beyond the strain limit, for unit stiffness. Shapes are rest lengths, m.
#[derive(Debug)]
pub(super) struct StrainLimit {
    strain: f64,
    /// The added stiffness beyond the limit, relative to the spring's.
    stiffening: f64,
}

saved! { StrainLimit { strain, stiffening } }

/// The largest stiffening factor.
const STIFFEST: f32 = 1e6;

pub(super) fn new(definition: &BodyDefinition, springs: &[Spring], order: &NodeOrder) -> Result<Option<Box<dyn Term>>> {
    let (strain, stiffening) = (definition.strain_limit, definition.limit_stiffening);
    not_negative("strain_limit", strain)?;
    if strain == 0.0 {
        return Ok(None);
    }
    ensure!(
        stiffening > 0.0 && stiffening <= STIFFEST,
        "limit_stiffening is {stiffening}: must be above 0, and at most {STIFFEST}"
    );
    ensure!(
        !springs.is_empty(),
        "strain_limit is {strain} while the body has no springs"
    );
    let limits = spring_stencils(springs, order, true, |rest_length| rest_length)?;
    let law = StrainLimit {
        strain: f64::from(strain),
        stiffening: f64::from(stiffening),
    };
    Stencils::boxed(law, limits, definition.positions.len())
}

impl StrainLimit {
    /// The vector between two nodes, its length, and the excess over the limit, m.
    fn excess(&self, rest_length: f32, [from, to]: &[DVec3; 2]) -> (DVec3, f64, f64) {
        let offset = *to - *from;
        let length = offset.length();
        let longest = f64::from(rest_length) * (1.0 + self.strain);
        (offset, length, (length - longest).max(0.0))
    }

    fn stiffness(&self, rest_length: f32, positions: &[DVec3; 2]) -> DMat3 {
        let (offset, length, excess) = self.excess(rest_length, positions);
        if excess == 0.0 {
            return DMat3::ZERO;
        }
        axial_matrix(offset / length, self.stiffening, self.stiffening * excess / length)
    }
}

impl StencilLaw<2> for StrainLimit {
    const SAVED_AS: u8 = 2;

    type Shape = f32;

    const BELONGS_TO_SPRINGS: bool = true;

    fn energy(&self, &rest_length: &f32, positions: &[DVec3; 2]) -> f64 {
        0.5 * self.stiffening * self.excess(rest_length, positions).2.powi(2)
    }

    fn energy_change(&self, &rest_length: &f32, positions: &[DVec3; 2], displacements: &[DVec3; 2]) -> f64 {
        let (offset, _, before) = self.excess(rest_length, positions);
        let extra = displacements[1] - displacements[0];
        let after = self.excess(rest_length, &[DVec3::ZERO, offset + extra]).2;
        let elongation = if before > 0.0 && after > 0.0 {
            lengthening(offset, extra)
        } else {
            after - before
        };
        0.5 * self.stiffening * elongation * (before + after)
    }

    fn forces(&self, &rest_length: &f32, positions: &[DVec3; 2]) -> [DVec3; 2] {
        let (offset, length, excess) = self.excess(rest_length, positions);
        if excess == 0.0 {
            return [DVec3::ZERO; 2];
        }
        let pull = offset * (self.stiffening * excess / length);
        [pull, -pull]
    }

    fn blocks(&self, &rest_length: &f32, positions: &[DVec3; 2], _is_exact: bool) -> [[DMat3; 2]; 2] {
        let block = self.stiffness(rest_length, positions);
        [[block, -block], [-block, block]]
    }

    fn size(&self, rest_length: &f32) -> f32 {
        *rest_length
    }

    fn shape_with_rest_length(&self, _before: &f32, rest_length: f32) -> Option<f32> {
        (rest_length > 0.0).then_some(rest_length)
    }

    #[inline(always)]
    fn parameters(&rest_length: &f32) -> [f32; 2] {
        [rest_length, 0.0]
    }

    #[inline(always)]
    fn response(&self, [rest_length, _]: [f32; 2], length: f32) -> AxialResponse {
        let stiffening = self.stiffening as f32;
        let excess = (length - rest_length) - rest_length * self.strain as f32;
        let slope = if excess > 0.0 { stiffening } else { 0.0 };
        let pull = slope * excess;
        AxialResponse {
            pull,
            slope,
            transverse: pull,
            stiffening: 1.0 + slope,
        }
    }

    fn stiffening(&self, &rest_length: &f32, positions: &[DVec3; 2]) -> f64 {
        let (_, _, excess) = self.excess(rest_length, positions);
        if excess > 0.0 { 1.0 + self.stiffening } else { 1.0 }
    }
}
