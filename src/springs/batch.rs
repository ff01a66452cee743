//! Forces of links that come one by one: their ends are fetched first, then many are computed at a time.
//!
//! Each sum is in the order in which its links came, so where a batch ends makes no difference to any bit, nor do the
//! instructions of a kernel: only exact operations are used, none of them fused.

use glam::Vec3;

use super::kernels::prefetch;
use super::law::pull;
use super::{Link, Motion, TileForces};

/// Links of a batch.
const BATCH: usize = 128;

/// How many numbers a cache line holds.
const LINE: usize = 16;

/// Adds up the forces on the nodes of a tile.
pub(super) struct Batch<'a, const DAMPED: bool> {
    positions: [&'a [f32]; 3],
    velocities: [&'a [f32]; 3],
    soon: [&'a [f32]; 6],
    forces: &'a mut TileForces,
    /// The tile's first node.
    first: usize,
    count: usize,
    links: Links,
}

/// The links of a batch, as arrays.
struct Links {
    nodes: [u32; BATCH],
    neighbours: [u32; BATCH],
    stiffnesses: [f32; BATCH],
    rest_lengths: [f32; BATCH],
    dampings: [f32; BATCH],
    /// From the node to the neighbour.
    offsets: [[f32; BATCH]; 3],
    /// Of the neighbour against the node.
    velocities: [[f32; BATCH]; 3],
}

impl Links {
    const NONE: Self = Self {
        nodes: [0; BATCH],
        neighbours: [0; BATCH],
        stiffnesses: [0.0; BATCH],
        rest_lengths: [0.0; BATCH],
        dampings: [0.0; BATCH],
        offsets: [[0.0; BATCH]; 3],
        velocities: [[0.0; BATCH]; 3],
    };
}

/// The axes, as slices that are seen to be of one length.
#[inline(always)]
fn even([x, y, z]: [&[f32]; 3]) -> [&[f32]; 3] {
    let count = x.len();
    [x, &y[..count], &z[..count]]
}

#[inline(always)]
fn at([x, y, z]: [&[f32]; 3], node: usize) -> [f32; 3] {
    [x[node], y[node], z[node]]
}

impl<'a, const DAMPED: bool> Batch<'a, DAMPED> {
    /// For the tile that begins with node `first` and has `count`.
    #[inline(always)]
    pub fn new(motion: &Motion<'a>, first: usize, count: usize, forces: &'a mut TileForces) -> Self {
        for axis in forces.axes_mut() {
            axis[..count].fill(0.0);
        }
        Self {
            positions: even(motion.positions.axes()),
            velocities: motion.velocities.map_or([&[]; 3], |velocities| even(velocities.axes())),
            soon: motion.soon,
            forces,
            first,
            count: 0,
            links: Links::NONE,
        }
    }

    /// Adds the links of `node`, after those of all nodes before it.
    #[inline(always)]
    pub fn add(&mut self, node: usize, links: impl Iterator<Item = Link>) {
        let place = node - self.first;
        if place.is_multiple_of(LINE) {
            for axis in self.soon {
                prefetch(axis.as_ptr().wrapping_add(place));
            }
        }
        let positions = self.positions;
        let position = at(positions, node);
        let velocity = if DAMPED { at(self.velocities, node) } else { [0.0; 3] };
        let mut count = self.count;
        for link in links {
            if count == BATCH {
                self.count = count;
                self.finish();
                count = 0;
            }
            let other = at(positions, link.neighbour as usize);
            let to = &mut self.links;
            to.nodes[count] = node as u32;
            to.neighbours[count] = link.neighbour;
            to.stiffnesses[count] = link.stiffness;
            to.rest_lengths[count] = link.rest_length;
            for axis in 0..3 {
                to.offsets[axis][count] = other[axis] - position[axis];
            }
            if DAMPED {
                to.dampings[count] = link.damping;
                let other = at(self.velocities, link.neighbour as usize);
                for axis in 0..3 {
                    to.velocities[axis][count] = other[axis] - velocity[axis];
                }
            }
            count += 1;
        }
        self.count = count;
    }

    /// Computes the forces of the links that have come, and adds them up.
    #[inline(always)]
    pub fn finish(&mut self) {
        let links = &self.links;
        let mut forces = [[0.0_f32; BATCH]; 3];
        for lane in 0..BATCH {
            let vector = |axes: &[[f32; BATCH]; 3]| Vec3::new(axes[0][lane], axes[1][lane], axes[2][lane]);
            let link = Link {
                neighbour: links.neighbours[lane],
                stiffness: links.stiffnesses[lane],
                rest_length: links.rest_lengths[lane],
                damping: if DAMPED { links.dampings[lane] } else { 0.0 },
            };
            let velocity = DAMPED.then(|| vector(&links.velocities));
            let force = pull(links.nodes[lane] as usize, &link, vector(&links.offsets), velocity);
            for (forces, force) in forces.iter_mut().zip(force.to_array()) {
                forces[lane] = force;
            }
        }
        let mut lane = 0;
        while lane < self.count.min(BATCH) {
            let node = links.nodes[lane];
            let place = node as usize - self.first;
            let mut sum = self.forces.get(place);
            while lane < self.count.min(BATCH) && links.nodes[lane] == node {
                sum += Vec3::new(forces[0][lane], forces[1][lane], forces[2][lane]);
                lane += 1;
            }
            self.forces.set(place, sum);
        }
        self.count = 0;
    }
}
