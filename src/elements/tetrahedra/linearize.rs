//! Force differentials and tangent blocks of tetrahedra, for any law.

use super::node_pairs::{PAIRS, PairLanes};
use super::{GROUP, Tetrahedra, batches};
use crate::simd::algebra::{Matrix3, Vector, difference, scaled, scaled_matrix, sum, times_upper};
use crate::simd::{Lanes, Record, WithLanes};

/// A law, linearized at a deformation.
pub(super) trait Linearize {
    /// The tangents of a lane batch.
    type Tangent<L: Lanes>: Copy;

    /// The tangents of a lane batch at the current deformation.
    ///
    /// # Safety
    /// As for the kernel; `first` is the first lane of a batch of the group with this index.
    unsafe fn tangent<L: Lanes>(&self, tetrahedra: &Tetrahedra, index: usize, first: usize) -> Self::Tangent<L>;

    /// The change of the first Piola-Kirchhoff stress for this change of the deformation gradient, and, with nodal
    /// pressures, of the pressure, Pa.
    ///
    /// # Safety
    /// As for the kernel.
    unsafe fn stress_change<L: Lanes>(
        tangent: Self::Tangent<L>,
        change: Matrix3<L>,
        pressure_change: Option<L>,
    ) -> Matrix3<L>;

    /// The force on a corner over the volume, for displacements of another corner, without nodal pressures, Pa/m². The
    /// corners have shape functions with these gradients at rest.
    ///
    /// # Safety
    /// As for the kernel.
    unsafe fn block<L: Lanes>(tangent: &Self::Tangent<L>, gradients: [Vector<L>; 2]) -> Matrix3<L>;

    /// Upper bounds on the stiffness relative to rest, at least 1.
    ///
    /// # Safety
    /// As for [`Self::tangent`].
    unsafe fn stiffening<L: Lanes>(&self, tetrahedra: &Tetrahedra, index: usize, first: usize) -> L;
}

/// Computes force differentials. With `NODAL`, the fourth component of a node's displacement is its pressure change.
pub(super) struct FindDifferentials<'a, T, const NODAL: bool> {
    pub law: T,
    pub displacements: *const Record,
    pub tetrahedra: Tetrahedra<'a>,
}

impl<T: Linearize, const NODAL: bool> WithLanes for FindDifferentials<'_, T, NODAL> {
    type Output = ();

    #[inline(always)]
    unsafe fn run<L: Lanes>(self) {
        let Self {
            law,
            displacements,
            tetrahedra,
        } = self;
        // SAFETY: the same contract; corners are indices of positions, displacements and sums.
        unsafe {
            for (index, group) in tetrahedra.groups.iter().enumerate() {
                for first in batches::<L>() {
                    let inverse = Tetrahedra::inverse::<L>(group, first);
                    let tangent = law.tangent::<L>(&tetrahedra, index, first);
                    let (edges, pressure) = Tetrahedra::edges::<L>(displacements, group, first);
                    let pressure_change = if NODAL { Some(pressure) } else { None };
                    let change = times_upper(edges, inverse);
                    let stress_change = T::stress_change(tangent, change, pressure_change);
                    let minus = L::splat(0.0).sub(Tetrahedra::volumes::<L>(group, first));
                    tetrahedra.scatter_forces(group, first, scaled_matrix(stress_change, minus), inverse);
                }
            }
        }
    }
}

/// Adds the tangent block of each pair of corners to the three records of its pair.
pub(super) struct FindTangents<'a, T> {
    pub law: T,
    pub pairs: &'a [PairLanes],
    pub records: [*mut Record; 3],
    pub tetrahedra: Tetrahedra<'a>,
}

impl<T: Linearize> WithLanes for FindTangents<'_, T> {
    type Output = ();

    #[inline(always)]
    unsafe fn run<L: Lanes>(self) {
        let Self {
            law,
            pairs,
            records,
            tetrahedra,
        } = self;
        // SAFETY: the same contract; indices of pairs are indices of records.
        unsafe {
            let zero = L::splat(0.0);
            for (index, (group, pairs)) in tetrahedra.groups.iter().zip(pairs).enumerate() {
                for first in batches::<L>() {
                    let tangent = law.tangent::<L>(&tetrahedra, index, first);
                    let volumes = Tetrahedra::volumes::<L>(group, first);
                    let [xx, xy, xz, yy, yz, zz] = Tetrahedra::inverse::<L>(group, first);
                    let (b, c, d) = ([xx, xy, xz], [zero, yy, yz], [zero, zero, zz]);
                    let a = difference([zero; 3], sum(sum(b, c), d));
                    let gradients = [a, b, c, d];
                    for (number, [one, other]) in PAIRS.into_iter().enumerate() {
                        let block = T::block::<L>(&tangent, [gradients[one], gradients[other]]);
                        pairs.add(records, number, first, scaled_matrix(block, zero.sub(volumes)));
                    }
                }
            }
        }
    }
}

/// Writes the upper bounds on the stiffness of tetrahedra relative to rest.
pub(super) struct FindStiffenings<'a, T> {
    pub law: &'a T,
    pub stiffenings: &'a mut [[f32; GROUP]],
    pub tetrahedra: Tetrahedra<'a>,
}

impl<T: Linearize> WithLanes for FindStiffenings<'_, T> {
    type Output = ();

    #[inline(always)]
    unsafe fn run<L: Lanes>(self) {
        // SAFETY: the same contract.
        unsafe {
            for (index, to) in self
                .stiffenings
                .iter_mut()
                .enumerate()
                .take(self.tetrahedra.groups.len())
            {
                for first in batches::<L>() {
                    let stiffening = self.law.stiffening::<L>(&self.tetrahedra, index, first);
                    stiffening.store(to.as_mut_ptr().add(first));
                }
            }
        }
    }
}

impl PairLanes {
    /// Adds the blocks of a pair to its records: the diagonal, the symmetric part, and the antisymmetric part of the
    /// block with the lower node first.
    ///
    /// # Safety
    /// As for the kernel; `first` is the first lane of a batch.
    #[inline(always)]
    unsafe fn add<L: Lanes>(&self, records: [*mut Record; 3], pair: usize, first: usize, [x, y, z]: Matrix3<L>) {
        // SAFETY: indices of pairs are indices of records.
        unsafe {
            let half = L::splat(0.5);
            let symmetric = [y[2].add(z[1]), z[0].add(x[2]), x[1].add(y[0])];
            let antisymmetric = [z[1].sub(y[2]), x[2].sub(z[0]), y[0].sub(x[1])];
            let sign = signs::<L>(self.are_ordered[pair], first);
            let indices = self.indices[pair].as_ptr().add(first);
            L::scatter_add_records(records[0], indices, [x[0], y[1], z[2]]);
            L::scatter_add_records(records[1], indices, scaled(symmetric, half));
            L::scatter_add_records(records[2], indices, scaled(antisymmetric, half.mul(sign)));
        }
    }
}

/// 1 in the lanes of a batch whose bits are set, and -1 in others.
///
/// # Safety
/// As for the kernel.
#[inline(always)]
pub(super) unsafe fn signs<L: Lanes>(bits: u16, first: usize) -> L {
    // SAFETY: the same contract.
    unsafe { L::splat(2.0).mask(u32::from(bits) >> first).sub(L::splat(1.0)) }
}
