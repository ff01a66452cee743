//! Springs that relax: what the arms beside them pull with.
//!
//! Arms are as those of tetrahedra ([`crate::elements`]): their pull is the load on them and, in an implicit equation, g times what is
//! elastic on top of it.

use glam::{DMat3, DVec3};

use super::nonlinear::Curve;
use super::stencils::{StencilLaw, Stencils, directed, direction, lengthening, of_springs};
use super::strings::Tension;
use super::{Event, Term};
use crate::base::{Result, StateHasher};
use crate::codec::saved;
use crate::def::{BodyDefinition, RelaxationStep, Spring, SpringLaw, Viscosity};
use crate::soa::NodeOrder;

/// Beside springs of a law.
#[derive(Debug)]
pub(super) struct Arms {
    law: SpringLaw,
    curve: Curve,
    viscosity: Viscosity,
    stiffening: f64,
    /// Of the equation that is being solved; nothing where there is none.
    course: RelaxationStep,
}

saved! { Arms { law, curve, viscosity, stiffening, course } }

/// Stresses are pulls over the spring's stiffness, m.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arm {
    rest_length: f32,
    load: f32,
    stress: f32,
    elastic: f32,
    kept_stress: f32,
    kept_elastic: f32,
}

saved! { Arm { rest_length, load, stress, elastic, kept_stress, kept_elastic } }

pub(super) fn new(definition: &BodyDefinition, springs: &[Spring], order: &NodeOrder) -> Result<Option<Box<dyn Term>>> {
    let viscosity = definition.viscosity;
    let Some(stiffening) = viscosity.stiffening().filter(|_| !springs.is_empty()) else {
        return Ok(None);
    };
    let arms = of_springs(springs, order, false, |rest_length| Arm {
        rest_length,
        load: 0.0,
        stress: 0.0,
        elastic: 0.0,
        kept_stress: 0.0,
        kept_elastic: 0.0,
    })?;
    let law = Arms {
        law: definition.spring_law,
        curve: Curve::new(definition.spring_law),
        viscosity,
        stiffening,
        course: RelaxationStep::NOTHING,
    };
    Stencils::boxed(law, arms, definition.positions.len())
}

/// An arm where it is: the way from its first node to the other, and what is elastic.
struct PlacedArm {
    way: DVec3,
    length: f64,
    strain: f64,
    /// m, and how it grows with the length.
    elastic: f64,
    slope: f64,
}

impl Arms {
    fn place(&self, arm: &Arm, [from, to]: &[DVec3; 2]) -> PlacedArm {
        let way = *to - *from;
        let (length, rest_length) = (way.length(), f64::from(arm.rest_length));
        let mut placed = PlacedArm {
            way,
            length,
            strain: 0.0,
            elastic: length - rest_length,
            slope: 1.0,
        };
        if rest_length > 0.0 {
            placed.strain = length / rest_length - 1.0;
            let [pull, slope, _] = self.law.beyond(placed.strain);
            placed.elastic += rest_length * pull;
            placed.slope += slope;
        }
        placed
    }

    /// What is elastic of an arm of this length, m, and how it grows with the length, in `f32`.
    #[inline(always)]
    fn beside(&self, rest_length: f32, length: f32) -> [f32; 2] {
        let longer = length - rest_length;
        let strain = if rest_length > 0.0 { longer / rest_length } else { 0.0 };
        let [pull, slope] = self.curve.beyond(strain);
        [longer + rest_length * pull, 1.0 + slope]
    }

    fn pull(&self, arm: &Arm, placed: &PlacedArm) -> f64 {
        f64::from(arm.load) + self.course.gain * placed.elastic
    }

    fn stiffness(&self, arm: &Arm, placed: &PlacedArm, is_exact: bool) -> DMat3 {
        let pull = self.pull(arm, placed);
        let across = if placed.length > 0.0 && (is_exact || pull > 0.0) {
            pull / placed.length
        } else {
            0.0
        };
        directed(direction(placed.way), self.course.gain * placed.slope, across)
    }
}

impl StencilLaw<2> for Arms {
    const SAVED_AS: u8 = 1;

    type Shape = Arm;

    const IS_OF_SPRINGS: bool = true;

    const REMEMBERS: bool = true;

    fn energy(&self, arm: &Arm, places: &[DVec3; 2]) -> f64 {
        let pull = self.pull(arm, &self.place(arm, places));
        0.5 * pull * pull / self.stiffening
    }

    fn change(&self, arm: &Arm, places: &[DVec3; 2], ways: &[DVec3; 2]) -> f64 {
        let placed = self.place(arm, places);
        let more = ways[1] - ways[0];
        let (longer, rest_length) = (lengthening(placed.way, more), f64::from(arm.rest_length));
        let both = placed.length + (placed.way + more).length();
        let mut elastic = 0.5 * longer * (both - 2.0 * rest_length);
        if rest_length > 0.0 {
            elastic += rest_length.powi(2) * self.law.change(placed.strain, longer / rest_length);
        }
        self.course.gain * elastic
    }

    fn change_of_load(&self, arm: &Arm, [from, to]: &[DVec3; 2], ways: &[DVec3; 2]) -> f64 {
        f64::from(arm.load) * lengthening(*to - *from, ways[1] - ways[0])
    }

    fn forces(&self, arm: &Arm, places: &[DVec3; 2]) -> [DVec3; 2] {
        let placed = self.place(arm, places);
        let pull = direction(placed.way) * self.pull(arm, &placed);
        [pull, -pull]
    }

    fn blocks(&self, arm: &Arm, places: &[DVec3; 2], is_exact: bool) -> [[DMat3; 2]; 2] {
        let block = self.stiffness(arm, &self.place(arm, places), is_exact);
        [[block, -block], [-block, block]]
    }

    fn size(&self, arm: &Arm) -> f32 {
        arm.rest_length
    }

    fn shape_of_spring(&self, before: &Arm, rest_length: f32) -> Option<Arm> {
        Some(Arm { rest_length, ..*before })
    }

    fn begin(&mut self, moment: Event) {
        self.course = match moment {
            Event::Foresee(time) => self.viscosity.over(time),
            Event::Recall | Event::Keep | Event::Age => RelaxationStep::NOTHING,
        };
    }

    fn pass(&self, moment: Event, arm: &mut Arm) {
        match moment {
            Event::Recall => (arm.stress, arm.elastic, arm.load) = (arm.kept_stress, arm.kept_elastic, arm.kept_stress),
            Event::Keep => (arm.kept_stress, arm.kept_elastic) = (arm.stress, arm.elastic),
            Event::Foresee(_) => {
                let RelaxationStep { decay, gain, .. } = self.course;
                arm.load = (decay * f64::from(arm.stress) - gain * f64::from(arm.elastic)) as f32;
            }
            Event::Age => {}
        }
    }

    #[inline(always)]
    fn numbers(arm: &Arm) -> [f32; 2] {
        [arm.rest_length, arm.load]
    }

    #[inline(always)]
    fn tension(&self, [rest_length, load]: [f32; 2], length: f32) -> Tension {
        let gain = self.course.gain as f32;
        let [elastic, slope] = self.beside(rest_length, length);
        let pull = load + gain * elastic;
        Tension {
            pull,
            slope: gain * slope,
            sideways: if pull > 0.0 { pull } else { 0.0 },
            stiffening: 1.0,
        }
    }

    #[inline(always)]
    fn elastic(&self, [rest_length, _]: [f32; 2], length: f32) -> f32 {
        self.beside(rest_length, length)[0]
    }

    #[inline(always)]
    fn age(&self, arm: &mut Arm, elastic: f32, RelaxationStep { decay, gain, .. }: RelaxationStep) {
        let longer = f64::from(elastic) - f64::from(arm.elastic);
        let stress = (decay * f64::from(arm.stress) + gain * longer) as f32;
        // Nothing is held by what is beyond the range of numbers.
        arm.stress = if stress.is_finite() { stress } else { 0.0 };
        arm.elastic = if elastic.is_finite() { elastic } else { 0.0 };
        arm.load = arm.stress;
    }

    fn hash(&self, arm: &Arm, hasher: &mut StateHasher) {
        hasher.write_floats(&[arm.kept_stress, arm.kept_elastic]);
    }
}
