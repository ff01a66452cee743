//! Kernels of St Venant-Kirchhoff tetrahedra with a signed volume term.

use super::linearize::Linearize;
use super::{DeformedLanes, GROUP, Stresses, Tetrahedra, batches};
use crate::elements::{ElasticLaw, LEAST_SHEAR};
use crate::simd::algebra::{
    Matrix3, Six, Vector, add_identity, add_outer, add_skew, add_times, cross, dot, largest, scaled, scaled_matrix,
    scaled_six, sum_six, times_transposed, times_upper, times_vector,
};
use crate::simd::{Lanes, Record, WithLanes};

/// Computes forces. With `NODAL`, the fourth component of a node's record is its pressure. With `LOADED`, each group
/// has an extra stress.
pub(super) struct FindForces<'a, const NODAL: bool, const LOADED: bool> {
    pub law: ElasticLaw,
    pub extra: &'a [Stresses],
    pub tetrahedra: Tetrahedra<'a>,
}

/// Computes stresses, one for each group.
pub(super) struct FindStresses<'a> {
    pub law: ElasticLaw,
    pub stresses: &'a mut [Stresses],
    pub tetrahedra: Tetrahedra<'a>,
}

pub(super) struct FindEnergy<'a> {
    pub law: ElasticLaw,
    pub tetrahedra: Tetrahedra<'a>,
}

pub(super) struct FindVolumeChanges<'a> {
    pub displacements: Option<*const Record>,
    pub tetrahedra: Tetrahedra<'a>,
}

/// The constants of a law in every lane.
#[derive(Clone, Copy)]
struct Constants<L> {
    lambda: L,
    mu: L,
    kappa: L,
}

impl<L: Lanes> Constants<L> {
    #[inline(always)]
    unsafe fn new(law: ElasticLaw) -> Self {
        // SAFETY: the caller guarantees the instruction set.
        unsafe {
            Self {
                lambda: L::splat(law.lambda),
                mu: L::splat(law.mu),
                kappa: L::splat(law.kappa),
            }
        }
    }

    /// The constants without volume resistance, if nodal pressures provide it.
    #[inline(always)]
    unsafe fn without_nodal_pressure(law: ElasticLaw) -> Self {
        // SAFETY: the same contract.
        unsafe {
            Self::new(if law.nodal_pressure {
                ElasticLaw { kappa: 0.0, ..law }
            } else {
                law
            })
        }
    }

    /// The stress S for twice a strain.
    #[inline(always)]
    unsafe fn stress(self, twice_strain: Six<L>, twice_trace: L) -> Six<L> {
        // SAFETY: the caller guarantees the instruction set.
        unsafe {
            let volumetric = self.lambda.mul(twice_trace).mul(L::splat(0.5));
            let [xx, xy, xz, yy, yz, zz] = twice_strain;
            [
                self.mu.mul_add(xx, volumetric),
                self.mu.mul(xy),
                self.mu.mul(xz),
                self.mu.mul_add(yy, volumetric),
                self.mu.mul(yz),
                self.mu.mul_add(zz, volumetric),
            ]
        }
    }
}

/// Upper bounds on the stiffness of tetrahedra relative to rest.
#[derive(Clone, Copy)]
struct StiffeningBound<L> {
    constants: Constants<L>,
    /// The modulus of terms that scale with the square of the largest stretch.
    modulus: L,
    /// The inverse stiffness at rest at the least and at the largest fraction of shear. The ratio is largest at the
    /// largest fraction for tension, and at the least for all other terms.
    inv_third: L,
    inv_one: L,
}

impl<L: Lanes> StiffeningBound<L> {
    #[inline(always)]
    unsafe fn new(law: ElasticLaw) -> Self {
        // SAFETY: the caller guarantees the instruction set.
        unsafe {
            Self {
                constants: Constants::new(law),
                modulus: L::splat(law.lambda.max(0.0) + 2.0 * law.mu * LEAST_SHEAR),
                inv_third: L::splat(1.0 / law.rest_stiffness_bound(LEAST_SHEAR)),
                inv_one: L::splat(1.0 / law.rest_stiffness_bound(1.0)),
            }
        }
    }

    /// The bound at this pressure, with an extra stress of this norm.
    #[inline(always)]
    unsafe fn stiffening(&self, deformed: &DeformedLanes<L>, pressure: L, extra_norm: L) -> L {
        // SAFETY: the caller guarantees the instruction set.
        unsafe {
            let Constants { lambda, mu, kappa } = self.constants;
            let (one, half) = (L::splat(1.0), L::splat(0.5));
            // An upper bound on the square of the largest stretch (Gershgorin).
            let [xx, xy, xz, yy, yz, zz] = deformed.twice_strain;
            let (xy, xz, yz) = (xy.abs(), xz.abs(), yz.abs());
            let stretch = xx.add(xy).add(xz).max(yy.add(xy).add(yz)).max(zz.add(xz).add(yz));
            let stretch = stretch.max(L::splat(0.0)).add(one);
            let tension = mu.mul(stretch.sub(one));
            let tension = lambda.mul(deformed.twice_trace).mul_add(half, tension);
            let tension = tension.max(L::splat(0.0)).add(extra_norm);
            // Pressure scales with the stretch; the root is below its tangents at 1, 9 and 81.
            let root = stretch.mul_add(half, half);
            let root = root.min(stretch.mul_add(L::splat(1.0 / 6.0), L::splat(1.5)));
            let root = root.min(stretch.mul_add(L::splat(1.0 / 18.0), L::splat(4.5)));
            let pressure_term = pressure.abs().mul(root);
            // The volume term scales with the square of the largest area ratio.
            let [ab, bc, ca] = deformed.cofactors;
            let areas = [
                dot(ab, ab),
                dot(ab, bc),
                dot(ab, ca),
                dot(bc, bc),
                dot(bc, ca),
                dot(ca, ca),
            ];
            let area = largest(areas).max(stretch);
            let stiffness = self.modulus.mul_add(stretch, pressure_term);
            let stiffness = kappa.mul_add(area, stiffness);
            let stiffness = stiffness.mul(self.inv_third);
            tension.mul_add(self.inv_one, stiffness)
        }
    }
}

impl<const NODAL: bool, const LOADED: bool> WithLanes for FindForces<'_, NODAL, LOADED> {
    type Output = f32;

    #[inline(always)]
    unsafe fn run<L: Lanes>(self) -> f32 {
        let Self { law, extra, tetrahedra } = self;
        // SAFETY: the same contract; corners are indices of positions and sums.
        unsafe {
            let constants = Constants::<L>::new(law);
            let bounds = StiffeningBound::<L>::new(law);
            let mut highest = L::splat(0.0);
            for (index, group) in tetrahedra.groups.iter().enumerate() {
                for first in batches::<L>() {
                    let inverse = Tetrahedra::inverse::<L>(group, first);
                    let volumes = Tetrahedra::volumes::<L>(group, first);
                    let deformed = tetrahedra.deformed(group, first, inverse);
                    let DeformedLanes {
                        gradient,
                        cofactors,
                        twice_strain,
                        twice_trace,
                        volume_strain,
                        pressure,
                    } = deformed;
                    let mut stress = constants.stress(twice_strain, twice_trace);
                    let mut pressure = if NODAL {
                        pressure
                    } else {
                        constants.kappa.mul(volume_strain)
                    };
                    let mut extra_norm = L::splat(0.0);
                    if LOADED {
                        let entries = extra[index].entries::<L>(first);
                        stress = sum_six(stress, entries);
                        extra_norm = largest(entries);
                        if !NODAL {
                            pressure = pressure.add(extra[index].pressures::<L>(first));
                        }
                    }
                    let minus = L::splat(0.0).sub(volumes);
                    let stress = scaled_six(stress, minus);
                    let stiffness = bounds.stiffening(&deformed, pressure, extra_norm);
                    let rates = L::load(group.rates.as_ptr().add(first));
                    highest = highest.max(stiffness.mul(rates));
                    let force_pressure = pressure.mul(minus);
                    let first_stress = scaled_matrix(cofactors, force_pressure);
                    tetrahedra.scatter_forces(group, first, add_times(first_stress, gradient, stress), inverse);
                }
            }
            let mut lane_bounds = [0.0_f32; GROUP];
            highest.store(lane_bounds.as_mut_ptr());
            lane_bounds.into_iter().fold(0.0, f32::max)
        }
    }
}

/// The law. With `LOADED`, each group has an extra stress.
pub(super) struct StVenantKirchhoff<'a, const LOADED: bool> {
    pub law: ElasticLaw,
    pub extra: &'a [Stresses],
    /// True if tangents are made positive semidefinite.
    pub is_clamped: bool,
}

impl<const LOADED: bool> StVenantKirchhoff<'_, LOADED> {
    /// The pressure of the volume term.
    #[inline(always)]
    unsafe fn pressure<L: Lanes>(&self, deformed: &DeformedLanes<L>, index: usize, first: usize) -> L {
        // SAFETY: the caller guarantees the instruction set.
        unsafe {
            let pressure = L::splat(self.law.kappa).mul(deformed.volume_strain);
            if LOADED {
                pressure.add(self.extra[index].pressures::<L>(first))
            } else {
                pressure
            }
        }
    }
}

/// The tangents of a lane batch.
#[derive(Clone, Copy)]
pub(super) struct Tangents<L> {
    constants: Constants<L>,
    gradient: Matrix3<L>,
    cofactors: Matrix3<L>,
    /// F F^T, the left Cauchy-Green strain.
    left_strain: Matrix3<L>,
    /// The stress; in a clamped tangent, shifted so that it is positive semidefinite.
    stress: Six<L>,
    /// The pressure of the volume term; 0 in a clamped tangent.
    pressure: L,
}

impl<const LOADED: bool> Linearize for StVenantKirchhoff<'_, LOADED> {
    type Tangent<L: Lanes> = Tangents<L>;

    #[inline(always)]
    unsafe fn tangent<L: Lanes>(&self, tetrahedra: &Tetrahedra, index: usize, first: usize) -> Tangents<L> {
        // SAFETY: the same contract.
        unsafe {
            let constants = Constants::<L>::new(self.law);
            let group = &tetrahedra.groups[index];
            let deformed = tetrahedra.deformed(group, first, Tetrahedra::inverse::<L>(group, first));
            let mut stress = constants.stress(deformed.twice_strain, deformed.twice_trace);
            if LOADED {
                stress = sum_six(stress, self.extra[index].entries::<L>(first));
            }
            let mut pressure = L::splat(0.0);
            if self.is_clamped {
                // The shift is Gershgorin's bound on the lowest eigenvalue.
                let (xy, xz, yz) = (stress[1].abs(), stress[2].abs(), stress[4].abs());
                let lift = [
                    xy.add(xz).sub(stress[0]),
                    xy.add(yz).sub(stress[3]),
                    xz.add(yz).sub(stress[5]),
                ];
                let lift = lift[0].max(lift[1]).max(lift[2]).max(L::splat(0.0));
                for diagonal in [0, 3, 5] {
                    stress[diagonal] = stress[diagonal].add(lift);
                }
            } else {
                pressure = self.pressure(&deformed, index, first);
            }
            Tangents {
                constants,
                gradient: deformed.gradient,
                cofactors: deformed.cofactors,
                left_strain: times_transposed(deformed.gradient),
                stress,
                pressure,
            }
        }
    }

    #[inline(always)]
    unsafe fn stress_change<L: Lanes>(
        tangent: Tangents<L>,
        change: Matrix3<L>,
        pressure_change: Option<L>,
    ) -> Matrix3<L> {
        // SAFETY: the same contract.
        unsafe {
            let ([a, b, c], [da, db, dc]) = (tangent.gradient, change);
            let twice_strain = [
                dot(a, da).add(dot(a, da)),
                dot(a, db).add(dot(b, da)),
                dot(a, dc).add(dot(c, da)),
                dot(b, db).add(dot(b, db)),
                dot(b, dc).add(dot(c, db)),
                dot(c, dc).add(dot(c, dc)),
            ];
            let twice_trace = twice_strain[0].add(twice_strain[3]).add(twice_strain[5]);
            let stress_change = tangent.constants.stress(twice_strain, twice_trace);
            let pressure_change = match pressure_change {
                Some(pressure_change) => pressure_change,
                None => {
                    let [ca, cb, cc] = tangent.cofactors;
                    let volume_change = dot(ca, da).add(dot(cb, db)).add(dot(cc, dc));
                    tangent.constants.kappa.mul(volume_change)
                }
            };
            let changed = scaled_matrix(tangent.cofactors, pressure_change);
            let changed = add_times(changed, tangent.gradient, stress_change);
            add_times(changed, change, tangent.stress)
        }
    }

    /// With `f = F g` and `c = cof F g`, the block is `lambda f f'^T + mu f' f^T + mu (g . g') F F^T + (g . S g') I +
    /// kappa c c'^T`, and the pressure times `F (g' x g)` crossed with the displacement.
    #[inline(always)]
    unsafe fn block<L: Lanes>(tangent: &Tangents<L>, [g, other_g]: [Vector<L>; 2]) -> Matrix3<L> {
        // SAFETY: the same contract.
        unsafe {
            let Constants { lambda, mu, kappa } = tangent.constants;
            let (f, other_f) = (
                times_vector(tangent.gradient, g),
                times_vector(tangent.gradient, other_g),
            );
            let (c, other_c) = (
                times_vector(tangent.cofactors, g),
                times_vector(tangent.cofactors, other_g),
            );
            let [xx, xy, xz, yy, yz, zz] = tangent.stress;
            let stressed = times_vector([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], other_g);
            let block = scaled_matrix(tangent.left_strain, mu.mul(dot(g, other_g)));
            let block = add_outer(block, scaled(f, lambda), other_f);
            let block = add_outer(block, scaled(other_f, mu), f);
            let block = add_outer(block, scaled(c, kappa), other_c);
            let turned = times_vector(tangent.gradient, cross(other_g, g));
            let block = add_skew(block, scaled(turned, tangent.pressure));
            add_identity(block, dot(g, stressed))
        }
    }

    #[inline(always)]
    unsafe fn stiffening<L: Lanes>(&self, tetrahedra: &Tetrahedra, index: usize, first: usize) -> L {
        // SAFETY: the same contract.
        unsafe {
            let group = &tetrahedra.groups[index];
            let deformed = tetrahedra.deformed(group, first, Tetrahedra::inverse::<L>(group, first));
            let extra_norm = if LOADED {
                largest(self.extra[index].entries::<L>(first))
            } else {
                L::splat(0.0)
            };
            let pressure = self.pressure(&deformed, index, first);
            StiffeningBound::new(self.law).stiffening(&deformed, pressure, extra_norm)
        }
    }
}

impl WithLanes for FindVolumeChanges<'_> {
    type Output = ();

    #[inline(always)]
    unsafe fn run<L: Lanes>(self) {
        let Self {
            displacements,
            tetrahedra,
        } = self;
        // SAFETY: the same contract; corners are indices of positions, displacements and sums.
        unsafe {
            let (zero, one) = (L::splat(0.0), L::splat(1.0));
            let quarter = L::splat(0.25);
            for group in tetrahedra.groups {
                for first in batches::<L>() {
                    let inverse = Tetrahedra::inverse::<L>(group, first);
                    let (edges, _) = Tetrahedra::edges::<L>(tetrahedra.positions, group, first);
                    let [a, b, c] = times_upper(edges, inverse);
                    let volume_strain = match displacements {
                        None => dot(a, cross(b, c)).sub(one),
                        Some(displacements) => {
                            let (edges, _) = Tetrahedra::edges::<L>(displacements, group, first);
                            let [da, db, dc] = times_upper(edges, inverse);
                            dot(da, cross(b, c)).add(dot(db, cross(c, a))).add(dot(dc, cross(a, b)))
                        }
                    };
                    let volumes = Tetrahedra::volumes::<L>(group, first);
                    let volume_strain = volume_strain.mul(volumes).mul(quarter);
                    for corners in &group.corners {
                        L::scatter_add_records(
                            tetrahedra.sums,
                            corners.as_ptr().add(first),
                            [volume_strain, zero, zero],
                        );
                    }
                }
            }
        }
    }
}

impl WithLanes for FindStresses<'_> {
    type Output = ();

    #[inline(always)]
    unsafe fn run<L: Lanes>(self) {
        let Self {
            law,
            stresses,
            tetrahedra,
        } = self;
        // SAFETY: the same contract; corners are indices of positions, and lanes are of a group.
        unsafe {
            let constants = Constants::<L>::without_nodal_pressure(law);
            for (group, stresses) in tetrahedra.groups.iter().zip(stresses) {
                for first in batches::<L>() {
                    let inverse = Tetrahedra::inverse::<L>(group, first);
                    let deformed = tetrahedra.deformed(group, first, inverse);
                    let [a, b, c, d, e, f] = constants.stress(deformed.twice_strain, deformed.twice_trace);
                    let pressure = constants.kappa.mul(deformed.volume_strain);
                    for (entry, to) in [a, b, c, d, e, f, pressure].into_iter().zip(&mut stresses.0) {
                        entry.store(to.as_mut_ptr().add(first));
                    }
                }
            }
        }
    }
}

impl WithLanes for FindEnergy<'_> {
    type Output = f64;

    #[inline(always)]
    unsafe fn run<L: Lanes>(self) -> f64 {
        let Self { law, tetrahedra } = self;
        let mut energy = 0.0;
        // SAFETY: the same contract; corners are indices of positions.
        unsafe {
            let constants = Constants::<L>::without_nodal_pressure(law);
            for group in tetrahedra.groups {
                for first in batches::<L>() {
                    let inverse = Tetrahedra::inverse::<L>(group, first);
                    let deformed = tetrahedra.deformed(group, first, inverse);
                    let [xx, xy, xz, yy, yz, zz] = deformed.twice_strain;
                    let off_diagonal = dot([xy, xz, yz], [xy, xz, yz]);
                    let squares = dot([xx, yy, zz], [xx, yy, zz]).add(off_diagonal).add(off_diagonal);
                    let trace = deformed.twice_trace;
                    let volume_strain = deformed.volume_strain;
                    // The strains are doubled, so their squares have a quarter of the usual factor.
                    let density = constants.lambda.mul(trace).mul(trace).mul(L::splat(0.125));
                    let density = constants.mu.mul(squares).mul_add(L::splat(0.25), density);
                    let volume_term = constants.kappa.mul(volume_strain).mul(volume_strain);
                    let density = volume_term.mul_add(L::splat(0.5), density);
                    let energies = density.mul(Tetrahedra::volumes::<L>(group, first));
                    let mut lane_energies = [0.0_f32; GROUP];
                    energies.store(lane_energies.as_mut_ptr());
                    energy += lane_energies.into_iter().map(f64::from).sum::<f64>();
                }
            }
        }
        energy
    }
}
