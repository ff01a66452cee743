//! Spring forces on the nodes of a tile, and other sums over springs, for as many nodes at a time as there are SIMD
//! lanes.
//!
//! The force of a spring is `(k - k L0 / L) d`, where d is the vector of length L to its other end. This takes a
//! quarter fewer operations than `k (L - L0) / L d`, and its rounding error is below that of the positions. Both ends
//! compute the same value with opposite signs, so momentum is lost only to the rounding of sums.

use std::marker::PhantomData;

use glam::Vec3;

use super::accumulators::{
    Accumulator, Change, Force, HalfEnergy, LinkColumn, LinkVectors, NodeVectors, SpringLanes, difference,
};
use super::columns::Columns;
use super::layout::{ColumnEnds, GatherColumn, RunColumn, SpringParameters};
use crate::order::LANES;
use crate::simd::{ChosenKernel, Index, Lanes, WithLanes, prefetch};
use crate::soa::{BasePointers, TileForces, Vectors, View};
use crate::springs::{DirectionInput, ForceInput, Link, Tangent};

impl Columns {
    /// Writes the forces on the nodes of the tile, N.
    pub fn forces(
        &self,
        kernel: ChosenKernel,
        table: &[SpringParameters],
        input: &ForceInput,
        forces: &mut TileForces,
    ) {
        let &ForceInput {
            positions,
            velocities,
            prefetched,
        } = input;
        let velocities = velocities.filter(|_| self.damped).map(Vectors::view);
        let tile = self.tile(table, positions, velocities, prefetched, Tangent::NONE);
        match velocities {
            None => tile.accumulate::<Force<false>>(kernel, forces),
            Some(_) => tile.accumulate::<Force<true>>(kernel, forces),
        }
    }

    /// Writes the first-order changes of the forces on the nodes of the tile, N.
    pub fn force_changes(
        &self,
        kernel: ChosenKernel,
        table: &[SpringParameters],
        input: &DirectionInput,
        changes: &mut TileForces,
    ) {
        let tangent = input.tangent;
        let tile = self.tile(table, input.positions, Some(input.displacements), [&[]; 6], tangent);
        if self.damped && tangent.rate > 0.0 {
            tile.accumulate::<Change<true>>(kernel, changes);
        } else {
            tile.accumulate::<Change<false>>(kernel, changes);
        }
    }

    /// Half the energy of all links of the tile, J.
    pub fn half_energy(&self, kernel: ChosenKernel, table: &[SpringParameters], positions: View) -> f64 {
        let mut energies = TileForces::ZERO;
        let tile = self.tile(table, positions, None, [&[]; 6], Tangent::NONE);
        tile.accumulate::<HalfEnergy>(kernel, &mut energies);
        let [of_nodes, ..] = energies.axes();
        of_nodes[..self.count].iter().copied().map(f64::from).sum()
    }

    fn tile<'a>(
        &'a self,
        table: &'a [SpringParameters],
        positions: View<'a>,
        second_vectors: Option<View<'a>>,
        prefetched: [&'a [f32]; 6],
        tangent: Tangent,
    ) -> KernelTile<'a> {
        // The columns were validated against this range, so the kernel reads it without checks.
        assert!(positions.covers(&self.reads, self.node_count));
        assert!(second_vectors.is_none_or(|second_vectors| second_vectors.covers(&self.reads, self.node_count)));
        KernelTile {
            columns: self,
            table,
            positions: positions.base_pointers(),
            second_vectors: second_vectors.map(|second_vectors| second_vectors.base_pointers()),
            prefetched: prefetched.map(|address| address.as_ptr()),
            tangent,
            fallback: CoincidentFallback {
                columns: self,
                table,
                positions,
                second_vectors,
                tangent,
            },
        }
    }
}

/// The number of runs that are interleaved. Each sum is a dependency chain, and out-of-order execution sees only a
/// limited distance ahead.
const GROUP: usize = 4;

/// The sums over a tile's links, as work for a kernel.
struct TileLinks<'a, Q> {
    tile: KernelTile<'a>,
    sums: &'a mut TileForces,
    accumulator: PhantomData<Q>,
}

/// The data that the kernel reads.
struct KernelTile<'a> {
    columns: &'a Columns,
    table: &'a [SpringParameters],
    /// Covers the range that the columns read.
    positions: BasePointers,
    second_vectors: Option<BasePointers>,
    /// Data to prefetch, block by block.
    prefetched: [*const f32; 6],
    tangent: Tangent,
    fallback: CoincidentFallback<'a>,
}

impl KernelTile<'_> {
    fn accumulate<Q: Accumulator>(self, kernel: ChosenKernel, sums: &mut TileForces) {
        kernel.run_with_lanes(TileLinks::<Q> {
            tile: self,
            sums,
            accumulator: PhantomData,
        });
    }
}

impl<Q: Accumulator> WithLanes for TileLinks<'_, Q> {
    type Output = ();

    #[inline(always)]
    unsafe fn run<L: Lanes>(self) {
        let Self { tile, sums: forces, .. } = self;
        let fallback = &tile.fallback;
        let columns = tile.columns;
        let chunks = LANES / L::COUNT;
        // Two loops, so that each needs few addresses. A regular grid needs only the first.
        let only_runs = columns.own_rest_lengths.is_empty() && columns.near.is_empty() && columns.far.is_empty();
        let mut axes = forces.axes_mut().map(|axis| axis.as_mut_ptr());
        // SAFETY: the same contract; a tile has no more blocks than forces have room for.
        unsafe {
            let mut start = ColumnEnds::default();
            for (block, &end) in columns.blocks.iter().enumerate() {
                for address in tile.prefetched {
                    prefetch(address.wrapping_add(block * LANES));
                }
                for chunk in 0..chunks {
                    let index = block * LANES + chunk * L::COUNT;
                    let sums = tile.sum_runs::<L, Q>(start, end, index);
                    sums.store(axes, index);
                    if only_runs && sums.any_nan() {
                        axes = fallback.nodes::<Q>(index, L::COUNT, forces);
                    }
                }
                start = end;
            }
            if !only_runs {
                start = ColumnEnds::default();
                for (block, &end) in columns.blocks.iter().enumerate() {
                    for chunk in 0..chunks {
                        let index = block * LANES + chunk * L::COUNT;
                        let sums = tile.add_remaining_columns::<L, Q>(start, end, index, ForceLanes::load(axes, index));
                        sums.store(axes, index);
                        if sums.any_nan() {
                            axes = fallback.nodes::<Q>(index, L::COUNT, forces);
                        }
                    }
                    start = end;
                }
            }
            for batch in 0..columns.strays.batch_count() {
                tile.add_strays::<L, Q>(batch, forces);
            }
        }
    }
}

/// Gather columns with their indices, relative to the window.
struct Gathers<'a, I> {
    headers: &'a [GatherColumn],
    indices: *const [I; LANES],
    window: usize,
}

/// The forces on consecutive nodes; NaN if the ends of a spring coincide.
#[derive(Clone, Copy)]
struct ForceLanes<L>([L; 3]);

impl KernelTile<'_> {
    /// The sum over the runs with shared parameters, for the nodes of a block or a part of it as wide as `L`.
    #[inline(always)]
    unsafe fn sum_runs<L: Lanes, Q: Accumulator>(
        &self,
        start: ColumnEnds,
        end: ColumnEnds,
        index: usize,
    ) -> ForceLanes<L> {
        let columns = self.columns;
        let (node, lane) = (columns.first + index, index % LANES);
        // SAFETY: blocks end within the margins; columns were validated: used lanes refer to nodes of the body, unused
        // ones stay within the margins.
        unsafe {
            let here = self.load_nodes::<L, Q>(node as isize);
            let mut sums = ForceLanes([L::splat(0.0); 3]);
            let runs = columns.runs.get_unchecked(start.runs as usize..end.runs as usize);
            let (groups, rest) = runs.as_chunks::<GROUP>();
            for group in groups {
                // Not a closure: it could be compiled as its own function, without the kernel's instruction set.
                let mut links = [self.load_run::<L, Q>(&group[0], node, lane); GROUP];
                for (links, run) in links.iter_mut().zip(group).skip(1) {
                    *links = self.load_run::<L, Q>(run, node, lane);
                }
                sums.add::<GROUP, Q>(here, links, &self.tangent);
            }
            for run in rest {
                sums.add::<1, Q>(here, [self.load_run::<L, Q>(run, node, lane)], &self.tangent);
            }
            sums
        }
    }

    /// Loads a run for the nodes starting at `node`.
    #[inline(always)]
    unsafe fn load_run<L: Lanes, Q: Accumulator>(&self, run: &RunColumn, node: usize, lane: usize) -> LinkColumn<L> {
        let entry = if Q::USES_DAMPING || Q::USES_REST_LENGTH {
            self.table[usize::from(run.entry)]
        } else {
            SpringParameters::default()
        };
        // SAFETY: as in `sum_runs`.
        unsafe {
            LinkColumn {
                spring: SpringLanes {
                    stiffness: L::splat(run.stiffness),
                    half_tension: L::splat(run.half_tension),
                    rest_length: L::splat(entry.rest_length),
                    damping: L::splat(entry.damping),
                },
                there: self.load_nodes::<L, Q>(node as isize + run.offset as isize),
                lanes: u32::from(run.lanes) >> lane,
            }
        }
    }

    /// Adds all other columns of the same nodes to `sums`.
    #[inline(always)]
    unsafe fn add_remaining_columns<L: Lanes, Q: Accumulator>(
        &self,
        start: ColumnEnds,
        end: ColumnEnds,
        index: usize,
        mut sums: ForceLanes<L>,
    ) -> ForceLanes<L> {
        let columns = self.columns;
        let (node, lane) = (columns.first + index, index % LANES);
        let mut own = start.own as usize;
        // SAFETY: as in `sum_runs`; gathers were validated to refer to nodes of the body.
        unsafe {
            let here = self.load_nodes::<L, Q>(node as isize);
            for run in columns
                .own_runs
                .get_unchecked(start.own_runs as usize..end.own_runs as usize)
            {
                let links = LinkColumn {
                    spring: self.load_parameters::<L, Q>(None, &mut own, lane),
                    there: self.load_nodes::<L, Q>(node as isize + run.offset as isize),
                    lanes: u32::from(run.lanes) >> lane,
                };
                sums.add::<1, Q>(here, [links], &self.tangent);
            }
            let near = Gathers {
                headers: columns.near.get_unchecked(start.near as usize..end.near as usize),
                indices: columns
                    .near_indices
                    .as_ptr()
                    .cast::<[u16; LANES]>()
                    .add(start.near as usize),
                window: columns.window,
            };
            self.add_gathers::<L, Q, u16>(near, here, &mut own, lane, &mut sums);
            let far = Gathers {
                headers: columns.far.get_unchecked(start.far as usize..end.far as usize),
                indices: columns
                    .far_indices
                    .as_ptr()
                    .cast::<[u32; LANES]>()
                    .add(start.far as usize),
                window: 0,
            };
            self.add_gathers::<L, Q, u32>(far, here, &mut own, lane, &mut sums);
            sums
        }
    }

    /// Adds gathers to `sums`.
    #[inline(always)]
    unsafe fn add_gathers<L: Lanes, Q: Accumulator, I: Index>(
        &self,
        gathers: Gathers<I>,
        here: NodeVectors<L>,
        own: &mut usize,
        lane: usize,
        sums: &mut ForceLanes<L>,
    ) {
        let count = gathers.headers.len();
        if count == 0 {
            return;
        }
        // SAFETY: as in `add_remaining_columns`.
        unsafe {
            // The neighbors of the next column are loaded before the current one is added. The sum is a long dependency
            // chain, and out-of-order execution sees only a column or two ahead.
            let mut links = self.load_gather::<L, Q, I>(&gathers, 0, own, lane);
            for column in 1..count {
                let next = self.load_gather::<L, Q, I>(&gathers, column, own, lane);
                sums.add::<1, Q>(here, [links], &self.tangent);
                links = next;
            }
            sums.add::<1, Q>(here, [links], &self.tangent);
        }
    }

    /// Loads one gather column.
    #[inline(always)]
    unsafe fn load_gather<L: Lanes, Q: Accumulator, I: Index>(
        &self,
        gathers: &Gathers<I>,
        column: usize,
        own: &mut usize,
        lane: usize,
    ) -> LinkColumn<L> {
        // SAFETY: as in `add_remaining_columns`.
        unsafe {
            let header = gathers.headers.get_unchecked(column);
            let indices = gathers.indices.add(column).cast::<I>().add(lane);
            LinkColumn {
                spring: self.load_parameters::<L, Q>(header.entry(), own, lane),
                there: self.gather_nodes::<L, Q, I>(indices, gathers.window),
                lanes: u32::from(header.lanes) >> lane,
            }
        }
    }

    /// Adds a batch of sixteen strays to the forces.
    #[inline(always)]
    unsafe fn add_strays<L: Lanes, Q: Accumulator>(&self, batch: usize, forces: &mut TileForces) {
        let batch = self.columns.strays.batch(batch);
        let mut batch_sums = [[0.0_f32; LANES]; 3];
        let mut coincide = false;
        for chunk in 0..LANES / L::COUNT {
            let lane = chunk * L::COUNT;
            // SAFETY: strays were validated to refer to nodes of the body.
            unsafe {
                let here = self.gather_nodes::<L, Q, u32>(batch.nodes.as_ptr().add(lane), 0);
                let there = self.gather_nodes::<L, Q, u32>(batch.neighbors.as_ptr().add(lane), 0);
                let stiffness = L::load(batch.stiffnesses.0.as_ptr().add(lane));
                let rest_length = L::load(batch.rest_lengths.0.as_ptr().add(lane));
                let spring = SpringLanes {
                    stiffness,
                    half_tension: half_tension(stiffness, rest_length),
                    rest_length,
                    damping: L::load(batch.dampings.0.as_ptr().add(lane)),
                };
                let mut sums = ForceLanes([L::splat(0.0); 3]);
                let links = LinkColumn {
                    spring,
                    there,
                    lanes: u32::MAX,
                };
                sums.add::<1, Q>(here, [links], &self.tangent);
                coincide |= sums.any_nan();
                for (sum, batch_sums) in sums.0.into_iter().zip(&mut batch_sums) {
                    sum.store(batch_sums.as_mut_ptr().add(lane));
                }
            }
        }
        for (lane, &index) in batch.local_nodes[..batch.count].iter().enumerate() {
            let mut force = Vec3::from(batch_sums.map(|axis| axis[lane]));
            if coincide {
                let link = Link {
                    neighbor: batch.neighbors[lane],
                    stiffness: batch.stiffnesses.0[lane],
                    rest_length: batch.rest_lengths.0[lane],
                    damping: batch.dampings.0[lane],
                };
                force = self.fallback.link::<Q>(batch.nodes[lane] as usize, &link);
            }
            let index = usize::from(index);
            forces.set(index, forces.get(index) + force);
        }
    }

    /// Loads as many consecutive nodes as `L` has lanes, starting at `node`.
    #[inline(always)]
    unsafe fn load_nodes<L: Lanes, Q: Accumulator>(&self, node: isize) -> NodeVectors<L> {
        // Not a closure, here and below: it could be compiled as its own function, without the kernel's instruction
        // set.
        // SAFETY: used lanes refer to nodes; unused ones stay within the margins.
        unsafe {
            let [x, y, z] = self.positions.axes;
            let position = [
                L::load(x.wrapping_offset(node)),
                L::load(y.wrapping_offset(node)),
                L::load(z.wrapping_offset(node)),
            ];
            match self.second_vectors {
                Some(BasePointers { axes: [x, y, z], .. }) if Q::USES_SECOND => NodeVectors {
                    position,
                    second: [
                        L::load(x.wrapping_offset(node)),
                        L::load(y.wrapping_offset(node)),
                        L::load(z.wrapping_offset(node)),
                    ],
                },
                _ => NodeVectors::without_second(position),
            }
        }
    }

    /// Gathers the nodes with these indices, relative to the window.
    #[inline(always)]
    unsafe fn gather_nodes<L: Lanes, Q: Accumulator, I: Index>(
        &self,
        indices: *const I,
        window: usize,
    ) -> NodeVectors<L> {
        // SAFETY: the indices were validated.
        unsafe {
            let position = gather(self.positions, window, indices);
            match self.second_vectors {
                Some(second_vectors) if Q::USES_SECOND => NodeVectors {
                    position,
                    second: gather(second_vectors, window, indices),
                },
                _ => NodeVectors::without_second(position),
            }
        }
    }

    /// Loads the parameters of a column. `own` counts the columns with per-spring parameters.
    #[inline(always)]
    unsafe fn load_parameters<L: Lanes, Q: Accumulator>(
        &self,
        entry: Option<usize>,
        own: &mut usize,
        lane: usize,
    ) -> SpringLanes<L> {
        // SAFETY: every column with per-spring parameters has an entry in their lists.
        unsafe {
            if let Some(entry) = entry {
                let entry = &self.table[entry];
                return SpringLanes {
                    stiffness: L::splat(entry.stiffness),
                    half_tension: L::splat(entry.half_tension()),
                    rest_length: L::splat(entry.rest_length),
                    damping: L::splat(entry.damping),
                };
            }
            let columns = self.columns;
            let rest_length = L::load(columns.own_rest_lengths.get_unchecked(*own).0.as_ptr().add(lane));
            let stiffness = if columns.own_stiffnesses.is_empty() {
                L::splat(columns.own_stiffness)
            } else {
                L::load(columns.own_stiffnesses.get_unchecked(*own).0.as_ptr().add(lane))
            };
            let spring = SpringLanes {
                stiffness,
                half_tension: half_tension(stiffness, rest_length),
                rest_length,
                damping: if Q::USES_DAMPING {
                    L::load(columns.own_dampings.get_unchecked(*own).0.as_ptr().add(lane))
                } else {
                    rest_length
                },
            };
            *own += 1;
            spring
        }
    }
}

impl<L: Lanes> ForceLanes<L> {
    /// Loads from three arrays that contain these lanes.
    #[inline(always)]
    unsafe fn load(axes: [*mut f32; 3], index: usize) -> Self {
        let [x, y, z] = axes;
        // SAFETY: the caller's promise.
        Self(unsafe { [L::load(x.add(index)), L::load(y.add(index)), L::load(z.add(index))] })
    }

    #[inline(always)]
    unsafe fn store(&self, axes: [*mut f32; 3], index: usize) {
        for (sum, axis) in self.0.into_iter().zip(axes) {
            // SAFETY: the caller's promise.
            unsafe { sum.store(axis.add(index)) };
        }
    }

    #[inline(always)]
    unsafe fn any_nan(&self) -> bool {
        let [x, y, z] = self.0;
        // SAFETY: the same contract.
        unsafe { x.any_nan() || y.any_nan() || z.any_nan() }
    }

    /// Adds the contributions of `N` columns of springs to the nodes `here`.
    #[inline(always)]
    unsafe fn add<const N: usize, Q: Accumulator>(
        &mut self,
        here: NodeVectors<L>,
        links: [LinkColumn<L>; N],
        tangent: &Tangent,
    ) {
        // SAFETY: the same contract.
        unsafe {
            // Not a closure, as in `sum_runs`.
            let [mut offsets, mut differences] = [[here.position; N], [here.second; N]];
            for (n, links) in links.iter().enumerate() {
                offsets[n] = difference(links.there.position, here.position);
                differences[n] = difference(links.there.second, here.second);
            }
            Q::add(
                &mut self.0,
                LinkVectors {
                    offsets,
                    differences,
                    links,
                },
                tangent,
            );
        }
    }
}

/// Gathers the vectors of the nodes with these indices, relative to the window.
#[inline(always)]
unsafe fn gather<L: Lanes, I: Index>(places: BasePointers, window: usize, indices: *const I) -> [L; 3] {
    // SAFETY: the indices were validated.
    unsafe {
        match places.records {
            Some(records) => L::gather_records(records.wrapping_add(window), indices),
            None => {
                let [x, y, z] = places.axes;
                [
                    L::gather(x.wrapping_add(window), indices),
                    L::gather(y.wrapping_add(window), indices),
                    L::gather(z.wrapping_add(window), indices),
                ]
            }
        }
    }
}

#[inline(always)]
unsafe fn half_tension<L: Lanes>(stiffness: L, rest_length: L) -> L {
    // SAFETY: the same contract.
    unsafe { stiffness.mul(L::splat(0.5)).mul(rest_length) }
}

/// The fallback for coincident nodes, where a spring has no direction of its own.
struct CoincidentFallback<'a> {
    columns: &'a Columns,
    table: &'a [SpringParameters],
    positions: View<'a>,
    second_vectors: Option<View<'a>>,
    tangent: Tangent,
}

impl CoincidentFallback<'_> {
    /// Sums the columns of `count` nodes starting at `index`. Returns the arrays of the sums.
    #[cold]
    #[inline(never)]
    fn nodes<Q: Accumulator>(&self, index: usize, count: usize, sums: &mut TileForces) -> [*mut f32; 3] {
        for index in index..(index + count).min(self.columns.count) {
            let node = self.columns.first + index;
            let mut sum = Vec3::ZERO;
            self.columns
                .visit_columns(node, self.table, &mut |link| sum += self.link::<Q>(node, &link));
            sums.set(index, sum);
        }
        sums.axes_mut().map(|axis| axis.as_mut_ptr())
    }

    /// The contribution of one spring.
    #[cold]
    fn link<Q: Accumulator>(&self, node: usize, link: &Link) -> Vec3 {
        let neighbor = link.neighbor as usize;
        let offset = self.positions.get(neighbor) - self.positions.get(node);
        let difference = self.second_vectors.map_or(Vec3::ZERO, |second_vectors| {
            second_vectors.get(neighbor) - second_vectors.get(node)
        });
        Q::single_link(node, link, offset, difference, &self.tangent)
    }
}
