//! Hyperelastic laws, one per file. Each is written once, for `f64` and for SIMD lanes.
//!
//! A law is the part w of an energy density `w(I1, I2, J) + kappa/2 (J - 1)²`; w is linear in I2. `StrainState`
//! computes stresses, tangents and bounds from its derivatives. A new law needs a file, a row in `with_hyperelastic`
//! and a variant of [`crate::def::ElementLaw`].

mod mooney_rivlin;
mod neo_hookean;
mod strained;
#[cfg(test)]
mod tests;

pub(super) use mooney_rivlin::MooneyRivlin;
pub(super) use neo_hookean::NeoHookean;
#[cfg(test)]
use strained::inner;
pub(super) use strained::{MatrixColumns, StrainState, tensor_cross};

use crate::simd::Real;

/// The energy density w without the volume term, as a function of `I1 = |F|²`, `I2 = |cof F|²` and `J - 1`, Pa. At
/// small strains it has the shear modulus mu and Poisson's ratio 0. It has no stress at rest.
pub(crate) trait Hyperelastic: Copy {
    /// The derivatives of w with respect to I1, I2 and J.
    fn first_derivatives<R: Real>(self, i1: R, volume_strain: R) -> [R; 3];

    /// The second derivatives of w with respect to I1 and J, at least 0.
    fn second_derivatives<R: Real>(self, i1: R, volume_strain: R) -> [R; 2];

    /// The change of w when I1, I2 and J - 1 grow from `from` by `added`: the terms of I1, I2 and J, to be added.
    fn change(self, from: [f64; 3], added: [f64; 3]) -> [f64; 3];

    /// The energy density at I1, I2 and J - 1.
    fn energy(self, [i1, i2, volume_strain]: [f64; 3]) -> f64 {
        self.change([3.0, 3.0, 0.0], [i1 - 3.0, i2 - 3.0, volume_strain])
            .iter()
            .sum()
    }
}

/// Evaluates the first expression with the hyperelastic law of a [`super::ElasticLaw`], or the second for St
/// Venant-Kirchhoff, which has kernels of its own.
macro_rules! with_hyperelastic {
    ($law:expr, |$of:ident| $run:expr, $otherwise:expr) => {
        match $law.form {
            crate::def::ElementLaw::StVenantKirchhoff => $otherwise,
            crate::def::ElementLaw::NeoHookean => {
                let $of = crate::elements::laws::NeoHookean::new($law.mu);
                $run
            }
            crate::def::ElementLaw::MooneyRivlin { ratio } => {
                let $of = crate::elements::laws::MooneyRivlin::new($law.mu, ratio);
                $run
            }
        }
    };
}

pub(super) use with_hyperelastic;
