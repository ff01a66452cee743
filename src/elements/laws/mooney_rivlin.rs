//! Mooney and Rivlin's law for any J, also where a tetrahedron is inverted.
//!
//! `w = c1 (I1 - 3) + c2 (I2 - 3) - (2 c1 + 4 c2)(J - 1) + c1 (J - 1)²`: that of Ciarlet and Geymonat with `J - 1` instead of `ln J`, as the stable
//! neo-Hookean law has it. It is convex in F, cof F and J. Where volume is kept it is the law of Mooney and Rivlin.

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
        let (both, ratio) = (0.5 * f64::from(mu), f64::from(ratio));
        Self {
            c1: both * (1.0 - ratio),
            c2: both * ratio,
        }
    }

    /// The stress at rest of what I1 and I2 do, Pa.
    fn stress(self) -> f64 {
        2.0 * self.c1 + 4.0 * self.c2
    }
}

impl Hyperelastic for MooneyRivlin {
    #[inline(always)]
    fn slopes<R: Real>(self, _: R, growth: R) -> [R; 3] {
        [
            R::of(self.c1),
            R::of(self.c2),
            R::of(2.0 * self.c1) * growth - R::of(self.stress()),
        ]
    }

    #[inline(always)]
    fn curvatures<R: Real>(self, _: R, _: R) -> [R; 2] {
        [R::of(0.0), R::of(2.0 * self.c1)]
    }

    fn change(self, [_, _, growth]: [f64; 3], [more_i1, more_i2, more]: [f64; 3]) -> [f64; 3] {
        [
            self.c1 * more_i1,
            self.c2 * more_i2,
            more * (self.c1 * (2.0 * growth + more) - self.stress()),
        ]
    }
}
