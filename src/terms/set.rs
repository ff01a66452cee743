//! Springs that take a set: stretched or pressed beyond a strain they yield, and are at rest elsewhere from then on (perfect plasticity;
//! Terzopoulos, Fleischer 1988 have it for graphics).
//!
//! Where a spring would be longer at rest if it stopped where it is, it pulls as if it were so already: its pull has a limit, with an
//! energy of its own, which is convex. So an implicit step, however long, yields as far as it must, and where there is a state of rest it
//! is one. What has yielded is kept where a substep ends.

use glam::{DMat3, DVec3};

use super::stencils::{StencilLaw, Stencils, directed, direction, lengthening, of_springs};
use super::strings::Tension;
use super::{Event, Term};
use crate::base::{Result, StateHasher, ensure};
use crate::codec::saved;
use crate::def::{BodyDefinition, RelaxationStep, Spring, SpringLaw, Yielding};
use crate::soa::NodeOrder;

/// What springs pull less than before they yielded, over their stiffness.
#[derive(Debug)]
pub(super) struct Sets {
    yield_strain: f64,
    largest: f64,
}

saved! { Sets { yield_strain, largest } }

/// m
#[derive(Clone, Copy, Debug)]
pub(super) struct Set {
    rest_length: f32,
    /// By how much longer it is at rest.
    longer: f32,
    kept: f32,
}

saved! { Set { rest_length, longer, kept } }

pub(super) fn new(definition: &BodyDefinition, springs: &[Spring], order: &NodeOrder) -> Result<Option<Box<dyn Term>>> {
    let Yielding { strain, largest } = definition.yielding;
    if definition.yielding.is_none() || springs.is_empty() {
        return Ok(None);
    }
    ensure!(
        definition.spring_law == SpringLaw::Linear,
        "yield_strain is {strain} while spring_law is not linear: only linear springs yield"
    );
    let sets = of_springs(springs, order, true, |rest_length| Set {
        rest_length,
        longer: 0.0,
        kept: 0.0,
    })?;
    let law = Sets {
        yield_strain: f64::from(strain),
        largest: f64::from(largest),
    };
    Stencils::boxed(law, sets, definition.positions.len())
}

/// What a spring does at a length.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum SpringFlow {
    Elastic,
    Yields,
    /// By as much as it may, longer or shorter.
    AtEnd,
}

impl Sets {
    /// By how much longer it would be at rest if it stopped at this length, m.
    fn longer_at(&self, set: &Set, length: f64) -> (f64, SpringFlow) {
        let (rest_length, longer) = (f64::from(set.rest_length), f64::from(set.longer));
        let stretch = length - rest_length - longer;
        let yielded = stretch.abs() - self.yield_strain * rest_length;
        if yielded <= 0.0 {
            return (longer, SpringFlow::Elastic);
        }
        let (after, most) = (longer + yielded.copysign(stretch), self.largest * rest_length);
        if after.abs() < most {
            (after, SpringFlow::Yields)
        } else {
            (after.clamp(-most, most), SpringFlow::AtEnd)
        }
    }

    /// The integral of minus that over the length, so that it is what the elastic energy is off by where it does not yield.
    fn energy_at(&self, set: &Set, length: f64) -> f64 {
        let (rest_length, longer) = (f64::from(set.rest_length), f64::from(set.longer));
        let (after, _) = self.longer_at(set, length);
        if after == longer {
            return longer * (0.5 * longer - (length - rest_length));
        }
        let yields = (self.yield_strain * rest_length).copysign(after - longer);
        // Where it begins to yield, and where it ends.
        let first = longer * (0.5 * longer - (longer + yields));
        let flowing = 0.5 * (after * after - longer * longer);
        first - flowing - after * (length - rest_length - yields - after)
    }
}

impl StencilLaw<2> for Sets {
    const SAVED_AS: u8 = 3;

    type Shape = Set;

    const IS_OF_SPRINGS: bool = true;

    const REMEMBERS: bool = true;

    /// What the spring has less of than if it could not yield.
    fn energy(&self, set: &Set, [from, to]: &[DVec3; 2]) -> f64 {
        self.energy_at(set, from.distance(*to))
    }

    fn change(&self, set: &Set, [from, to]: &[DVec3; 2], ways: &[DVec3; 2]) -> f64 {
        let (way, more) = (*to - *from, ways[1] - ways[0]);
        let lengths = [way.length(), (way + more).length()];
        let [before, after] = lengths.map(|length| self.longer_at(set, length));
        if before.1 == after.1 {
            -0.5 * (before.0 + after.0) * lengthening(way, more)
        } else {
            self.energy_at(set, lengths[1]) - self.energy_at(set, lengths[0])
        }
    }

    fn forces(&self, set: &Set, [from, to]: &[DVec3; 2]) -> [DVec3; 2] {
        let push = direction(*to - *from) * self.longer_at(set, from.distance(*to)).0;
        [-push, push]
    }

    fn blocks(&self, set: &Set, [from, to]: &[DVec3; 2], is_exact: bool) -> [[DMat3; 2]; 2] {
        let way = *to - *from;
        let length = way.length();
        let (longer, flow) = self.longer_at(set, length);
        let along = if flow == SpringFlow::Yields { -1.0 } else { 0.0 };
        let across = if length > 0.0 && (is_exact || longer < 0.0) {
            -longer / length
        } else {
            0.0
        };
        let block = directed(direction(way), along, across);
        [[block, -block], [-block, block]]
    }

    fn size(&self, set: &Set) -> f32 {
        set.rest_length
    }

    fn shape_of_spring(&self, before: &Set, rest_length: f32) -> Option<Set> {
        (rest_length > 0.0).then_some(Set { rest_length, ..*before })
    }

    fn pass(&self, moment: Event, set: &mut Set) {
        match moment {
            Event::Recall => set.longer = set.kept,
            Event::Keep => set.kept = set.longer,
            Event::Foresee(_) | Event::Age => {}
        }
    }

    #[inline(always)]
    fn numbers(set: &Set) -> [f32; 2] {
        [set.longer, set.rest_length]
    }

    #[inline(always)]
    fn tension(&self, [longer, rest_length]: [f32; 2], length: f32) -> Tension {
        let stretch = length - rest_length - longer;
        let yielded = stretch.abs() - self.yield_strain as f32 * rest_length;
        let most = self.largest as f32 * rest_length;
        let moved = longer + if yielded > 0.0 { yielded.copysign(stretch) } else { 0.0 };
        let after = if yielded > 0.0 {
            moved.clamp(-most, most)
        } else {
            longer
        };
        Tension {
            pull: -after,
            slope: if yielded > 0.0 && moved.abs() < most { -1.0 } else { 0.0 },
            sideways: if after < 0.0 { -after } else { 0.0 },
            stiffening: 1.0,
        }
    }

    #[inline(always)]
    fn age(&self, set: &mut Set, length: f32, course: RelaxationStep) {
        if course.yields {
            set.longer = self.longer_at(set, f64::from(length)).0 as f32;
        }
    }

    fn hash(&self, set: &Set, hasher: &mut StateHasher) {
        hasher.write_floats(&[set.kept]);
    }
}
