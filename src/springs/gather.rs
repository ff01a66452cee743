//! The force on a node as a sum over its own links: nothing else is written, so tiles can be worked on in any order.
//!
//! Links that lie side by side are worked on eight at a time where the processor can, others one after the other.

use glam::Vec3;

use super::kept::{KeptLink, NOBODY};
use super::law::pull;
use super::{Link, Motion};
use crate::simd::{Eights, Sight, WithEights, prefetch};
use crate::soa::TileForces;

/// How many numbers a cache line holds.
const LINE: usize = 16;

/// How much of a row of links is fetched ahead, bytes; the processor sees by itself how a longer one goes on.
const FETCHED: usize = 512;

/// What the links of a tile's nodes are seen against.
pub(super) struct Gather<'a, const DAMPED: bool> {
    positions: [&'a [f32]; 3],
    velocities: [&'a [f32]; 3],
    soon: [&'a [f32]; 6],
    /// The tile's first node.
    first: usize,
}

/// The axes, as slices that are seen to be of one length.
#[inline(always)]
fn even([x, y, z]: [&[f32]; 3]) -> [&[f32]; 3] {
    let count = x.len();
    [x, &y[..count], &z[..count]]
}

#[inline(always)]
fn at([x, y, z]: [&[f32]; 3], node: usize) -> Vec3 {
    Vec3::new(x[node], y[node], z[node])
}

impl<'a, const DAMPED: bool> Gather<'a, DAMPED> {
    /// For the tile that begins with node `first`, of a body of `node_count`.
    #[inline(always)]
    pub fn new(motion: &Motion<'a>, first: usize, node_count: usize) -> Self {
        Self {
            positions: even(motion.positions.slices(0..node_count)),
            velocities: motion.velocities.map_or([&[]; 3], |velocities| even(velocities.axes())),
            soon: motion.soon,
            first,
        }
    }

    /// Writes the force of its links on `node`, and begins to fetch what is wanted after the forces.
    #[inline(always)]
    pub fn node(&self, node: usize, links: impl Iterator<Item = Link>, forces: &mut TileForces) {
        self.fetch_soon(node);
        let here = self.here(node);
        let mut sum = Vec3::ZERO;
        links.for_each(|link| sum += self.pull(here, &link));
        forces.set(node - self.first, sum);
    }

    /// The same for links in arrays, empty places behind them.
    #[inline(always)]
    pub fn node_of_rows<'l, L: KeptLink>(
        &self,
        node: usize,
        rows: impl Iterator<Item = &'l [L]>,
        eights: impl Eights,
        forces: &mut TileForces,
    ) {
        self.fetch_soon(node);
        let here = self.here(node);
        let sight = Sight {
            positions: self.positions,
            here: here.position,
        };
        let mut sum = Vec3::ZERO;
        for row in rows {
            let (groups, rest) = row.as_chunks::<8>();
            for links in groups {
                // Written out: a closure may be compiled on its own, without the kernel's instructions.
                if !DAMPED
                    && links[7].neighbour() != NOBODY
                    && let Some(links) = L::eight(links)
                    && let Some(force) = eights.pull(sight, links)
                {
                    sum += force;
                } else {
                    sum += self.pull_each(here, links);
                }
            }
            sum += self.pull_each(here, rest);
        }
        forces.set(node - self.first, sum);
    }

    #[inline(always)]
    fn fetch_soon(&self, node: usize) {
        let place = node - self.first;
        if place.is_multiple_of(LINE) {
            for axis in self.soon {
                prefetch(axis.as_ptr().wrapping_add(place));
            }
        }
    }

    #[inline(always)]
    fn here(&self, node: usize) -> Here {
        Here {
            node,
            position: at(self.positions, node),
            velocity: if DAMPED { at(self.velocities, node) } else { Vec3::ZERO },
        }
    }

    #[inline(always)]
    fn pull(&self, here: Here, link: &Link) -> Vec3 {
        let neighbour = link.neighbour as usize;
        let offset = at(self.positions, neighbour) - here.position;
        let velocity = DAMPED.then(|| at(self.velocities, neighbour) - here.velocity);
        pull(here.node, link, offset, velocity)
    }

    #[inline(always)]
    fn pull_each<L: KeptLink>(&self, here: Here, links: &[L]) -> Vec3 {
        let mut sum = Vec3::ZERO;
        for link in links.iter().take_while(|link| link.neighbour() != NOBODY) {
            sum += self.pull(here, &link.link());
        }
        sum
    }
}

/// A node as its links see it.
#[derive(Clone, Copy)]
struct Here {
    node: usize,
    position: Vec3,
    velocity: Vec3,
}

/// A storage that keeps the links of a node in arrays.
pub(super) trait RowStorage {
    /// Writes the forces on a tile. To be marked `#[inline(always)]`: it is compiled for each kernel.
    fn tile_forces<const DAMPED: bool>(
        &self,
        tile: usize,
        motion: &Motion,
        eights: impl Eights,
        forces: &mut TileForces,
    );
}

/// The forces of such a storage on a tile, for a kernel to run.
pub(super) struct Rows<'a, 'm, S> {
    pub storage: &'a S,
    pub tile: usize,
    pub motion: &'a Motion<'m>,
    pub forces: &'a mut TileForces,
}

impl<S: RowStorage> WithEights for Rows<'_, '_, S> {
    #[inline(always)]
    fn run<E: Eights>(self, eights: E) {
        if self.motion.velocities.is_some() {
            self.storage
                .tile_forces::<true>(self.tile, self.motion, eights, self.forces);
        } else {
            self.storage
                .tile_forces::<false>(self.tile, self.motion, eights, self.forces);
        }
    }
}

/// Begins to fetch `size` bytes from `place`, which need not be anyone's.
#[inline(always)]
pub(super) fn prefetch_row<L>(place: *const L, size: usize) {
    for line in (0..size.min(FETCHED)).step_by(64) {
        prefetch(place.cast::<u8>().wrapping_add(line));
    }
}
