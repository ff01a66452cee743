//! The spring forces on the nodes of a tile, as many nodes at a time as the processor has lanes.
//!
//! The force of a spring is `k (L - L0) / L d` for the way d of length L to its other end. Both ends compute it in the same
//! way, with opposite signs: no momentum is lost to rounding but where forces are added up.

use glam::Vec3;

use super::ChosenKernel;
use super::columns::{Columns, LANES, Material};
use super::lanes::Lanes;
use crate::body::{MARGIN, Vectors};
use crate::springs::law::{SHORTEST, separation};
use crate::springs::{Link, TileForces};

impl Columns {
    /// Writes the forces on the nodes of the tile, N; with velocities, given where springs are damped, also the damping
    /// along them.
    pub fn forces(
        &self,
        kernel: ChosenKernel,
        materials: &[Material],
        positions: &Vectors,
        velocities: Option<&Vectors>,
        forces: &mut TileForces,
    ) {
        // What the kernel reads without a check was checked against this.
        assert_eq!(positions.len(), self.node_count);
        assert!(velocities.is_none_or(|velocities| velocities.len() == self.node_count));
        let place = |vectors: &'_ Vectors| vectors.with_margins().map(|axis| axis[MARGIN..].as_ptr());
        let tile = Tile {
            columns: self,
            materials,
            positions: place(positions),
            velocities: velocities.filter(|_| self.damped).map(place),
        };
        let careful = Careful {
            columns: self,
            materials,
            positions,
            velocities: velocities.filter(|_| self.damped),
        };
        kernel.forces(TileLinks { tile, careful, forces });
    }
}

/// The forces on a tile, for a kernel to compute.
pub(super) struct TileLinks<'a> {
    tile: Tile<'a>,
    careful: Careful<'a>,
    forces: &'a mut TileForces,
}

/// What the kernel reads.
struct Tile<'a> {
    columns: &'a Columns,
    materials: &'a [Material],
    /// The first node's coordinates, with [`MARGIN`] numbers before them and as many after the last block.
    positions: [*const f32; 3],
    velocities: Option<[*const f32; 3]>,
}

impl TileLinks<'_> {
    /// # Safety
    /// The processor has the instructions of `L`.
    #[inline(always)]
    pub(super) unsafe fn run<L: Lanes>(self) {
        // SAFETY: the same contract.
        unsafe {
            if self.tile.velocities.is_some() {
                self.sum::<L, true>();
            } else {
                self.sum::<L, false>();
            }
        }
    }

    #[inline(always)]
    unsafe fn sum<L: Lanes, const DAMPED: bool>(self) {
        let Self { tile, careful, forces } = self;
        for block in 0..tile.columns.blocks.len() {
            for part in 0..LANES / L::COUNT {
                // SAFETY: the same contract.
                unsafe { tile.block::<L, DAMPED>(block, part, &careful, forces) };
            }
        }
        for batch in 0..tile.columns.strays.batch_count() {
            // SAFETY: the same contract.
            unsafe { tile.strays::<L, DAMPED>(batch, &careful, forces) };
        }
    }
}

/// The forces on some nodes side by side.
#[derive(Clone, Copy)]
struct Sums<L> {
    axes: [L; 3],
    /// The least squared length.
    least: L,
}

/// Parameters of some springs side by side.
#[derive(Clone, Copy)]
struct Spring<L> {
    stiffness: L,
    rest_length: L,
    damping: L,
}

/// Where some nodes are, and how fast, side by side.
#[derive(Clone, Copy)]
struct Ends<L> {
    position: [L; 3],
    velocity: [L; 3],
}

impl Tile<'_> {
    /// The links of the nodes of a block, or of a part of it, as wide as `L`.
    #[inline(always)]
    unsafe fn block<L: Lanes, const DAMPED: bool>(
        &self,
        block: usize,
        part: usize,
        careful: &Careful,
        forces: &mut TileForces,
    ) {
        let columns = self.columns;
        let lane = part * L::COUNT;
        let place = block * LANES + lane;
        let node = columns.first + place;
        let (start, end) = columns.ends(block);
        let mut own = start.own as usize;
        // SAFETY: blocks end within the margins; columns were checked to lead to nodes of the body where their lanes are
        // set, and within the margins elsewhere.
        unsafe {
            let here = self.ends::<L, DAMPED>(|axis| L::load(axis.add(node)));
            let mut sums = Sums {
                axes: [L::splat(0.0); 3],
                least: L::splat(f32::INFINITY),
            };
            for run in columns.runs.get_unchecked(start.runs as usize..end.runs as usize) {
                let spring = self.spring::<L, DAMPED>(run.header.material(), &mut own, lane);
                let there = self.ends::<L, DAMPED>(|axis| L::load(axis.offset(node as isize + run.offset as isize)));
                sums.add::<DAMPED>(here, there, spring, u32::from(run.header.lanes) >> lane);
            }
            for near in start.near as usize..end.near as usize {
                let header = columns.near.get_unchecked(near);
                let indices = columns.near_indices.get_unchecked(near).0.as_ptr().add(lane);
                let spring = self.spring::<L, DAMPED>(header.material(), &mut own, lane);
                let there = self.ends::<L, DAMPED>(|axis| L::gather_near(axis.add(columns.window), indices));
                sums.add::<DAMPED>(here, there, spring, u32::from(header.lanes) >> lane);
            }
            for far in start.far as usize..end.far as usize {
                let header = columns.far.get_unchecked(far);
                let indices = columns.far_indices.get_unchecked(far).0.as_ptr().add(lane);
                let spring = self.spring::<L, DAMPED>(header.material(), &mut own, lane);
                let there = self.ends::<L, DAMPED>(|axis| L::gather(axis, indices));
                sums.add::<DAMPED>(here, there, spring, u32::from(header.lanes) >> lane);
            }
            if sums.least.any_at_most(SHORTEST * SHORTEST) {
                careful.block(node, L::COUNT, forces);
            } else {
                for (sum, forces) in sums.axes.into_iter().zip(&mut forces.axes) {
                    sum.store(forces[place..place + L::COUNT].as_mut_ptr());
                }
            }
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
                let here = self.ends::<L, DAMPED>(|axis| L::gather(axis, batch.nodes.as_ptr().add(lane)));
                let there = self.ends::<L, DAMPED>(|axis| L::gather(axis, batch.neighbours.as_ptr().add(lane)));
                let spring = Spring {
                    stiffness: L::load(batch.stiffnesses.0.as_ptr().add(lane)),
                    rest_length: L::load(batch.rest_lengths.0.as_ptr().add(lane)),
                    damping: L::load(batch.dampings.0.as_ptr().add(lane)),
                };
                let mut sums = Sums {
                    axes: [L::splat(0.0); 3],
                    least: L::splat(f32::INFINITY),
                };
                sums.add::<DAMPED>(here, there, spring, u32::MAX);
                coincide |= sums.least.any_at_most(SHORTEST * SHORTEST);
                for (sum, found) in sums.axes.into_iter().zip(&mut found) {
                    sum.store(found.as_mut_ptr().add(lane));
                }
            }
        }
        for lane in 0..batch.count {
            let mut force = Vec3::new(found[0][lane], found[1][lane], found[2][lane]);
            if coincide {
                let link = Link {
                    neighbour: batch.neighbours[lane],
                    stiffness: batch.stiffnesses.0[lane],
                    rest_length: batch.rest_lengths.0[lane],
                    damping: batch.dampings.0[lane],
                };
                force = careful.link(batch.nodes[lane] as usize, &link);
            }
            let place = usize::from(batch.places[lane]);
            forces.set(place, forces.get(place) + force);
        }
    }

    #[inline(always)]
    unsafe fn ends<L: Lanes, const DAMPED: bool>(&self, fetch: impl Fn(*const f32) -> L) -> Ends<L> {
        let position = self.positions.map(&fetch);
        match self.velocities {
            Some(velocities) if DAMPED => Ends {
                position,
                velocity: velocities.map(&fetch),
            },
            _ => Ends {
                position,
                velocity: position,
            },
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
                    rest_length: L::splat(material.rest_length),
                    damping: L::splat(material.damping),
                };
            }
            let columns = self.columns;
            let rest_length = L::load(columns.own_rest_lengths.get_unchecked(*own).0.as_ptr().add(lane));
            let spring = Spring {
                stiffness: if columns.own_stiffnesses.is_empty() {
                    L::splat(columns.own_stiffness)
                } else {
                    L::load(columns.own_stiffnesses.get_unchecked(*own).0.as_ptr().add(lane))
                },
                rest_length,
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
    /// Adds the forces of springs from `here` to `there` in the lanes that are set.
    #[inline(always)]
    unsafe fn add<const DAMPED: bool>(&mut self, here: Ends<L>, there: Ends<L>, spring: Spring<L>, lanes: u32) {
        // SAFETY: the same contract.
        unsafe {
            let way = difference(there.position, here.position);
            let squared = dot(way, way);
            self.least = self.least.lesser_where(lanes, squared);
            let (length, inverse) = squared.roots();
            // The stretch is exact where it is small: a product with the inverse would not be.
            let tension = length.subtract(spring.rest_length).multiply(spring.stiffness);
            let mut factor = tension.multiply(inverse);
            if DAMPED {
                let rate = dot(way, difference(there.velocity, here.velocity));
                let rate = rate.multiply(inverse).multiply(inverse);
                factor = rate.multiply_add(spring.damping, factor);
            }
            let factor = factor.where_set(lanes);
            for (sum, way) in self.axes.iter_mut().zip(way) {
                *sum = way.multiply_add(factor, *sum);
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
unsafe fn dot<L: Lanes>([ax, ay, az]: [L; 3], [bx, by, bz]: [L; 3]) -> L {
    // SAFETY: the same contract.
    unsafe { az.multiply_add(bz, ay.multiply_add(by, ax.multiply(bx))) }
}

/// The same forces where nodes coincide, and a spring between them has no direction of its own.
struct Careful<'a> {
    columns: &'a Columns,
    materials: &'a [Material],
    positions: &'a Vectors,
    velocities: Option<&'a Vectors>,
}

impl Careful<'_> {
    /// The columns of `count` nodes from `first` on.
    #[cold]
    fn block(&self, first: usize, count: usize, forces: &mut TileForces) {
        let end = (first + count).min(self.columns.first + self.columns.count);
        for node in first..end {
            let mut force = Vec3::ZERO;
            self.columns
                .visit_columns(node, self.materials, &mut |link| force += self.link(node, &link));
            forces.set(node - self.columns.first, force);
        }
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
