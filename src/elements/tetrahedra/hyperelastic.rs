//! The kernels of tetrahedra of a hyperelastic law of [`crate::elements::laws`], as many at a time as the processor has lanes.

use super::{GROUP, Law, Tetrahedra, turns};
use crate::elements::LEAST_SHEAR;
use crate::elements::laws::{Hyperelastic, MatrixColumns, Strained};
use crate::simd::algebra::{Matrix3, scaled_matrix, times_upper};
use crate::simd::{InLanes, Lanes, Record, WithLanes};

/// With the pressures that their nodes have beside their places, or none.
pub(super) struct HyperelasticForces<'a, H, const RINGS: bool> {
    pub law: Law,
    pub form: H,
    pub of: Tetrahedra<'a>,
}

pub(super) struct HyperelasticChanges<'a, H, const RINGS: bool> {
    pub law: Law,
    pub form: H,
    pub ways: *const Record,
    pub of: Tetrahedra<'a>,
}

/// # Safety
/// As [`InLanes::new`].
#[inline(always)]
unsafe fn numbers<L: Lanes>([a, b, c]: Matrix3<L>) -> MatrixColumns<InLanes<L>> {
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
fn lanes<L: Lanes>([a, b, c]: MatrixColumns<InLanes<L>>) -> Matrix3<L> {
    [
        [a[0].lanes(), a[1].lanes(), a[2].lanes()],
        [b[0].lanes(), b[1].lanes(), b[2].lanes()],
        [c[0].lanes(), c[1].lanes(), c[2].lanes()],
    ]
}

impl<H: Hyperelastic, const RINGS: bool> WithLanes for HyperelasticForces<'_, H, RINGS> {
    type Output = f32;

    #[inline(always)]
    unsafe fn run<L: Lanes>(self) -> f32 {
        let Self { law, form, of } = self;
        // SAFETY: the same contract; corners lead to positions and sums.
        unsafe {
            let zero = L::splat(0.0);
            let kappa = InLanes::new(L::splat(law.kappa));
            let own = if RINGS { InLanes::new(zero) } else { kappa };
            let least = InLanes::new(L::splat(1.0 / law.stiffest(LEAST_SHEAR)));
            let most = InLanes::new(L::splat(1.0 / law.stiffest(1.0)));
            let mut highest = zero;
            for group in of.groups {
                for first in turns::<L>() {
                    let inverse = Tetrahedra::inverse::<L>(group, first);
                    let volumes = Tetrahedra::volumes::<L>(group, first);
                    let (edges, pressure) = Tetrahedra::edges::<L>(of.positions, group, first);
                    let gradient = numbers(times_upper(edges, inverse));
                    let mut strained = Strained::new(form, gradient, own);
                    if RINGS {
                        strained = strained.pressed(InLanes::new(pressure)).with_volume(kappa);
                    }
                    let rates = L::load(group.rates.as_ptr().add(first));
                    let stiffness = strained.stiffening(least, most).lanes();
                    highest = highest.greater(stiffness.multiply(rates));
                    let stress = scaled_matrix(lanes(strained.stress()), zero.subtract(volumes));
                    of.spread(group, first, stress, inverse);
                }
            }
            let mut all = [0.0_f32; GROUP];
            highest.store(all.as_mut_ptr());
            all.into_iter().fold(0.0, f32::max)
        }
    }
}

impl<H: Hyperelastic, const RINGS: bool> WithLanes for HyperelasticChanges<'_, H, RINGS> {
    type Output = ();

    #[inline(always)]
    unsafe fn run<L: Lanes>(self) {
        let Self { law, form, ways, of } = self;
        // SAFETY: the same contract; corners lead to positions, ways and sums.
        unsafe {
            let zero = L::splat(0.0);
            let own = InLanes::new(L::splat(if RINGS { 0.0 } else { law.kappa }));
            for group in of.groups {
                for first in turns::<L>() {
                    let inverse = Tetrahedra::inverse::<L>(group, first);
                    let volumes = Tetrahedra::volumes::<L>(group, first);
                    let (edges, _) = Tetrahedra::edges::<L>(of.positions, group, first);
                    let strained = Strained::new(form, numbers(times_upper(edges, inverse)), own);
                    let (edges, pressure) = Tetrahedra::edges::<L>(ways, group, first);
                    let change = numbers(times_upper(edges, inverse));
                    // The pressure of rings pushes nothing sideways: what is left is positive with the lift.
                    let (strained, lift) = strained.positive();
                    let mut changed = strained.stress_change(change, lift);
                    if RINGS {
                        changed = strained.with_pressure_change(changed, InLanes::new(pressure));
                    }
                    let changed = scaled_matrix(lanes(changed), zero.subtract(volumes));
                    of.spread(group, first, changed, inverse);
                }
            }
        }
    }
}
