//! What is added up over the springs of a node: forces, how they change, energy.

use crate::simd::Lanes;
use crate::springs::law::{half_energy, pull};
use crate::springs::{Link, Tangent};

use glam::Vec3;

/// Parameters of some springs side by side.
#[derive(Clone, Copy)]
pub(super) struct SpringLanes<L> {
    pub stiffness: L,
    /// Half the stiffness times the rest length.
    pub half_tension: L,
    pub rest_length: L,
    pub damping: L,
}

/// Where some nodes are, and their second vectors, side by side.
#[derive(Clone, Copy)]
pub(super) struct NodePlaces<L> {
    pub position: [L; 3],
    pub second: [L; 3],
}

impl<L: Copy> NodePlaces<L> {
    /// Second vectors are not asked for.
    #[inline(always)]
    pub fn still(position: [L; 3]) -> Self {
        Self {
            position,
            second: position,
        }
    }
}

/// A column of springs: what they are like, where they lead, and which lanes have one.
#[derive(Clone, Copy)]
pub(super) struct LinkColumn<L> {
    pub spring: SpringLanes<L>,
    pub there: NodePlaces<L>,
    pub lanes: u32,
}

/// Columns of springs seen from one end: the ways to the other, and the differences of what else is known of both ends.
pub(super) struct Ways<L, const N: usize> {
    pub ways: [[L; 3]; N],
    pub differences: [[L; 3]; N],
    pub links: [LinkColumn<L>; N],
}

/// A sum over the springs of a node.
///
/// # Safety
/// The processor has the instructions of `L`.
pub(super) trait Quantity {
    /// Whether it is made of a second vector of each node: its velocity, or where it goes.
    const SECOND: bool;
    /// Whether it is made of the dampings of springs.
    const DAMPED: bool;
    /// Whether it is made of the rest lengths themselves.
    const RESTING: bool = false;

    /// Adds those of `N` columns to `sums`; NaN where a spring's ends coincide.
    unsafe fn add<L: Lanes, const N: usize>(sums: &mut [L; 3], ways: Ways<L, N>, tangent: &Tangent);

    /// That of one spring of `node`, wherever its ends are.
    fn of_link(node: usize, link: &Link, way: Vec3, difference: Vec3, tangent: &Tangent) -> Vec3;
}

impl<L: Lanes, const N: usize> Ways<L, N> {
    /// The forces of the springs over their lengths, and 1 over their lengths.
    #[inline(always)]
    unsafe fn pulls(&self) -> ([L; N], [L; N]) {
        // SAFETY: the caller's promise.
        unsafe {
            let [mut squares, mut stiffnesses, mut half_tensions] = [[L::splat(0.0); N]; 3];
            for (n, (&way, links)) in self.ways.iter().zip(&self.links).enumerate() {
                squares[n] = dot(way, way);
                (stiffnesses[n], half_tensions[n]) = (links.spring.stiffness, links.spring.half_tension);
            }
            L::pulls(squares, stiffnesses, half_tensions)
        }
    }
}

/// Adds `factor` times `vector` where a lane is set.
#[inline(always)]
unsafe fn add_scaled<L: Lanes>(sums: &mut [L; 3], vector: [L; 3], factor: L, lanes: u32) {
    // SAFETY: the caller's promise.
    unsafe {
        let factor = factor.where_set(lanes);
        for (sum, part) in sums.iter_mut().zip(vector) {
            *sum = part.multiply_add(factor, *sum);
        }
    }
}

/// The spring forces, N; with damping, the second vectors are velocities.
pub(super) struct Force<const DAMPED: bool>;

impl<const DAMPED: bool> Quantity for Force<DAMPED> {
    const SECOND: bool = DAMPED;
    const DAMPED: bool = DAMPED;

    #[inline(always)]
    unsafe fn add<L: Lanes, const N: usize>(sums: &mut [L; 3], ways: Ways<L, N>, _: &Tangent) {
        // SAFETY: the same contract.
        unsafe {
            let (mut factors, inverses) = ways.pulls();
            if DAMPED {
                for n in 0..N {
                    let rate = dot(ways.ways[n], ways.differences[n]);
                    let rate = rate.multiply(inverses[n]).multiply(inverses[n]);
                    factors[n] = rate.multiply_add(ways.links[n].spring.damping, factors[n]);
                }
            }
            for (n, &factor) in factors.iter().enumerate() {
                add_scaled(sums, ways.ways[n], factor, ways.links[n].lanes);
            }
        }
    }

    fn of_link(node: usize, link: &Link, way: Vec3, difference: Vec3, _: &Tangent) -> Vec3 {
        pull(node, link, way, DAMPED.then_some(difference))
    }
}

/// How the forces change where the nodes go by the second vectors, to first order, N.
pub(super) struct Change<const DAMPED: bool>;

impl<const DAMPED: bool> Quantity for Change<DAMPED> {
    const SECOND: bool = true;
    const DAMPED: bool = DAMPED;

    #[inline(always)]
    unsafe fn add<L: Lanes, const N: usize>(sums: &mut [L; 3], ways: Ways<L, N>, tangent: &Tangent) {
        // SAFETY: the same contract.
        unsafe {
            let (pulls, inverses) = ways.pulls();
            for n in 0..N {
                let spring = ways.links[n].spring;
                let across = L::splat(tangent.floor).greater(pulls[n]);
                let mut along = spring.stiffness.subtract(across);
                if DAMPED {
                    along = spring.damping.multiply_add(L::splat(tangent.rate), along);
                }
                let lengthening = dot(ways.ways[n], ways.differences[n]);
                let factor = lengthening.multiply(inverses[n]).multiply(inverses[n]).multiply(along);
                add_scaled(sums, ways.ways[n], factor, ways.links[n].lanes);
                // A comparison drops what is NaN: here it has been seen.
                add_scaled(sums, ways.differences[n], across, ways.links[n].lanes);
            }
        }
    }

    fn of_link(node: usize, link: &Link, way: Vec3, difference: Vec3, tangent: &Tangent) -> Vec3 {
        tangent.change(node, link, way, difference)
    }
}

/// Half the energy of the springs, as x, J: the other half is met at their other ends.
pub(super) struct HalfEnergy;

impl Quantity for HalfEnergy {
    const SECOND: bool = false;
    const DAMPED: bool = false;
    const RESTING: bool = true;

    #[inline(always)]
    unsafe fn add<L: Lanes, const N: usize>(sums: &mut [L; 3], ways: Ways<L, N>, _: &Tangent) {
        // SAFETY: the same contract.
        unsafe {
            let (_, inverses) = ways.pulls();
            for (n, &inverse) in inverses.iter().enumerate() {
                let square = dot(ways.ways[n], ways.ways[n]);
                let stretch = square.multiply(inverse).subtract(ways.links[n].spring.rest_length);
                let force = stretch
                    .multiply(ways.links[n].spring.stiffness)
                    .multiply(L::splat(0.25));
                let energy = force.multiply(stretch);
                sums[0] = energy
                    .where_set(ways.links[n].lanes)
                    .multiply_add(L::splat(1.0), sums[0]);
            }
        }
    }

    fn of_link(node: usize, link: &Link, way: Vec3, _: Vec3, _: &Tangent) -> Vec3 {
        Vec3::new(half_energy(node, link, way), 0.0, 0.0)
    }
}

#[inline(always)]
pub(super) unsafe fn difference<L: Lanes>([ax, ay, az]: [L; 3], [bx, by, bz]: [L; 3]) -> [L; 3] {
    // SAFETY: the caller's promise.
    unsafe { [ax.subtract(bx), ay.subtract(by), az.subtract(bz)] }
}

#[inline(always)]
unsafe fn dot<L: Lanes>([ax, ay, az]: [L; 3], [bx, by, bz]: [L; 3]) -> L {
    // SAFETY: the caller's promise.
    unsafe { az.multiply_add(bz, ay.multiply_add(by, ax.multiply(bx))) }
}
