//! The elastic law of one tetrahedron in `f64`: the energies and forces that kernels compute for several, and second
//! derivatives.

use super::rates::LEAST_SHEAR;
use crate::base::{cross_matrix, outer, trace};
use crate::codec::saved;
use crate::def::ElementLaw;
use glam::{DMat3, DVec3};

use super::laws::{Hyperelastic, MatrixColumns, StrainState, tensor_cross, with_hyperelastic};

/// A St Venant-Kirchhoff law with a signed volume term, or a hyperelastic law of [`super::laws`], Pa.
///
/// The energy of a St Venant-Kirchhoff tetrahedron is `V (lambda/2 (tr E)² + mu tr E² + kappa/2 (J - 1)²)`. A
/// hyperelastic law uses mu, with all of Lamé's first parameter as kappa.
///
/// Without the volume term, a flattened tetrahedron inverts and stays inverted. Kikuuwe, Tabuchi, Yamamoto 2009 write
/// the energy in squared edge lengths. The volume term takes its kappa from lambda, so Young's modulus and Poisson's
/// ratio at small strains stay the same.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ElasticLaw {
    pub lambda: f32,
    pub mu: f32,
    pub kappa: f32,
    /// True for average nodal pressure (Bonet, Burton 1998): the pressure of a tetrahedron is the mean of its nodes'
    /// pressures. The volume term belongs to nodes, `kappa/2 V (V'/V - 1)²`, V and V' being a quarter of the rest and
    /// current volumes around a node. Linear tetrahedra that each keep their volume lock (Irving, Schroeder, Fedkiw
    /// 2007).
    pub nodal_pressure: bool,
    pub form: ElementLaw,
}

saved! { ElasticLaw { lambda, mu, kappa, nodal_pressure, form } }

/// Poisson's ratio from which average nodal pressure is used.
const NODAL_PRESSURE_FROM: f32 = 0.4;

impl ElasticLaw {
    /// Creates the law from Young's modulus, Pa, and Poisson's ratio.
    ///
    /// A St Venant-Kirchhoff tetrahedron recovers from inversion if kappa is above about (lambda + 2 mu) / 8. Kappa is
    /// twice that, or lambda if that is larger.
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
            nodal_pressure: poisson_ratio >= NODAL_PRESSURE_FROM,
            form,
        }
    }

    /// A law that resists volume change only, with kappa in Pa.
    pub fn volume_only(kappa: f32) -> Self {
        Self {
            lambda: 0.0,
            mu: 0.0,
            kappa,
            nodal_pressure: false,
            form: ElementLaw::StVenantKirchhoff,
        }
    }

    /// True for a law of [`super::laws`], which has no history.
    pub fn is_hyperelastic(&self) -> bool {
        self.form != ElementLaw::StVenantKirchhoff
    }

    /// The law with all stiffnesses multiplied by `factor`.
    pub fn scaled(&self, factor: f32) -> Self {
        Self {
            lambda: self.lambda * factor,
            mu: self.mu * factor,
            kappa: self.kappa * factor,
            ..*self
        }
    }

    /// The energy density at these stresses, for strains so small that all laws agree, Pa.
    pub fn energy_density(&self, TetStress { stress, pressure }: TetStress) -> f64 {
        let (lambda, mu, kappa) = (f64::from(self.lambda), f64::from(self.mu), f64::from(self.kappa));
        let mut energy = 0.0;
        if mu > 0.0 {
            let trace = trace(&stress);
            energy +=
                (inner_product(&stress, &stress) - lambda / (3.0 * lambda + 2.0 * mu) * trace * trace) / (4.0 * mu);
        }
        if kappa > 0.0 && !self.nodal_pressure {
            energy += 0.5 * pressure * pressure / kappa;
        }
        energy
    }

    /// The P-wave modulus lambda + 2 mu at small strains, with kappa as a part of lambda, Pa.
    pub fn p_wave_modulus(&self) -> f32 {
        self.lambda + 2.0 * self.mu + self.kappa
    }

    /// An upper bound on the stiffness of a tetrahedron at rest, for this fraction of shear, Pa.
    pub fn rest_stiffness_bound(&self, shear_fraction: f32) -> f32 {
        self.lambda.max(0.0) + self.kappa + 2.0 * self.mu * shear_fraction
    }
}

/// The stress of a tetrahedron: elastic stress, or extra stress that is added to it, Pa.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TetStress {
    /// The second Piola-Kirchhoff stress S.
    pub stress: DMat3,
    /// The pressure of the volume term.
    pub pressure: f64,
}

saved! { TetStress { stress, pressure } }

impl TetStress {
    pub const ZERO: Self = Self {
        stress: DMat3::ZERO,
        pressure: 0.0,
    };

    /// Creates it from the entries 00, 01, 02, 11, 12, 22 and the pressure.
    pub fn from_components([xx, xy, xz, yy, yz, zz, pressure]: [f64; 7]) -> Self {
        Self {
            stress: DMat3::from_cols_array(&[xx, xy, xz, xy, yy, yz, xz, yz, zz]),
            pressure,
        }
    }
}

/// The rest shape of a tetrahedron.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RestTet {
    /// The inverse of the edge matrix, in a frame where it is upper triangular, 1/m. Edges start at the first corner.
    pub inverse: DMat3,
    /// m³
    pub volume: f64,
}

saved! { RestTet { inverse, volume } }

impl RestTet {
    /// Creates the rest shape from the edges from the first corner to the others, of either orientation, m. The
    /// inverse of a degenerate tetrahedron is not finite.
    pub fn from_edges(edges: DMat3) -> Self {
        // Gram-Schmidt: the edges are a rotation times this matrix.
        let [a, b, c] = [edges.x_axis, edges.y_axis, edges.z_axis];
        let x = a.normalize();
        let across = b - x * b.dot(x);
        let y = across.normalize();
        let z = x.cross(y);
        let triangular = DMat3::from_cols(
            DVec3::new(a.length(), 0.0, 0.0),
            DVec3::new(b.dot(x), across.length(), 0.0),
            DVec3::new(c.dot(x), c.dot(y), c.dot(z)),
        );
        Self {
            inverse: triangular.inverse(),
            volume: edges.determinant().abs() / 6.0,
        }
    }

    /// The gradients of the corners' shape functions, 1/m.
    pub fn gradients(&self) -> [DVec3; 4] {
        let rows = self.inverse.transpose();
        let others = [rows.x_axis, rows.y_axis, rows.z_axis];
        [-(others[0] + others[1] + others[2]), others[0], others[1], others[2]]
    }
}

/// The deformation of a tetrahedron.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DeformedTet {
    gradient: DMat3,
    cofactors: DMat3,
    /// The Green strain E.
    strain: DMat3,
    /// The volumetric strain J - 1.
    volume_strain: f64,
    /// Pa
    pressure: f64,
    extra: TetStress,
    volume: f64,
    lambda: f64,
    mu: f64,
    /// 0 with average nodal pressure.
    kappa: f64,
    law: ElasticLaw,
    /// The state of a hyperelastic law without `pressure`; `None` for St Venant-Kirchhoff.
    strain_state: Option<StrainState<f64>>,
}

impl DeformedTet {
    /// Creates it from the deformed edges from the first corner to the others, m.
    pub fn new(law: ElasticLaw, rest: &RestTet, edges: DMat3) -> Self {
        let gradient = edges * rest.inverse;
        let [a, b, c] = [gradient.x_axis, gradient.y_axis, gradient.z_axis];
        let volume_strain = gradient.determinant() - 1.0;
        let kappa = if law.nodal_pressure { 0.0 } else { f64::from(law.kappa) };
        Self {
            gradient,
            cofactors: DMat3::from_cols(b.cross(c), c.cross(a), a.cross(b)),
            strain: (gradient.transpose() * gradient - DMat3::IDENTITY) * 0.5,
            volume_strain,
            pressure: kappa * volume_strain,
            extra: TetStress::ZERO,
            volume: rest.volume,
            lambda: f64::from(law.lambda),
            mu: f64::from(law.mu),
            kappa,
            law,
            strain_state: with_hyperelastic!(law, |of| Some(StrainState::new(of, columns(&gradient), kappa)), None),
        }
    }

    /// The state of a hyperelastic law with `pressure`.
    fn strain_state(&self) -> Option<StrainState<f64>> {
        let added_pressure = self.pressure - self.kappa * self.volume_strain;
        self.strain_state
            .map(|strain_state| strain_state.with_added_pressure(added_pressure))
    }

    /// Adds an extra stress.
    pub fn with_extra_stress(self, extra: TetStress) -> Self {
        Self {
            pressure: self.pressure + extra.pressure,
            extra,
            ..self
        }
    }

    /// The elastic stress, without the extra stress.
    pub fn elastic(&self) -> TetStress {
        TetStress {
            stress: self.elastic_stress(),
            pressure: self.pressure - self.extra.pressure,
        }
    }

    /// Replaces the pressure by the mean pressure of the nodes, Pa.
    pub fn with_pressure(self, pressure: f64) -> Self {
        Self { pressure, ..self }
    }

    /// The volume minus the rest volume, m³.
    pub fn volume_change(&self) -> f64 {
        self.volume * self.volume_strain
    }

    /// The derivative of the volume with respect to the position of a corner, by its shape function's gradient, m².
    pub fn area(&self, gradient: DVec3) -> DVec3 {
        self.cofactors * gradient * self.volume
    }

    fn trace(&self) -> f64 {
        trace(&self.strain)
    }

    /// The second Piola-Kirchhoff stress S, Pa.
    fn stress(&self) -> DMat3 {
        self.elastic_stress() + self.extra.stress
    }

    fn elastic_stress(&self) -> DMat3 {
        self.strain * (2.0 * self.mu) + DMat3::from_diagonal(DVec3::splat(self.lambda * self.trace()))
    }

    /// The elastic energy, J.
    pub fn energy(&self) -> f64 {
        let volume_energy = 0.5 * self.kappa * self.volume_strain.powi(2);
        let density = with_hyperelastic!(self.law, |of| of.energy(self.invariants()), {
            let squares = inner_product(&self.strain, &self.strain);
            0.5 * self.lambda * self.trace().powi(2) + self.mu * squares
        });
        self.volume * (density + volume_energy)
    }

    /// The invariants I1, I2 and J - 1.
    fn invariants(&self) -> [f64; 3] {
        let squares = |matrix: &DMat3| inner_product(matrix, matrix);
        [squares(&self.gradient), squares(&self.cofactors), self.volume_strain]
    }

    /// The exact changes when the edges grow by `added`: of the energies of strain, of volume and of the extra stress,
    /// J, and of the volume, m³. Computed without cancellation.
    pub fn change(&self, rest: &RestTet, added: DMat3) -> [f64; 4] {
        let added = added * rest.inverse;
        let [a, b, c] = [added.x_axis, added.y_axis, added.z_axis];
        let change_cofactors = DMat3::from_cols(b.cross(c), c.cross(a), a.cross(b));
        let half_change = self.gradient.transpose() * added;
        let strain = (half_change + half_change.transpose() + added.transpose() * added) * 0.5;
        let trace = trace(&strain);
        let volume_strain = inner_product(&self.cofactors, &added)
            + inner_product(&self.gradient, &change_cofactors)
            + added.determinant();
        let strain_sum = self.strain * 2.0 + strain;
        let volume_energy = 0.5 * self.kappa * volume_strain * (2.0 * self.volume_strain + volume_strain);
        let [strain_term, volume_term] = with_hyperelastic!(
            self.law,
            |of| {
                let areas = matrix(tensor_cross(columns(&self.gradient), columns(&added))) + change_cofactors;
                let di1 = 2.0 * inner_product(&self.gradient, &added) + inner_product(&added, &added);
                let di2 = 2.0 * inner_product(&self.cofactors, &areas) + inner_product(&areas, &areas);
                let [of_i1, of_i2, volume_term] = of.change(self.invariants(), [di1, di2, volume_strain]);
                [of_i1 + of_i2, volume_term + volume_energy]
            },
            {
                let elastic = 0.5 * self.lambda * trace * (2.0 * self.trace() + trace)
                    + self.mu * inner_product(&strain_sum, &strain);
                [elastic + volume_energy, 0.0]
            }
        );
        let extra_change = inner_product(&self.extra.stress, &strain) + self.extra.pressure * volume_strain;
        [strain_term, volume_term, extra_change, volume_strain].map(|change| self.volume * change)
    }

    /// An upper bound on the stiffness relative to the stiffness at rest, at this pressure.
    /// `TetrahedronGroups::forces` computes the same bound for several tetrahedra.
    pub fn stiffening(&self, law: ElasticLaw, pressure: f64) -> f64 {
        let [lambda, mu, kappa] = [law.lambda, law.mu, law.kappa].map(f64::from);
        let stretch = 1.0 + largest_row(&(self.strain * 2.0), |entry| entry).max(0.0);
        let abs_row_sum = |matrix: &DMat3| largest_row(matrix, f64::abs);
        let tension = (lambda * self.trace() + mu * (stretch - 1.0)).max(0.0) + abs_row_sum(&self.extra.stress);
        let root_tangents = [(0.5, 0.5), (1.5, 1.0 / 6.0), (4.5, 1.0 / 18.0)];
        let root_tangents = root_tangents.map(|(start, slope)| start + slope * stretch);
        let pressure_term = pressure.abs() * root_tangents.into_iter().fold(f64::INFINITY, f64::min);
        let area = abs_row_sum(&(self.cofactors.transpose() * self.cofactors)).max(stretch);
        let shear_modulus = lambda.max(0.0) + 2.0 * mu * f64::from(LEAST_SHEAR);
        (shear_modulus * stretch + pressure_term + kappa * area) / f64::from(law.rest_stiffness_bound(LEAST_SHEAR))
            + tension / f64::from(law.rest_stiffness_bound(1.0))
    }

    /// The pressure of the volume term, without nodal pressures, Pa.
    pub fn pressure(&self) -> f64 {
        self.pressure
    }

    /// The force on a corner, by its shape function's gradient, N.
    pub fn force(&self, gradient: DVec3) -> DVec3 {
        if let Some(strain_state) = self.strain_state() {
            return -(matrix(strain_state.stress()) * gradient) * self.volume;
        }
        let stress = self.gradient * self.stress() + self.cofactors * self.pressure;
        -(stress * gradient) * self.volume
    }

    /// The block of the stiffness matrix for two corners, by their shape functions' gradients, N/m.
    pub fn stiffness(&self, a: DVec3, b: DVec3) -> DMat3 {
        if let Some(strain_state) = self.strain_state() {
            return self.hyperelastic_stiffness(&strain_state, 0.0, [a, b]);
        }
        let turned = cross_matrix(-(self.gradient * a.cross(b)));
        self.st_venant_stiffness(self.stress(), a, b) + turned * (self.volume * self.pressure)
    }

    /// The block of the stiffness matrix, made positive semidefinite by leaving out the destabilizing part of the
    /// pressure.
    pub fn clamped_stiffness(&self, a: DVec3, b: DVec3) -> DMat3 {
        if let Some(strain_state) = self.strain_state() {
            let (strain_state, lift) = strain_state.clamped();
            return self.hyperelastic_stiffness(&strain_state, lift, [a, b]);
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
        self.st_venant_stiffness(stress + DMat3::from_diagonal(DVec3::splat(lift)), a, b)
    }

    /// The block of a hyperelastic law, with this shift of the tangent.
    fn hyperelastic_stiffness(&self, strain_state: &StrainState<f64>, lift: f64, [a, b]: [DVec3; 2]) -> DMat3 {
        let column = |axis: DVec3| {
            let change = columns(&outer(axis, b));
            matrix(strain_state.stress_change(change, lift)) * a * self.volume
        };
        DMat3::from_cols(column(DVec3::X), column(DVec3::Y), column(DVec3::Z))
    }

    fn st_venant_stiffness(&self, stress: DMat3, a: DVec3, b: DVec3) -> DMat3 {
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

/// The Frobenius inner product.
fn inner_product(a: &DMat3, b: &DMat3) -> f64 {
    a.x_axis.dot(b.x_axis) + a.y_axis.dot(b.y_axis) + a.z_axis.dot(b.z_axis)
}

/// The largest Gershgorin row sum of a symmetric matrix: the diagonal entry mapped by `diagonal`, plus the absolute
/// off-diagonal entries.
fn largest_row(matrix: &DMat3, diagonal: impl Fn(f64) -> f64) -> f64 {
    let [x, y, z] = [matrix.x_axis, matrix.y_axis, matrix.z_axis];
    let rows = [
        diagonal(x.x) + x.y.abs() + x.z.abs(),
        diagonal(y.y) + x.y.abs() + y.z.abs(),
        diagonal(z.z) + x.z.abs() + y.z.abs(),
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
            let law = ElasticLaw::new(5000.0, nu, form);
            for _ in 0..20 {
                let rest = DMat3::from_cols(vector(&mut random), vector(&mut random), vector(&mut random));
                if rest.determinant().abs() < 0.1 {
                    continue;
                }
                let rest = RestTet::from_edges(rest);
                let corners = [0; 4].map(|_| vector(&mut random));
                let at = |corners: [DVec3; 4]| {
                    let [a, b, c, d] = corners;
                    DeformedTet::new(law, &rest, DMat3::from_cols(b - a, c - a, d - a))
                };
                let gradients = rest.gradients();
                let size = at(corners).energy();
                let more = DMat3::from_cols(vector(&mut random), vector(&mut random), vector(&mut random));
                let [a, b, c, d] = corners;
                let then = [a, b + more.x_axis, c + more.y_axis, d + more.z_axis];
                let [strain_term, volume_term, _, volume_strain] = at(corners).change(&rest, more);
                let change = strain_term + volume_term;
                let grown = at(then).volume_change() - at(corners).volume_change();
                assert!(
                    (volume_strain - grown).abs() < 1e-12 * (1.0 + grown.abs()),
                    "{volume_strain} {grown}"
                );
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
