//! SIMD kernels for tetrahedra, with as many elements at once as the processor has lanes.
//!
//! Let F be the current edges from a tetrahedron's first corner times the inverse of the rest edges, E = (F^T F - I) /
//! 2 and J = det F. The St Venant-Kirchhoff energy is `V (lambda/2 (tr E)² + mu tr E² + kappa/2 (J - 1)²)`. Forces
//! follow from `P = F S + kappa (J - 1) cof F` and `S = lambda tr E + 2 mu E`. The laws are isotropic, so each
//! tetrahedron uses a rest frame in which the inverse is upper triangular and has six entries instead of nine.
#![allow(unsafe_code)]

mod hyperelastic;
mod linearize;
mod node_pairs;
mod st_venant_kirchhoff;
mod tangent_matrix;

use std::ops::Range;

use self::hyperelastic::HyperelasticTangent;
use self::linearize::{FindDifferentials, FindStiffenings, Linearize};
pub(super) use self::node_pairs::NodePairs;
use self::st_venant_kirchhoff::{FindEnergy, FindForces, FindStresses, FindVolumeChanges, StVenantKirchhoff};
pub(crate) use self::tangent_matrix::TangentMatrix;
use crate::codec::saved;
use crate::elements::ElasticLaw;
use crate::elements::laws::with_hyperelastic;
use crate::simd::algebra::{Matrix3, Six, cross, difference, dot, sum, times_lower, times_upper};
use crate::simd::{ChosenKernel, Lanes, Record};

/// The number of tetrahedra of a group.
pub(crate) const GROUP: usize = 16;

/// Sixteen tetrahedra in structure-of-arrays layout. Unused lanes have no volume.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug)]
pub(crate) struct Group {
    /// Twice the indices of the nodes in the part: a record has 16 bytes, and addresses are scaled by at most 8.
    pub corners: [[u16; GROUP]; 4],
    /// The inverse of the rest edges, 1/m: its entries 00, 01, 02, 11, 12, 22.
    pub inverse: [[f32; GROUP]; 6],
    /// The rest volume times the relative stiffness, m³.
    pub volumes: [f32; GROUP],
    /// A bound on the squared angular frequency of its nodes at rest, 1/s².
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

/// The stresses of sixteen tetrahedra, Pa: the entries 00, 01, 02, 11, 12, 22 of S, and the pressure of the volume
/// term.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stresses(pub [[f32; GROUP]; 7]);

saved! { Stresses { 0 } }

impl Stresses {
    pub const ZERO: Self = Self([[0.0; GROUP]; 7]);
}

/// The groups of a part, with node indices below `node_count`.
#[derive(Debug)]
pub(crate) struct TetrahedronGroups {
    groups: Vec<Group>,
    node_count: usize,
}

saved! { TetrahedronGroups { groups, node_count } where Self::has_valid_corners }

impl TetrahedronGroups {
    /// # Panics
    /// If a corner is not below `node_count`.
    pub fn new(groups: Vec<Group>, node_count: usize) -> Self {
        let groups = Self { groups, node_count };
        assert!(groups.has_valid_corners());
        groups
    }

    fn has_valid_corners(&self) -> bool {
        let corners = self.groups.iter().flat_map(|group| group.corners.as_flattened());
        corners.into_iter().all(|corner| self.is_valid_corner(corner))
    }

    fn is_valid_corner(&self, corner: &u16) -> bool {
        usize::from(corner / 2) < self.node_count && corner.is_multiple_of(2)
    }

    pub fn as_slice(&self) -> &[Group] {
        &self.groups
    }

    /// Sets each tetrahedron's rate bound to the highest of its corners' bounds.
    pub fn set_rates(&mut self, corner_rate: impl Fn(u16) -> f32) {
        for group in &mut self.groups {
            for lane in (0..GROUP).filter(|&lane| group.volumes[lane] > 0.0) {
                let rates = group.corners.map(|corners| corner_rate(corners[lane] / 2));
                group.rates[lane] = rates.into_iter().fold(0.0, f32::max);
            }
        }
    }

    /// Replaces volume and inverse of the tetrahedra for which `shape` returns new ones. A volume of 0 removes the
    /// tetrahedron.
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

    /// Stores a tetrahedron in a free lane of a group. Corners are twice the indices of nodes.
    ///
    /// # Panics
    /// If a corner is not below the number of nodes.
    pub fn insert(&mut self, [group, lane]: [usize; 2], corners: [u16; 4], inverse: [f32; 6], volume: f32) {
        assert!(corners.iter().all(|corner| self.is_valid_corner(corner)));
        let group = &mut self.groups[group];
        for (to, corner) in group.corners.iter_mut().zip(corners) {
            to[lane] = corner;
        }
        for (to, entry) in group.inverse.iter_mut().zip(inverse) {
            to[lane] = entry;
        }
        group.volumes[lane] = volume;
    }

    /// Sets the rate bound of a tetrahedron.
    pub fn set_rate(&mut self, [group, lane]: [usize; 2], rate: f32) {
        self.groups[group].rates[lane] = rate;
    }

    /// Sets the volume of a tetrahedron.
    pub fn set_volume(&mut self, [group, lane]: [usize; 2], volume: f32) {
        self.groups[group].volumes[lane] = volume;
    }

    /// Removes a tetrahedron: its lane has no volume afterwards.
    pub fn remove(&mut self, group: usize, lane: usize) {
        let group = &mut self.groups[group];
        group.volumes[lane] = 0.0;
        group.rates[lane] = 0.0;
        group.inverse.iter_mut().for_each(|entry| entry[lane] = 0.0);
    }

    /// Adds the forces of the tetrahedra to `sums`, N. `extra` are extra stresses; the slice may be empty. Returns a
    /// bound on the squared angular frequency, 1/s².
    pub fn forces(
        &self,
        kernel: ChosenKernel,
        law: ElasticLaw,
        extra: &[Stresses],
        positions: &[Record],
        sums: &mut [Record],
    ) -> f32 {
        assert!(extra.is_empty() || extra.len() == self.groups.len());
        let tetrahedra = self.checked(positions, sums);
        with_hyperelastic!(
            law,
            |hyperelastic_law| if law.nodal_pressure {
                kernel.run_with_lanes(hyperelastic::HyperelasticForces::<_, true> {
                    law,
                    hyperelastic_law,
                    tetrahedra,
                })
            } else {
                kernel.run_with_lanes(hyperelastic::HyperelasticForces::<_, false> {
                    law,
                    hyperelastic_law,
                    tetrahedra,
                })
            },
            match (law.nodal_pressure, extra) {
                (true, []) => kernel.run_with_lanes(FindForces::<true, false> { law, extra, tetrahedra }),
                (false, []) => kernel.run_with_lanes(FindForces::<false, false> { law, extra, tetrahedra }),
                (true, _) => kernel.run_with_lanes(FindForces::<true, true> { law, extra, tetrahedra }),
                (false, _) => kernel.run_with_lanes(FindForces::<false, true> { law, extra, tetrahedra }),
            }
        )
    }

    /// Adds the force differentials for these displacements to `sums`, N.
    pub fn force_differentials(
        &self,
        kernel: ChosenKernel,
        law: ElasticLaw,
        extra: &[Stresses],
        [positions, displacements]: [&[Record]; 2],
        sums: &mut [Record],
    ) {
        assert_eq!(displacements.len(), self.node_count);
        assert!(extra.is_empty() || extra.len() == self.groups.len());
        let (displacements, tetrahedra) = (displacements.as_ptr(), self.checked(positions, sums));
        with_law(
            law,
            extra,
            true,
            Differentiate {
                kernel,
                is_nodal: law.nodal_pressure,
                displacements,
                tetrahedra,
            },
        );
    }

    /// Assembles the tangent matrix.
    pub fn assemble(
        &self,
        kernel: ChosenKernel,
        law: ElasticLaw,
        extra: &[Stresses],
        positions: &[Record],
        matrix: &mut TangentMatrix,
    ) {
        assert!(extra.is_empty() || extra.len() == self.groups.len());
        let tetrahedra = self.checked(positions, &mut []);
        with_law(
            law,
            extra,
            true,
            Assemble {
                kernel,
                matrix,
                tetrahedra,
            },
        );
    }

    /// Assembles the blocks of pairs, and computes upper bounds on the stiffness relative to rest.
    pub fn assemble_pairs(
        &self,
        kernel: ChosenKernel,
        law: ElasticLaw,
        extra: &[Stresses],
        positions: &[Record],
        (pairs, stiffenings): (&mut NodePairs, &mut [[f32; GROUP]]),
    ) {
        assert!(extra.is_empty() || extra.len() == self.groups.len());
        with_law(
            law,
            extra,
            false,
            FindBound {
                kernel,
                pairs,
                stiffenings,
                groups: self,
                positions,
            },
        );
    }

    /// Sets each tetrahedron's rate bound to the highest of its corners' bounds, over its stiffness relative to rest.
    /// Returns the highest of these stiffnesses.
    pub fn set_relative_rates(&mut self, stiffenings: &[[f32; GROUP]], corner_rate: impl Fn(u16) -> f32) -> f32 {
        self.set_rates(corner_rate);
        let mut stiffest = 1.0_f32;
        for (group, stiffenings) in self.groups.iter_mut().zip(stiffenings) {
            for lane in (0..GROUP).filter(|&lane| group.volumes[lane] > 0.0) {
                let stiffening = stiffenings[lane].max(1.0);
                stiffest = stiffest.max(stiffening);
                group.rates[lane] /= stiffening;
            }
        }
        stiffest
    }

    /// Computes the stresses of the tetrahedra, without nodal pressures.
    pub fn stresses(&self, kernel: ChosenKernel, law: ElasticLaw, positions: &[Record], stresses: &mut [Stresses]) {
        assert_eq!(stresses.len(), self.groups.len());
        kernel.run_with_lanes(FindStresses {
            law,
            stresses,
            tetrahedra: self.checked(positions, &mut []),
        });
    }

    /// Adds a quarter of each tetrahedron's volume change to the first component of its nodes' sums, m³. With
    /// displacements, adds the differential of the volume instead.
    pub fn volume_changes(
        &self,
        kernel: ChosenKernel,
        positions: &[Record],
        displacements: Option<&[Record]>,
        sums: &mut [Record],
    ) {
        assert!(displacements.is_none_or(|displacements| displacements.len() == self.node_count));
        kernel.run_with_lanes(FindVolumeChanges {
            displacements: displacements.map(<[Record]>::as_ptr),
            tetrahedra: self.checked(positions, sums),
        });
    }

    /// The energy of the tetrahedra, without that of nodal pressures, J.
    pub fn energy(&self, kernel: ChosenKernel, law: ElasticLaw, positions: &[Record]) -> f64 {
        kernel.run_with_lanes(FindEnergy {
            law,
            tetrahedra: self.checked(positions, &mut []),
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

/// Work with the linearized law of a part.
trait WithLaw {
    fn run(self, law: impl Linearize);
}

/// Runs `work` with a law and its extra stresses. `is_clamped`: with tangents that are made positive semidefinite.
fn with_law(law: ElasticLaw, extra: &[Stresses], is_clamped: bool, work: impl WithLaw) {
    with_hyperelastic!(
        law,
        |hyperelastic_law| work.run(HyperelasticTangent {
            law,
            hyperelastic_law,
            is_clamped,
        }),
        if extra.is_empty() {
            work.run(StVenantKirchhoff::<false> { law, extra, is_clamped });
        } else {
            work.run(StVenantKirchhoff::<true> { law, extra, is_clamped });
        }
    );
}

struct Differentiate<'a> {
    kernel: ChosenKernel,
    is_nodal: bool,
    displacements: *const Record,
    tetrahedra: Tetrahedra<'a>,
}

impl WithLaw for Differentiate<'_> {
    fn run(self, law: impl Linearize) {
        let (displacements, tetrahedra) = (self.displacements, self.tetrahedra);
        if self.is_nodal {
            self.kernel.run_with_lanes(FindDifferentials::<_, true> {
                law,
                displacements,
                tetrahedra,
            });
        } else {
            self.kernel.run_with_lanes(FindDifferentials::<_, false> {
                law,
                displacements,
                tetrahedra,
            });
        }
    }
}

struct FindBound<'a> {
    kernel: ChosenKernel,
    pairs: &'a mut NodePairs,
    stiffenings: &'a mut [[f32; GROUP]],
    groups: &'a TetrahedronGroups,
    positions: &'a [Record],
}

impl WithLaw for FindBound<'_> {
    fn run(self, law: impl Linearize) {
        self.kernel.run_with_lanes(FindStiffenings {
            law: &law,
            stiffenings: self.stiffenings,
            tetrahedra: self.groups.checked(self.positions, &mut []),
        });
        let tetrahedra = self.groups.checked(self.positions, &mut []);
        self.pairs.assemble(self.kernel, law, tetrahedra);
    }
}

struct Assemble<'a> {
    kernel: ChosenKernel,
    matrix: &'a mut TangentMatrix,
    tetrahedra: Tetrahedra<'a>,
}

impl WithLaw for Assemble<'_> {
    fn run(self, law: impl Linearize) {
        self.matrix.assemble(self.kernel, law, self.tetrahedra);
    }
}

/// Groups with validated pointers: corners index readable positions and, except for energies and stresses, writable
/// sums.
struct Tetrahedra<'a> {
    groups: &'a [Group],
    positions: *const Record,
    sums: *mut Record,
}

/// The deformation of the tetrahedra of a lane batch.
#[derive(Clone, Copy)]
struct DeformedLanes<L> {
    /// The deformation gradient F.
    gradient: Matrix3<L>,
    /// The cofactors of F.
    cofactors: Matrix3<L>,
    /// 2 E.
    twice_strain: Six<L>,
    /// 2 tr E.
    twice_trace: L,
    /// The volumetric strain J - 1.
    volume_strain: L,
    /// The mean of the fourth components of its nodes' records, which are their pressures if there are any, Pa.
    pressure: L,
}

impl<'a> Tetrahedra<'a> {
    /// The edges from the first corner to the others, and the mean of the fourth components of the corners' records.
    ///
    /// # Safety
    /// As for the kernel; `first` is the first lane of a batch.
    #[inline(always)]
    unsafe fn edges<L: Lanes>(from: *const Record, group: &Group, first: usize) -> (Matrix3<L>, L) {
        // SAFETY: corners are indices of records.
        unsafe {
            let [a, b, c, d] = &group.corners;
            let [ax, ay, az, pa] = L::gather_records_scaled(from, a.as_ptr().add(first));
            let [bx, by, bz, pb] = L::gather_records_scaled(from, b.as_ptr().add(first));
            let [cx, cy, cz, pc] = L::gather_records_scaled(from, c.as_ptr().add(first));
            let [dx, dy, dz, pd] = L::gather_records_scaled(from, d.as_ptr().add(first));
            let origin = [ax, ay, az];
            let edges = [
                difference([bx, by, bz], origin),
                difference([cx, cy, cz], origin),
                difference([dx, dy, dz], origin),
            ];
            (edges, pa.add(pb).add(pc.add(pd)).mul(L::splat(0.25)))
        }
    }

    #[inline(always)]
    unsafe fn inverse<L: Lanes>(group: &Group, first: usize) -> Six<L> {
        // SAFETY: the lanes are of a group.
        unsafe { load_six(&group.inverse, first) }
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
                dot(a, a).sub(one),
                dot(a, b),
                dot(a, c),
                dot(b, b).sub(one),
                dot(b, c),
                dot(c, c).sub(one),
            ];
            let cofactors = [cross(b, c), cross(c, a), cross(a, b)];
            DeformedLanes {
                gradient,
                cofactors,
                twice_strain,
                twice_trace: twice_strain[0].add(twice_strain[3]).add(twice_strain[5]),
                volume_strain: dot(a, cofactors[0]).sub(one),
                pressure,
            }
        }
    }

    /// Subtracts the volume times the stress, applied to the gradients of the shape functions, from the forces of the
    /// corners.
    #[inline(always)]
    unsafe fn scatter_forces<L: Lanes>(&self, group: &Group, first: usize, stress: Matrix3<L>, inverse: Six<L>) {
        // SAFETY: the same contract.
        unsafe {
            let [b, c, d] = times_lower(stress, inverse);
            let corners = &group.corners;
            L::scatter_add_records(self.sums, corners[1].as_ptr().add(first), b);
            L::scatter_add_records(self.sums, corners[2].as_ptr().add(first), c);
            L::scatter_add_records(self.sums, corners[3].as_ptr().add(first), d);
            let zero = [L::splat(0.0); 3];
            let a = difference(zero, sum(sum(b, c), d));
            L::scatter_add_records(self.sums, corners[0].as_ptr().add(first), a);
        }
    }
}

/// Loads the first six rows of numbers for a lane batch.
///
/// # Safety
/// As for the kernel; there are at least six rows, and `first` is the first lane of a batch.
#[inline(always)]
unsafe fn load_six<L: Lanes>(numbers: &[[f32; GROUP]], first: usize) -> Six<L> {
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

/// The first lane of each batch.
fn batches<L: Lanes>() -> impl Iterator<Item = usize> {
    Range { start: 0, end: GROUP }.step_by(L::COUNT)
}

impl Stresses {
    /// # Safety
    /// As for the kernel; `first` is the first lane of a batch.
    #[inline(always)]
    unsafe fn entries<L: Lanes>(&self, first: usize) -> Six<L> {
        // SAFETY: the lanes are of a group.
        unsafe { load_six(&self.0, first) }
    }

    /// # Safety
    /// As for [`Self::entries`].
    #[inline(always)]
    unsafe fn pressures<L: Lanes>(&self, first: usize) -> L {
        // SAFETY: the lanes are of a group.
        unsafe { L::load(self.0[6].as_ptr().add(first)) }
    }
}
