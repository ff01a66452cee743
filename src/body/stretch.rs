//! Which springs have become too long: looked for where nodes have gone far enough for that alone.

use crate::base::{Result, memory};
use crate::codec::saved;
use crate::geometry::Bounds;
use crate::simd::{ChosenKernel, Loops};
use crate::soa::Vectors;
use crate::threads::{Items, Team};

/// Springs that are looked at together.
const CHUNK: usize = 512;

/// What rounding may make of a length, as a part of it.
const ROUNDING: f32 = 1e-6;

/// Nodes that are looked at together, and side by side.
const NODES: usize = 2048;
const LANES: usize = 16;

/// A spring that is not to become too long, in the body's own numbers, the lower first.
#[derive(Clone, Copy, Debug)]
pub(super) struct WatchedSpring {
    pub nodes: [u32; 2],
    /// Of the longest that it may be, m².
    pub longest_squared: f32,
}

saved! { WatchedSpring { nodes, longest_squared } }

/// What is known of some springs.
#[derive(Clone, Copy, Debug, Default)]
struct Chunk {
    /// How much longer each of them may have become since they were measured without any being too long, m.
    slack: f32,
    is_any_too_long: bool,
}

saved! { Chunk { slack, is_any_too_long } }

/// What is known of the lengths of springs.
#[derive(Debug)]
pub(super) struct StretchBound {
    chunks: Vec<Chunk>,
    /// Where nodes were when springs were last measured.
    measured: Vectors,
    /// Whether both are of the springs and nodes that there are.
    is_measured: bool,
    /// How many chunks have been looked through since.
    looked: usize,
    /// How far nodes have gone since, so many together.
    drifts: Vec<Bounds>,
}

saved! { StretchBound { chunks, measured, is_measured, looked, drifts } }

impl StretchBound {
    /// Of so many nodes, with room for more up to so many in all.
    pub fn new(node_count: usize, room: usize) -> Result<Self> {
        let mut measured = Vectors::zeros(node_count)?;
        measured.reserve(room)?;
        let mut drifts = memory::reserved(room.div_ceil(NODES))?;
        drifts.resize(node_count.div_ceil(NODES), Bounds::EMPTY);
        Ok(Self {
            chunks: Vec::new(),
            measured,
            is_measured: false,
            looked: 0,
            drifts,
        })
    }

    /// Makes room for so many springs in all.
    pub fn reserve(&mut self, springs: usize) -> Result<()> {
        memory::reserve(&mut self.chunks, springs.div_ceil(CHUNK))
    }

    /// Nodes have come, for which there is room, up to so many in all.
    pub fn grow(&mut self, node_count: usize) {
        self.measured.grow(node_count);
        self.drifts.resize(node_count.div_ceil(NODES), Bounds::EMPTY);
        self.is_measured = false;
    }

    /// Springs are not what they were.
    pub fn forget(&mut self) {
        self.is_measured = false;
    }

    /// Looks for springs that are too long, for all of which there is room. Those of which nodes have not gone far enough since they were
    /// measured are not looked at.
    pub fn look(&mut self, springs: &[WatchedSpring], positions: &Vectors, (kernel, team): (ChosenKernel, &Team)) {
        let axes = positions.axes();
        let count = springs.len().div_ceil(CHUNK);
        self.chunks.resize(count, Chunk::default());
        if !self.is_measured || self.looked >= count {
            team.pass(count, Items::new(&mut self.chunks), |chunk, it| {
                *it = measured(of_chunk(springs, chunk), axes);
            });
            self.measured.copy_from(positions);
            (self.is_measured, self.looked) = (true, 0);
            return;
        }
        let nodes = positions.len();
        let before = &self.measured;
        team.pass(nodes.div_ceil(NODES), Items::new(&mut self.drifts), |part, drift| {
            let some = part * NODES..nodes.min((part + 1) * NODES);
            let [now, before] = [positions, before].map(|places| places.slices(some.clone()));
            *drift = kernel.run(Travel { now, before });
        });
        let drift = self.drifts.iter().fold(Bounds::EMPTY, |all, drift| all.and(drift));
        let furthest = drift.magnitudes().max_element();
        // The ends of a spring have not gone further apart than this.
        let spread = (drift.max - drift.min).length() * (1.0 + ROUNDING) + furthest * ROUNDING;
        // What is no number is looked at.
        let is_looked_at = |chunk: &Chunk| !(spread < chunk.slack);
        self.looked += self.chunks.iter().filter(|chunk| is_looked_at(chunk)).count();
        team.pass(count, Items::new(&mut self.chunks), |chunk, it| {
            it.is_any_too_long = is_looked_at(it) && measured(of_chunk(springs, chunk), axes).is_any_too_long;
        });
    }

    /// The springs among which [`Self::look`] has found some that are too long, with their places.
    pub fn found<'a>(&'a self, springs: &'a [WatchedSpring]) -> impl Iterator<Item = (usize, &'a WatchedSpring)> {
        let chunks = self
            .chunks
            .iter()
            .enumerate()
            .filter(|(_, chunk)| chunk.is_any_too_long);
        chunks.flat_map(|(chunk, _)| (chunk * CHUNK..).zip(of_chunk(springs, chunk)))
    }
}

fn of_chunk(springs: &[WatchedSpring], chunk: usize) -> &[WatchedSpring] {
    &springs[chunk * CHUNK..springs.len().min((chunk + 1) * CHUNK)]
}

/// What is to be known of some springs.
fn measured(springs: &[WatchedSpring], [x, y, z]: [&[f32]; 3]) -> Chunk {
    let (y, z) = (&y[..x.len()], &z[..x.len()]);
    let mut chunk = Chunk {
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

/// How far nodes have gone.
struct Travel<'a> {
    now: [&'a [f32]; 3],
    before: [&'a [f32]; 3],
}

impl Loops for Travel<'_> {
    type Output = Bounds;

    #[inline(always)]
    fn run(self) -> Bounds {
        let mut bounds = Bounds::EMPTY;
        for axis in 0..3 {
            let (now, before) = (self.now[axis], self.before[axis]);
            let (mut low, mut high) = ([f32::INFINITY; LANES], [f32::NEG_INFINITY; LANES]);
            for (now, before) in now.chunks_exact(LANES).zip(before.chunks_exact(LANES)) {
                for lane in 0..LANES {
                    let way = now[lane] - before[lane];
                    low[lane] = if way < low[lane] { way } else { low[lane] };
                    high[lane] = if way > high[lane] { way } else { high[lane] };
                }
            }
            let done = now.len() - now.len() % LANES;
            let rest = (done..now.len()).map(|node| now[node] - before[node]);
            let ways = |lanes: [f32; LANES]| lanes.into_iter().chain(rest.clone());
            bounds.min[axis] = ways(low).fold(f32::INFINITY, f32::min);
            bounds.max[axis] = ways(high).fold(f32::NEG_INFINITY, f32::max);
        }
        bounds
    }
}
