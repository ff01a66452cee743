//! The kernels of tetrahedra of St Venant and Kirchhoff's law with a signed volume term.

use super::{DeformedLanes, GROUP, Stresses, Tetrahedra, turns};
use crate::elements::{LEAST_SHEAR, Law};
use crate::simd::algebra::{Six, add_times, cross, dot, largest, scaled_matrix, scaled_six, sum_six, times_upper};
use crate::simd::{Lanes, Record, WithLanes};

/// With the pressures that their nodes have beside their places, or none, and with as many loads as groups, or none.
pub(super) struct FindForces<'a, const RINGS: bool, const LOADED: bool> {
    pub law: Law,
    pub loads: &'a [Stresses],
    pub of: Tetrahedra<'a>,
}

pub(super) struct FindChanges<'a, const RINGS: bool, const LOADED: bool> {
    pub law: Law,
    pub loads: &'a [Stresses],
    pub ways: *const Record,
    pub of: Tetrahedra<'a>,
}

/// Of as many groups as there are stresses.
pub(super) struct FindStresses<'a> {
    pub law: Law,
    pub stresses: &'a mut [Stresses],
    pub of: Tetrahedra<'a>,
}

pub(super) struct FindEnergy<'a> {
    pub law: Law,
    pub of: Tetrahedra<'a>,
}

pub(super) struct FindGrowths<'a> {
    pub ways: Option<*const Record>,
    pub of: Tetrahedra<'a>,
}

/// A law's numbers in every lane.
#[derive(Clone, Copy)]
struct Constants<L> {
    lambda: L,
    mu: L,
    kappa: L,
}

impl<L: Lanes> Constants<L> {
    #[inline(always)]
    unsafe fn new(law: Law) -> Self {
        // SAFETY: the caller promises the instructions.
        unsafe {
            Self {
                lambda: L::splat(law.lambda),
                mu: L::splat(law.mu),
                kappa: L::splat(law.kappa),
            }
        }
    }

    /// With no resistance of volume where that is a matter of rings.
    #[inline(always)]
    unsafe fn without_rings(law: Law) -> Self {
        // SAFETY: the same contract.
        unsafe { Self::new(if law.rings { Law { kappa: 0.0, ..law } } else { law }) }
    }

    /// The stress S of twice a strain.
    #[inline(always)]
    unsafe fn stress(self, twice_strain: Six<L>, twice_trace: L) -> Six<L> {
        // SAFETY: the caller promises the instructions.
        unsafe {
            let part = self.lambda.multiply(twice_trace).multiply(L::splat(0.5));
            let [xx, xy, xz, yy, yz, zz] = twice_strain;
            [
                self.mu.multiply_add(xx, part),
                self.mu.multiply(xy),
                self.mu.multiply(xz),
                self.mu.multiply_add(yy, part),
                self.mu.multiply(yz),
                self.mu.multiply_add(zz, part),
            ]
        }
    }
}

impl<const RINGS: bool, const LOADED: bool> WithLanes for FindForces<'_, RINGS, LOADED> {
    type Output = f32;

    #[inline(always)]
    unsafe fn run<L: Lanes>(self) -> f32 {
        let Self { law, loads, of } = self;
        // SAFETY: the same contract; corners lead to positions and sums.
        unsafe {
            let constants = Constants::<L>::new(law);
            let (one, half) = (L::splat(1.0), L::splat(0.5));
            // Of what rates are made for, tension is most where shear counts most, all else where it counts least.
            let least = L::splat(1.0 / law.stiffest(LEAST_SHEAR));
            let most = L::splat(1.0 / law.stiffest(1.0));
            let along = L::splat(law.lambda.max(0.0) + 2.0 * law.mu * LEAST_SHEAR);
            let mut highest = L::splat(0.0);
            for (index, group) in of.groups.iter().enumerate() {
                for first in turns::<L>() {
                    let inverse = Tetrahedra::inverse::<L>(group, first);
                    let volumes = Tetrahedra::volumes::<L>(group, first);
                    let deformed = of.deformed(group, first, inverse);
                    let DeformedLanes {
                        gradient,
                        cofactors,
                        twice_strain,
                        twice_trace,
                        growth,
                        pressure,
                    } = deformed;
                    let mut stress = constants.stress(twice_strain, twice_trace);
                    let mut pressure = if RINGS {
                        pressure
                    } else {
                        constants.kappa.multiply(growth)
                    };
                    let mut load = L::splat(0.0);
                    if LOADED {
                        let entries = loads[index].entries::<L>(first);
                        stress = sum_six(stress, entries);
                        load = largest(entries);
                        if !RINGS {
                            pressure = pressure.add(loads[index].pressures::<L>(first));
                        }
                    }
                    let minus = L::splat(0.0).subtract(volumes);
                    let stress = scaled_six(stress, minus);
                    // The largest stretch squared is at most the largest sum of a row's sizes (Gershgorin).
                    let [xx, xy, xz, yy, yz, zz] = twice_strain;
                    let (xy, xz, yz) = (xy.size(), xz.size(), yz.size());
                    let stretch = xx
                        .add(xy)
                        .add(xz)
                        .greater(yy.add(xy).add(yz))
                        .greater(zz.add(xz).add(yz));
                    let stretch = stretch.greater(L::splat(0.0)).add(one);
                    let tension = constants.mu.multiply(stretch.subtract(one));
                    let tension = constants.lambda.multiply(twice_trace).multiply_add(half, tension);
                    let tension = tension.greater(L::splat(0.0)).add(load);
                    // Pressure turns with the root of that, which is below its tangents: at 1, 9 and 81.
                    let root = stretch.multiply_add(half, half);
                    let root = root.lesser(stretch.multiply_add(L::splat(1.0 / 6.0), L::splat(1.5)));
                    let root = root.lesser(stretch.multiply_add(L::splat(1.0 / 18.0), L::splat(4.5)));
                    let pressed = pressure.size().multiply(root);
                    // Volume grows with areas: the square of the largest.
                    let [ab, bc, ca] = cofactors;
                    let areas = [
                        dot(ab, ab),
                        dot(ab, bc),
                        dot(ab, ca),
                        dot(bc, bc),
                        dot(bc, ca),
                        dot(ca, ca),
                    ];
                    let area = largest(areas).greater(stretch);
                    let stiffness = along.multiply_add(stretch, pressed);
                    let stiffness = constants.kappa.multiply_add(area, stiffness);
                    let stiffness = stiffness.multiply(least);
                    let stiffness = tension.multiply_add(most, stiffness);
                    let rates = L::load(group.rates.as_ptr().add(first));
                    highest = highest.greater(stiffness.multiply(rates));
                    let load = pressure.multiply(minus);
                    let first_stress = scaled_matrix(cofactors, load);
                    of.spread(group, first, add_times(first_stress, gradient, stress), inverse);
                }
            }
            let mut all = [0.0_f32; GROUP];
            highest.store(all.as_mut_ptr());
            all.into_iter().fold(0.0, f32::max)
        }
    }
}

impl<const RINGS: bool, const LOADED: bool> WithLanes for FindChanges<'_, RINGS, LOADED> {
    type Output = ();

    #[inline(always)]
    unsafe fn run<L: Lanes>(self) {
        let Self { law, loads, ways, of } = self;
        // SAFETY: the same contract; corners lead to positions, ways and sums.
        unsafe {
            let constants = Constants::<L>::new(law);
            let zero = L::splat(0.0);
            for (index, group) in of.groups.iter().enumerate() {
                for first in turns::<L>() {
                    let inverse = Tetrahedra::inverse::<L>(group, first);
                    let volumes = Tetrahedra::volumes::<L>(group, first);
                    let deformed = of.deformed(group, first, inverse);
                    let [a, b, c] = deformed.gradient;
                    let (edges, pressure) = Tetrahedra::edges::<L>(ways, group, first);
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
                    // Pressure is lifted as far as it may push sideways: Gershgorin's bound on the lowest eigenvalue.
                    let mut stress = constants.stress(deformed.twice_strain, deformed.twice_trace);
                    if LOADED {
                        stress = sum_six(stress, loads[index].entries::<L>(first));
                    }
                    let (xy, xz, yz) = (stress[1].size(), stress[2].size(), stress[4].size());
                    let lift = [
                        xy.add(xz).subtract(stress[0]),
                        xy.add(yz).subtract(stress[3]),
                        xz.add(yz).subtract(stress[5]),
                    ];
                    let lift = lift[0].greater(lift[1]).greater(lift[2]).greater(zero);
                    for place in [0, 3, 5] {
                        stress[place] = stress[place].add(lift);
                    }
                    let [ca, cb, cc] = deformed.cofactors;
                    let load = if RINGS {
                        pressure
                    } else {
                        let swelling = dot(ca, da).add(dot(cb, db)).add(dot(cc, dc));
                        constants.kappa.multiply(swelling)
                    };
                    let changed = scaled_matrix(deformed.cofactors, load);
                    let changed = add_times(changed, deformed.gradient, stress_change);
                    let changed = add_times(changed, change, stress);
                    let minus = zero.subtract(volumes);
                    let changed = scaled_matrix(changed, minus);
                    of.spread(group, first, changed, inverse);
                }
            }
        }
    }
}

impl WithLanes for FindGrowths<'_> {
    type Output = ();

    #[inline(always)]
    unsafe fn run<L: Lanes>(self) {
        let Self { ways, of } = self;
        // SAFETY: the same contract; corners lead to positions, ways and sums.
        unsafe {
            let (zero, one) = (L::splat(0.0), L::splat(1.0));
            let quarter = L::splat(0.25);
            for group in of.groups {
                for first in turns::<L>() {
                    let inverse = Tetrahedra::inverse::<L>(group, first);
                    let (edges, _) = Tetrahedra::edges::<L>(of.positions, group, first);
                    let [a, b, c] = times_upper(edges, inverse);
                    let growth = match ways {
                        None => dot(a, cross(b, c)).subtract(one),
                        Some(ways) => {
                            let (edges, _) = Tetrahedra::edges::<L>(ways, group, first);
                            let [da, db, dc] = times_upper(edges, inverse);
                            dot(da, cross(b, c)).add(dot(db, cross(c, a))).add(dot(dc, cross(a, b)))
                        }
                    };
                    let volumes = Tetrahedra::volumes::<L>(group, first);
                    let growth = growth.multiply(volumes).multiply(quarter);
                    for corners in &group.corners {
                        L::add_to_records(of.sums, corners.as_ptr().add(first), [growth, zero, zero]);
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
        let Self { law, stresses, of } = self;
        // SAFETY: the same contract; corners lead to positions, and lanes are of a group.
        unsafe {
            let constants = Constants::<L>::without_rings(law);
            for (group, stresses) in of.groups.iter().zip(stresses) {
                for first in turns::<L>() {
                    let inverse = Tetrahedra::inverse::<L>(group, first);
                    let deformed = of.deformed(group, first, inverse);
                    let [a, b, c, d, e, f] = constants.stress(deformed.twice_strain, deformed.twice_trace);
                    let pressure = constants.kappa.multiply(deformed.growth);
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
        let Self { law, of } = self;
        let mut energy = 0.0;
        // SAFETY: the same contract; corners lead to positions.
        unsafe {
            let constants = Constants::<L>::without_rings(law);
            for group in of.groups {
                for first in turns::<L>() {
                    let inverse = Tetrahedra::inverse::<L>(group, first);
                    let deformed = of.deformed(group, first, inverse);
                    let [xx, xy, xz, yy, yz, zz] = deformed.twice_strain;
                    let across = dot([xy, xz, yz], [xy, xz, yz]);
                    let squares = dot([xx, yy, zz], [xx, yy, zz]).add(across).add(across);
                    let trace = deformed.twice_trace;
                    let growth = deformed.growth;
                    // Of twice the strains: a quarter.
                    let density = constants
                        .lambda
                        .multiply(trace)
                        .multiply(trace)
                        .multiply(L::splat(0.125));
                    let density = constants.mu.multiply(squares).multiply_add(L::splat(0.25), density);
                    let swollen = constants.kappa.multiply(growth).multiply(growth);
                    let density = swollen.multiply_add(L::splat(0.5), density);
                    let energies = density.multiply(Tetrahedra::volumes::<L>(group, first));
                    let mut all = [0.0_f32; GROUP];
                    energies.store(all.as_mut_ptr());
                    energy += all.into_iter().map(f64::from).sum::<f64>();
                }
            }
        }
        energy
    }
}
