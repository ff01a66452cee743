//! The stable neo-Hookean law (Smith, de Goes, Kim 2018, equation 14), with parameters such that mu is the shear modulus at small strains.
//!
//! `w = m/2 (I1 - 3) - m/2 ln((I1 + 1)/4) - 3/4 m (J - 1) + 5/16 m (J - 1)²` with `m = 4/3 mu`. With `kappa = lambda` that is the law of the paper, whose
//! volume term is `(lambda + 5/6 mu)/2 (J - alpha)²`.

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
    fn slopes<R: Real>(self, i1: R, growth: R) -> [R; 3] {
        [
            R::of(0.5 * self.modulus) * i1 / (i1 + R::of(1.0)),
            R::of(0.0),
            R::of(0.625 * self.modulus) * growth - R::of(0.75 * self.modulus),
        ]
    }

    #[inline(always)]
    fn curvatures<R: Real>(self, i1: R, _: R) -> [R; 2] {
        let beyond = i1 + R::of(1.0);
        [
            R::of(0.5 * self.modulus) / (beyond * beyond),
            R::of(0.625 * self.modulus),
        ]
    }

    fn change(self, [i1, _, growth]: [f64; 3], [more_i1, _, more]: [f64; 3]) -> [f64; 3] {
        [
            0.5 * self.modulus * (more_i1 - libm::log1p(more_i1 / (i1 + 1.0))),
            0.0,
            self.modulus * more * (0.3125 * (2.0 * growth + more) - 0.75),
        ]
    }
}
