//! Forces of links as storages keep them: a few links of a node at a time, and nothing written but the node's own force.
//!
//! Only exact operations are used, none of them fused, so all processors and all kernels give the same bits.

use std::array::from_fn;

use super::kept::{KeptLink, NOBODY};
use super::kernels::prefetch;
use super::{Motion, TileForces};

/// Links that are computed together.
pub(super) const LANES: usize = 8;

/// How many numbers a cache line holds.
const LINE: usize = 16;

/// One number of each of some links.
type Lanes = [f32; LANES];

/// What the links of a tile's nodes are seen against.
pub(super) struct Gather<'a, const DAMPED: bool> {
    positions: [&'a [f32]; 3],
    velocities: [&'a [f32]; 3],
    soon: [&'a [f32]; 6],
    /// The tile's first node.
    first: usize,
}

/// The force on a node so far.
pub(super) struct Sum {
    node: usize,
    position: [f32; 3],
    velocity: [f32; 3],
    lanes: [Lanes; 3],
}

/// The axes, as slices that are seen to be of one length.
#[inline(always)]
fn even([x, y, z]: [&[f32]; 3]) -> [&[f32]; 3] {
    let count = x.len();
    [x, &y[..count], &z[..count]]
}

/// How vectors at `nodes`, which are within all axes, differ from `own`.
#[inline(always)]
fn differences(axes: [&[f32]; 3], nodes: &[usize; LANES], own: [f32; 3]) -> [Lanes; 3] {
    let along = |axis: usize| from_fn(|lane| axes[axis][nodes[lane]] - own[axis]);
    [along(0), along(1), along(2)]
}

#[inline(always)]
fn dot(a: &[Lanes; 3], b: &[Lanes; 3]) -> Lanes {
    from_fn(|lane| a[0][lane] * b[0][lane] + a[1][lane] * b[1][lane] + a[2][lane] * b[2][lane])
}

impl<'a, const DAMPED: bool> Gather<'a, DAMPED> {
    /// For the tile that begins with node `first`.
    #[inline(always)]
    pub fn new(motion: &Motion<'a>, first: usize) -> Self {
        Self {
            positions: even(motion.positions.axes()),
            velocities: motion.velocities.map_or([&[]; 3], |velocities| even(velocities.axes())),
            soon: motion.soon,
            first,
        }
    }

    /// The force on `node` without any link; begins to fetch what is wanted after the forces.
    #[inline(always)]
    pub fn begin(&self, node: usize) -> Sum {
        let place = node - self.first;
        if place.is_multiple_of(LINE) {
            for axis in self.soon {
                prefetch(axis.as_ptr().wrapping_add(place));
            }
        }
        let own = |axes: [&[f32]; 3]| axes.map(|axis| axis[node]);
        Sum {
            node,
            position: own(self.positions),
            velocity: if DAMPED { own(self.velocities) } else { [0.0; 3] },
            lanes: [[0.0; LANES]; 3],
        }
    }

    /// Adds the forces of all links of a row, which end where the first place is empty.
    #[inline(always)]
    pub fn add_row<L: KeptLink>(&self, sum: &mut Sum, row: &[L]) {
        let (full, rest) = row.as_chunks::<LANES>();
        for links in full {
            if links[0].neighbour() == NOBODY {
                return;
            }
            self.add(sum, links);
        }
        if !rest.is_empty() {
            self.add(
                sum,
                &from_fn(|lane| if lane < rest.len() { rest[lane] } else { L::EMPTY }),
            );
        }
    }

    /// Adds the forces of some links, or empty places.
    #[inline(always)]
    pub fn add<L: KeptLink>(&self, sum: &mut Sum, links: &[L; LANES]) {
        let last = self.positions[0].len().saturating_sub(1);
        // An empty place is as a link to the node itself, without stiffness.
        let neighbours: [usize; LANES] = from_fn(|lane| match links[lane].neighbour() {
            NOBODY => sum.node,
            neighbour => neighbour as usize,
        });
        // What is checked once for all of them.
        let neighbours = neighbours.map(|neighbour| neighbour.min(last));
        let offsets = differences(self.positions, &neighbours, sum.position);
        let squares = dot(&offsets, &offsets);
        let lengths = squares.map(f32::sqrt);
        let apart: [bool; LANES] = from_fn(|lane| squares[lane] > 0.0);
        let inverses: Lanes = lengths.map(|length| 1.0 / length);
        // The direction, as in `separation`: where the ends are at one place, from the lower number to the higher.
        let mut directions: [Lanes; 3] = from_fn(|axis| {
            from_fn(|lane| {
                if apart[lane] {
                    offsets[axis][lane] * inverses[lane]
                } else {
                    0.0
                }
            })
        });
        directions[0] = from_fn(|lane| match apart[lane] {
            true => directions[0][lane],
            false if sum.node < neighbours[lane] => 1.0,
            false => -1.0,
        });
        let mut pulls: Lanes = from_fn(|lane| {
            let link = links[lane].link();
            link.stiffness * (lengths[lane] - link.rest_length)
        });
        if DAMPED {
            let velocities = differences(self.velocities, &neighbours, sum.velocity);
            let rates = dot(&velocities, &directions);
            pulls = from_fn(|lane| pulls[lane] + links[lane].link().damping * rates[lane]);
        }
        for (sums, direction) in sum.lanes.iter_mut().zip(directions) {
            *sums = from_fn(|lane| sums[lane] + direction[lane] * pulls[lane]);
        }
    }

    /// Writes the force on the node.
    #[inline(always)]
    pub fn finish(&self, sum: &Sum, forces: &mut TileForces) {
        let place = sum.node - self.first;
        for (axis, lanes) in forces.axes_mut().into_iter().zip(&sum.lanes) {
            let pairs: [f32; 4] = from_fn(|lane| lanes[lane] + lanes[lane + 4]);
            axis[place] = (pairs[0] + pairs[2]) + (pairs[1] + pairs[3]);
        }
    }
}
