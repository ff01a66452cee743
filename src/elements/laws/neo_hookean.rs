//! The stable neo-Hookean law (Smith, de Goes, Kim 2018, equation 14), parametrized such that mu is the shear modulus
//! at small strains.
//!
//! `w = m/2 (I1 - 3) - m/2 ln((I1 + 1)/4) - 3/4 m (J - 1) + 5/16 m (J - 1)²` with `m = 4/3 mu`. With `kappa = lambda`
//! it is the law of the paper, whose volume term is `(lambda + 5/6 mu)/2 (J - alpha)²`.

use super::Hyperelastic;
use crate::simd::Real;

#[derive(Clone, Copy, Debug)]
pub(crate) struct NeoHookean {
    /// m, Pa.
    modulus: f64,
}

impl NeoHookean {
    pub fn new(mu: f32) -> Self {
        Self {
            modulus: f64::from(mu) * 4.0 / 3.0,
        }
    }
}

impl Hyperelastic for NeoHookean {
    #[inline(always)]
    fn first_derivatives<R: Real>(self, i1: R, volume_strain: R) -> [R; 3] {
        [
            R::from_f64(0.5 * self.modulus) * i1 / (i1 + R::from_f64(1.0)),
            R::from_f64(0.0),
            R::from_f64(0.625 * self.modulus) * volume_strain - R::from_f64(0.75 * self.modulus),
        ]
    }

    #[inline(always)]
    fn second_derivatives<R: Real>(self, i1: R, _: R) -> [R; 2] {
        let shifted = i1 + R::from_f64(1.0);
        [
            R::from_f64(0.5 * self.modulus) / (shifted * shifted),
            R::from_f64(0.625 * self.modulus),
        ]
    }

    fn change(self, [i1, _, volume_strain]: [f64; 3], [di1, _, dj]: [f64; 3]) -> [f64; 3] {
        [
            0.5 * self.modulus * (di1 - libm::log1p(di1 / (i1 + 1.0))),
            0.0,
            self.modulus * dj * (0.3125 * (2.0 * volume_strain + dj) - 0.75),
        ]
    }
}
