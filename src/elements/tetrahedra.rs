//! Tetrahedra of St Venant and Kirchhoff's law with a signed volume term, as many at a time as the processor has lanes.
//!
//! With F the edges from a tetrahedron's first corner times the inverse of what they are at rest, E = (F^T F - I) / 2 and J = det F, the
//! energy is `V (lambda/2 (tr E)² + mu tr E² + kappa/2 (J - 1)²)` and the forces are those of `P = F S + kappa (J - 1) cof F`,
//! `S = lambda tr E + 2 mu E`. The law is the same in every direction, so each tetrahedron may have its own frame at rest: one in
//! which that inverse is upper triangular, six numbers instead of nine.
#![allow(unsafe_code)]

mod hyperelastic;
mod st_venant_kirchhoff;

use std::ops::Range;

use self::st_venant_kirchhoff::{FindChanges, FindEnergy, FindForces, FindGrowths, FindStresses};
use crate::codec::saved;
use crate::elements::Law;
use crate::elements::laws::with_hyperelastic;
use crate::simd::algebra::{Matrix3, Six, cross, difference, dot, sum, times_lower, times_upper};
use crate::simd::{ChosenKernel, Lanes, Record};

/// Tetrahedra side by side.
pub(crate) const GROUP: usize = 16;

/// Sixteen tetrahedra side by side; what is missing to sixteen has no volume.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug)]
pub(crate) struct Group {
    /// Twice the numbers of their nodes in the part, as a record is twice as long as what an address can be scaled by.
    pub corners: [[u16; GROUP]; 4],
    /// The inverse at rest, 1/m: its entries 00, 01, 02, 11, 12, 22.
    pub inverse: [[f32; GROUP]; 6],
    /// At rest, times how much stiffer it is than the law, m³.
    pub volumes: [f32; GROUP],
    /// A bound on the squared frequency of its nodes at rest, 1/s².
    pub rates: [f32; GROUP],
}

saved! { Group { corners, inverse, volumes, rates } }

impl Group {
    pub const EMPTY: Self = Self {
        corners: [[0; GROUP]; 4],
        inverse: [[0.0; GROUP]; 6],
        volumes: [0.0; GROUP],
        rates: [0.0; GROUP],
    };
}

/// Stresses of sixteen tetrahedra, Pa: S with its entries 00, 01, 02, 11, 12, 22, and the pressure of the volume term.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stresses(pub [[f32; GROUP]; 7]);

saved! { Stresses { 0 } }

impl Stresses {
    pub const ZERO: Self = Self([[0.0; GROUP]; 7]);
}

/// Tetrahedra of nodes below a number.
#[derive(Debug)]
pub(crate) struct TetrahedronGroups {
    groups: Vec<Group>,
    node_count: usize,
}

saved! { TetrahedronGroups { groups, node_count } where Self::lead_to_nodes }

impl TetrahedronGroups {
    /// # Panics
    /// Where a corner is not below `node_count`.
    pub fn new(groups: Vec<Group>, node_count: usize) -> Self {
        let groups = Self { groups, node_count };
        assert!(groups.lead_to_nodes());
        groups
    }

    fn lead_to_nodes(&self) -> bool {
        let corners = self.groups.iter().flat_map(|group| group.corners.as_flattened());
        corners.into_iter().all(|corner| self.is_node(corner))
    }

    fn is_node(&self, corner: &u16) -> bool {
        usize::from(corner / 2) < self.node_count && corner.is_multiple_of(2)
    }

    pub fn as_slice(&self) -> &[Group] {
        &self.groups
    }

    /// Sets the bounds on frequencies to the highest of the corners'.
    pub fn set_rates(&mut self, of_corner: impl Fn(u16) -> f32) {
        for group in &mut self.groups {
            for lane in (0..GROUP).filter(|&lane| group.volumes[lane] > 0.0) {
                let rates = group.corners.map(|corners| of_corner(corners[lane] / 2));
                group.rates[lane] = rates.into_iter().fold(0.0, f32::max);
            }
        }
    }

    /// Gives tetrahedra that there are another volume and inverse, those for which `shape` has one; without a volume they are taken away.
    pub fn reshape(&mut self, mut shape: impl FnMut(&Group, usize) -> Option<(f32, [f32; 6])>) {
        for index in 0..self.groups.len() {
            for lane in 0..GROUP {
                let group = &self.groups[index];
                if group.volumes[lane] == 0.0 {
                    continue;
                }
                if let Some((volume, inverse)) = shape(group, lane) {
                    if volume == 0.0 {
                        self.remove(index, lane);
                        continue;
                    }
                    let group = &mut self.groups[index];
                    group.volumes[lane] = volume;
                    for (to, entry) in group.inverse.iter_mut().zip(inverse) {
                        to[lane] = entry;
                    }
                }
            }
        }
    }

    /// Puts a tetrahedron of these corners, twice the numbers of nodes, into a lane of a group where there is none.
    ///
    /// # Panics
    /// Where a corner is not below the number of nodes.
    pub fn put(&mut self, [group, lane]: [usize; 2], corners: [u16; 4], inverse: [f32; 6], volume: f32) {
        assert!(corners.iter().all(|corner| self.is_node(corner)));
        let group = &mut self.groups[group];
        for (to, corner) in group.corners.iter_mut().zip(corners) {
            to[lane] = corner;
        }
        for (to, entry) in group.inverse.iter_mut().zip(inverse) {
            to[lane] = entry;
        }
        group.volumes[lane] = volume;
    }

    /// Sets the bound on frequencies of a tetrahedron.
    pub fn set_rate(&mut self, [group, lane]: [usize; 2], rate: f32) {
        self.groups[group].rates[lane] = rate;
    }

    /// Gives a tetrahedron another volume.
    pub fn set_volume(&mut self, [group, lane]: [usize; 2], volume: f32) {
        self.groups[group].volumes[lane] = volume;
    }

    /// Takes away a tetrahedron: what is left of it has no volume.
    pub fn remove(&mut self, group: usize, lane: usize) {
        let group = &mut self.groups[group];
        group.volumes[lane] = 0.0;
        group.rates[lane] = 0.0;
        group.inverse.iter_mut().for_each(|entry| entry[lane] = 0.0);
    }

    /// Adds the forces of the tetrahedra, N, with nodes at `positions`, and with `loads` on top of their stresses, which may be none: a
    /// bound on the squares of frequencies, 1/s².
    pub fn forces(
        &self,
        kernel: ChosenKernel,
        law: Law,
        loads: &[Stresses],
        positions: &[Record],
        sums: &mut [Record],
    ) -> f32 {
        assert!(loads.is_empty() || loads.len() == self.groups.len());
        let of = self.checked(positions, sums);
        with_hyperelastic!(
            law,
            |form| if law.rings {
                kernel.run_with_lanes(hyperelastic::HyperelasticForces::<_, true> { law, form, of })
            } else {
                kernel.run_with_lanes(hyperelastic::HyperelasticForces::<_, false> { law, form, of })
            },
            match (law.rings, loads) {
                (true, []) => kernel.run_with_lanes(FindForces::<true, false> { law, loads, of }),
                (false, []) => kernel.run_with_lanes(FindForces::<false, false> { law, loads, of }),
                (true, _) => kernel.run_with_lanes(FindForces::<true, true> { law, loads, of }),
                (false, _) => kernel.run_with_lanes(FindForces::<false, true> { law, loads, of }),
            }
        )
    }

    /// Adds how these forces change where nodes go these ways, to first order, N.
    pub fn changes(
        &self,
        kernel: ChosenKernel,
        law: Law,
        loads: &[Stresses],
        [positions, ways]: [&[Record]; 2],
        sums: &mut [Record],
    ) {
        assert_eq!(ways.len(), self.node_count);
        assert!(loads.is_empty() || loads.len() == self.groups.len());
        let ways = ways.as_ptr();
        let of = self.checked(positions, sums);
        with_hyperelastic!(
            law,
            |form| if law.rings {
                kernel.run_with_lanes(hyperelastic::HyperelasticChanges::<_, true> { law, form, ways, of });
            } else {
                kernel.run_with_lanes(hyperelastic::HyperelasticChanges::<_, false> { law, form, ways, of });
            },
            match (law.rings, loads) {
                (true, []) => kernel.run_with_lanes(FindChanges::<true, false> { law, loads, ways, of }),
                (false, []) => kernel.run_with_lanes(FindChanges::<false, false> { law, loads, ways, of }),
                (true, _) => kernel.run_with_lanes(FindChanges::<true, true> { law, loads, ways, of }),
                (false, _) => kernel.run_with_lanes(FindChanges::<false, true> { law, loads, ways, of }),
            }
        );
    }

    /// Writes the stresses of the tetrahedra, without pressures where those are of rings.
    pub fn stresses(&self, kernel: ChosenKernel, law: Law, positions: &[Record], stresses: &mut [Stresses]) {
        assert_eq!(stresses.len(), self.groups.len());
        kernel.run_with_lanes(FindStresses {
            law,
            stresses,
            of: self.checked(positions, &mut []),
        });
    }

    /// Adds to the first number of each node a quarter of what its tetrahedra are larger than at rest, m³, or with ways to first
    /// order how much larger they become.
    pub fn growths(&self, kernel: ChosenKernel, positions: &[Record], ways: Option<&[Record]>, sums: &mut [Record]) {
        assert!(ways.is_none_or(|ways| ways.len() == self.node_count));
        kernel.run_with_lanes(FindGrowths {
            ways: ways.map(<[Record]>::as_ptr),
            of: self.checked(positions, sums),
        });
    }

    /// The energy of the tetrahedra, without that of rings, J.
    pub fn energy(&self, kernel: ChosenKernel, law: Law, positions: &[Record]) -> f64 {
        kernel.run_with_lanes(FindEnergy {
            law,
            of: self.checked(positions, &mut []),
        })
    }

    fn checked<'a>(&'a self, positions: &'a [Record], sums: &'a mut [Record]) -> Tetrahedra<'a> {
        assert!(positions.len() == self.node_count && (sums.is_empty() || sums.len() == self.node_count));
        Tetrahedra {
            groups: &self.groups,
            positions: positions.as_ptr(),
            sums: sums.as_mut_ptr(),
        }
    }
}

/// Tetrahedra whose corners lead to readable positions and, but for their energy, writable sums.
struct Tetrahedra<'a> {
    groups: &'a [Group],
    positions: *const Record,
    sums: *mut Record,
}

/// A tetrahedron as it is deformed.
struct DeformedLanes<L> {
    /// F.
    gradient: Matrix3<L>,
    /// The cofactors of F.
    cofactors: Matrix3<L>,
    /// 2 E.
    twice_strain: Six<L>,
    /// 2 tr E.
    twice_trace: L,
    /// J - 1.
    growth: L,
    /// The mean of its nodes' pressures, where they have any, Pa.
    pressure: L,
}

impl<'a> Tetrahedra<'a> {
    /// The edges from the first corner to the others, and the mean of what the corners have beside their places.
    ///
    /// # Safety
    /// As for the kernel; `first` is a turn's first lane.
    #[inline(always)]
    unsafe fn edges<L: Lanes>(from: *const Record, group: &Group, first: usize) -> (Matrix3<L>, L) {
        // SAFETY: corners lead to records.
        unsafe {
            let [a, b, c, d] = &group.corners;
            let [ax, ay, az, pa] = L::records_twice(from, a.as_ptr().add(first));
            let [bx, by, bz, pb] = L::records_twice(from, b.as_ptr().add(first));
            let [cx, cy, cz, pc] = L::records_twice(from, c.as_ptr().add(first));
            let [dx, dy, dz, pd] = L::records_twice(from, d.as_ptr().add(first));
            let place = [ax, ay, az];
            let edges = [
                difference([bx, by, bz], place),
                difference([cx, cy, cz], place),
                difference([dx, dy, dz], place),
            ];
            (edges, pa.add(pb).add(pc.add(pd)).multiply(L::splat(0.25)))
        }
    }

    #[inline(always)]
    unsafe fn inverse<L: Lanes>(group: &Group, first: usize) -> Six<L> {
        // SAFETY: the lanes are of a group.
        unsafe { six(&group.inverse, first) }
    }

    #[inline(always)]
    unsafe fn volumes<L: Lanes>(group: &Group, first: usize) -> L {
        // SAFETY: the lanes are of a group.
        unsafe { L::load(group.volumes.as_ptr().add(first)) }
    }

    #[inline(always)]
    unsafe fn deformed<L: Lanes>(&self, group: &Group, first: usize, inverse: Six<L>) -> DeformedLanes<L> {
        // SAFETY: the same contract.
        unsafe {
            let (edges, pressure) = Self::edges::<L>(self.positions, group, first);
            let gradient = times_upper(edges, inverse);
            let [a, b, c] = gradient;
            let one = L::splat(1.0);
            let twice_strain = [
                dot(a, a).subtract(one),
                dot(a, b),
                dot(a, c),
                dot(b, b).subtract(one),
                dot(b, c),
                dot(c, c).subtract(one),
            ];
            let cofactors = [cross(b, c), cross(c, a), cross(a, b)];
            DeformedLanes {
                gradient,
                cofactors,
                twice_strain,
                twice_trace: twice_strain[0].add(twice_strain[3]).add(twice_strain[5]),
                growth: dot(a, cofactors[0]).subtract(one),
                pressure,
            }
        }
    }

    /// Adds the forces of stresses times minus the volume at rest.
    #[inline(always)]
    unsafe fn spread<L: Lanes>(&self, group: &Group, first: usize, stress: Matrix3<L>, inverse: Six<L>) {
        // SAFETY: the same contract.
        unsafe {
            let [b, c, d] = times_lower(stress, inverse);
            let corners = &group.corners;
            L::add_to_records(self.sums, corners[1].as_ptr().add(first), b);
            L::add_to_records(self.sums, corners[2].as_ptr().add(first), c);
            L::add_to_records(self.sums, corners[3].as_ptr().add(first), d);
            let zero = [L::splat(0.0); 3];
            let a = difference(zero, sum(sum(b, c), d));
            L::add_to_records(self.sums, corners[0].as_ptr().add(first), a);
        }
    }
}

/// The first six numbers of a turn's lanes.
///
/// # Safety
/// As for the kernel; there are six at least, and `first` is a turn's first lane.
#[inline(always)]
unsafe fn six<L: Lanes>(numbers: &[[f32; GROUP]], first: usize) -> Six<L> {
    // SAFETY: the lanes are of a group.
    unsafe {
        [
            L::load(numbers[0].as_ptr().add(first)),
            L::load(numbers[1].as_ptr().add(first)),
            L::load(numbers[2].as_ptr().add(first)),
            L::load(numbers[3].as_ptr().add(first)),
            L::load(numbers[4].as_ptr().add(first)),
            L::load(numbers[5].as_ptr().add(first)),
        ]
    }
}

/// Where each turn's lanes begin.
fn turns<L: Lanes>() -> impl Iterator<Item = usize> {
    Range { start: 0, end: GROUP }.step_by(L::COUNT)
}

impl Stresses {
    /// # Safety
    /// As for the kernel; `first` is a turn's first lane.
    #[inline(always)]
    unsafe fn entries<L: Lanes>(&self, first: usize) -> Six<L> {
        // SAFETY: the lanes are of a group.
        unsafe { six(&self.0, first) }
    }

    /// # Safety
    /// As above.
    #[inline(always)]
    unsafe fn pressures<L: Lanes>(&self, first: usize) -> L {
        // SAFETY: the lanes are of a group.
        unsafe { L::load(self.0[6].as_ptr().add(first)) }
    }
}
