//! Finds springs that are too long. Springs are only measured again after nodes have moved far enough.

use crate::base::{Result, memory};
use crate::codec::saved;
use crate::geometry::Aabb;
use crate::simd::{ChosenKernel, Loops};
use crate::soa::Vectors;
use crate::threads::{Items, Team};

/// The number of springs in a chunk.
const CHUNK_SPRINGS: usize = 512;

/// The relative rounding error of a length.
const ROUNDING: f32 = 1e-6;

/// The number of nodes that a task examines, and of SIMD lanes.
const BLOCK_NODES: usize = 2048;
const LANES: usize = 16;

/// A spring with a maximum length, in internal indices, the lower node first.
#[derive(Clone, Copy, Debug)]
pub(super) struct WatchedSpring {
    pub nodes: [u32; 2],
    /// The square of the maximum length, m².
    pub longest_squared: f32,
}

saved! { WatchedSpring { nodes, longest_squared } }

/// Bounds for a chunk of springs.
#[derive(Clone, Copy, Debug, Default)]
struct SpringChunk {
    /// The length that each spring of the chunk can gain before one can be too long, m.
    slack: f32,
    is_any_too_long: bool,
}

saved! { SpringChunk { slack, is_any_too_long } }

/// Conservative bounds on the lengths of springs.
#[derive(Debug)]
pub(super) struct StrainMonitor {
    chunks: Vec<SpringChunk>,
    /// The positions of nodes when springs were last measured.
    measured: Vectors,
    /// True if `chunks` and `measured` fit the current springs and nodes.
    is_measured: bool,
    /// The number of chunks that were measured again since.
    remeasured: usize,
    /// Bounds of the displacements since, for each block of nodes.
    drifts: Vec<Aabb>,
}

saved! { StrainMonitor { chunks, measured, is_measured, remeasured, drifts } }

impl StrainMonitor {
    /// Creates bounds for `node_count` nodes, and reserves space for `room` nodes in total.
    pub fn new(node_count: usize, room: usize) -> Result<Self> {
        let mut measured = Vectors::zeros(node_count)?;
        measured.reserve(room)?;
        let mut drifts = memory::reserved(room.div_ceil(BLOCK_NODES))?;
        drifts.resize(node_count.div_ceil(BLOCK_NODES), Aabb::EMPTY);
        Ok(Self {
            chunks: Vec::new(),
            measured,
            is_measured: false,
            remeasured: 0,
            drifts,
        })
    }

    /// Reserves space for this many springs in total.
    pub fn reserve(&mut self, springs: usize) -> Result<()> {
        memory::reserve(&mut self.chunks, springs.div_ceil(CHUNK_SPRINGS))
    }

    /// Extends the lists to this many nodes, for which space is reserved.
    pub fn resize_nodes(&mut self, node_count: usize) {
        self.measured.grow(node_count);
        self.drifts.resize(node_count.div_ceil(BLOCK_NODES), Aabb::EMPTY);
        self.is_measured = false;
    }

    /// Invalidates the bounds after springs have changed.
    pub fn forget(&mut self) {
        self.is_measured = false;
    }

    /// Finds springs that are too long. Space for all is reserved. Chunks whose nodes have not moved far enough since
    /// they were measured are skipped.
    pub fn update(&mut self, springs: &[WatchedSpring], positions: &Vectors, (kernel, team): (ChosenKernel, &Team)) {
        let axes = positions.axes();
        let count = springs.len().div_ceil(CHUNK_SPRINGS);
        self.chunks.resize(count, SpringChunk::default());
        if !self.is_measured || self.remeasured >= count {
            team.pass(count, Items::new(&mut self.chunks), |chunk, it| {
                *it = measure_chunk(springs_of_chunk(springs, chunk), axes);
            });
            self.measured.copy_from(positions);
            (self.is_measured, self.remeasured) = (true, 0);
            return;
        }
        let nodes = positions.len();
        let before = &self.measured;
        team.pass(
            nodes.div_ceil(BLOCK_NODES),
            Items::new(&mut self.drifts),
            |block, drift| {
                let block_nodes = block * BLOCK_NODES..nodes.min((block + 1) * BLOCK_NODES);
                let [now, before] = [positions, before].map(|vectors| vectors.slices(block_nodes.clone()));
                *drift = kernel.run(DisplacementBounds { now, before });
            },
        );
        let drift = self.drifts.iter().fold(Aabb::EMPTY, |all, drift| all.and(drift));
        let largest = drift.magnitudes().max_element();
        // A bound on the change of distance between the ends of a spring.
        let spread = (drift.max - drift.min).length() * (1.0 + ROUNDING) + largest * ROUNDING;
        // NaN is examined.
        let needs_measuring = |chunk: &SpringChunk| !(spread < chunk.slack);
        self.remeasured += self.chunks.iter().filter(|chunk| needs_measuring(chunk)).count();
        team.pass(count, Items::new(&mut self.chunks), |chunk, it| {
            it.is_any_too_long =
                needs_measuring(it) && measure_chunk(springs_of_chunk(springs, chunk), axes).is_any_too_long;
        });
    }

    /// The springs of the chunks in which [`Self::update`] found one that is too long, with their indices.
    pub fn candidates<'a>(&'a self, springs: &'a [WatchedSpring]) -> impl Iterator<Item = (usize, &'a WatchedSpring)> {
        let chunks = self
            .chunks
            .iter()
            .enumerate()
            .filter(|(_, chunk)| chunk.is_any_too_long);
        chunks.flat_map(|(chunk, _)| (chunk * CHUNK_SPRINGS..).zip(springs_of_chunk(springs, chunk)))
    }
}

fn springs_of_chunk(springs: &[WatchedSpring], chunk: usize) -> &[WatchedSpring] {
    &springs[chunk * CHUNK_SPRINGS..springs.len().min((chunk + 1) * CHUNK_SPRINGS)]
}

/// Measures a chunk of springs.
fn measure_chunk(springs: &[WatchedSpring], [x, y, z]: [&[f32]; 3]) -> SpringChunk {
    let (y, z) = (&y[..x.len()], &z[..x.len()]);
    let mut chunk = SpringChunk {
        slack: f32::INFINITY,
        is_any_too_long: false,
    };
    for spring in springs {
        let [a, b] = spring.nodes.map(|node| node as usize);
        let (u, v, w) = (x[b] - x[a], y[b] - y[a], z[b] - z[a]);
        let squared = u * u + v * v + w * w;
        chunk.is_any_too_long |= squared > spring.longest_squared;
        let slack = spring.longest_squared.sqrt() * (1.0 - ROUNDING) - squared.sqrt() * (1.0 + ROUNDING);
        chunk.slack = chunk.slack.min(slack);
    }
    chunk
}

/// Computes the bounds of displacements.
struct DisplacementBounds<'a> {
    now: [&'a [f32]; 3],
    before: [&'a [f32]; 3],
}

impl Loops for DisplacementBounds<'_> {
    type Output = Aabb;

    #[inline(always)]
    fn run(self) -> Aabb {
        let mut bounds = Aabb::EMPTY;
        for axis in 0..3 {
            let (now, before) = (self.now[axis], self.before[axis]);
            let (mut low, mut high) = ([f32::INFINITY; LANES], [f32::NEG_INFINITY; LANES]);
            for (now, before) in now.chunks_exact(LANES).zip(before.chunks_exact(LANES)) {
                for lane in 0..LANES {
                    let displacement = now[lane] - before[lane];
                    low[lane] = if displacement < low[lane] {
                        displacement
                    } else {
                        low[lane]
                    };
                    high[lane] = if displacement > high[lane] {
                        displacement
                    } else {
                        high[lane]
                    };
                }
            }
            let vectorized = now.len() - now.len() % LANES;
            let remaining = (vectorized..now.len()).map(|node| now[node] - before[node]);
            let displacements = |lanes: [f32; LANES]| lanes.into_iter().chain(remaining.clone());
            bounds.min[axis] = displacements(low).fold(f32::INFINITY, f32::min);
            bounds.max[axis] = displacements(high).fold(f32::NEG_INFINITY, f32::max);
        }
        bounds
    }
}
