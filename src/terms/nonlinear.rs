//! Springs that stiffen when stretched, as tissue does: the force beyond the linear `k (L - L0)`.
//!
//! The spring storage computes the linear part, so that every storage and kernel supports nonlinear springs. With the
//! strain `e = L/L0 - 1` the additional force is `k L0 p(e)`. Every law continues linearly beyond a strain limit, which
//! bounds the stiffness. It is convex, so that the static equilibrium is unique.

use glam::{DMat3, DVec3};

use super::Term;
use super::axial_terms::AxialResponse;
use super::stencils::{StencilLaw, Stencils, axial_matrix, direction, lengthening, spring_stencils};
use crate::base::{Result, ensure};
use crate::codec::saved;
use crate::def::{BodyDefinition, Spring, SpringLaw};
use crate::soa::NodeOrder;

impl SpringLaw {
    /// The force, slope and energy beyond those of a linear spring, up to the limit.
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

    /// The force, slope and energy beyond those of a linear spring.
    pub(super) fn beyond(&self, strain: f64) -> [f64; 3] {
        let limit = self.limit();
        if strain <= limit {
            return self.below_limit(strain);
        }
        let [pull, slope, energy] = self.below_limit(limit);
        let extra = strain - limit;
        [
            pull + slope * extra,
            slope,
            energy + extra * (pull + 0.5 * slope * extra),
        ]
    }

    /// The change of energy if the strain increases by `extra`.
    pub(super) fn energy_change(&self, strain: f64, extra: f64) -> f64 {
        let steepness = match *self {
            SpringLaw::Exponential { steepness, .. } => f64::from(steepness).max(1.0),
            _ => 1.0,
        };
        if extra.abs() * steepness > 0.05 {
            return self.beyond(strain + extra)[2] - self.beyond(strain)[2];
        }
        // Integrates the force by three-point Gauss quadrature; a difference of energies would lose the last digits.
        let points = [0.5 - 0.15_f64.sqrt(), 0.5, 0.5 + 0.15_f64.sqrt()];
        let [first, middle, last] = points.map(|point| self.beyond(strain + point * extra)[0]);
        extra * (5.0 * (first + last) + 8.0 * middle) / 18.0
    }

    /// The largest additional stiffness, relative to a linear spring.
    fn stiffest(&self) -> f64 {
        let ends = [-1.0, self.limit()].map(|strain| self.below_limit(strain)[1]);
        ends.into_iter().fold(0.0, f64::max)
    }
}

/// The law in `f32` without branches, for SIMD loops. It is the sum of the exponential and the cubic law, one of which
/// is 0.
#[derive(Clone, Copy, Debug)]
pub(super) struct StiffeningCurve {
    steepness: f32,
    inverse_steepness: f32,
    quadratic: f32,
    cubic: f32,
    limit: f32,
}

saved! { StiffeningCurve { steepness, inverse_steepness, quadratic, cubic, limit } }

impl StiffeningCurve {
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

    /// The force and slope beyond those of a linear spring.
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

/// `exp(number) - 1 - number` for a number from 0 to 14, without cancellation. It is computed as `2^n exp(r)` with
/// integer n and |r| of at most half of ln 2.
#[inline(always)]
fn exponential_beyond(number: f32) -> f32 {
    /// Adding this number rounds to an integer n, whose bits are the last ones of the sum.
    const WHOLE: f32 = 12_582_912.0;
    /// ln 2 in two parts; products of the first with n are exact.
    const LOGARITHM: [f32; 2] = [0.693_359_4, -2.121_944_4e-4];
    let shifted = number * std::f32::consts::LOG2_E + WHOLE;
    let n = shifted - WHOLE;
    let r = (number - n * LOGARITHM[0]) - n * LOGARITHM[1];
    let power = f32::from_bits((shifted.to_bits() << 23).wrapping_add(1.0_f32.to_bits()));
    // `(exp(r) - 1 - r) / r²` by its Taylor series, with a relative truncation error below 2^-23.
    let mut beyond = 1.0 / 5040.0;
    for factor in [1.0 / 720.0, 1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0, 0.5] {
        beyond = beyond * r + factor;
    }
    power * (r * r * beyond) + ((power - 1.0) * (1.0 + r) - n * std::f32::consts::LN_2)
}

/// The law of springs beyond their linear part. Shapes are rest lengths, m.
#[derive(Debug)]
pub(super) struct NonlinearSprings {
    law: SpringLaw,
    curve: StiffeningCurve,
    stiffest: f64,
}

saved! { NonlinearSprings { law, curve, stiffest } }

pub(super) fn new(definition: &BodyDefinition, springs: &[Spring], order: &NodeOrder) -> Result<Option<Box<dyn Term>>> {
    let law = definition.spring_law;
    law.check()?;
    if law == SpringLaw::Linear {
        return Ok(None);
    }
    ensure!(!springs.is_empty(), "spring_law is given while the body has no springs");
    let stiffest = law.stiffest();
    let stiffening = spring_stencils(springs, order, true, |rest_length| rest_length)?;
    let law = NonlinearSprings {
        law,
        curve: StiffeningCurve::new(law),
        stiffest,
    };
    Stencils::boxed(law, stiffening, definition.positions.len())
}

/// A spring at given positions.
struct StretchedSpring {
    offset: DVec3,
    length: f64,
    rest_length: f64,
    strain: f64,
}

impl StretchedSpring {
    fn new(rest_length: f32, [from, to]: &[DVec3; 2]) -> Self {
        let (offset, rest_length) = (*to - *from, f64::from(rest_length));
        let length = offset.length();
        Self {
            offset,
            length,
            rest_length,
            strain: length / rest_length - 1.0,
        }
    }
}

impl NonlinearSprings {
    fn stiffness(&self, spring: &StretchedSpring, is_exact: bool) -> DMat3 {
        let [pull, slope, _] = self.law.beyond(spring.strain);
        // A compressed spring pushes its ends sideways.
        let across = if spring.length > 0.0 && (is_exact || spring.strain > 0.0) {
            pull * spring.rest_length / spring.length
        } else {
            0.0
        };
        axial_matrix(direction(spring.offset), slope, across)
    }
}

impl StencilLaw<2> for NonlinearSprings {
    const SAVED_AS: u8 = 5;

    type Shape = f32;

    const BELONGS_TO_SPRINGS: bool = true;

    fn energy(&self, &rest_length: &f32, positions: &[DVec3; 2]) -> f64 {
        let spring = StretchedSpring::new(rest_length, positions);
        spring.rest_length.powi(2) * self.law.beyond(spring.strain)[2]
    }

    fn energy_change(&self, &rest_length: &f32, positions: &[DVec3; 2], displacements: &[DVec3; 2]) -> f64 {
        let spring = StretchedSpring::new(rest_length, positions);
        let elongation = lengthening(spring.offset, displacements[1] - displacements[0]);
        spring.rest_length.powi(2) * self.law.energy_change(spring.strain, elongation / spring.rest_length)
    }

    fn forces(&self, &rest_length: &f32, positions: &[DVec3; 2]) -> [DVec3; 2] {
        let spring = StretchedSpring::new(rest_length, positions);
        let pull = direction(spring.offset) * (spring.rest_length * self.law.beyond(spring.strain)[0]);
        [pull, -pull]
    }

    fn blocks(&self, &rest_length: &f32, positions: &[DVec3; 2], is_exact: bool) -> [[DMat3; 2]; 2] {
        let block = self.stiffness(&StretchedSpring::new(rest_length, positions), is_exact);
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
        let elongation = length - rest_length;
        let [pull, slope] = self.curve.beyond(elongation / rest_length);
        let pull = rest_length * pull;
        AxialResponse {
            pull,
            slope,
            transverse: if elongation > 0.0 { pull } else { 0.0 },
            stiffening: 1.0,
        }
    }

    fn rate_bound(&self, _rest_length: &f32, inverse_masses: [f64; 2]) -> f64 {
        self.stiffest * (inverse_masses[0] + inverse_masses[1])
    }
}
