//! Hyperelastic laws, each in a file of its own and written once, for `f64` and for the lanes of a kernel.
//!
//! A law is the part w of an energy density `w(I1, I2, J) + kappa/2 (J - 1)²`, that is linear in I2. `Strained` makes stresses, tangents and
//! bounds of its derivatives. To add one: a file, a row in `with_hyperelastic`, and a variant of [`crate::def::ElementLaw`].

mod mooney_rivlin;
mod neo_hookean;
mod strained;
#[cfg(test)]
mod tests;

pub(super) use mooney_rivlin::MooneyRivlin;
pub(super) use neo_hookean::NeoHookean;
#[cfg(test)]
use strained::inner;
pub(super) use strained::{MatrixColumns, Strained, product_of};

use crate::simd::Real;

/// The part of an energy per volume that each tetrahedron has by itself, of `I1 = |F|²`, `I2 = |cof F|²` and `J - 1`, Pa. It has Young's modulus
/// and Poisson's ratio 0 of a shear modulus mu at small strains, and no stress at rest.
pub(crate) trait Hyperelastic: Copy {
    /// Its derivatives with I1, I2 and J.
    fn slopes<R: Real>(self, i1: R, growth: R) -> [R; 3];

    /// Its second derivatives with I1 and with J, at least 0.
    fn curvatures<R: Real>(self, i1: R, growth: R) -> [R; 2];

    /// How it changes from some I1, I2 and J - 1 to others that are so much more: the sum, of the changes with I1, I2 and J.
    fn change(self, from: [f64; 3], more: [f64; 3]) -> [f64; 3];

    /// The energy of I1, I2 and J - 1.
    fn energy(self, [i1, i2, growth]: [f64; 3]) -> f64 {
        self.change([3.0, 3.0, 0.0], [i1 - 3.0, i2 - 3.0, growth]).iter().sum()
    }
}

/// Runs the first expression with the hyperelastic law of a [`super::Law`], or the second for St Venant and Kirchhoff's, whose kernels are its own.
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
