//! The law of a tetrahedron, one at a time and in `f64`: what kernels work out for many, and second derivatives.

use super::rates::LEAST_SHEAR;
use crate::base::{cross_matrix, outer, trace};
use crate::codec::saved;
use crate::def::ElementLaw;
use glam::{DMat3, DVec3};

use super::laws::{Hyperelastic, MatrixColumns, Strained, product_of, with_hyperelastic};

/// St Venant and Kirchhoff's law with a signed volume term, Pa: the energy of a tetrahedron is
/// `V (lambda/2 (tr E)² + mu tr E² + kappa/2 (J - 1)²)`; or one of [`super::laws`] with mu, beside all of lambda as kappa.
///
/// Without the last, a tetrahedron that is pressed flat turns inside out and stays so (Kikuuwe, Tabuchi, Yamamoto 2009 have the energy as
/// one of squared lengths of edges). What the volume term takes is not in lambda, so that Young's modulus and Poisson's ratio at small
/// strains stay what they are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Law {
    pub lambda: f32,
    pub mu: f32,
    pub kappa: f32,
    /// Whether the volume term is one of all tetrahedra about a node together, `kappa/2 V (V'/V - 1)²` with V a quarter of their volumes
    /// and V' what it becomes: linear tetrahedra that keep their volume each can hardly move (Irving, Schroeder, Fedkiw 2007; the
    /// pressure of a tetrahedron is the mean of its nodes', Bonet, Burton 1998).
    pub rings: bool,
    pub form: ElementLaw,
}

saved! { Law { lambda, mu, kappa, rings, form } }

/// Poisson's ratio from which volume is kept by rings.
const RINGS_FROM: f32 = 0.4;

impl Law {
    /// That of Young's modulus, Pa, and Poisson's ratio.
    ///
    /// Inversion ends where kappa is above some (lambda + 2 mu) / 8; twice that is used, and all of lambda where it is more.
    pub fn new(young_modulus: f32, poisson_ratio: f32, form: ElementLaw) -> Self {
        let (e, nu) = (f64::from(young_modulus), f64::from(poisson_ratio));
        let lambda = e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu));
        let mu = e / (2.0 * (1.0 + nu));
        let kappa = match form {
            ElementLaw::StVenantKirchhoff => lambda.max(0.25 * (lambda + 2.0 * mu)),
            _ => lambda,
        };
        Self {
            lambda: (lambda - kappa) as f32,
            mu: mu as f32,
            kappa: kappa as f32,
            rings: poisson_ratio >= RINGS_FROM,
            form,
        }
    }

    /// That of volume alone, Pa.
    pub fn of_volume(kappa: f32) -> Self {
        Self {
            lambda: 0.0,
            mu: 0.0,
            kappa,
            rings: false,
            form: ElementLaw::StVenantKirchhoff,
        }
    }

    /// Whether it is one of [`super::laws`], of which nothing is remembered.
    pub fn is_hyperelastic(&self) -> bool {
        self.form != ElementLaw::StVenantKirchhoff
    }

    /// So many times as stiff.
    pub fn times(&self, factor: f32) -> Self {
        Self {
            lambda: self.lambda * factor,
            mu: self.mu * factor,
            kappa: self.kappa * factor,
            ..*self
        }
    }

    /// The energy per volume where these are the stresses, and strains small enough to be the same whichever law they follow, Pa.
    pub fn energy_of(&self, Load { stress, pressure }: Load) -> f64 {
        let (lambda, mu, kappa) = (f64::from(self.lambda), f64::from(self.mu), f64::from(self.kappa));
        let mut energy = 0.0;
        if mu > 0.0 {
            let trace = trace(&stress);
            energy += (product(&stress, &stress) - lambda / (3.0 * lambda + 2.0 * mu) * trace * trace) / (4.0 * mu);
        }
        if kappa > 0.0 && !self.rings {
            energy += 0.5 * pressure * pressure / kappa;
        }
        energy
    }

    /// What resists a small stretch with its sides held, Pa: lambda + 2 mu with all of lambda.
    pub fn whole(&self) -> f32 {
        self.lambda + 2.0 * self.mu + self.kappa
    }

    /// At most so stiff is a tetrahedron at rest, Pa, of which shear counts as this part.
    pub fn stiffest(&self, part: f32) -> f32 {
        self.lambda.max(0.0) + self.kappa + 2.0 * self.mu * part
    }
}

/// What acts in a tetrahedron on top of its elastic stresses, Pa.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Load {
    /// On top of S.
    pub stress: DMat3,
    /// On top of the pressure of the volume term.
    pub pressure: f64,
}

saved! { Load { stress, pressure } }

impl Load {
    pub const NONE: Self = Self {
        stress: DMat3::ZERO,
        pressure: 0.0,
    };

    /// Of the entries 00, 01, 02, 11, 12, 22 and the pressure.
    pub fn of([xx, xy, xz, yy, yz, zz, pressure]: [f64; 7]) -> Self {
        Self {
            stress: DMat3::from_cols_array(&[xx, xy, xz, xy, yy, yz, xz, yz, zz]),
            pressure,
        }
    }
}

/// A tetrahedron at rest.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rest {
    /// The inverse of the edges from its first corner, in a frame where it is upper triangular, 1/m.
    pub inverse: DMat3,
    /// m³
    pub volume: f64,
}

saved! { Rest { inverse, volume } }

impl Rest {
    /// With these edges from its first corner to the others, m, in any order of hands. One without a volume has an inverse that is not
    /// finite.
    pub fn of(edges: DMat3) -> Self {
        // Gram and Schmidt: the edges are a rotation times this.
        let [a, b, c] = [edges.x_axis, edges.y_axis, edges.z_axis];
        let x = a.normalize();
        let across = b - x * b.dot(x);
        let y = across.normalize();
        let z = x.cross(y);
        let upright = DMat3::from_cols(
            DVec3::new(a.length(), 0.0, 0.0),
            DVec3::new(b.dot(x), across.length(), 0.0),
            DVec3::new(c.dot(x), c.dot(y), c.dot(z)),
        );
        Self {
            inverse: upright.inverse(),
            volume: edges.determinant().abs() / 6.0,
        }
    }

    /// How the deformation changes with each corner's place: the gradients of the corners' functions, 1/m.
    pub fn gradients(&self) -> [DVec3; 4] {
        let rows = self.inverse.transpose();
        let others = [rows.x_axis, rows.y_axis, rows.z_axis];
        [-(others[0] + others[1] + others[2]), others[0], others[1], others[2]]
    }
}

/// A tetrahedron as it is deformed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Deformed {
    gradient: DMat3,
    cofactors: DMat3,
    /// E.
    strain: DMat3,
    /// J - 1.
    growth: f64,
    /// Pa
    pressure: f64,
    load: Load,
    volume: f64,
    lambda: f64,
    mu: f64,
    /// 0 where volume is kept by rings.
    kappa: f64,
    law: Law,
    /// Under a hyperelastic law, without its pressure.
    strained: Option<Strained<f64>>,
}

impl Deformed {
    /// With these edges from its first corner to the others, m.
    pub fn new(law: Law, rest: &Rest, edges: DMat3) -> Self {
        let gradient = edges * rest.inverse;
        let [a, b, c] = [gradient.x_axis, gradient.y_axis, gradient.z_axis];
        let growth = gradient.determinant() - 1.0;
        let kappa = if law.rings { 0.0 } else { f64::from(law.kappa) };
        Self {
            gradient,
            cofactors: DMat3::from_cols(b.cross(c), c.cross(a), a.cross(b)),
            strain: (gradient.transpose() * gradient - DMat3::IDENTITY) * 0.5,
            growth,
            pressure: kappa * growth,
            load: Load::NONE,
            volume: rest.volume,
            lambda: f64::from(law.lambda),
            mu: f64::from(law.mu),
            kappa,
            law,
            strained: with_hyperelastic!(law, |of| Some(Strained::new(of, columns(&gradient), kappa)), None),
        }
    }

    /// Under a hyperelastic law, with all of its pressure.
    fn strained(&self) -> Option<Strained<f64>> {
        let more = self.pressure - self.kappa * self.growth;
        self.strained.map(|strained| strained.pressed(more))
    }

    /// With these on top of its stresses.
    pub fn loaded(self, load: Load) -> Self {
        Self {
            pressure: self.pressure + load.pressure,
            load,
            ..self
        }
    }

    /// Its elastic stresses.
    pub fn elastic(&self) -> Load {
        Load {
            stress: self.elastic_stress(),
            pressure: self.pressure - self.load.pressure,
        }
    }

    /// With the pressure of its rings, Pa.
    pub fn under(self, pressure: f64) -> Self {
        Self { pressure, ..self }
    }

    /// How much larger it is than at rest, m³.
    pub fn swelling(&self) -> f64 {
        self.volume * self.growth
    }

    /// How its volume grows with the place of a corner whose function has this gradient, m².
    pub fn area(&self, gradient: DVec3) -> DVec3 {
        self.cofactors * gradient * self.volume
    }

    fn trace(&self) -> f64 {
        trace(&self.strain)
    }

    /// The stress S, Pa.
    fn stress(&self) -> DMat3 {
        self.elastic_stress() + self.load.stress
    }

    fn elastic_stress(&self) -> DMat3 {
        self.strain * (2.0 * self.mu) + DMat3::from_diagonal(DVec3::splat(self.lambda * self.trace()))
    }

    /// What is elastic, J.
    pub fn energy(&self) -> f64 {
        let swollen = 0.5 * self.kappa * self.growth.powi(2);
        let density = with_hyperelastic!(self.law, |of| of.energy(self.invariants()), {
            let squares = product(&self.strain, &self.strain);
            0.5 * self.lambda * self.trace().powi(2) + self.mu * squares
        });
        self.volume * (density + swollen)
    }

    /// I1, I2 and J - 1.
    fn invariants(&self) -> [f64; 3] {
        let squares = |matrix: &DMat3| product(matrix, matrix);
        [squares(&self.gradient), squares(&self.cofactors), self.growth]
    }

    /// How the energy of the strain and of the volume, and beside them that of the load, change where the edges become longer by this, J, and the
    /// volume, m³, to the last digits of the changes.
    pub fn change(&self, rest: &Rest, more: DMat3) -> [f64; 4] {
        let more = more * rest.inverse;
        let [a, b, c] = [more.x_axis, more.y_axis, more.z_axis];
        let cofactors = DMat3::from_cols(b.cross(c), c.cross(a), a.cross(b));
        let half = self.gradient.transpose() * more;
        let strain = (half + half.transpose() + more.transpose() * more) * 0.5;
        let trace = trace(&strain);
        let growth = product(&self.cofactors, &more) + product(&self.gradient, &cofactors) + more.determinant();
        let both = self.strain * 2.0 + strain;
        let swollen = 0.5 * self.kappa * growth * (2.0 * self.growth + growth);
        let [of_strain, of_volume] = with_hyperelastic!(
            self.law,
            |of| {
                let areas = matrix(product_of(columns(&self.gradient), columns(&more))) + cofactors;
                let more_i1 = 2.0 * product(&self.gradient, &more) + product(&more, &more);
                let more_i2 = 2.0 * product(&self.cofactors, &areas) + product(&areas, &areas);
                let [of_i1, of_i2, of_volume] = of.change(self.invariants(), [more_i1, more_i2, growth]);
                [of_i1 + of_i2, of_volume + swollen]
            },
            {
                let elastic =
                    0.5 * self.lambda * trace * (2.0 * self.trace() + trace) + self.mu * product(&both, &strain);
                [elastic + swollen, 0.0]
            }
        );
        let of_load = product(&self.load.stress, &strain) + self.load.pressure * growth;
        [of_strain, of_volume, of_load, growth].map(|change| self.volume * change)
    }

    /// How many times as stiff as at rest it is at most, where its volume is kept by this pressure: what `TetrahedronGroups::forces` bounds frequencies
    /// with, one at a time.
    pub fn stiffening(&self, law: Law, pressure: f64) -> f64 {
        let [lambda, mu, kappa] = [law.lambda, law.mu, law.kappa].map(f64::from);
        let stretch = 1.0 + largest_row(&(self.strain * 2.0), |entry| entry).max(0.0);
        let size = |matrix: &DMat3| largest_row(matrix, f64::abs);
        let tension = (lambda * self.trace() + mu * (stretch - 1.0)).max(0.0) + size(&self.load.stress);
        let root = [(0.5, 0.5), (1.5, 1.0 / 6.0), (4.5, 1.0 / 18.0)];
        let root = root.map(|(start, slope)| start + slope * stretch);
        let pressed = pressure.abs() * root.into_iter().fold(f64::INFINITY, f64::min);
        let area = size(&(self.cofactors.transpose() * self.cofactors)).max(stretch);
        let along = lambda.max(0.0) + 2.0 * mu * f64::from(LEAST_SHEAR);
        (along * stretch + pressed + kappa * area) / f64::from(law.stiffest(LEAST_SHEAR))
            + tension / f64::from(law.stiffest(1.0))
    }

    /// The pressure that keeps its volume, Pa, without that of rings.
    pub fn pressure(&self) -> f64 {
        self.pressure
    }

    /// The force on a corner whose function has this gradient, N.
    pub fn force(&self, gradient: DVec3) -> DVec3 {
        if let Some(strained) = self.strained() {
            return -(matrix(strained.stress()) * gradient) * self.volume;
        }
        let stress = self.gradient * self.stress() + self.cofactors * self.pressure;
        -(stress * gradient) * self.volume
    }

    /// How much the force on one corner lessens with the place of another, N/m, by the gradients of their functions.
    pub fn stiffness(&self, a: DVec3, b: DVec3) -> DMat3 {
        if let Some(strained) = self.strained() {
            return self.stiffness_of(&strained, 0.0, [a, b]);
        }
        let turned = cross_matrix(-(self.gradient * a.cross(b)));
        self.stiffness_under(self.stress(), a, b) + turned * (self.volume * self.pressure)
    }

    /// The same, positive semidefinite: pressure pushes nothing sideways.
    pub fn clamped_stiffness(&self, a: DVec3, b: DVec3) -> DMat3 {
        if let Some(strained) = self.strained() {
            let (strained, lift) = strained.positive();
            return self.stiffness_of(&strained, lift, [a, b]);
        }
        let stress = self.stress();
        let [x, y, z] = [stress.x_axis, stress.y_axis, stress.z_axis].map(DVec3::abs);
        // Gershgorin's bound on the lowest eigenvalue.
        let lift = [
            x.y + x.z - stress.x_axis.x,
            y.x + y.z - stress.y_axis.y,
            z.x + z.y - stress.z_axis.z,
        ];
        let lift = lift.into_iter().fold(0.0, f64::max);
        self.stiffness_under(stress + DMat3::from_diagonal(DVec3::splat(lift)), a, b)
    }

    /// That of a hyperelastic law with this lift.
    fn stiffness_of(&self, strained: &Strained<f64>, lift: f64, [a, b]: [DVec3; 2]) -> DMat3 {
        let column = |axis: DVec3| {
            let change = columns(&outer(axis, b));
            matrix(strained.stress_change(change, lift)) * a * self.volume
        };
        DMat3::from_cols(column(DVec3::X), column(DVec3::Y), column(DVec3::Z))
    }

    fn stiffness_under(&self, stress: DMat3, a: DVec3, b: DVec3) -> DMat3 {
        let [fa, fb] = [self.gradient * a, self.gradient * b];
        let [ca, cb] = [self.cofactors * a, self.cofactors * b];
        let squares = self.gradient * self.gradient.transpose();
        let matrix = squares * (self.mu * a.dot(b))
            + outer(fb, fa) * self.mu
            + outer(fa, fb) * self.lambda
            + outer(ca, cb) * self.kappa
            + DMat3::from_diagonal(DVec3::splat(a.dot(stress * b)));
        matrix * self.volume
    }
}

/// The sum of the products of entries.
fn product(a: &DMat3, b: &DMat3) -> f64 {
    a.x_axis.dot(b.x_axis) + a.y_axis.dot(b.y_axis) + a.z_axis.dot(b.z_axis)
}

/// The largest sum of a row of a symmetric matrix: its diagonal entry by `on`, the others by their sizes (Gershgorin).
fn largest_row(matrix: &DMat3, on: impl Fn(f64) -> f64) -> f64 {
    let [x, y, z] = [matrix.x_axis, matrix.y_axis, matrix.z_axis];
    let rows = [
        on(x.x) + x.y.abs() + x.z.abs(),
        on(y.y) + x.y.abs() + y.z.abs(),
        on(z.z) + x.z.abs() + y.z.abs(),
    ];
    rows.into_iter().fold(f64::NEG_INFINITY, f64::max)
}

fn columns(matrix: &DMat3) -> MatrixColumns<f64> {
    matrix.to_cols_array_2d()
}

fn matrix(columns: MatrixColumns<f64>) -> DMat3 {
    DMat3::from_cols_array_2d(&columns)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    fn vector(random: &mut Random) -> DVec3 {
        DVec3::from_array([0; 3].map(|_| f64::from(random.unit()) * 2.0 - 1.0))
    }

    #[test]
    fn forces_and_stiffnesses_are_derivatives_of_the_energy() {
        let mut random = Random(5);
        let forms = [
            ElementLaw::StVenantKirchhoff,
            ElementLaw::NeoHookean,
            ElementLaw::MooneyRivlin { ratio: 0.3 },
        ];
        for (nu, form) in [0.0, 0.3, 0.39].into_iter().flat_map(|nu| forms.map(|form| (nu, form))) {
            let law = Law::new(5000.0, nu, form);
            for _ in 0..20 {
                let rest = DMat3::from_cols(vector(&mut random), vector(&mut random), vector(&mut random));
                if rest.determinant().abs() < 0.1 {
                    continue;
                }
                let rest = Rest::of(rest);
                let corners = [0; 4].map(|_| vector(&mut random));
                let at = |corners: [DVec3; 4]| {
                    let [a, b, c, d] = corners;
                    Deformed::new(law, &rest, DMat3::from_cols(b - a, c - a, d - a))
                };
                let gradients = rest.gradients();
                let size = at(corners).energy();
                let more = DMat3::from_cols(vector(&mut random), vector(&mut random), vector(&mut random));
                let [a, b, c, d] = corners;
                let then = [a, b + more.x_axis, c + more.y_axis, d + more.z_axis];
                let [of_strain, of_volume, _, growth] = at(corners).change(&rest, more);
                let change = of_strain + of_volume;
                let grown = at(then).swelling() - at(corners).swelling();
                assert!((growth - grown).abs() < 1e-12 * (1.0 + grown.abs()), "{growth} {grown}");
                let expected = at(then).energy() - size;
                assert!(
                    (change - expected).abs() < 1e-12 * (size + at(then).energy()),
                    "{change} {expected}"
                );
                for corner in 0..4 {
                    for axis in 0..3 {
                        const STEP: f64 = 1e-5;
                        let moved = |by: f64| {
                            let mut corners = corners;
                            corners[corner][axis] += by;
                            at(corners)
                        };
                        let (more, less) = (moved(STEP), moved(-STEP));
                        let force = at(corners).force(gradients[corner])[axis];
                        let slope = (less.energy() - more.energy()) / (2.0 * STEP);
                        assert!((force - slope).abs() < 1e-6 * size, "{force} {slope}");
                        for other in 0..4 {
                            let change = less.force(gradients[other]) - more.force(gradients[other]);
                            let expected = change / (2.0 * STEP);
                            let stiffness = at(corners).stiffness(gradients[other], gradients[corner]);
                            assert!((stiffness.col(axis) - expected).length() < 1e-5 * size);
                        }
                    }
                }
            }
        }
    }
}
