//! Plastic springs: strained beyond a yield strain, they keep a permanent elongation (perfect plasticity; Terzopoulos
//! and Fleischer 1988 in graphics).
//!
//! The force is that of the spring with the plastic elongation it would have after stopping here. It is therefore
//! bounded, and derives from a convex energy. An implicit step of any length yields as far as it must, and a static
//! equilibrium is found if there is one. The plastic elongation is updated at the end of a substep.

use glam::{DMat3, DVec3};

use super::axial_terms::AxialResponse;
use super::stencils::{StencilLaw, Stencils, axial_matrix, direction, lengthening, spring_stencils};
use super::{HistoryEvent, Term};
use crate::base::{Result, StateHasher, ensure};
use crate::codec::saved;
use crate::def::{BodyDefinition, RelaxationStep, Spring, SpringLaw, Yielding};
use crate::soa::NodeOrder;

/// The law of the force that yielding removes, for unit stiffness.
#[derive(Debug)]
pub(super) struct PlasticSprings {
    yield_strain: f64,
    largest: f64,
}

saved! { PlasticSprings { yield_strain, largest } }

/// A spring with its plastic elongation, m.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlasticSpring {
    rest_length: f32,
    /// The plastic elongation.
    plastic_elongation: f32,
    committed: f32,
}

saved! { PlasticSpring { rest_length, plastic_elongation, committed } }

pub(super) fn new(definition: &BodyDefinition, springs: &[Spring], order: &NodeOrder) -> Result<Option<Box<dyn Term>>> {
    let Yielding { strain, largest } = definition.yielding;
    if definition.yielding.is_none() || springs.is_empty() {
        return Ok(None);
    }
    ensure!(
        definition.spring_law == SpringLaw::Linear,
        "yield_strain is {strain} while spring_law is not linear: only linear springs yield"
    );
    let plastic_springs = spring_stencils(springs, order, true, |rest_length| PlasticSpring {
        rest_length,
        plastic_elongation: 0.0,
        committed: 0.0,
    })?;
    let law = PlasticSprings {
        yield_strain: f64::from(strain),
        largest: f64::from(largest),
    };
    Stencils::boxed(law, plastic_springs, definition.positions.len())
}

/// The yield state of a spring at a length.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum SpringFlow {
    Elastic,
    Yields,
    /// Yielded up to the maximum, in tension or compression.
    AtEnd,
}

impl PlasticSprings {
    /// The plastic elongation after stopping at this length, m.
    fn plastic_elongation_at(&self, spring: &PlasticSpring, length: f64) -> (f64, SpringFlow) {
        let (rest_length, plastic_elongation) = (f64::from(spring.rest_length), f64::from(spring.plastic_elongation));
        let stretch = length - rest_length - plastic_elongation;
        let yielded = stretch.abs() - self.yield_strain * rest_length;
        if yielded <= 0.0 {
            return (plastic_elongation, SpringFlow::Elastic);
        }
        let (after, limit) = (
            plastic_elongation + yielded.copysign(stretch),
            self.largest * rest_length,
        );
        if after.abs() < limit {
            (after, SpringFlow::Yields)
        } else {
            (after.clamp(-limit, limit), SpringFlow::AtEnd)
        }
    }

    /// The integral of the negative plastic elongation over the length: the difference from the elastic energy without
    /// yielding.
    fn energy_at(&self, spring: &PlasticSpring, length: f64) -> f64 {
        let (rest_length, plastic_elongation) = (f64::from(spring.rest_length), f64::from(spring.plastic_elongation));
        let (after, _) = self.plastic_elongation_at(spring, length);
        if after == plastic_elongation {
            return plastic_elongation * (0.5 * plastic_elongation - (length - rest_length));
        }
        let yields = (self.yield_strain * rest_length).copysign(after - plastic_elongation);
        // The elastic part up to yielding, and the flowing part.
        let first = plastic_elongation * (0.5 * plastic_elongation - (plastic_elongation + yields));
        let flowing = 0.5 * (after * after - plastic_elongation * plastic_elongation);
        first - flowing - after * (length - rest_length - yields - after)
    }
}

impl StencilLaw<2> for PlasticSprings {
    const SAVED_AS: u8 = 3;

    type Shape = PlasticSpring;

    const BELONGS_TO_SPRINGS: bool = true;

    const HAS_HISTORY: bool = true;

    /// The energy relative to a spring that cannot yield.
    fn energy(&self, spring: &PlasticSpring, [from, to]: &[DVec3; 2]) -> f64 {
        self.energy_at(spring, from.distance(*to))
    }

    fn energy_change(&self, spring: &PlasticSpring, [from, to]: &[DVec3; 2], displacements: &[DVec3; 2]) -> f64 {
        let (offset, extra) = (*to - *from, displacements[1] - displacements[0]);
        let lengths = [offset.length(), (offset + extra).length()];
        let [before, after] = lengths.map(|length| self.plastic_elongation_at(spring, length));
        if before.1 == after.1 {
            -0.5 * (before.0 + after.0) * lengthening(offset, extra)
        } else {
            self.energy_at(spring, lengths[1]) - self.energy_at(spring, lengths[0])
        }
    }

    fn forces(&self, spring: &PlasticSpring, [from, to]: &[DVec3; 2]) -> [DVec3; 2] {
        let push = direction(*to - *from) * self.plastic_elongation_at(spring, from.distance(*to)).0;
        [-push, push]
    }

    fn blocks(&self, spring: &PlasticSpring, [from, to]: &[DVec3; 2], is_exact: bool) -> [[DMat3; 2]; 2] {
        let offset = *to - *from;
        let length = offset.length();
        let (plastic_elongation, flow) = self.plastic_elongation_at(spring, length);
        let along = if flow == SpringFlow::Yields { -1.0 } else { 0.0 };
        let across = if length > 0.0 && (is_exact || plastic_elongation < 0.0) {
            -plastic_elongation / length
        } else {
            0.0
        };
        let block = axial_matrix(direction(offset), along, across);
        [[block, -block], [-block, block]]
    }

    fn size(&self, spring: &PlasticSpring) -> f32 {
        spring.rest_length
    }

    fn shape_with_rest_length(&self, before: &PlasticSpring, rest_length: f32) -> Option<PlasticSpring> {
        (rest_length > 0.0).then_some(PlasticSpring { rest_length, ..*before })
    }

    fn apply_event(&self, event: HistoryEvent, spring: &mut PlasticSpring) {
        match event {
            HistoryEvent::Restore => spring.plastic_elongation = spring.committed,
            HistoryEvent::Commit => spring.committed = spring.plastic_elongation,
            HistoryEvent::Predict(_) | HistoryEvent::Advance => {}
        }
    }

    #[inline(always)]
    fn parameters(spring: &PlasticSpring) -> [f32; 2] {
        [spring.plastic_elongation, spring.rest_length]
    }

    #[inline(always)]
    fn response(&self, [plastic_elongation, rest_length]: [f32; 2], length: f32) -> AxialResponse {
        let stretch = length - rest_length - plastic_elongation;
        let yielded = stretch.abs() - self.yield_strain as f32 * rest_length;
        let limit = self.largest as f32 * rest_length;
        let trial = plastic_elongation + if yielded > 0.0 { yielded.copysign(stretch) } else { 0.0 };
        let after = if yielded > 0.0 {
            trial.clamp(-limit, limit)
        } else {
            plastic_elongation
        };
        AxialResponse {
            pull: -after,
            slope: if yielded > 0.0 && trial.abs() < limit {
                -1.0
            } else {
                0.0
            },
            transverse: if after < 0.0 { -after } else { 0.0 },
            stiffening: 1.0,
        }
    }

    #[inline(always)]
    fn advance(&self, spring: &mut PlasticSpring, length: f32, relaxation: RelaxationStep) {
        if relaxation.yields {
            spring.plastic_elongation = self.plastic_elongation_at(spring, f64::from(length)).0 as f32;
        }
    }

    fn hash(&self, spring: &PlasticSpring, hasher: &mut StateHasher) {
        hasher.write_floats(&[spring.committed]);
    }
}
