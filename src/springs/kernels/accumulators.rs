//! Sums over the springs of a node: forces, force changes and energy.

use crate::simd::Lanes;
use crate::springs::law::{half_energy, pull};
use crate::springs::{Link, Tangent};

use glam::Vec3;

/// The parameters of springs, one per lane.
#[derive(Clone, Copy)]
pub(super) struct SpringLanes<L> {
    pub stiffness: L,
    /// Half of stiffness times rest length.
    pub half_tension: L,
    pub rest_length: L,
    pub damping: L,
}

/// The positions and second vectors of nodes, one per lane.
#[derive(Clone, Copy)]
pub(super) struct NodeVectors<L> {
    pub position: [L; 3],
    pub second: [L; 3],
}

impl<L: Copy> NodeVectors<L> {
    /// Positions for a sum that uses no second vectors.
    #[inline(always)]
    pub fn without_second(position: [L; 3]) -> Self {
        Self {
            position,
            second: position,
        }
    }
}

/// A column of springs: parameters, neighbors, and a mask of used lanes.
#[derive(Clone, Copy)]
pub(super) struct LinkColumn<L> {
    pub spring: SpringLanes<L>,
    pub there: NodeVectors<L>,
    pub lanes: u32,
}

/// The vectors to the other ends of springs, and the differences of their second vectors.
pub(super) struct LinkVectors<L, const N: usize> {
    pub offsets: [[L; 3]; N],
    pub differences: [[L; 3]; N],
    pub links: [LinkColumn<L>; N],
}

/// A sum over the springs of a node.
///
/// # Safety
/// The processor must support the instructions of `L`.
pub(super) trait Accumulator {
    /// True if it depends on a second vector per node: the velocity or the displacement.
    const USES_SECOND: bool;
    /// True if it depends on the dampings of springs.
    const USES_DAMPING: bool;
    /// True if it depends on the rest lengths themselves.
    const USES_REST_LENGTH: bool = false;

    /// Adds `N` columns to `sums`; NaN if the ends of a spring coincide.
    unsafe fn add<L: Lanes, const N: usize>(sums: &mut [L; 3], offsets: LinkVectors<L, N>, tangent: &Tangent);

    /// The contribution of one spring of `node`, valid for coincident ends.
    fn single_link(node: usize, link: &Link, offset: Vec3, difference: Vec3, tangent: &Tangent) -> Vec3;
}

impl<L: Lanes, const N: usize> LinkVectors<L, N> {
    /// The spring forces divided by the lengths, and the inverse lengths.
    #[inline(always)]
    unsafe fn pulls(&self) -> ([L; N], [L; N]) {
        // SAFETY: the caller's promise.
        unsafe {
            let [mut squares, mut stiffnesses, mut half_tensions] = [[L::splat(0.0); N]; 3];
            for (n, (&offset, links)) in self.offsets.iter().zip(&self.links).enumerate() {
                squares[n] = dot(offset, offset);
                (stiffnesses[n], half_tensions[n]) = (links.spring.stiffness, links.spring.half_tension);
            }
            L::force_over_length(squares, stiffnesses, half_tensions)
        }
    }
}

/// Adds `factor` times `vector` in used lanes.
#[inline(always)]
unsafe fn add_scaled<L: Lanes>(sums: &mut [L; 3], vector: [L; 3], factor: L, lanes: u32) {
    // SAFETY: the caller's promise.
    unsafe {
        let factor = factor.mask(lanes);
        for (sum, component) in sums.iter_mut().zip(vector) {
            *sum = component.mul_add(factor, *sum);
        }
    }
}

/// The spring forces, N. With damping the second vectors are velocities.
pub(super) struct Force<const USES_DAMPING: bool>;

impl<const USES_DAMPING: bool> Accumulator for Force<USES_DAMPING> {
    const USES_SECOND: bool = USES_DAMPING;
    const USES_DAMPING: bool = USES_DAMPING;

    #[inline(always)]
    unsafe fn add<L: Lanes, const N: usize>(sums: &mut [L; 3], offsets: LinkVectors<L, N>, _: &Tangent) {
        // SAFETY: the same contract.
        unsafe {
            let (mut factors, inverses) = offsets.pulls();
            if USES_DAMPING {
                for n in 0..N {
                    let rate = dot(offsets.offsets[n], offsets.differences[n]);
                    let rate = rate.mul(inverses[n]).mul(inverses[n]);
                    factors[n] = rate.mul_add(offsets.links[n].spring.damping, factors[n]);
                }
            }
            for (n, &factor) in factors.iter().enumerate() {
                add_scaled(sums, offsets.offsets[n], factor, offsets.links[n].lanes);
            }
        }
    }

    fn single_link(node: usize, link: &Link, offset: Vec3, difference: Vec3, _: &Tangent) -> Vec3 {
        pull(node, link, offset, USES_DAMPING.then_some(difference))
    }
}

/// The first-order force changes, N, where the second vectors are displacements.
pub(super) struct Change<const USES_DAMPING: bool>;

impl<const USES_DAMPING: bool> Accumulator for Change<USES_DAMPING> {
    const USES_SECOND: bool = true;
    const USES_DAMPING: bool = USES_DAMPING;

    #[inline(always)]
    unsafe fn add<L: Lanes, const N: usize>(sums: &mut [L; 3], offsets: LinkVectors<L, N>, tangent: &Tangent) {
        // SAFETY: the same contract.
        unsafe {
            let (pulls, inverses) = offsets.pulls();
            for n in 0..N {
                let spring = offsets.links[n].spring;
                let across = L::splat(tangent.floor).max(pulls[n]);
                let mut along = spring.stiffness.sub(across);
                if USES_DAMPING {
                    along = spring.damping.mul_add(L::splat(tangent.rate), along);
                }
                let lengthening = dot(offsets.offsets[n], offsets.differences[n]);
                let factor = lengthening.mul(inverses[n]).mul(inverses[n]).mul(along);
                add_scaled(sums, offsets.offsets[n], factor, offsets.links[n].lanes);
                // The comparison with the bound drops NaN; the sum above has propagated it.
                add_scaled(sums, offsets.differences[n], across, offsets.links[n].lanes);
            }
        }
    }

    fn single_link(node: usize, link: &Link, offset: Vec3, difference: Vec3, tangent: &Tangent) -> Vec3 {
        tangent.force_change(node, link, offset, difference)
    }
}

/// Half the energy of the springs, J, as x component. The other half counts at their other ends.
pub(super) struct HalfEnergy;

impl Accumulator for HalfEnergy {
    const USES_SECOND: bool = false;
    const USES_DAMPING: bool = false;
    const USES_REST_LENGTH: bool = true;

    #[inline(always)]
    unsafe fn add<L: Lanes, const N: usize>(sums: &mut [L; 3], offsets: LinkVectors<L, N>, _: &Tangent) {
        // SAFETY: the same contract.
        unsafe {
            let (_, inverses) = offsets.pulls();
            for (n, &inverse) in inverses.iter().enumerate() {
                let square = dot(offsets.offsets[n], offsets.offsets[n]);
                let stretch = square.mul(inverse).sub(offsets.links[n].spring.rest_length);
                let force = stretch.mul(offsets.links[n].spring.stiffness).mul(L::splat(0.25));
                let energy = force.mul(stretch);
                sums[0] = energy.mask(offsets.links[n].lanes).mul_add(L::splat(1.0), sums[0]);
            }
        }
    }

    fn single_link(node: usize, link: &Link, offset: Vec3, _: Vec3, _: &Tangent) -> Vec3 {
        Vec3::new(half_energy(node, link, offset), 0.0, 0.0)
    }
}

#[inline(always)]
pub(super) unsafe fn difference<L: Lanes>([ax, ay, az]: [L; 3], [bx, by, bz]: [L; 3]) -> [L; 3] {
    // SAFETY: the caller's promise.
    unsafe { [ax.sub(bx), ay.sub(by), az.sub(bz)] }
}

#[inline(always)]
unsafe fn dot<L: Lanes>([ax, ay, az]: [L; 3], [bx, by, bz]: [L; 3]) -> L {
    // SAFETY: the caller's promise.
    unsafe { az.mul_add(bz, ay.mul_add(by, ax.mul(bx))) }
}
