//! Kernels of St Venant-Kirchhoff tetrahedra with a signed volume term.

use super::{DeformedLanes, GROUP, Stresses, Tetrahedra, batches};
use crate::elements::{ElasticLaw, LEAST_SHEAR};
use crate::simd::algebra::{Six, add_times, cross, dot, largest, scaled_matrix, scaled_six, sum_six, times_upper};
use crate::simd::{Lanes, Record, WithLanes};

/// Computes forces. With `NODAL`, the fourth component of a node's record is its pressure. With `LOADED`, each group
/// has an extra stress.
pub(super) struct FindForces<'a, const NODAL: bool, const LOADED: bool> {
    pub law: ElasticLaw,
    pub extra: &'a [Stresses],
    pub tetrahedra: Tetrahedra<'a>,
}

pub(super) struct FindDifferentials<'a, const NODAL: bool, const LOADED: bool> {
    pub law: ElasticLaw,
    pub extra: &'a [Stresses],
    pub displacements: *const Record,
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

impl<const NODAL: bool, const LOADED: bool> WithLanes for FindForces<'_, NODAL, LOADED> {
    type Output = f32;

    #[inline(always)]
    unsafe fn run<L: Lanes>(self) -> f32 {
        let Self { law, extra, tetrahedra } = self;
        // SAFETY: the same contract; corners are indices of positions and sums.
        unsafe {
            let constants = Constants::<L>::new(law);
            let (one, half) = (L::splat(1.0), L::splat(0.5));
            // The ratio to the stiffness at rest is largest at the largest shear fraction for tension, and at the
            // least for all other terms.
            let inv_third = L::splat(1.0 / law.rest_stiffness_bound(LEAST_SHEAR));
            let inv_one = L::splat(1.0 / law.rest_stiffness_bound(1.0));
            let modulus = L::splat(law.lambda.max(0.0) + 2.0 * law.mu * LEAST_SHEAR);
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
                    // An upper bound on the square of the largest stretch (Gershgorin).
                    let [xx, xy, xz, yy, yz, zz] = twice_strain;
                    let (xy, xz, yz) = (xy.abs(), xz.abs(), yz.abs());
                    let stretch = xx.add(xy).add(xz).max(yy.add(xy).add(yz)).max(zz.add(xz).add(yz));
                    let stretch = stretch.max(L::splat(0.0)).add(one);
                    let tension = constants.mu.mul(stretch.sub(one));
                    let tension = constants.lambda.mul(twice_trace).mul_add(half, tension);
                    let tension = tension.max(L::splat(0.0)).add(extra_norm);
                    // Pressure scales with the stretch; the root is below its tangents at 1, 9 and 81.
                    let root = stretch.mul_add(half, half);
                    let root = root.min(stretch.mul_add(L::splat(1.0 / 6.0), L::splat(1.5)));
                    let root = root.min(stretch.mul_add(L::splat(1.0 / 18.0), L::splat(4.5)));
                    let pressure_term = pressure.abs().mul(root);
                    // The volume term scales with the square of the largest area ratio.
                    let [ab, bc, ca] = cofactors;
                    let areas = [
                        dot(ab, ab),
                        dot(ab, bc),
                        dot(ab, ca),
                        dot(bc, bc),
                        dot(bc, ca),
                        dot(ca, ca),
                    ];
                    let area = largest(areas).max(stretch);
                    let stiffness = modulus.mul_add(stretch, pressure_term);
                    let stiffness = constants.kappa.mul_add(area, stiffness);
                    let stiffness = stiffness.mul(inv_third);
                    let stiffness = tension.mul_add(inv_one, stiffness);
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

impl<const NODAL: bool, const LOADED: bool> WithLanes for FindDifferentials<'_, NODAL, LOADED> {
    type Output = ();

    #[inline(always)]
    unsafe fn run<L: Lanes>(self) {
        let Self {
            law,
            extra,
            displacements,
            tetrahedra,
        } = self;
        // SAFETY: the same contract; corners are indices of positions, displacements and sums.
        unsafe {
            let constants = Constants::<L>::new(law);
            let zero = L::splat(0.0);
            for (index, group) in tetrahedra.groups.iter().enumerate() {
                for first in batches::<L>() {
                    let inverse = Tetrahedra::inverse::<L>(group, first);
                    let volumes = Tetrahedra::volumes::<L>(group, first);
                    let deformed = tetrahedra.deformed(group, first, inverse);
                    let [a, b, c] = deformed.gradient;
                    let (edges, pressure) = Tetrahedra::edges::<L>(displacements, group, first);
                    let change = times_upper(edges, inverse);
                    let [da, db, dc] = change;
                    let twice_strain = [
                        dot(a, da).add(dot(a, da)),
                        dot(a, db).add(dot(b, da)),
                        dot(a, dc).add(dot(c, da)),
                        dot(b, db).add(dot(b, db)),
                        dot(b, dc).add(dot(c, db)),
                        dot(c, dc).add(dot(c, dc)),
                    ];
                    let twice_trace = twice_strain[0].add(twice_strain[3]).add(twice_strain[5]);
                    let stress_change = constants.stress(twice_strain, twice_trace);
                    // The stress is shifted by Gershgorin's bound on its lowest eigenvalue, so that the tangent stays
                    // positive semidefinite.
                    let mut stress = constants.stress(deformed.twice_strain, deformed.twice_trace);
                    if LOADED {
                        stress = sum_six(stress, extra[index].entries::<L>(first));
                    }
                    let (xy, xz, yz) = (stress[1].abs(), stress[2].abs(), stress[4].abs());
                    let lift = [
                        xy.add(xz).sub(stress[0]),
                        xy.add(yz).sub(stress[3]),
                        xz.add(yz).sub(stress[5]),
                    ];
                    let lift = lift[0].max(lift[1]).max(lift[2]).max(zero);
                    for diagonal in [0, 3, 5] {
                        stress[diagonal] = stress[diagonal].add(lift);
                    }
                    let [ca, cb, cc] = deformed.cofactors;
                    let pressure_change = if NODAL {
                        pressure
                    } else {
                        let volume_change = dot(ca, da).add(dot(cb, db)).add(dot(cc, dc));
                        constants.kappa.mul(volume_change)
                    };
                    let stress_differential = scaled_matrix(deformed.cofactors, pressure_change);
                    let stress_differential = add_times(stress_differential, deformed.gradient, stress_change);
                    let stress_differential = add_times(stress_differential, change, stress);
                    let minus = zero.sub(volumes);
                    let stress_differential = scaled_matrix(stress_differential, minus);
                    tetrahedra.scatter_forces(group, first, stress_differential, inverse);
                }
            }
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
