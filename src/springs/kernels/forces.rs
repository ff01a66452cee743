//! The spring forces on the nodes of a tile, as many nodes at a time as the processor has lanes.
//!
//! The force of a spring is `(k - k L0 / L) d` for the way d of length L to its other end: a quarter fewer operations than
//! `k (L - L0) / L d`, and what it rounds is less than what positions are rounded by. Both ends compute it in the same way,
//! with opposite signs: no momentum is lost to rounding but where forces are added up.

use glam::Vec3;

use super::columns::{Columns, Ends, LANES, Material, Run};
use super::lanes::Lanes;
use super::prefetch::prefetch;
use super::{ChosenKernel, WithLanes};
use crate::body::{Vectors, View};
use crate::springs::law::separation;
use crate::springs::{Link, Motion, TileForces};

impl Columns {
    /// Writes the forces on the nodes of the tile, N.
    pub fn forces(&self, kernel: ChosenKernel, materials: &[Material], motion: &Motion, forces: &mut TileForces) {
        let &Motion {
            positions,
            velocities,
            soon,
        } = motion;
        let velocities = velocities.filter(|_| self.damped);
        // What the kernel reads without a check was checked against this.
        assert!(positions.covers(&self.reads));
        assert!(velocities.is_none_or(|velocities| velocities.len() == self.node_count));
        let tile = Tile {
            columns: self,
            materials,
            positions: positions.places(),
            velocities: velocities.map(|velocities| velocities.view().places()),
            soon: soon.map(|wanted| wanted.as_ptr()),
        };
        let careful = Careful {
            columns: self,
            materials,
            positions,
            velocities,
        };
        kernel.run_with_lanes(TileLinks { tile, careful, forces });
    }
}

/// Runs that are worked on together: each step of one waits for the step before, and the processor can look only so far
/// ahead for other work.
const GROUP: usize = 4;

/// The forces on a tile, for a kernel to compute.
struct TileLinks<'a> {
    tile: Tile<'a>,
    careful: Careful<'a>,
    forces: &'a mut TileForces,
}

/// What the kernel reads.
struct Tile<'a> {
    columns: &'a Columns,
    materials: &'a [Material],
    /// Where the coordinates of node 0 would be: what the columns read is there.
    positions: [*const f32; 3],
    velocities: Option<[*const f32; 3]>,
    /// What is wanted next, block by block.
    soon: [*const f32; 6],
}

impl WithLanes for TileLinks<'_> {
    type Output = ();

    #[inline(always)]
    unsafe fn run<L: Lanes>(self) {
        // SAFETY: the same contract.
        unsafe {
            if self.tile.velocities.is_some() {
                self.sum::<L, true>();
            } else {
                self.sum::<L, false>();
            }
        }
    }
}

impl TileLinks<'_> {
    #[inline(always)]
    unsafe fn sum<L: Lanes, const DAMPED: bool>(self) {
        let Self { tile, careful, forces } = self;
        let columns = tile.columns;
        let parts = LANES / L::COUNT;
        // Loop by loop, so that each has few addresses to keep. A grid needs no more than the first.
        let runs_alone = columns.own_rest_lengths.is_empty() && columns.near.is_empty() && columns.far.is_empty();
        let mut axes = forces.axes_mut().map(|axis| axis.as_mut_ptr());
        // SAFETY: the same contract; a tile has no more blocks than forces have room for.
        unsafe {
            let mut start = Ends::default();
            for (block, &end) in columns.blocks.iter().enumerate() {
                for wanted in tile.soon {
                    prefetch(wanted.wrapping_add(block * LANES));
                }
                for part in 0..parts {
                    let place = block * LANES + part * L::COUNT;
                    let sums = tile.runs::<L, DAMPED>(start, end, place);
                    sums.store(axes, place);
                    if runs_alone && sums.any_nan() {
                        axes = careful.nodes(place, L::COUNT, forces);
                    }
                }
                start = end;
            }
            if !runs_alone {
                start = Ends::default();
                for (block, &end) in columns.blocks.iter().enumerate() {
                    for part in 0..parts {
                        let place = block * LANES + part * L::COUNT;
                        let sums = tile.others::<L, DAMPED>(start, end, place, Sums::load(axes, place));
                        sums.store(axes, place);
                        if sums.any_nan() {
                            axes = careful.nodes(place, L::COUNT, forces);
                        }
                    }
                    start = end;
                }
            }
            for batch in 0..columns.strays.batch_count() {
                tile.strays::<L, DAMPED>(batch, &careful, forces);
            }
        }
    }
}

/// The forces on some nodes side by side; NaN where a spring's ends coincide.
#[derive(Clone, Copy)]
struct Sums<L>([L; 3]);

/// Parameters of some springs side by side.
#[derive(Clone, Copy)]
struct Spring<L> {
    stiffness: L,
    /// Half the stiffness times the rest length.
    half_tension: L,
    damping: L,
}

/// Where some nodes are, and how fast, side by side.
#[derive(Clone, Copy)]
struct Place<L> {
    position: [L; 3],
    velocity: [L; 3],
}

impl<L: Copy> Place<L> {
    /// Velocities are not asked for.
    #[inline(always)]
    fn still(position: [L; 3]) -> Self {
        Self {
            position,
            velocity: position,
        }
    }
}

/// A column of springs: what they are like, where they lead, and which lanes have one.
#[derive(Clone, Copy)]
struct Links<L> {
    spring: Spring<L>,
    there: Place<L>,
    lanes: u32,
}

impl Tile<'_> {
    /// The runs of the nodes of a block, or of a part of it, as wide as `L`, whose springs share their parameters.
    #[inline(always)]
    unsafe fn runs<L: Lanes, const DAMPED: bool>(&self, start: Ends, end: Ends, place: usize) -> Sums<L> {
        let columns = self.columns;
        let (node, lane) = (columns.first + place, place % LANES);
        // SAFETY: blocks end within the margins; columns were checked to lead to nodes of the body where their lanes are
        // set, and within the margins elsewhere.
        unsafe {
            let here = self.at::<L, DAMPED>(node as isize);
            let mut sums = Sums([L::splat(0.0); 3]);
            let runs = columns.runs.get_unchecked(start.runs as usize..end.runs as usize);
            let (groups, rest) = runs.as_chunks::<GROUP>();
            for group in groups {
                // Written out: a closure may be compiled on its own, without the kernel's instructions.
                let mut links = [self.run::<L, DAMPED>(&group[0], node, lane); GROUP];
                for (links, run) in links.iter_mut().zip(group).skip(1) {
                    *links = self.run::<L, DAMPED>(run, node, lane);
                }
                sums.add::<GROUP, DAMPED>(here, links);
            }
            for run in rest {
                sums.add::<1, DAMPED>(here, [self.run::<L, DAMPED>(run, node, lane)]);
            }
            sums
        }
    }

    /// A run from the nodes from `node` on.
    #[inline(always)]
    unsafe fn run<L: Lanes, const DAMPED: bool>(&self, run: &Run, node: usize, lane: usize) -> Links<L> {
        let damping = if DAMPED {
            self.materials[usize::from(run.material)].damping
        } else {
            0.0
        };
        // SAFETY: as in `runs`.
        unsafe {
            Links {
                spring: Spring {
                    stiffness: L::splat(run.stiffness),
                    half_tension: L::splat(run.half_tension),
                    damping: L::splat(damping),
                },
                there: self.at::<L, DAMPED>(node as isize + run.offset as isize),
                lanes: u32::from(run.lanes) >> lane,
            }
        }
    }

    /// All other columns of the same nodes, added to `sums`.
    #[inline(always)]
    unsafe fn others<L: Lanes, const DAMPED: bool>(
        &self,
        start: Ends,
        end: Ends,
        place: usize,
        mut sums: Sums<L>,
    ) -> Sums<L> {
        let columns = self.columns;
        let (node, lane) = (columns.first + place, place % LANES);
        let mut own = start.own as usize;
        // SAFETY: as in `runs`; gathers were checked to lead to nodes of the body.
        unsafe {
            let here = self.at::<L, DAMPED>(node as isize);
            for run in columns
                .own_runs
                .get_unchecked(start.own_runs as usize..end.own_runs as usize)
            {
                let links = Links {
                    spring: self.spring::<L, DAMPED>(None, &mut own, lane),
                    there: self.at::<L, DAMPED>(node as isize + run.offset as isize),
                    lanes: u32::from(run.lanes) >> lane,
                };
                sums.add::<1, DAMPED>(here, [links]);
            }
            for near in start.near as usize..end.near as usize {
                let header = columns.near.get_unchecked(near);
                let indices = columns.near_indices.get_unchecked(near).0.as_ptr().add(lane);
                let spring = self.spring::<L, DAMPED>(header.material(), &mut own, lane);
                let there = self.gathered_near::<L, DAMPED>(indices);
                let links = Links {
                    spring,
                    there,
                    lanes: u32::from(header.lanes) >> lane,
                };
                sums.add::<1, DAMPED>(here, [links]);
            }
            for far in start.far as usize..end.far as usize {
                let header = columns.far.get_unchecked(far);
                let indices = columns.far_indices.get_unchecked(far).0.as_ptr().add(lane);
                let spring = self.spring::<L, DAMPED>(header.material(), &mut own, lane);
                let there = self.gathered::<L, DAMPED>(indices);
                let links = Links {
                    spring,
                    there,
                    lanes: u32::from(header.lanes) >> lane,
                };
                sums.add::<1, DAMPED>(here, [links]);
            }
            sums
        }
    }

    /// Sixteen strays.
    #[inline(always)]
    unsafe fn strays<L: Lanes, const DAMPED: bool>(&self, batch: usize, careful: &Careful, forces: &mut TileForces) {
        let batch = self.columns.strays.batch(batch);
        let mut found = [[0.0_f32; LANES]; 3];
        let mut coincide = false;
        for part in 0..LANES / L::COUNT {
            let lane = part * L::COUNT;
            // SAFETY: strays were checked to lead to nodes of the body.
            unsafe {
                let here = self.gathered::<L, DAMPED>(batch.nodes.as_ptr().add(lane));
                let there = self.gathered::<L, DAMPED>(batch.neighbours.as_ptr().add(lane));
                let stiffness = L::load(batch.stiffnesses.0.as_ptr().add(lane));
                let rest_length = L::load(batch.rest_lengths.0.as_ptr().add(lane));
                let spring = Spring {
                    stiffness,
                    half_tension: half_tension(stiffness, rest_length),
                    damping: L::load(batch.dampings.0.as_ptr().add(lane)),
                };
                let mut sums = Sums([L::splat(0.0); 3]);
                let links = Links {
                    spring,
                    there,
                    lanes: u32::MAX,
                };
                sums.add::<1, DAMPED>(here, [links]);
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
                force = careful.link(batch.nodes[lane] as usize, &link);
            }
            let place = usize::from(place);
            forces.set(place, forces.get(place) + force);
        }
    }

    /// Sixteen nodes, or as many as `L` has lanes, from `node` on.
    #[inline(always)]
    unsafe fn at<L: Lanes, const DAMPED: bool>(&self, node: isize) -> Place<L> {
        // Written out here and below: a closure may be compiled on its own, without the kernel's instructions.
        // SAFETY: where a lane is set there is a node, and within the margins elsewhere.
        unsafe {
            let [x, y, z] = self.positions;
            let position = [
                L::load(x.wrapping_offset(node)),
                L::load(y.wrapping_offset(node)),
                L::load(z.wrapping_offset(node)),
            ];
            match self.velocities {
                Some([x, y, z]) if DAMPED => Place {
                    position,
                    velocity: [
                        L::load(x.wrapping_offset(node)),
                        L::load(y.wrapping_offset(node)),
                        L::load(z.wrapping_offset(node)),
                    ],
                },
                _ => Place::still(position),
            }
        }
    }

    /// The nodes with these numbers.
    #[inline(always)]
    unsafe fn gathered<L: Lanes, const DAMPED: bool>(&self, indices: *const u32) -> Place<L> {
        // SAFETY: the numbers were checked to be those of nodes.
        unsafe {
            let [x, y, z] = self.positions;
            let position = [L::gather(x, indices), L::gather(y, indices), L::gather(z, indices)];
            match self.velocities {
                Some([x, y, z]) if DAMPED => Place {
                    position,
                    velocity: [L::gather(x, indices), L::gather(y, indices), L::gather(z, indices)],
                },
                _ => Place::still(position),
            }
        }
    }

    /// The nodes with these numbers, counted from the window.
    #[inline(always)]
    unsafe fn gathered_near<L: Lanes, const DAMPED: bool>(&self, indices: *const u16) -> Place<L> {
        let window = self.columns.window;
        // SAFETY: as in `gathered`.
        unsafe {
            let [x, y, z] = self.positions.map(|axis| axis.wrapping_add(window));
            let position = [
                L::gather_near(x, indices),
                L::gather_near(y, indices),
                L::gather_near(z, indices),
            ];
            match self.velocities {
                Some(velocities) if DAMPED => {
                    let [x, y, z] = velocities.map(|axis| axis.wrapping_add(window));
                    Place {
                        position,
                        velocity: [
                            L::gather_near(x, indices),
                            L::gather_near(y, indices),
                            L::gather_near(z, indices),
                        ],
                    }
                }
                _ => Place::still(position),
            }
        }
    }

    /// The parameters of a column; `own` counts those that bring their own.
    #[inline(always)]
    unsafe fn spring<L: Lanes, const DAMPED: bool>(
        &self,
        material: Option<usize>,
        own: &mut usize,
        lane: usize,
    ) -> Spring<L> {
        // SAFETY: every column that brings its own parameters has a place in their lists.
        unsafe {
            if let Some(material) = material {
                let material = &self.materials[material];
                return Spring {
                    stiffness: L::splat(material.stiffness),
                    half_tension: L::splat(material.half_tension()),
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
            let spring = Spring {
                stiffness,
                half_tension: half_tension(stiffness, rest_length),
                damping: if DAMPED {
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

impl<L: Lanes> Sums<L> {
    /// From and to three lists that have these lanes.
    #[inline(always)]
    unsafe fn load(axes: [*mut f32; 3], place: usize) -> Self {
        // SAFETY: the caller's promise.
        Self(axes.map(|axis| unsafe { L::load(axis.add(place)) }))
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

    /// Adds the forces of `N` columns of springs from `here` on.
    #[inline(always)]
    unsafe fn add<const N: usize, const DAMPED: bool>(&mut self, here: Place<L>, links: [Links<L>; N]) {
        // SAFETY: the same contract.
        unsafe {
            let ways = links.map(|links| difference(links.there.position, here.position));
            let squares = ways.map(|way| dot(way, way));
            let stiffnesses = links.map(|links| links.spring.stiffness);
            let half_tensions = links.map(|links| links.spring.half_tension);
            let (mut factors, inverses) = L::pulls(squares, stiffnesses, half_tensions);
            if DAMPED {
                for n in 0..N {
                    let rate = dot(ways[n], difference(links[n].there.velocity, here.velocity));
                    let rate = rate.multiply(inverses[n]).multiply(inverses[n]);
                    factors[n] = rate.multiply_add(links[n].spring.damping, factors[n]);
                }
            }
            for n in 0..N {
                let factor = factors[n].where_set(links[n].lanes);
                for (sum, way) in self.0.iter_mut().zip(ways[n]) {
                    *sum = way.multiply_add(factor, *sum);
                }
            }
        }
    }
}

#[inline(always)]
unsafe fn difference<L: Lanes>([ax, ay, az]: [L; 3], [bx, by, bz]: [L; 3]) -> [L; 3] {
    // SAFETY: the same contract.
    unsafe { [ax.subtract(bx), ay.subtract(by), az.subtract(bz)] }
}

#[inline(always)]
unsafe fn half_tension<L: Lanes>(stiffness: L, rest_length: L) -> L {
    // SAFETY: the same contract.
    unsafe { stiffness.multiply(L::splat(0.5)).multiply(rest_length) }
}

#[inline(always)]
unsafe fn dot<L: Lanes>([ax, ay, az]: [L; 3], [bx, by, bz]: [L; 3]) -> L {
    // SAFETY: the same contract.
    unsafe { az.multiply_add(bz, ay.multiply_add(by, ax.multiply(bx))) }
}

/// The same forces where nodes coincide, and a spring between them has no direction of its own.
struct Careful<'a> {
    columns: &'a Columns,
    materials: &'a [Material],
    positions: View<'a>,
    velocities: Option<&'a Vectors>,
}

impl Careful<'_> {
    /// The columns of `count` nodes from `place` on: where the forces are kept.
    #[cold]
    #[inline(never)]
    fn nodes(&self, place: usize, count: usize, forces: &mut TileForces) -> [*mut f32; 3] {
        for place in place..(place + count).min(self.columns.count) {
            let node = self.columns.first + place;
            let mut force = Vec3::ZERO;
            self.columns
                .visit_columns(node, self.materials, &mut |link| force += self.link(node, &link));
            forces.set(place, force);
        }
        forces.axes_mut().map(|axis| axis.as_mut_ptr())
    }

    /// The force of one spring.
    #[cold]
    fn link(&self, node: usize, link: &Link) -> Vec3 {
        let neighbour = link.neighbour as usize;
        let way = self.positions.get(neighbour) - self.positions.get(node);
        let (length, direction) = separation(node, neighbour, way);
        let rate = self.velocities.map_or(0.0, |velocities| {
            direction.dot(velocities.get(neighbour) - velocities.get(node))
        });
        direction * (link.stiffness * (length - link.rest_length) + link.damping * rate)
    }
}
