//! Springs that stiffen as they are stretched, as tissue does: what their pull is beyond `k (L - L0)`.
//!
//! The linear part stays where springs are kept, so that every storage and kernel has such springs. With e the strain `L/L0 - 1`, what is
//! beyond is `k L0 p(e)`; every law goes on evenly from a limit of the strain, so that there is a bound to how stiff a spring becomes,
//! and is convex, so that there is one state of rest.

use glam::{DMat3, DVec3};

use super::Term;
use super::stencils::{StencilLaw, Stencils, directed, direction, lengthening, of_springs};
use super::strings::Tension;
use crate::base::{Result, ensure};
use crate::codec::saved;
use crate::def::{BodyDefinition, Spring, SpringLaw};
use crate::soa::NodeOrder;

impl SpringLaw {
    /// What the pull, its slope and the energy are beyond those of a linear spring, up to the limit.
    fn below_limit(&self, strain: f64) -> [f64; 3] {
        match *self {
            SpringLaw::Exponential { steepness, .. } if strain > 0.0 => {
                let steepness = f64::from(steepness);
                let slope = libm::expm1(steepness * strain);
                let pull = slope / steepness - strain;
                [pull, slope, pull / steepness - 0.5 * strain * strain]
            }
            SpringLaw::Cubic { quadratic, cubic, .. } => {
                let (a, b) = (f64::from(quadratic), f64::from(cubic));
                let square = strain * strain;
                [
                    square * (a + b * strain),
                    strain * (2.0 * a + 3.0 * b * strain),
                    square * strain * (a / 3.0 + 0.25 * b * strain),
                ]
            }
            _ => [0.0; 3],
        }
    }

    fn limit(&self) -> f64 {
        match *self {
            SpringLaw::Linear => f64::INFINITY,
            SpringLaw::Exponential { limit, .. } | SpringLaw::Cubic { limit, .. } => f64::from(limit),
        }
    }

    /// What the pull, its slope and the energy are beyond those of a linear spring.
    pub(super) fn beyond(&self, strain: f64) -> [f64; 3] {
        let limit = self.limit();
        if strain <= limit {
            return self.below_limit(strain);
        }
        let [pull, slope, energy] = self.below_limit(limit);
        let more = strain - limit;
        [pull + slope * more, slope, energy + more * (pull + 0.5 * slope * more)]
    }

    /// How the energy changes where the strain becomes so much larger.
    pub(super) fn change(&self, strain: f64, more: f64) -> f64 {
        let steepness = match *self {
            SpringLaw::Exponential { steepness, .. } => f64::from(steepness).max(1.0),
            _ => 1.0,
        };
        if more.abs() * steepness > 0.05 {
            return self.beyond(strain + more)[2] - self.beyond(strain)[2];
        }
        // The pull over the way, by Gauss's rule of three points: a difference of energies would lose the last digits.
        let points = [0.5 - 0.15_f64.sqrt(), 0.5, 0.5 + 0.15_f64.sqrt()];
        let [first, middle, last] = points.map(|point| self.beyond(strain + point * more)[0]);
        more * (5.0 * (first + last) + 8.0 * middle) / 18.0
    }

    /// The most by which a spring is stiffer than a linear one.
    fn stiffest(&self) -> f64 {
        let ends = [-1.0, self.limit()].map(|strain| self.below_limit(strain)[1]);
        ends.into_iter().fold(0.0, f64::max)
    }
}

/// The same in `f32` and without branches, for springs side by side: the exponential and the cubic are added up, one of them 0.
#[derive(Clone, Copy, Debug)]
pub(super) struct Curve {
    steepness: f32,
    inverse_steepness: f32,
    quadratic: f32,
    cubic: f32,
    limit: f32,
}

saved! { Curve { steepness, inverse_steepness, quadratic, cubic, limit } }

impl Curve {
    pub fn new(law: SpringLaw) -> Self {
        let linear = Self {
            steepness: 0.0,
            inverse_steepness: 0.0,
            quadratic: 0.0,
            cubic: 0.0,
            limit: f32::INFINITY,
        };
        match law {
            SpringLaw::Linear => linear,
            SpringLaw::Exponential { steepness, limit } => Self {
                steepness,
                inverse_steepness: 1.0 / steepness,
                limit,
                ..linear
            },
            SpringLaw::Cubic {
                quadratic,
                cubic,
                limit,
            } => Self {
                quadratic,
                cubic,
                limit,
                ..linear
            },
        }
    }

    /// What the pull and its slope are beyond those of a linear spring.
    #[inline(always)]
    pub fn beyond(&self, strain: f32) -> [f32; 2] {
        let within = if strain < self.limit { strain } else { self.limit };
        let stretch = if within > 0.0 { within } else { 0.0 };
        let steep = self.steepness * stretch;
        let steeper = exponential_beyond(steep);
        let (a, b) = (self.quadratic, self.cubic);
        let pull = steeper * self.inverse_steepness + within * within * (a + b * within);
        let slope = steeper + steep + within * (2.0 * a + 3.0 * b * within);
        [pull + slope * (strain - within), slope]
    }
}

/// `exp(number) - 1 - number`, of a number from 0 to 14, without a difference that loses digits: as `2^n exp(r)`, n being whole and r at
/// most half the logarithm of 2.
#[inline(always)]
fn exponential_beyond(number: f32) -> f32 {
    /// Numbers of this size are whole, and their last bits are those of n.
    const WHOLE: f32 = 12_582_912.0;
    /// The logarithm of 2, in two parts: products of the first with n are exact.
    const LOGARITHM: [f32; 2] = [0.693_359_4, -2.121_944_4e-4];
    let shifted = number * std::f32::consts::LOG2_E + WHOLE;
    let n = shifted - WHOLE;
    let r = (number - n * LOGARITHM[0]) - n * LOGARITHM[1];
    let power = f32::from_bits((shifted.to_bits() << 23).wrapping_add(1.0_f32.to_bits()));
    // exp(r) - 1 - r, over r²: Taylor's series; what is left out is less than 2^-23 of it.
    let mut beyond = 1.0 / 5040.0;
    for factor in [1.0 / 720.0, 1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0, 0.5] {
        beyond = beyond * r + factor;
    }
    power * (r * r * beyond) + ((power - 1.0) * (1.0 + r) - n * std::f32::consts::LN_2)
}

/// What springs of a law do beyond what linear ones do; shapes are their rest lengths, m.
#[derive(Debug)]
pub(super) struct Stiffening {
    law: SpringLaw,
    curve: Curve,
    stiffest: f64,
}

saved! { Stiffening { law, curve, stiffest } }

pub(super) fn new(definition: &BodyDefinition, springs: &[Spring], order: &NodeOrder) -> Result<Option<Box<dyn Term>>> {
    let law = definition.spring_law;
    law.check()?;
    if law == SpringLaw::Linear {
        return Ok(None);
    }
    ensure!(!springs.is_empty(), "spring_law is given while the body has no springs");
    let stiffest = law.stiffest();
    let stiffening = of_springs(springs, order, true, |rest_length| rest_length)?;
    let law = Stiffening {
        law,
        curve: Curve::new(law),
        stiffest,
    };
    Stencils::boxed(law, stiffening, definition.positions.len())
}

/// A spring where it is.
struct Stretched {
    way: DVec3,
    length: f64,
    rest_length: f64,
    strain: f64,
}

impl Stretched {
    fn new(rest_length: f32, [from, to]: &[DVec3; 2]) -> Self {
        let (way, rest_length) = (*to - *from, f64::from(rest_length));
        let length = way.length();
        Self {
            way,
            length,
            rest_length,
            strain: length / rest_length - 1.0,
        }
    }
}

impl Stiffening {
    fn stiffness(&self, spring: &Stretched, is_exact: bool) -> DMat3 {
        let [pull, slope, _] = self.law.beyond(spring.strain);
        // A pressed spring pushes its ends sideways.
        let across = if spring.length > 0.0 && (is_exact || spring.strain > 0.0) {
            pull * spring.rest_length / spring.length
        } else {
            0.0
        };
        directed(direction(spring.way), slope, across)
    }
}

impl StencilLaw<2> for Stiffening {
    const SAVED_AS: u8 = 5;

    type Shape = f32;

    const IS_OF_SPRINGS: bool = true;

    fn energy(&self, &rest_length: &f32, places: &[DVec3; 2]) -> f64 {
        let spring = Stretched::new(rest_length, places);
        spring.rest_length.powi(2) * self.law.beyond(spring.strain)[2]
    }

    fn change(&self, &rest_length: &f32, places: &[DVec3; 2], ways: &[DVec3; 2]) -> f64 {
        let spring = Stretched::new(rest_length, places);
        let longer = lengthening(spring.way, ways[1] - ways[0]);
        spring.rest_length.powi(2) * self.law.change(spring.strain, longer / spring.rest_length)
    }

    fn forces(&self, &rest_length: &f32, places: &[DVec3; 2]) -> [DVec3; 2] {
        let spring = Stretched::new(rest_length, places);
        let pull = direction(spring.way) * (spring.rest_length * self.law.beyond(spring.strain)[0]);
        [pull, -pull]
    }

    fn blocks(&self, &rest_length: &f32, places: &[DVec3; 2], is_exact: bool) -> [[DMat3; 2]; 2] {
        let block = self.stiffness(&Stretched::new(rest_length, places), is_exact);
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
        let longer = length - rest_length;
        let [pull, slope] = self.curve.beyond(longer / rest_length);
        let pull = rest_length * pull;
        Tension {
            pull,
            slope,
            sideways: if longer > 0.0 { pull } else { 0.0 },
            stiffening: 1.0,
        }
    }

    fn rate(&self, _rest_length: &f32, inverse_masses: [f64; 2]) -> f64 {
        self.stiffest * (inverse_masses[0] + inverse_masses[1])
    }
}
