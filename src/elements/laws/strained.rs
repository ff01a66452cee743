//! Stress, tangent and bounds of a hyperelastic law, from its derivatives with respect to I1, I2 and J.
//!
//! `P = 2 w1 F + 2 w2 F x cof F + wJ cof F`, where the tensor cross product `A x B` has `F x F = 2 cof F` (Bonet, Gil,
//! Ortigosa 2015). The tangent is `2 w1 dF + 4 w11 F (F : dF) + 2 w2 F x (F x dF) + X x dF + wJJ cof F (cof F : dF)`
//! with `X = 2 w2 cof F + wJ F`. All terms but `X x dF` are positive semidefinite.
//!
//! Let s be the principal stretches, and c the products of two of them. In the principal frame, all terms but w11 have
//! closed forms. Pairs of off-diagonal entries have the eigenvalues `2 w1 + 2 w2 s_k² ± (2 w2 c_k + wJ s_k)`. The
//! diagonal entries have the matrix `2 w1 + 2 w2 (I1 + 2 s s^T - 3 s_k²) + wJ O + wJJ c c^T`. Here O has the
//! off-diagonal entries s_k; it is also `(c c^T - diag c²) / J`. With `wJ = -4 w2 + r` the matrix is the sum of `2 w1 +
//! r O + wJJ c c^T` and `2 w2 (I1 - s_k² + 2 (Oc - O))`, where Oc has the off-diagonal entries c_k. Bounds on these
//! terms serve to make the tangent positive semidefinite, and to bound its stiffness.

use super::Hyperelastic;
use crate::simd::Real;

/// A matrix as three columns.
pub(crate) type MatrixColumns<R> = [[R; 3]; 3];

/// A deformation, and the derivatives of the law there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StrainState<R> {
    /// The deformation gradient F.
    pub gradient: MatrixColumns<R>,
    pub cofactors: MatrixColumns<R>,
    pub i1: R,
    /// The volumetric strain J - 1.
    pub volume_strain: R,
    /// w1, w2 and wJ, including kappa and pressure.
    first_derivatives: [R; 3],
    /// w11, and wJJ including kappa.
    second_derivatives: [R; 2],
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

#[inline(always)]
fn times<R: Real>([a, b, c]: MatrixColumns<R>, [x, y, z]: [R; 3]) -> [R; 3] {
    sum(sum(scaled(a, x), scaled(b, y)), scaled(c, z))
}

/// `matrix + a b^T`
#[inline(always)]
fn add_outer<R: Real>([x, y, z]: MatrixColumns<R>, a: [R; 3], b: [R; 3]) -> MatrixColumns<R> {
    [
        sum(x, scaled(a, b[0])),
        sum(y, scaled(a, b[1])),
        sum(z, scaled(a, b[2])),
    ]
}

/// The Frobenius inner product.
#[inline(always)]
pub(crate) fn inner<R: Real>([a, b, c]: MatrixColumns<R>, [x, y, z]: MatrixColumns<R>) -> R {
    dot(a, x) + dot(b, y) + dot(c, z)
}

/// The tensor cross product A x B.
#[inline(always)]
pub(crate) fn tensor_cross<R: Real>([a, b, c]: MatrixColumns<R>, [x, y, z]: MatrixColumns<R>) -> MatrixColumns<R> {
    [
        sum(cross(b, z), cross(y, c)),
        sum(cross(c, x), cross(z, a)),
        sum(cross(a, y), cross(x, b)),
    ]
}

/// An upper bound on the largest eigenvalue of A^T A (Gershgorin).
#[inline(always)]
fn largest_eigenvalue<R: Real>([a, b, c]: MatrixColumns<R>) -> R {
    let (ab, ac, bc) = (dot(a, b).abs(), dot(a, c).abs(), dot(b, c).abs());
    let rows = [dot(a, a) + ab + ac, dot(b, b) + ab + bc, dot(c, c) + ac + bc];
    rows[0].max(rows[1]).max(rows[2])
}

/// An upper bound on the square root, at most about 15 % too high from 1/20 to 150: the lowest of its tangents at 1/9,
/// 1, 9 and 81.
#[inline(always)]
fn sqrt_bound<R: Real>(square: R) -> R {
    let tangent = |middle: f64| square * R::from_f64(0.5 / middle) + R::from_f64(0.5 * middle);
    tangent(1.0 / 3.0).min(tangent(1.0)).min(tangent(3.0)).min(tangent(9.0))
}

/// The maximum of `(A g + B) / (K + 2 mu g)` over g from 1/3 to 1, attained at an end. `inv_third` and `inv_one` are
/// the inverse denominators.
#[inline(always)]
fn max_ratio<R: Real>(shear: R, volume: R, [inv_third, inv_one]: [R; 2]) -> R {
    let third = (shear * R::from_f64(1.0 / 3.0) + volume) * inv_third;
    third.max((shear + volume) * inv_one)
}

/// Bounds on the principal stretches.
struct StretchBounds<R> {
    /// The largest stretch, and its square.
    stretch: R,
    square: R,
    /// The square of the largest product of two stretches.
    area: R,
    /// The lowest product of two stretches, for J above 0 only.
    least_product: R,
    /// The square of the smallest stretch.
    least_square: R,
    /// Upper bounds on the largest eigenvalues of O and of Oc - O.
    o_eigenvalue: R,
    oc_minus_o: R,
    i2: R,
    volume: R,
    /// J, at least 0.001.
    positive_volume: R,
    /// 0 for J above 0.001, large for J below 0.
    inversion: R,
}

impl<R: Real> StrainState<R> {
    /// The state of a law and the volume term `kappa/2 (J - 1)²` at this deformation gradient.
    #[inline(always)]
    pub fn new(law: impl Hyperelastic, gradient: MatrixColumns<R>, kappa: R) -> Self {
        let [a, b, c] = gradient;
        let cofactors = [cross(b, c), cross(c, a), cross(a, b)];
        let i1 = inner(gradient, gradient);
        let volume_strain = dot(gradient[0], cofactors[0]) - R::from_f64(1.0);
        let [w1, w2, wj] = law.first_derivatives(i1, volume_strain);
        let [w11, wjj] = law.second_derivatives(i1, volume_strain);
        Self {
            gradient,
            cofactors,
            i1,
            volume_strain,
            first_derivatives: [w1, w2, wj + kappa * volume_strain],
            second_derivatives: [w11, wjj + kappa],
        }
    }

    /// Adds a pressure, Pa.
    #[inline(always)]
    pub fn with_added_pressure(mut self, added: R) -> Self {
        self.first_derivatives[2] = self.first_derivatives[2] + added;
        self
    }

    /// Adds the stiffness of a volume term whose pressure is already included, Pa.
    #[inline(always)]
    pub fn with_volume_stiffness(mut self, kappa: R) -> Self {
        self.second_derivatives[1] = self.second_derivatives[1] + kappa;
        self
    }

    /// Adds the stress change of a pressure change to `changed`, Pa.
    #[inline(always)]
    pub fn with_pressure_change(&self, changed: MatrixColumns<R>, pressure: R) -> MatrixColumns<R> {
        add(changed, self.cofactors, pressure)
    }

    /// The first Piola-Kirchhoff stress P, Pa.
    #[inline(always)]
    pub fn stress(&self) -> MatrixColumns<R> {
        let [w1, w2, wj] = self.first_derivatives;
        let (two, zero) = (R::from_f64(2.0), [[R::from_f64(0.0); 3]; 3]);
        let stress = add(zero, self.gradient, two * w1);
        let stress = add(stress, tensor_cross(self.gradient, self.cofactors), two * w2);
        add(stress, self.cofactors, wj)
    }

    /// The matrix X of the tangent, `2 w2 cof F + wJ F`.
    #[inline(always)]
    fn cross_factor(&self) -> MatrixColumns<R> {
        let [_, w2, wj] = self.first_derivatives;
        let zero = [[R::from_f64(0.0); 3]; 3];
        add(add(zero, self.cofactors, R::from_f64(2.0) * w2), self.gradient, wj)
    }

    /// The stress change to first order, Pa, with the tangent shifted by `lift`.
    #[inline(always)]
    pub fn stress_change(&self, change: MatrixColumns<R>, lift: R) -> MatrixColumns<R> {
        let ([w1, w2, _], [w11, wjj]) = (self.first_derivatives, self.second_derivatives);
        let two = R::from_f64(2.0);
        let changed = add(tensor_cross(self.cross_factor(), change), change, two * w1 + lift);
        let areas = tensor_cross(self.gradient, change);
        let changed = add(changed, tensor_cross(self.gradient, areas), two * w2);
        let strain_term = R::from_f64(4.0) * w11 * inner(self.gradient, change);
        let changed = add(changed, self.gradient, strain_term);
        add(changed, self.cofactors, wjj * inner(self.cofactors, change))
    }

    /// `g' . dP g` for a change `dF = u g'^T`, as a matrix that multiplies u, with the tangent shifted by `lift`. With
    /// `f = F g` and `c = cof F g`, it is `((2 w1 + lift) g . g' + 2 w2 (I1 g . g' - f . f')) I + 2 w2 (f f'^T - g . g'
    /// F F^T) + 4 w11 f f'^T + wJJ c c'^T`, and `X (g' x g)` crossed with u.
    #[inline(always)]
    pub fn tangent_block(&self, [g, other_g]: [[R; 3]; 2], lift: R) -> MatrixColumns<R> {
        let ([w1, w2, _], [w11, wjj]) = (self.first_derivatives, self.second_derivatives);
        let (two, zero) = (R::from_f64(2.0), R::from_f64(0.0));
        let two_w2 = two * w2;
        let [a, b, c] = self.gradient;
        let (f, other_f) = (times(self.gradient, g), times(self.gradient, other_g));
        let product = dot(g, other_g);
        let along = (two * w1 + lift) * product + two_w2 * (self.i1 * product - dot(f, other_f));
        let [x, y, z] = times(self.cross_factor(), cross(other_g, g));
        let skew = [[along, z, zero - y], [zero - z, along, x], [y, zero - x, along]];
        let block = add_outer(skew, scaled(a, zero - two_w2 * product), a);
        let block = add_outer(block, scaled(b, zero - two_w2 * product), b);
        let block = add_outer(block, scaled(c, zero - two_w2 * product), c);
        let block = add_outer(block, scaled(f, two_w2 + R::from_f64(4.0) * w11), other_f);
        add_outer(
            block,
            scaled(times(self.cofactors, g), wjj),
            times(self.cofactors, other_g),
        )
    }

    #[inline(always)]
    fn bounds(&self) -> StretchBounds<R> {
        let (zero, min_volume) = (R::from_f64(0.0), R::from_f64(1e-3));
        let square = largest_eigenvalue(self.gradient).max(R::from_f64(1e-12));
        let stretch = sqrt_bound(square);
        let volume = self.volume_strain + R::from_f64(1.0);
        let inversion = (min_volume - volume).max(zero) * R::from_f64(1e6);
        let smallest = volume / square;
        let i2 = inner(self.cofactors, self.cofactors);
        // 4/3 of the sum of (s_k - c_k)².
        let distance_sq = (self.i1 + i2 - R::from_f64(6.0) * volume) * R::from_f64(4.0 / 3.0);
        StretchBounds {
            stretch,
            square,
            area: largest_eigenvalue(self.cofactors),
            least_product: (volume / stretch - inversion).max(zero - R::from_f64(0.5) * self.i1),
            least_square: smallest * smallest,
            o_eigenvalue: R::from_f64(2.0) * sqrt_bound(self.i1 * R::from_f64(1.0 / 3.0)),
            oc_minus_o: sqrt_bound(distance_sq).min(R::from_f64(0.1) * sqrt_bound(R::from_f64(100.0) * distance_sq)),
            i2,
            volume,
            positive_volume: volume.max(min_volume),
            inversion,
        }
    }

    /// Limits the pressure so that the tangent stays nearly positive, and returns the shift that makes it positive
    /// semidefinite, Pa. At rest nothing is limited and the shift is 0. The pressure beyond the limit pulls in one
    /// direction as much as it pushes in another.
    #[inline(always)]
    pub fn clamped(mut self) -> (Self, R) {
        let ([w1, w2, wj], [_, wjj]) = (self.first_derivatives, self.second_derivatives);
        let (zero, two) = (R::from_f64(0.0), R::from_f64(2.0));
        let (two_w1, two_w2) = (two * w1, two * w2);
        let bounds = self.bounds();
        let max_wj = two_w1 / bounds.o_eigenvalue;
        let off_diagonal = (two_w1 + two_w2 * (bounds.least_square + bounds.least_product).max(zero)) / bounds.stretch;
        let diagonal = max_wj.max(bounds.volume.max(zero) * (wjj + two_w1 / bounds.i2)) + two * two_w2;
        let wj = wj.max(zero - off_diagonal.min(diagonal)).min(max_wj);
        self.first_derivatives[2] = wj;
        let size = wj.abs();
        let tension = wj.max(zero) * bounds.stretch;
        let off_diagonal = (size * bounds.stretch - two_w2 * (bounds.least_square + bounds.least_product))
            .max(tension + two_w2 * (bounds.square - bounds.least_square));
        // O is bounded by its eigenvalues, or by its form along c and across it.
        let r = wj + two * two_w2;
        let tension = r.max(zero) * bounds.o_eigenvalue;
        let form_bound =
            (r.abs() - bounds.volume * wjj).max(zero) * bounds.i2 / bounds.positive_volume + r.abs() * bounds.inversion;
        let diagonal = (r.abs() * bounds.o_eigenvalue).min(form_bound.max(tension));
        let diagonal = diagonal + two_w2 * (two * bounds.oc_minus_o + bounds.square - self.i1).max(zero);
        (self, (off_diagonal.max(diagonal) - two_w1).max(zero))
    }

    /// An upper bound on the stiffness relative to rest, at least 1: the maximum of `(A g + B) / (K + 2 mu g)` over
    /// shear fractions g from 1/3 to 1. `inv_third` and `inv_one` are the inverse denominators at 1/3 and 1.
    #[inline(always)]
    pub fn stiffening(&self, inv_third: R, inv_one: R) -> R {
        let ([w1, w2, wj], [w11, wjj]) = (self.first_derivatives, self.second_derivatives);
        let (zero, one, two) = (R::from_f64(0.0), R::from_f64(1.0), R::from_f64(2.0));
        let (two_w1, two_w2, size) = (two * w1, two * w2, wj.abs());
        let bounds = self.bounds();
        let compression = size * bounds.stretch - two_w2 * bounds.least_product.max(zero);
        let tension = two_w2 * bounds.square + wj.max(zero) * bounds.stretch;
        let off_diagonal = two_w1 + two_w2 * bounds.square + compression.max(tension);
        let diagonal = two_w1 + two_w2 * (self.i1 - bounds.least_square + two * bounds.oc_minus_o);
        let r = wj + two * two_w2;
        let strains = R::from_f64(4.0) * w11 * bounds.square;
        // O is bounded as in [`Self::clamped`].
        let split_bound = max_ratio(
            off_diagonal.max(diagonal + r.abs() * (bounds.area / bounds.positive_volume + bounds.inversion)),
            (wjj + r / bounds.positive_volume).max(zero) * bounds.area + strains,
            [inv_third, inv_one],
        );
        let shear = off_diagonal.max(diagonal + r.abs() * bounds.o_eigenvalue);
        let joint_bound = max_ratio(shear, wjj * bounds.area + strains, [inv_third, inv_one]);
        split_bound.min(joint_bound).max(one)
    }
}
