//! Springs that take a set: stretched or pressed beyond a strain they yield, and are at rest elsewhere from then on (perfect plasticity;
//! Terzopoulos, Fleischer 1988 have it for graphics).
//!
//! What was yielded is found where a substep ends, as the part of the length that is beyond the strain; within it a spring is elastic.

use glam::{DMat3, DVec3};

use super::stencils::{Law, Stencil, Stencils, directed};
use super::strings::Tension;
use super::{Moment, Term};
use crate::body::{BodyDefinition, NodeOrder, Spring};
use crate::diagnostics::StateHasher;
use crate::error::{Error, Result};
use crate::material::{Course, Yielding};
use crate::memory;
use crate::terms::SpringLaw;

/// What springs pull less than before they yielded, over their stiffness.
#[derive(Debug)]
struct Sets {
    yield_strain: f64,
    largest: f64,
}

/// m
#[derive(Clone, Copy, Debug)]
struct Set {
    rest_length: f32,
    /// By how much longer it is at rest.
    longer: f32,
    kept: f32,
}

pub(super) fn new(definition: &BodyDefinition, springs: &[Spring], order: &NodeOrder) -> Result<Option<Box<dyn Term>>> {
    let Yielding { strain, largest } = definition.yielding;
    if definition.yielding.is_none() || springs.is_empty() {
        return Ok(None);
    }
    if definition.spring_law != SpringLaw::Linear {
        return Err(Error::invalid(format!(
            "yield_strain is {strain} while spring_law is not linear: only linear springs yield"
        )));
    }
    let mut sets = memory::reserved(springs.len())?;
    // A spring without a length at rest has no strain.
    let there = springs
        .iter()
        .filter(|spring| spring.stiffness > 0.0 && spring.rest_length > 0.0);
    for spring in there {
        let mut nodes = spring.nodes.map(|node| order.own(node));
        nodes.sort_unstable();
        sets.push(Stencil {
            nodes,
            stiffness: spring.stiffness,
            shape: Set {
                rest_length: spring.rest_length,
                longer: 0.0,
                kept: 0.0,
            },
        });
    }
    let law = Sets {
        yield_strain: f64::from(strain),
        largest: f64::from(largest),
    };
    Ok(Some(Box::new(Stencils::new(law, sets, definition.positions.len())?)))
}

/// Where both nodes are at the same place it points along x, from the node with the lower number.
fn direction(way: DVec3) -> DVec3 {
    way.try_normalize().unwrap_or(DVec3::X)
}

impl Law<2> for Sets {
    type Shape = Set;

    const REMEMBERS: bool = true;

    /// What the spring has less of than if it had not yielded.
    fn energy(&self, set: &Set, [from, to]: &[DVec3; 2]) -> f64 {
        let longer = f64::from(set.longer);
        longer * (0.5 * longer - (from.distance(*to) - f64::from(set.rest_length)))
    }

    fn change(&self, set: &Set, [from, to]: &[DVec3; 2], ways: &[DVec3; 2]) -> f64 {
        let (way, more) = (*to - *from, ways[1] - ways[0]);
        let both = way.length() + (way + more).length();
        if both == 0.0 {
            return 0.0;
        }
        -f64::from(set.longer) * more.dot(way + way + more) / both
    }

    fn forces(&self, set: &Set, [from, to]: &[DVec3; 2]) -> [DVec3; 2] {
        let push = direction(*to - *from) * f64::from(set.longer);
        [-push, push]
    }

    fn blocks(&self, set: &Set, [from, to]: &[DVec3; 2], is_exact: bool) -> [[DMat3; 2]; 2] {
        let (way, longer) = (*to - *from, f64::from(set.longer));
        let length = way.length();
        let block = if length > 0.0 && (is_exact || longer < 0.0) {
            directed(way / length, 0.0, -longer / length)
        } else {
            DMat3::ZERO
        };
        [[block, -block], [-block, block]]
    }

    fn scaled(&self, set: &Set, length: f64) -> (Set, f64) {
        let rest_length = (f64::from(set.rest_length) * length) as f32;
        (Set { rest_length, ..*set }, 1.0)
    }

    fn is_finite(&self, set: &Set) -> bool {
        set.rest_length.is_finite()
    }

    fn size(&self, set: &Set) -> f32 {
        set.rest_length
    }

    fn shape_of_spring(&self, before: &Set, rest_length: f32) -> Option<Set> {
        (rest_length > 0.0).then_some(Set { rest_length, ..*before })
    }

    fn is_of_springs(&self) -> bool {
        true
    }

    /// A spring that has yielded is as stiff as before.
    fn rate(&self, _set: &Set, _inverse_masses: [f64; 2]) -> f64 {
        0.0
    }

    fn pass(&self, moment: Moment, set: &mut Set) {
        match moment {
            Moment::Recall => set.longer = set.kept,
            Moment::Keep => set.kept = set.longer,
            Moment::Foresee(_) | Moment::Age => {}
        }
    }

    const IS_STRING: bool = true;

    #[inline(always)]
    fn weights(_shape: &Set) -> [f32; 2] {
        [-1.0, 1.0]
    }

    #[inline(always)]
    fn numbers(set: &Set) -> [f32; 2] {
        [set.longer, 0.0]
    }

    #[inline(always)]
    fn tension(&self, [longer, _]: [f32; 2], _length: f32) -> Tension {
        Tension {
            pull: -longer,
            slope: 0.0,
            sideways: if longer < 0.0 { -longer } else { 0.0 },
            stiffening: 1.0,
        }
    }

    #[inline(always)]
    fn age(&self, set: &mut Set, length: f32, _course: Course) {
        let rest_length = f64::from(set.rest_length);
        let stretch = f64::from(length) - rest_length - f64::from(set.longer);
        let yielded = stretch.abs() - self.yield_strain * rest_length;
        if yielded > 0.0 {
            let most = self.largest * rest_length;
            let longer = f64::from(set.longer) + yielded.copysign(stretch);
            set.longer = longer.clamp(-most, most) as f32;
        }
    }

    fn hash(&self, set: &Set, hasher: &mut StateHasher) {
        hasher.write_floats(&[set.kept]);
    }
}
