//! Stresses, tangents and bounds of any hyperelastic law, of its derivatives with I1, I2 and J.
//!
//! `P = 2 w1 F + 2 w2 F x cof F + wJ cof F`, with the product `A x B` of matrices of which `F x F = 2 cof F` (Bonet, Gil, Ortigosa 2015). The tangent is
//! `2 w1 dF + 4 w11 F (F : dF) + 2 w2 F x (F x dF) + X x dF + wJJ cof F (cof F : dF)` with `X = 2 w2 cof F + wJ F`: all but `X x dF` is positive.
//!
//! With principal stretches s and products c of two of them, that of all terms but w11 is known in the frame of the stretches: pairs of entries
//! across have `2 w1 + 2 w2 s_k² ± (2 w2 c_k + wJ s_k)`, and entries along have `2 w1 + 2 w2 (I1 + 2 s s^T - 3 s_k²) + wJ O + wJJ c c^T`, where O has s_k
//! beside its diagonal and is also `(c c^T - diag c²) / J`. With `wJ = -4 w2 + r` those along have `2 w1 + r O + wJJ c c^T` and
//! `2 w2 (I1 - s_k² + 2 (Oc - O))`, Oc with c_k beside its diagonal. Bounds on these make the tangent positive, and tell how stiff it is.

use super::Hyperelastic;
use crate::simd::Real;

/// The columns of a matrix.
pub(crate) type MatrixColumns<R> = [[R; 3]; 3];

/// A tetrahedron as it is deformed, with what its law has there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Strained<R> {
    /// F.
    pub gradient: MatrixColumns<R>,
    pub cofactors: MatrixColumns<R>,
    pub i1: R,
    /// J - 1.
    pub growth: R,
    /// w1, w2, wJ; the last with the pressure.
    slopes: [R; 3],
    /// w11, and wJJ with kappa.
    curvatures: [R; 2],
}

#[inline(always)]
fn dot<R: Real>([ax, ay, az]: [R; 3], [bx, by, bz]: [R; 3]) -> R {
    ax * bx + ay * by + az * bz
}

#[inline(always)]
fn cross<R: Real>([ax, ay, az]: [R; 3], [bx, by, bz]: [R; 3]) -> [R; 3] {
    [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx]
}

#[inline(always)]
fn sum<R: Real>([ax, ay, az]: [R; 3], [bx, by, bz]: [R; 3]) -> [R; 3] {
    [ax + bx, ay + by, az + bz]
}

#[inline(always)]
fn scaled<R: Real>([x, y, z]: [R; 3], factor: R) -> [R; 3] {
    [x * factor, y * factor, z * factor]
}

/// `sum + matrix * factor`
#[inline(always)]
fn add<R: Real>([x, y, z]: MatrixColumns<R>, [a, b, c]: MatrixColumns<R>, factor: R) -> MatrixColumns<R> {
    [
        sum(x, scaled(a, factor)),
        sum(y, scaled(b, factor)),
        sum(z, scaled(c, factor)),
    ]
}

/// The sum of the products of entries.
#[inline(always)]
pub(crate) fn inner<R: Real>([a, b, c]: MatrixColumns<R>, [x, y, z]: MatrixColumns<R>) -> R {
    dot(a, x) + dot(b, y) + dot(c, z)
}

/// A x B.
#[inline(always)]
pub(crate) fn product_of<R: Real>([a, b, c]: MatrixColumns<R>, [x, y, z]: MatrixColumns<R>) -> MatrixColumns<R> {
    [
        sum(cross(b, z), cross(y, c)),
        sum(cross(c, x), cross(z, a)),
        sum(cross(a, y), cross(x, b)),
    ]
}

/// No less than the largest eigenvalue of the products of the columns (Gershgorin).
#[inline(always)]
fn largest<R: Real>([a, b, c]: MatrixColumns<R>) -> R {
    let (ab, ac, bc) = (dot(a, b).size(), dot(a, c).size(), dot(b, c).size());
    let rows = [dot(a, a) + ab + ac, dot(b, b) + ab + bc, dot(c, c) + ac + bc];
    rows[0].greater(rows[1]).greater(rows[2])
}

/// No less than a root, and no more than some 15 % above it from 1/20 to 150: the lowest of its tangents at 1/9, 1, 9 and 81.
#[inline(always)]
fn root<R: Real>(square: R) -> R {
    let at = |middle: f64| square * R::of(0.5 / middle) + R::of(0.5 * middle);
    at(1.0 / 3.0).lesser(at(1.0)).lesser(at(3.0)).lesser(at(9.0))
}

/// The greater of `A g + B` at a third and at 1, over the denominators there.
#[inline(always)]
fn relative<R: Real>(shear: R, volume: R, [least, most]: [R; 2]) -> R {
    let third = (shear * R::of(1.0 / 3.0) + volume) * least;
    third.greater((shear + volume) * most)
}

/// Bounds on the stretches.
struct StretchBounds<R> {
    /// The largest, and its square.
    stretch: R,
    square: R,
    /// The square of the largest product of two.
    area: R,
    /// The lowest product of two; only where J is above 0.
    least_product: R,
    /// The square of the least.
    least_square: R,
    /// The largest eigenvalue of O, and that of O with c_k off its diagonal, less.
    across: R,
    between: R,
    i2: R,
    volume: R,
    /// The same, above 0.
    positive: R,
    /// 0 where J is above a thousandth, large where it is below 0.
    inverted: R,
}

impl<R: Real> Strained<R> {
    /// Of a law beside `kappa/2 (J - 1)²` with the pressure that this has now.
    #[inline(always)]
    pub fn new(law: impl Hyperelastic, gradient: MatrixColumns<R>, kappa: R) -> Self {
        let [a, b, c] = gradient;
        let cofactors = [cross(b, c), cross(c, a), cross(a, b)];
        let i1 = inner(gradient, gradient);
        let growth = dot(gradient[0], cofactors[0]) - R::of(1.0);
        let [w1, w2, wj] = law.slopes(i1, growth);
        let [w11, wjj] = law.curvatures(i1, growth);
        Self {
            gradient,
            cofactors,
            i1,
            growth,
            slopes: [w1, w2, wj + kappa * growth],
            curvatures: [w11, wjj + kappa],
        }
    }

    /// With so much pressure more, Pa.
    #[inline(always)]
    pub fn pressed(mut self, more: R) -> Self {
        self.slopes[2] = self.slopes[2] + more;
        self
    }

    /// With volume resisting so much more, Pa, by a pressure that it already has.
    #[inline(always)]
    pub fn with_volume(mut self, kappa: R) -> Self {
        self.curvatures[1] = self.curvatures[1] + kappa;
        self
    }

    /// A change of the stress with that of a pressure on top, Pa.
    #[inline(always)]
    pub fn with_pressure_change(&self, changed: MatrixColumns<R>, pressure: R) -> MatrixColumns<R> {
        add(changed, self.cofactors, pressure)
    }

    /// P, the first stress of Piola and Kirchhoff, Pa.
    #[inline(always)]
    pub fn stress(&self) -> MatrixColumns<R> {
        let [w1, w2, wj] = self.slopes;
        let (two, zero) = (R::of(2.0), [[R::of(0.0); 3]; 3]);
        let stress = add(zero, self.gradient, two * w1);
        let stress = add(stress, product_of(self.gradient, self.cofactors), two * w2);
        add(stress, self.cofactors, wj)
    }

    /// How the stress changes with the deformation, to first order, Pa, and with this `lift` on top.
    #[inline(always)]
    pub fn stress_change(&self, change: MatrixColumns<R>, lift: R) -> MatrixColumns<R> {
        let ([w1, w2, wj], [w11, wjj]) = (self.slopes, self.curvatures);
        let (two, zero) = (R::of(2.0), [[R::of(0.0); 3]; 3]);
        let turns = add(add(zero, self.cofactors, two * w2), self.gradient, wj);
        let changed = add(product_of(turns, change), change, two * w1 + lift);
        let areas = product_of(self.gradient, change);
        let changed = add(changed, product_of(self.gradient, areas), two * w2);
        let along = R::of(4.0) * w11 * inner(self.gradient, change);
        let changed = add(changed, self.gradient, along);
        add(changed, self.cofactors, wjj * inner(self.cofactors, change))
    }

    #[inline(always)]
    fn bounds(&self) -> StretchBounds<R> {
        let (zero, least) = (R::of(0.0), R::of(1e-3));
        let square = largest(self.gradient).greater(R::of(1e-12));
        let stretch = root(square);
        let volume = self.growth + R::of(1.0);
        let inverted = (least - volume).greater(zero) * R::of(1e6);
        let low = volume / square;
        let i2 = inner(self.cofactors, self.cofactors);
        // The sum of the squares of s_k - c_k, by 4/3.
        let apart = (self.i1 + i2 - R::of(6.0) * volume) * R::of(4.0 / 3.0);
        StretchBounds {
            stretch,
            square,
            area: largest(self.cofactors),
            least_product: (volume / stretch - inverted).greater(zero - R::of(0.5) * self.i1),
            least_square: low * low,
            across: R::of(2.0) * root(self.i1 * R::of(1.0 / 3.0)),
            between: root(apart).lesser(R::of(0.1) * root(R::of(100.0) * apart)),
            i2,
            volume,
            positive: volume.greater(least),
            inverted,
        }
    }

    /// The same with no more pressure than its tangent can have, and what has to be added to the latter that nothing of it is negative, Pa. At
    /// rest that is all of the pressure and nothing. What pressure does beyond draws one way as much as it pushes another.
    #[inline(always)]
    pub fn positive(mut self) -> (Self, R) {
        let ([w1, w2, wj], [_, wjj]) = (self.slopes, self.curvatures);
        let (zero, two) = (R::of(0.0), R::of(2.0));
        let (of_i1, of_i2) = (two * w1, two * w2);
        let at = self.bounds();
        let high = of_i1 / at.across;
        let across = (of_i1 + of_i2 * (at.least_square + at.least_product).greater(zero)) / at.stretch;
        let along = high.greater(at.volume.greater(zero) * (wjj + of_i1 / at.i2)) + two * of_i2;
        let wj = wj.greater(zero - across.lesser(along)).lesser(high);
        self.slopes[2] = wj;
        let size = wj.size();
        let pulled = wj.greater(zero) * at.stretch;
        let across = (size * at.stretch - of_i2 * (at.least_square + at.least_product))
            .greater(pulled + of_i2 * (at.square - at.least_square));
        // O with its eigenvalues, or as what is along c c^T and beside it.
        let rest = wj + two * of_i2;
        let pulled = rest.greater(zero) * at.across;
        let apart = (rest.size() - at.volume * wjj).greater(zero) * at.i2 / at.positive + rest.size() * at.inverted;
        let along = (rest.size() * at.across).lesser(apart.greater(pulled));
        let along = along + of_i2 * (two * at.between + at.square - self.i1).greater(zero);
        (self, (across.greater(along) - of_i1).greater(zero))
    }

    /// How much stiffer it is than at rest at most, at least 1. It is `(A g + B) / (K + 2 mu g)`, of which a part g from a third to 1 counts as shear.
    /// `least` and `most` are 1 over the denominators at a third and at 1.
    #[inline(always)]
    pub fn stiffening(&self, least: R, most: R) -> R {
        let ([w1, w2, wj], [w11, wjj]) = (self.slopes, self.curvatures);
        let (zero, one, two) = (R::of(0.0), R::of(1.0), R::of(2.0));
        let (of_i1, of_i2, size) = (two * w1, two * w2, wj.size());
        let at = self.bounds();
        let pressed = size * at.stretch - of_i2 * at.least_product.greater(zero);
        let pulled = of_i2 * at.square + wj.greater(zero) * at.stretch;
        let across = of_i1 + of_i2 * at.square + pressed.greater(pulled);
        let along = of_i1 + of_i2 * (self.i1 - at.least_square + two * at.between);
        let rest = wj + two * of_i2;
        let strains = R::of(4.0) * w11 * at.square;
        // O as above.
        let apart = relative(
            across.greater(along + rest.size() * (at.area / at.positive + at.inverted)),
            (wjj + rest / at.positive).greater(zero) * at.area + strains,
            [least, most],
        );
        let shear = across.greater(along + rest.size() * at.across);
        let whole = relative(shear, wjj * at.area + strains, [least, most]);
        apart.lesser(whole).greater(one)
    }
}
