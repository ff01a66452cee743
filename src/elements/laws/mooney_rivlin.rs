//! The Mooney-Rivlin law for any J, including inverted tetrahedra.
//!
//! `w = c1 (I1 - 3) + c2 (I2 - 3) - (2 c1 + 4 c2)(J - 1) + c1 (J - 1)²` is the law of Ciarlet and Geymonat with `J -
//! 1` instead of `ln J`, like the stable neo-Hookean law. It is convex in F, cof F and J. At constant volume it is the
//! law of Mooney and Rivlin.

use super::Hyperelastic;
use crate::simd::Real;

#[derive(Clone, Copy, Debug)]
pub(crate) struct MooneyRivlin {
    /// Pa
    c1: f64,
    c2: f64,
}

impl MooneyRivlin {
    pub fn new(mu: f32, ratio: f32) -> Self {
        let (half_mu, ratio) = (0.5 * f64::from(mu), f64::from(ratio));
        Self {
            c1: half_mu * (1.0 - ratio),
            c2: half_mu * ratio,
        }
    }

    /// The pressure that cancels the stress of I1 and I2 at rest, Pa.
    fn rest_pressure(self) -> f64 {
        2.0 * self.c1 + 4.0 * self.c2
    }
}

impl Hyperelastic for MooneyRivlin {
    #[inline(always)]
    fn first_derivatives<R: Real>(self, _: R, volume_strain: R) -> [R; 3] {
        [
            R::from_f64(self.c1),
            R::from_f64(self.c2),
            R::from_f64(2.0 * self.c1) * volume_strain - R::from_f64(self.rest_pressure()),
        ]
    }

    #[inline(always)]
    fn second_derivatives<R: Real>(self, _: R, _: R) -> [R; 2] {
        [R::from_f64(0.0), R::from_f64(2.0 * self.c1)]
    }

    fn change(self, [_, _, volume_strain]: [f64; 3], [di1, di2, dj]: [f64; 3]) -> [f64; 3] {
        [
            self.c1 * di1,
            self.c2 * di2,
            dj * (self.c1 * (2.0 * volume_strain + dj) - self.rest_pressure()),
        ]
    }
}
