//! Maxwell branches of viscoelastic springs.
//!
//! They match the branches of tetrahedra ([`crate::elements`]). The force is a load from the history plus, in an
//! implicit equation, gain times the elastic force on top of it.

use glam::{DMat3, DVec3};

use super::axial_terms::AxialResponse;
use super::nonlinear::StiffeningCurve;
use super::stencils::{StencilLaw, Stencils, axial_matrix, direction, lengthening, spring_stencils};
use super::{HistoryEvent, Term};
use crate::base::{Result, StateHasher};
use crate::codec::saved;
use crate::def::{BodyDefinition, RelaxationStep, Spring, SpringLaw, Viscosity};
use crate::soa::NodeOrder;

/// The law of Maxwell branches in parallel with springs.
#[derive(Debug)]
pub(super) struct MaxwellSprings {
    law: SpringLaw,
    curve: StiffeningCurve,
    viscosity: Viscosity,
    stiffening: f64,
    /// The relaxation over the step of the current equation; the identity if there is none.
    relaxation: RelaxationStep,
}

saved! { MaxwellSprings { law, curve, viscosity, stiffening, relaxation } }

/// A Maxwell branch. Stresses are forces divided by the spring's stiffness, m.
#[derive(Clone, Copy, Debug)]
pub(super) struct MaxwellSpring {
    rest_length: f32,
    load: f32,
    stress: f32,
    elastic: f32,
    committed_stress: f32,
    committed_elastic: f32,
}

saved! { MaxwellSpring { rest_length, load, stress, elastic, committed_stress, committed_elastic } }

pub(super) fn new(definition: &BodyDefinition, springs: &[Spring], order: &NodeOrder) -> Result<Option<Box<dyn Term>>> {
    let viscosity = definition.viscosity;
    let Some(stiffening) = viscosity.stiffening().filter(|_| !springs.is_empty()) else {
        return Ok(None);
    };
    let maxwell_springs = spring_stencils(springs, order, false, |rest_length| MaxwellSpring {
        rest_length,
        load: 0.0,
        stress: 0.0,
        elastic: 0.0,
        committed_stress: 0.0,
        committed_elastic: 0.0,
    })?;
    let law = MaxwellSprings {
        law: definition.spring_law,
        curve: StiffeningCurve::new(definition.spring_law),
        viscosity,
        stiffening,
        relaxation: RelaxationStep::IDENTITY,
    };
    Stencils::boxed(law, maxwell_springs, definition.positions.len())
}

/// A branch at given positions: the vector between its nodes, and its elastic elongation.
struct MaxwellState {
    offset: DVec3,
    length: f64,
    strain: f64,
    /// The elastic elongation, m, and its derivative by the length.
    elastic: f64,
    slope: f64,
}

impl MaxwellSprings {
    fn state_at(&self, spring: &MaxwellSpring, [from, to]: &[DVec3; 2]) -> MaxwellState {
        let offset = *to - *from;
        let (length, rest_length) = (offset.length(), f64::from(spring.rest_length));
        let mut state = MaxwellState {
            offset,
            length,
            strain: 0.0,
            elastic: length - rest_length,
            slope: 1.0,
        };
        if rest_length > 0.0 {
            state.strain = length / rest_length - 1.0;
            let [pull, slope, _] = self.law.beyond(state.strain);
            state.elastic += rest_length * pull;
            state.slope += slope;
        }
        state
    }

    /// The elastic elongation at this length, m, and its derivative by the length, in `f32`.
    #[inline(always)]
    fn elastic_stretch(&self, rest_length: f32, length: f32) -> [f32; 2] {
        let elongation = length - rest_length;
        let strain = if rest_length > 0.0 {
            elongation / rest_length
        } else {
            0.0
        };
        let [pull, slope] = self.curve.beyond(strain);
        [elongation + rest_length * pull, 1.0 + slope]
    }

    fn pull(&self, spring: &MaxwellSpring, state: &MaxwellState) -> f64 {
        f64::from(spring.load) + self.relaxation.gain * state.elastic
    }

    fn stiffness(&self, spring: &MaxwellSpring, state: &MaxwellState, is_exact: bool) -> DMat3 {
        let pull = self.pull(spring, state);
        let across = if state.length > 0.0 && (is_exact || pull > 0.0) {
            pull / state.length
        } else {
            0.0
        };
        axial_matrix(direction(state.offset), self.relaxation.gain * state.slope, across)
    }
}

impl StencilLaw<2> for MaxwellSprings {
    const SAVED_AS: u8 = 1;

    type Shape = MaxwellSpring;

    const BELONGS_TO_SPRINGS: bool = true;

    const HAS_HISTORY: bool = true;

    fn energy(&self, spring: &MaxwellSpring, positions: &[DVec3; 2]) -> f64 {
        let pull = self.pull(spring, &self.state_at(spring, positions));
        0.5 * pull * pull / self.stiffening
    }

    fn energy_change(&self, spring: &MaxwellSpring, positions: &[DVec3; 2], displacements: &[DVec3; 2]) -> f64 {
        let state = self.state_at(spring, positions);
        let extra = displacements[1] - displacements[0];
        let (elongation, rest_length) = (lengthening(state.offset, extra), f64::from(spring.rest_length));
        let both = state.length + (state.offset + extra).length();
        let mut elastic = 0.5 * elongation * (both - 2.0 * rest_length);
        if rest_length > 0.0 {
            elastic += rest_length.powi(2) * self.law.energy_change(state.strain, elongation / rest_length);
        }
        self.relaxation.gain * elastic
    }

    fn load_energy_change(&self, spring: &MaxwellSpring, [from, to]: &[DVec3; 2], displacements: &[DVec3; 2]) -> f64 {
        f64::from(spring.load) * lengthening(*to - *from, displacements[1] - displacements[0])
    }

    fn forces(&self, spring: &MaxwellSpring, positions: &[DVec3; 2]) -> [DVec3; 2] {
        let state = self.state_at(spring, positions);
        let pull = direction(state.offset) * self.pull(spring, &state);
        [pull, -pull]
    }

    fn blocks(&self, spring: &MaxwellSpring, positions: &[DVec3; 2], is_exact: bool) -> [[DMat3; 2]; 2] {
        let block = self.stiffness(spring, &self.state_at(spring, positions), is_exact);
        [[block, -block], [-block, block]]
    }

    fn size(&self, spring: &MaxwellSpring) -> f32 {
        spring.rest_length
    }

    fn shape_with_rest_length(&self, before: &MaxwellSpring, rest_length: f32) -> Option<MaxwellSpring> {
        Some(MaxwellSpring { rest_length, ..*before })
    }

    fn begin_event(&mut self, event: HistoryEvent) {
        self.relaxation = match event {
            HistoryEvent::Predict(time) => self.viscosity.over(time),
            HistoryEvent::Restore | HistoryEvent::Commit | HistoryEvent::Advance => RelaxationStep::IDENTITY,
        };
    }

    fn apply_event(&self, event: HistoryEvent, spring: &mut MaxwellSpring) {
        match event {
            HistoryEvent::Restore => {
                (spring.stress, spring.elastic, spring.load) = (
                    spring.committed_stress,
                    spring.committed_elastic,
                    spring.committed_stress,
                )
            }
            HistoryEvent::Commit => {
                (spring.committed_stress, spring.committed_elastic) = (spring.stress, spring.elastic)
            }
            HistoryEvent::Predict(_) => {
                let RelaxationStep { decay, gain, .. } = self.relaxation;
                spring.load = (decay * f64::from(spring.stress) - gain * f64::from(spring.elastic)) as f32;
            }
            HistoryEvent::Advance => {}
        }
    }

    #[inline(always)]
    fn parameters(spring: &MaxwellSpring) -> [f32; 2] {
        [spring.rest_length, spring.load]
    }

    #[inline(always)]
    fn response(&self, [rest_length, load]: [f32; 2], length: f32) -> AxialResponse {
        let gain = self.relaxation.gain as f32;
        let [elastic, slope] = self.elastic_stretch(rest_length, length);
        let pull = load + gain * elastic;
        AxialResponse {
            pull,
            slope: gain * slope,
            transverse: if pull > 0.0 { pull } else { 0.0 },
            stiffening: 1.0,
        }
    }

    #[inline(always)]
    fn elastic(&self, [rest_length, _]: [f32; 2], length: f32) -> f32 {
        self.elastic_stretch(rest_length, length)[0]
    }

    #[inline(always)]
    fn advance(&self, spring: &mut MaxwellSpring, elastic: f32, RelaxationStep { decay, gain, .. }: RelaxationStep) {
        let elongation = f64::from(elastic) - f64::from(spring.elastic);
        let stress = (decay * f64::from(spring.stress) + gain * elongation) as f32;
        // Values beyond the range of `f32` are reset to 0.
        spring.stress = if stress.is_finite() { stress } else { 0.0 };
        spring.elastic = if elastic.is_finite() { elastic } else { 0.0 };
        spring.load = spring.stress;
    }

    fn hash(&self, spring: &MaxwellSpring, hasher: &mut StateHasher) {
        hasher.write_floats(&[spring.committed_stress, spring.committed_elastic]);
    }
}
