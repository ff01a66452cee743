//! A limit on strain: springs that are far stiffer once they are stretched beyond it.
//!
//! Provot 1995 moves nodes back where a spring is too long, after each step, which makes and takes energy. As a law it keeps both, in
//! every solver: what pulls beyond the limit adds to the spring, with an energy of its own.

use glam::{DMat3, DVec3};

use super::Term;
use super::stencils::{StencilLaw, Stencils, directed, lengthening, of_springs};
use super::strings::Tension;
use crate::base::{Result, ensure, not_negative};
use crate::codec::saved;
use crate::def::{BodyDefinition, Spring};
use crate::soa::NodeOrder;

/// What springs do beyond a strain, over their stiffness; shapes are their rest lengths, m.
#[derive(Debug)]
pub(super) struct Limit {
    strain: f64,
    /// How much stiffer they are beyond it.
    stiffening: f64,
}

saved! { Limit { strain, stiffening } }

/// A spring is never stiffer than this many times.
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
    let limits = of_springs(springs, order, true, |rest_length| rest_length)?;
    let law = Limit {
        strain: f64::from(strain),
        stiffening: f64::from(stiffening),
    };
    Stencils::boxed(law, limits, definition.positions.len())
}

impl Limit {
    /// The way between two nodes, its length, and by how much it is too long, m.
    fn excess(&self, rest_length: f32, [from, to]: &[DVec3; 2]) -> (DVec3, f64, f64) {
        let way = *to - *from;
        let length = way.length();
        let longest = f64::from(rest_length) * (1.0 + self.strain);
        (way, length, (length - longest).max(0.0))
    }

    fn stiffness(&self, rest_length: f32, places: &[DVec3; 2]) -> DMat3 {
        let (way, length, excess) = self.excess(rest_length, places);
        if excess == 0.0 {
            return DMat3::ZERO;
        }
        directed(way / length, self.stiffening, self.stiffening * excess / length)
    }
}

impl StencilLaw<2> for Limit {
    const SAVED_AS: u8 = 2;

    type Shape = f32;

    const IS_OF_SPRINGS: bool = true;

    fn energy(&self, &rest_length: &f32, places: &[DVec3; 2]) -> f64 {
        0.5 * self.stiffening * self.excess(rest_length, places).2.powi(2)
    }

    fn change(&self, &rest_length: &f32, places: &[DVec3; 2], ways: &[DVec3; 2]) -> f64 {
        let (way, _, before) = self.excess(rest_length, places);
        let more = ways[1] - ways[0];
        let after = self.excess(rest_length, &[DVec3::ZERO, way + more]).2;
        let longer = if before > 0.0 && after > 0.0 {
            lengthening(way, more)
        } else {
            after - before
        };
        0.5 * self.stiffening * longer * (before + after)
    }

    fn forces(&self, &rest_length: &f32, places: &[DVec3; 2]) -> [DVec3; 2] {
        let (way, length, excess) = self.excess(rest_length, places);
        if excess == 0.0 {
            return [DVec3::ZERO; 2];
        }
        let pull = way * (self.stiffening * excess / length);
        [pull, -pull]
    }

    fn blocks(&self, &rest_length: &f32, places: &[DVec3; 2], _is_exact: bool) -> [[DMat3; 2]; 2] {
        let block = self.stiffness(rest_length, places);
        [[block, -block], [-block, block]]
    }

    fn size(&self, rest_length: &f32) -> f32 {
        *rest_length
    }

    fn shape_of_spring(&self, _before: &f32, rest_length: f32) -> Option<f32> {
        (rest_length > 0.0).then_some(rest_length)
    }

    #[inline(always)]
    fn numbers(&rest_length: &f32) -> [f32; 2] {
        [rest_length, 0.0]
    }

    #[inline(always)]
    fn tension(&self, [rest_length, _]: [f32; 2], length: f32) -> Tension {
        let stiffening = self.stiffening as f32;
        let excess = (length - rest_length) - rest_length * self.strain as f32;
        let slope = if excess > 0.0 { stiffening } else { 0.0 };
        let pull = slope * excess;
        Tension {
            pull,
            slope,
            sideways: pull,
            stiffening: 1.0 + slope,
        }
    }

    fn stiffening(&self, &rest_length: &f32, places: &[DVec3; 2]) -> f64 {
        let (_, _, excess) = self.excess(rest_length, places);
        if excess > 0.0 { 1.0 + self.stiffening } else { 1.0 }
    }
}
