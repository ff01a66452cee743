//! Kernels of tetrahedra with a hyperelastic law of [`crate::elements::laws`].

use super::{ElasticLaw, GROUP, Tetrahedra, batches};
use crate::elements::LEAST_SHEAR;
use crate::elements::laws::{Hyperelastic, MatrixColumns, StrainState};
use crate::simd::algebra::{Matrix3, scaled_matrix, times_upper};
use crate::simd::{InLanes, Lanes, Record, WithLanes};

/// Computes forces. With `NODAL`, the fourth component of a node's record is its pressure.
pub(super) struct HyperelasticForces<'a, H, const NODAL: bool> {
    pub law: ElasticLaw,
    pub hyperelastic_law: H,
    pub tetrahedra: Tetrahedra<'a>,
}

pub(super) struct HyperelasticDifferentials<'a, H, const NODAL: bool> {
    pub law: ElasticLaw,
    pub hyperelastic_law: H,
    pub displacements: *const Record,
    pub tetrahedra: Tetrahedra<'a>,
}

/// # Safety
/// As for [`InLanes::new`].
#[inline(always)]
unsafe fn to_reals<L: Lanes>([a, b, c]: Matrix3<L>) -> MatrixColumns<InLanes<L>> {
    // SAFETY: the caller's promise.
    unsafe {
        [
            [InLanes::new(a[0]), InLanes::new(a[1]), InLanes::new(a[2])],
            [InLanes::new(b[0]), InLanes::new(b[1]), InLanes::new(b[2])],
            [InLanes::new(c[0]), InLanes::new(c[1]), InLanes::new(c[2])],
        ]
    }
}

#[inline(always)]
fn to_lanes<L: Lanes>([a, b, c]: MatrixColumns<InLanes<L>>) -> Matrix3<L> {
    [
        [a[0].lanes(), a[1].lanes(), a[2].lanes()],
        [b[0].lanes(), b[1].lanes(), b[2].lanes()],
        [c[0].lanes(), c[1].lanes(), c[2].lanes()],
    ]
}

impl<H: Hyperelastic, const NODAL: bool> WithLanes for HyperelasticForces<'_, H, NODAL> {
    type Output = f32;

    #[inline(always)]
    unsafe fn run<L: Lanes>(self) -> f32 {
        let Self {
            law,
            hyperelastic_law,
            tetrahedra,
        } = self;
        // SAFETY: the same contract; corners are indices of positions and sums.
        unsafe {
            let zero = L::splat(0.0);
            let kappa = InLanes::new(L::splat(law.kappa));
            let element_kappa = if NODAL { InLanes::new(zero) } else { kappa };
            let inv_third = InLanes::new(L::splat(1.0 / law.rest_stiffness_bound(LEAST_SHEAR)));
            let inv_one = InLanes::new(L::splat(1.0 / law.rest_stiffness_bound(1.0)));
            let mut highest = zero;
            for group in tetrahedra.groups {
                for first in batches::<L>() {
                    let inverse = Tetrahedra::inverse::<L>(group, first);
                    let volumes = Tetrahedra::volumes::<L>(group, first);
                    let (edges, pressure) = Tetrahedra::edges::<L>(tetrahedra.positions, group, first);
                    let gradient = to_reals(times_upper(edges, inverse));
                    let mut state = StrainState::new(hyperelastic_law, gradient, element_kappa);
                    if NODAL {
                        state = state
                            .with_added_pressure(InLanes::new(pressure))
                            .with_volume_stiffness(kappa);
                    }
                    let rates = L::load(group.rates.as_ptr().add(first));
                    let stiffness = state.stiffening(inv_third, inv_one).lanes();
                    highest = highest.max(stiffness.mul(rates));
                    let stress = scaled_matrix(to_lanes(state.stress()), zero.sub(volumes));
                    tetrahedra.scatter_forces(group, first, stress, inverse);
                }
            }
            let mut lane_bounds = [0.0_f32; GROUP];
            highest.store(lane_bounds.as_mut_ptr());
            lane_bounds.into_iter().fold(0.0, f32::max)
        }
    }
}

impl<H: Hyperelastic, const NODAL: bool> WithLanes for HyperelasticDifferentials<'_, H, NODAL> {
    type Output = ();

    #[inline(always)]
    unsafe fn run<L: Lanes>(self) {
        let Self {
            law,
            hyperelastic_law,
            displacements,
            tetrahedra,
        } = self;
        // SAFETY: the same contract; corners are indices of positions, displacements and sums.
        unsafe {
            let zero = L::splat(0.0);
            let element_kappa = InLanes::new(L::splat(if NODAL { 0.0 } else { law.kappa }));
            for group in tetrahedra.groups {
                for first in batches::<L>() {
                    let inverse = Tetrahedra::inverse::<L>(group, first);
                    let volumes = Tetrahedra::volumes::<L>(group, first);
                    let (edges, _) = Tetrahedra::edges::<L>(tetrahedra.positions, group, first);
                    let state =
                        StrainState::new(hyperelastic_law, to_reals(times_upper(edges, inverse)), element_kappa);
                    let (edges, pressure) = Tetrahedra::edges::<L>(displacements, group, first);
                    let change = to_reals(times_upper(edges, inverse));
                    // The nodal pressure does not enter the tangent; the rest is positive semidefinite with the shift.
                    let (state, lift) = state.clamped();
                    let mut stress_change = state.stress_change(change, lift);
                    if NODAL {
                        stress_change = state.with_pressure_change(stress_change, InLanes::new(pressure));
                    }
                    let stress_change = scaled_matrix(to_lanes(stress_change), zero.sub(volumes));
                    tetrahedra.scatter_forces(group, first, stress_change, inverse);
                }
            }
        }
    }
}
