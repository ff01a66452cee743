//! The force on a node as a sum over its own links: nothing else is written, so tiles can be worked on in any order.
//!
//! One link after the other, in plain code: on processors where a gather costs as much as the loads it stands for, many at
//! a time are no faster as long as each place brings its own parameters.

use glam::Vec3;

use super::kernels::prefetch;
use super::law::pull;
use super::{Link, Motion, TileForces};

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
        let place = node - self.first;
        if place.is_multiple_of(LINE) {
            for axis in self.soon {
                prefetch(axis.as_ptr().wrapping_add(place));
            }
        }
        let position = at(self.positions, node);
        let velocity = if DAMPED { at(self.velocities, node) } else { Vec3::ZERO };
        let mut sum = Vec3::ZERO;
        links.for_each(|link| {
            let neighbour = link.neighbour as usize;
            let offset = at(self.positions, neighbour) - position;
            let velocity = DAMPED.then(|| at(self.velocities, neighbour) - velocity);
            sum += pull(node, &link, offset, velocity);
        });
        forces.set(place, sum);
    }
}

/// Begins to fetch `size` bytes from `place`, which need not be anyone's.
#[inline(always)]
pub(super) fn prefetch_row<L>(place: *const L, size: usize) {
    for line in (0..size.min(FETCHED)).step_by(64) {
        prefetch(place.cast::<u8>().wrapping_add(line));
    }
}
