//! Kernels of tetrahedra with a hyperelastic law of [`crate::elements::laws`].

use super::linearize::Linearize;
use super::{ElasticLaw, GROUP, Tetrahedra, batches};
use crate::elements::LEAST_SHEAR;
use crate::elements::laws::{Hyperelastic, MatrixColumns, StrainState};
use crate::simd::algebra::{Matrix3, Vector, scaled_matrix, times_upper};
use crate::simd::{InLanes, Lanes, WithLanes};

/// Computes forces. With `NODAL`, the fourth component of a node's record is its pressure.
pub(super) struct HyperelasticForces<'a, H, const NODAL: bool> {
    pub law: ElasticLaw,
    pub hyperelastic_law: H,
    pub tetrahedra: Tetrahedra<'a>,
}

/// A law, with nodal pressures or the volume term of each element.
pub(super) struct HyperelasticTangent<H> {
    pub law: ElasticLaw,
    pub hyperelastic_law: H,
    /// True if tangents are made positive semidefinite.
    pub is_clamped: bool,
}

impl<H: Hyperelastic> HyperelasticTangent<H> {
    /// The state without limits. The nodal pressure does not enter the tangent.
    #[inline(always)]
    unsafe fn state<L: Lanes>(&self, tetrahedra: &Tetrahedra, index: usize, first: usize) -> StrainState<InLanes<L>> {
        // SAFETY: the caller's promise; corners are indices of positions.
        unsafe {
            let group = &tetrahedra.groups[index];
            let element_kappa = if self.law.nodal_pressure { 0.0 } else { self.law.kappa };
            let inverse = Tetrahedra::inverse::<L>(group, first);
            let (edges, _) = Tetrahedra::edges::<L>(tetrahedra.positions, group, first);
            let gradient = to_reals(times_upper(edges, inverse));
            StrainState::new(self.hyperelastic_law, gradient, InLanes::new(L::splat(element_kappa)))
        }
    }
}

/// # Safety
/// As for [`InLanes::new`].
#[inline(always)]
unsafe fn to_reals<L: Lanes>([a, b, c]: Matrix3<L>) -> MatrixColumns<InLanes<L>> {
    // SAFETY: the caller's promise.
    unsafe { [to_real(a), to_real(b), to_real(c)] }
}

/// # Safety
/// As for [`InLanes::new`].
#[inline(always)]
unsafe fn to_real<L: Lanes>([x, y, z]: Vector<L>) -> [InLanes<L>; 3] {
    // SAFETY: the caller's promise.
    unsafe { [InLanes::new(x), InLanes::new(y), InLanes::new(z)] }
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

impl<H: Hyperelastic> Linearize for HyperelasticTangent<H> {
    /// The state, and the shift of its tangent: limited and shifted to be positive semidefinite if clamped.
    type Tangent<L: Lanes> = (StrainState<InLanes<L>>, InLanes<L>);

    #[inline(always)]
    unsafe fn tangent<L: Lanes>(&self, tetrahedra: &Tetrahedra, index: usize, first: usize) -> Self::Tangent<L> {
        // SAFETY: the same contract.
        unsafe {
            let state = self.state(tetrahedra, index, first);
            if self.is_clamped {
                state.clamped()
            } else {
                (state, InLanes::new(L::splat(0.0)))
            }
        }
    }

    #[inline(always)]
    unsafe fn stress_change<L: Lanes>(
        (state, lift): Self::Tangent<L>,
        change: Matrix3<L>,
        pressure_change: Option<L>,
    ) -> Matrix3<L> {
        // SAFETY: the same contract.
        unsafe {
            let changed = state.stress_change(to_reals(change), lift);
            to_lanes(match pressure_change {
                Some(pressure_change) => state.with_pressure_change(changed, InLanes::new(pressure_change)),
                None => changed,
            })
        }
    }

    #[inline(always)]
    unsafe fn block<L: Lanes>((state, lift): &Self::Tangent<L>, [g, other_g]: [Vector<L>; 2]) -> Matrix3<L> {
        // SAFETY: the same contract.
        unsafe {
            let [g, other_g] = [to_real(g), to_real(other_g)];
            to_lanes(state.tangent_block([g, other_g], *lift))
        }
    }

    #[inline(always)]
    unsafe fn stiffening<L: Lanes>(&self, tetrahedra: &Tetrahedra, index: usize, first: usize) -> L {
        // SAFETY: the same contract.
        unsafe {
            let [inv_third, inv_one] = [LEAST_SHEAR, 1.0].map(|shear| 1.0 / self.law.rest_stiffness_bound(shear));
            let state = self.state::<L>(tetrahedra, index, first);
            let (inv_third, inv_one) = (InLanes::new(L::splat(inv_third)), InLanes::new(L::splat(inv_one)));
            state.stiffening(inv_third, inv_one).lanes()
        }
    }
}
