//! The spring forces on the nodes of a tile, and other sums over springs, as many nodes at a time as the processor has lanes.
//!
//! The force of a spring is `(k - k L0 / L) d` for the way d of length L to its other end: a quarter fewer operations than
//! `k (L - L0) / L d`, and what it rounds is less than what positions are rounded by. Both ends compute it in the same way,
//! with opposite signs: no momentum is lost to rounding but where forces are added up.

use std::marker::PhantomData;

use glam::Vec3;

use super::columns::Columns;
use super::layout::{ColumnEnds, GatherColumn, RunColumn, SpringMaterial};
use super::quantities::{Change, Force, HalfEnergy, LinkColumn, NodePlaces, Quantity, SpringLanes, Ways, difference};
use crate::order::LANES;
use crate::simd::{ChosenKernel, Index, Lanes, WithLanes, prefetch};
use crate::soa::{Places, TileForces, Vectors, View};
use crate::springs::{Course, Link, Motion, Tangent};

impl Columns {
    /// Writes the forces on the nodes of the tile, N.
    pub fn forces(&self, kernel: ChosenKernel, materials: &[SpringMaterial], motion: &Motion, forces: &mut TileForces) {
        let &Motion {
            positions,
            velocities,
            soon,
        } = motion;
        let velocities = velocities.filter(|_| self.damped).map(Vectors::view);
        let tile = self.tile(materials, positions, velocities, soon, Tangent::NONE);
        match velocities {
            None => tile.add_up::<Force<false>>(kernel, forces),
            Some(_) => tile.add_up::<Force<true>>(kernel, forces),
        }
    }

    /// Writes how the forces on the nodes of the tile change, N, in the first order.
    pub fn changes(
        &self,
        kernel: ChosenKernel,
        materials: &[SpringMaterial],
        course: &Course,
        changes: &mut TileForces,
    ) {
        let tangent = course.tangent;
        let tile = self.tile(materials, course.positions, Some(course.ways), [&[]; 6], tangent);
        if self.damped && tangent.rate > 0.0 {
            tile.add_up::<Change<true>>(kernel, changes);
        } else {
            tile.add_up::<Change<false>>(kernel, changes);
        }
    }

    /// Half the energy of all links of the tile, J.
    pub fn half_energy(&self, kernel: ChosenKernel, materials: &[SpringMaterial], positions: View) -> f64 {
        let mut energies = TileForces::ZERO;
        let tile = self.tile(materials, positions, None, [&[]; 6], Tangent::NONE);
        tile.add_up::<HalfEnergy>(kernel, &mut energies);
        let [of_nodes, ..] = energies.axes();
        of_nodes[..self.count].iter().copied().map(f64::from).sum()
    }

    fn tile<'a>(
        &'a self,
        materials: &'a [SpringMaterial],
        positions: View<'a>,
        seconds: Option<View<'a>>,
        soon: [&'a [f32]; 6],
        tangent: Tangent,
    ) -> KernelTile<'a> {
        // What the kernel reads without a check was checked against this.
        assert!(positions.covers(&self.reads, self.node_count));
        assert!(seconds.is_none_or(|seconds| seconds.covers(&self.reads, self.node_count)));
        KernelTile {
            columns: self,
            materials,
            positions: positions.places(),
            seconds: seconds.map(|seconds| seconds.places()),
            soon: soon.map(|wanted| wanted.as_ptr()),
            tangent,
            careful: Careful {
                columns: self,
                materials,
                positions,
                seconds,
                tangent,
            },
        }
    }
}

/// Runs that are worked on together: each step of one waits for the step before, and the processor can look only so far
/// ahead for other work.
const GROUP: usize = 4;

/// The sums of a tile's nodes, for a kernel to add up.
struct TileLinks<'a, Q> {
    tile: KernelTile<'a>,
    sums: &'a mut TileForces,
    quantity: PhantomData<Q>,
}

/// What the kernel reads.
struct KernelTile<'a> {
    columns: &'a Columns,
    materials: &'a [SpringMaterial],
    /// What the columns read is there.
    positions: Places,
    seconds: Option<Places>,
    /// What is wanted next, block by block.
    soon: [*const f32; 6],
    tangent: Tangent,
    careful: Careful<'a>,
}

impl KernelTile<'_> {
    fn add_up<Q: Quantity>(self, kernel: ChosenKernel, sums: &mut TileForces) {
        kernel.run_with_lanes(TileLinks::<Q> {
            tile: self,
            sums,
            quantity: PhantomData,
        });
    }
}

impl<Q: Quantity> WithLanes for TileLinks<'_, Q> {
    type Output = ();

    #[inline(always)]
    unsafe fn run<L: Lanes>(self) {
        let Self { tile, sums: forces, .. } = self;
        let careful = &tile.careful;
        let columns = tile.columns;
        let parts = LANES / L::COUNT;
        // Loop by loop, so that each has few addresses to keep. A grid needs no more than the first.
        let runs_alone = columns.own_rest_lengths.is_empty() && columns.near.is_empty() && columns.far.is_empty();
        let mut axes = forces.axes_mut().map(|axis| axis.as_mut_ptr());
        // SAFETY: the same contract; a tile has no more blocks than forces have room for.
        unsafe {
            let mut start = ColumnEnds::default();
            for (block, &end) in columns.blocks.iter().enumerate() {
                for wanted in tile.soon {
                    prefetch(wanted.wrapping_add(block * LANES));
                }
                for part in 0..parts {
                    let place = block * LANES + part * L::COUNT;
                    let sums = tile.runs::<L, Q>(start, end, place);
                    sums.store(axes, place);
                    if runs_alone && sums.any_nan() {
                        axes = careful.nodes::<Q>(place, L::COUNT, forces);
                    }
                }
                start = end;
            }
            if !runs_alone {
                start = ColumnEnds::default();
                for (block, &end) in columns.blocks.iter().enumerate() {
                    for part in 0..parts {
                        let place = block * LANES + part * L::COUNT;
                        let sums = tile.others::<L, Q>(start, end, place, ForceLanes::load(axes, place));
                        sums.store(axes, place);
                        if sums.any_nan() {
                            axes = careful.nodes::<Q>(place, L::COUNT, forces);
                        }
                    }
                    start = end;
                }
            }
            for batch in 0..columns.strays.batch_count() {
                tile.strays::<L, Q>(batch, forces);
            }
        }
    }
}

/// Columns of gathers, each with its indices, which count from the window.
struct Gathers<'a, I> {
    headers: &'a [GatherColumn],
    indices: *const [I; LANES],
    window: usize,
}

/// The forces on some nodes side by side; NaN where a spring's ends coincide.
#[derive(Clone, Copy)]
struct ForceLanes<L>([L; 3]);

impl KernelTile<'_> {
    /// The runs of the nodes of a block, or of a part of it, as wide as `L`, whose springs share their parameters.
    #[inline(always)]
    unsafe fn runs<L: Lanes, Q: Quantity>(&self, start: ColumnEnds, end: ColumnEnds, place: usize) -> ForceLanes<L> {
        let columns = self.columns;
        let (node, lane) = (columns.first + place, place % LANES);
        // SAFETY: blocks end within the margins; columns were checked to lead to nodes of the body where their lanes are
        // set, and within the margins elsewhere.
        unsafe {
            let here = self.at::<L, Q>(node as isize);
            let mut sums = ForceLanes([L::splat(0.0); 3]);
            let runs = columns.runs.get_unchecked(start.runs as usize..end.runs as usize);
            let (groups, rest) = runs.as_chunks::<GROUP>();
            for group in groups {
                // Written out: a closure may be compiled on its own, without the kernel's instructions.
                let mut links = [self.run::<L, Q>(&group[0], node, lane); GROUP];
                for (links, run) in links.iter_mut().zip(group).skip(1) {
                    *links = self.run::<L, Q>(run, node, lane);
                }
                sums.add::<GROUP, Q>(here, links, &self.tangent);
            }
            for run in rest {
                sums.add::<1, Q>(here, [self.run::<L, Q>(run, node, lane)], &self.tangent);
            }
            sums
        }
    }

    /// A run from the nodes from `node` on.
    #[inline(always)]
    unsafe fn run<L: Lanes, Q: Quantity>(&self, run: &RunColumn, node: usize, lane: usize) -> LinkColumn<L> {
        let material = if Q::DAMPED || Q::RESTING {
            self.materials[usize::from(run.material)]
        } else {
            SpringMaterial::default()
        };
        // SAFETY: as in `runs`.
        unsafe {
            LinkColumn {
                spring: SpringLanes {
                    stiffness: L::splat(run.stiffness),
                    half_tension: L::splat(run.half_tension),
                    rest_length: L::splat(material.rest_length),
                    damping: L::splat(material.damping),
                },
                there: self.at::<L, Q>(node as isize + run.offset as isize),
                lanes: u32::from(run.lanes) >> lane,
            }
        }
    }

    /// All other columns of the same nodes, added to `sums`.
    #[inline(always)]
    unsafe fn others<L: Lanes, Q: Quantity>(
        &self,
        start: ColumnEnds,
        end: ColumnEnds,
        place: usize,
        mut sums: ForceLanes<L>,
    ) -> ForceLanes<L> {
        let columns = self.columns;
        let (node, lane) = (columns.first + place, place % LANES);
        let mut own = start.own as usize;
        // SAFETY: as in `runs`; gathers were checked to lead to nodes of the body.
        unsafe {
            let here = self.at::<L, Q>(node as isize);
            for run in columns
                .own_runs
                .get_unchecked(start.own_runs as usize..end.own_runs as usize)
            {
                let links = LinkColumn {
                    spring: self.spring::<L, Q>(None, &mut own, lane),
                    there: self.at::<L, Q>(node as isize + run.offset as isize),
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
    unsafe fn add_gathers<L: Lanes, Q: Quantity, I: Index>(
        &self,
        gathers: Gathers<I>,
        here: NodePlaces<L>,
        own: &mut usize,
        lane: usize,
        sums: &mut ForceLanes<L>,
    ) {
        let count = gathers.headers.len();
        if count == 0 {
            return;
        }
        // SAFETY: as in `others`.
        unsafe {
            // The neighbours of a column are fetched before what the one before it adds up to: that is a long chain of operations,
            // each of which waits for the last, and the processor looks no more than a column or two ahead for other work.
            let mut links = self.gather_column::<L, Q, I>(&gathers, 0, own, lane);
            for column in 1..count {
                let next = self.gather_column::<L, Q, I>(&gathers, column, own, lane);
                sums.add::<1, Q>(here, [links], &self.tangent);
                links = next;
            }
            sums.add::<1, Q>(here, [links], &self.tangent);
        }
    }

    /// One of some gathers.
    #[inline(always)]
    unsafe fn gather_column<L: Lanes, Q: Quantity, I: Index>(
        &self,
        gathers: &Gathers<I>,
        column: usize,
        own: &mut usize,
        lane: usize,
    ) -> LinkColumn<L> {
        // SAFETY: as in `others`.
        unsafe {
            let header = gathers.headers.get_unchecked(column);
            let indices = gathers.indices.add(column).cast::<I>().add(lane);
            LinkColumn {
                spring: self.spring::<L, Q>(header.material(), own, lane),
                there: self.gathered::<L, Q, I>(indices, gathers.window),
                lanes: u32::from(header.lanes) >> lane,
            }
        }
    }

    /// Sixteen strays.
    #[inline(always)]
    unsafe fn strays<L: Lanes, Q: Quantity>(&self, batch: usize, forces: &mut TileForces) {
        let batch = self.columns.strays.batch(batch);
        let mut found = [[0.0_f32; LANES]; 3];
        let mut coincide = false;
        for part in 0..LANES / L::COUNT {
            let lane = part * L::COUNT;
            // SAFETY: strays were checked to lead to nodes of the body.
            unsafe {
                let here = self.gathered::<L, Q, u32>(batch.nodes.as_ptr().add(lane), 0);
                let there = self.gathered::<L, Q, u32>(batch.neighbours.as_ptr().add(lane), 0);
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
                for (sum, found) in sums.0.into_iter().zip(&mut found) {
                    sum.store(found.as_mut_ptr().add(lane));
                }
            }
        }
        for (lane, &place) in batch.places[..batch.count].iter().enumerate() {
            let mut force = Vec3::from(found.map(|axis| axis[lane]));
            if coincide {
                let link = Link {
                    neighbour: batch.neighbours[lane],
                    stiffness: batch.stiffnesses.0[lane],
                    rest_length: batch.rest_lengths.0[lane],
                    damping: batch.dampings.0[lane],
                };
                force = self.careful.link::<Q>(batch.nodes[lane] as usize, &link);
            }
            let place = usize::from(place);
            forces.set(place, forces.get(place) + force);
        }
    }

    /// Sixteen nodes, or as many as `L` has lanes, from `node` on.
    #[inline(always)]
    unsafe fn at<L: Lanes, Q: Quantity>(&self, node: isize) -> NodePlaces<L> {
        // Written out here and below: a closure may be compiled on its own, without the kernel's instructions.
        // SAFETY: where a lane is set there is a node, and within the margins elsewhere.
        unsafe {
            let [x, y, z] = self.positions.axes;
            let position = [
                L::load(x.wrapping_offset(node)),
                L::load(y.wrapping_offset(node)),
                L::load(z.wrapping_offset(node)),
            ];
            match self.seconds {
                Some(Places { axes: [x, y, z], .. }) if Q::SECOND => NodePlaces {
                    position,
                    second: [
                        L::load(x.wrapping_offset(node)),
                        L::load(y.wrapping_offset(node)),
                        L::load(z.wrapping_offset(node)),
                    ],
                },
                _ => NodePlaces::still(position),
            }
        }
    }

    /// The nodes with these numbers, counted from the window.
    #[inline(always)]
    unsafe fn gathered<L: Lanes, Q: Quantity, I: Index>(&self, indices: *const I, window: usize) -> NodePlaces<L> {
        // SAFETY: the numbers were checked to be those of nodes.
        unsafe {
            let position = gather(self.positions, window, indices);
            match self.seconds {
                Some(seconds) if Q::SECOND => NodePlaces {
                    position,
                    second: gather(seconds, window, indices),
                },
                _ => NodePlaces::still(position),
            }
        }
    }

    /// The parameters of a column; `own` counts those that bring their own.
    #[inline(always)]
    unsafe fn spring<L: Lanes, Q: Quantity>(
        &self,
        material: Option<usize>,
        own: &mut usize,
        lane: usize,
    ) -> SpringLanes<L> {
        // SAFETY: every column that brings its own parameters has a place in their lists.
        unsafe {
            if let Some(material) = material {
                let material = &self.materials[material];
                return SpringLanes {
                    stiffness: L::splat(material.stiffness),
                    half_tension: L::splat(material.half_tension()),
                    rest_length: L::splat(material.rest_length),
                    damping: L::splat(material.damping),
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
                damping: if Q::DAMPED {
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
    /// From and to three lists that have these lanes.
    #[inline(always)]
    unsafe fn load(axes: [*mut f32; 3], place: usize) -> Self {
        let [x, y, z] = axes;
        // SAFETY: the caller's promise.
        Self(unsafe { [L::load(x.add(place)), L::load(y.add(place)), L::load(z.add(place))] })
    }

    #[inline(always)]
    unsafe fn store(&self, axes: [*mut f32; 3], place: usize) {
        for (sum, axis) in self.0.into_iter().zip(axes) {
            // SAFETY: the caller's promise.
            unsafe { sum.store(axis.add(place)) };
        }
    }

    #[inline(always)]
    unsafe fn any_nan(&self) -> bool {
        let [x, y, z] = self.0;
        // SAFETY: the same contract.
        unsafe { x.any_nan() || y.any_nan() || z.any_nan() }
    }

    /// Adds what `N` columns of springs add up to from `here` on.
    #[inline(always)]
    unsafe fn add<const N: usize, Q: Quantity>(
        &mut self,
        here: NodePlaces<L>,
        links: [LinkColumn<L>; N],
        tangent: &Tangent,
    ) {
        // SAFETY: the same contract.
        unsafe {
            // Written out, as in `runs`.
            let [mut ways, mut differences] = [[here.position; N], [here.second; N]];
            for (n, links) in links.iter().enumerate() {
                ways[n] = difference(links.there.position, here.position);
                differences[n] = difference(links.there.second, here.second);
            }
            Q::add(
                &mut self.0,
                Ways {
                    ways,
                    differences,
                    links,
                },
                tangent,
            );
        }
    }
}

/// The vectors of the nodes with these numbers, counted from the window.
#[inline(always)]
unsafe fn gather<L: Lanes, I: Index>(places: Places, window: usize, indices: *const I) -> [L; 3] {
    // SAFETY: the numbers were checked to be those of nodes.
    unsafe {
        match places.records {
            Some(records) => L::records(records.wrapping_add(window), indices),
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
    unsafe { stiffness.multiply(L::splat(0.5)).multiply(rest_length) }
}

/// The same sums where nodes coincide, and a spring between them has no direction of its own.
struct Careful<'a> {
    columns: &'a Columns,
    materials: &'a [SpringMaterial],
    positions: View<'a>,
    seconds: Option<View<'a>>,
    tangent: Tangent,
}

impl Careful<'_> {
    /// The columns of `count` nodes from `place` on: where the sums are kept.
    #[cold]
    #[inline(never)]
    fn nodes<Q: Quantity>(&self, place: usize, count: usize, sums: &mut TileForces) -> [*mut f32; 3] {
        for place in place..(place + count).min(self.columns.count) {
            let node = self.columns.first + place;
            let mut sum = Vec3::ZERO;
            self.columns
                .visit_columns(node, self.materials, &mut |link| sum += self.link::<Q>(node, &link));
            sums.set(place, sum);
        }
        sums.axes_mut().map(|axis| axis.as_mut_ptr())
    }

    /// What one spring adds.
    #[cold]
    fn link<Q: Quantity>(&self, node: usize, link: &Link) -> Vec3 {
        let neighbour = link.neighbour as usize;
        let way = self.positions.get(neighbour) - self.positions.get(node);
        let difference = self
            .seconds
            .map_or(Vec3::ZERO, |seconds| seconds.get(neighbour) - seconds.get(node));
        Q::of_link(node, link, way, difference, &self.tangent)
    }
}
