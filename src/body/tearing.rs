//! What springs of a body bear before it tears, and which of them are beyond that.

use super::definition::not_negative;
use super::{BodyDefinition, Bounds, NodeOrder, Spring, Vectors};
use crate::cutting::Changes;
use crate::diagnostics::StateHasher;
use crate::error::{Error, Result};
use crate::memory;
use crate::springs::{Change, ChosenKernel, Link, Loops, Rewiring, tile_count, tile_nodes};
use crate::threads::{Items, Team};

/// No spring.
const NONE: u32 = u32::MAX;

/// Springs that are looked at together.
const CHUNK: usize = 512;

/// What rounding may make of a length, as a part of it.
const ROUNDING: f32 = 1e-6;

/// Nodes that are worked on side by side.
const LANES: usize = 16;

/// When a body tears.
///
/// A spring that a step has left beyond its limits tears the surface through one of its nodes, across what pulls that node apart (O'Brien,
/// Hodgins 1999, equation 13); where a cut ends in a triangle next to the spring, that goes on instead. A tear goes as far as the next triangle
/// that is simulated, and is a cut in all it does.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tearing {
    /// The part of its rest length by which a spring may become longer, at least 0; 0: any. A spring without a rest length has no strain.
    pub strain: f32,
    /// How much a spring may pull, N, at least 0; 0: any. What a cut leaves of a spring bears its part.
    pub force: f32,
    /// The most tears in a step, those of the most loaded springs; 0: the body does not tear, and pays nothing for it.
    pub most_per_step: u32,
    /// A tear that would part a piece with less area in the rest shape, m², is not made; at least 0.
    pub smallest_piece: f32,
}

/// What tore in the last step, and what did not.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TearReport {
    /// Tears that were made.
    pub tears: u32,
    /// How many more pieces the surface has.
    pub pieces_parted: u32,
    /// Springs beyond their limits whose turn is to come: there were as many tears as there may be, one beside them, or nothing pulls their nodes
    /// apart.
    pub waiting: u32,
    /// Springs beyond their limits that would part too small a piece.
    pub small_pieces: u32,
    /// Springs beyond their limits for whose tears there is no room: not as many spare nodes, or places in a row of fixed length, or memory.
    pub no_room: u32,
}

/// Why a spring beyond its limits was not torn. It is not tried again before the topology changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Withheld {
    SmallPiece,
    NoRoom,
    NoWay,
}

/// A spring that may tear, in the body's own numbers, the lower first.
#[derive(Clone, Copy, Debug)]
struct Watched {
    nodes: [u32; 2],
    /// Of the longest that it may be, m².
    longest_squared: f32,
}

#[derive(Clone, Copy, Debug)]
struct Limits {
    strain: f32,
    force: f32,
    /// The next spring of the same lower node.
    next: u32,
    /// Since which version of the topology.
    withheld: Option<(u32, Withheld)>,
}

/// What is known of some springs.
#[derive(Clone, Copy, Debug, Default)]
struct Chunk {
    /// How much longer each of them may have become since they were measured without any being beyond its limits, m.
    slack: f32,
    is_any_beyond: bool,
}

/// A spring beyond its limits.
#[derive(Clone, Copy, Debug)]
struct Beyond {
    /// Its stretch as a multiple of the most that it may have.
    load: f32,
    callers: [u32; 2],
    nodes: [u32; 2],
}

/// The springs of a body that tears, and those beyond their limits after the last step.
#[derive(Debug)]
pub(crate) struct Tears {
    asked: Tearing,
    /// Each with its limits at the same place.
    springs: Vec<Watched>,
    limits: Vec<Limits>,
    /// Of each node the first spring that it is the lower one of.
    first: Vec<u32>,
    chunks: Vec<Chunk>,
    /// Where nodes were when chunks were last measured.
    measured: Vectors,
    /// Whether chunks and `measured` are of the springs and nodes that there are.
    is_measured: bool,
    /// How many chunks have been looked through since.
    looked: usize,
    /// How far the nodes of each tile have gone since.
    drifts: Vec<Bounds>,
    /// The most loaded first.
    beyond: Vec<Beyond>,
    /// How many of them have had their turn.
    seen: usize,
    /// Tears that were tried in this step.
    tried: u32,
    /// Nodes about the tears of this step.
    torn: Vec<u32>,
    pub(super) report: TearReport,
}

impl Tearing {
    /// Refuses what is out of its range, or not possible for such a body.
    pub(super) fn check(&self, definition: &BodyDefinition) -> Result<()> {
        let of_springs = [("tear_strain", self.strain), ("tear_force", self.force)];
        for (name, value) in of_springs.into_iter().chain([("smallest_piece", self.smallest_piece)]) {
            not_negative(name, value)?;
            if value > 0.0 && self.most_per_step == 0 {
                return Err(Error::invalid(format!(
                    "{name} is {value}, and most_tears is 0: must be at least 1"
                )));
            }
        }
        if self.most_per_step == 0 {
            return Ok(());
        }
        let most = self.most_per_step;
        if definition.spare_nodes == 0 {
            return Err(Error::invalid(format!(
                "most_tears is {most}, and spare_nodes is 0: a tear needs nodes to come"
            )));
        }
        if !definition.tetrahedra.is_empty() || !definition.cells.is_empty() {
            return Err(Error::Unsupported(format!(
                "most_tears is {most}: bodies with tetrahedra or cells do not tear"
            )));
        }
        Ok(())
    }
}

impl Tears {
    /// With springs in the body's own numbers, and room for `spare` nodes; `None`: the body is not to tear.
    pub fn new(definition: &BodyDefinition, springs: &[Spring]) -> Result<Option<Box<Self>>> {
        let asked = definition.tearing;
        if asked.most_per_step == 0 {
            return Ok(None);
        }
        let node_count = definition.positions.len();
        let mut first = memory::reserved(node_count + definition.spare_nodes as usize)?;
        first.resize(node_count, NONE);
        let mut tears = Self {
            asked,
            springs: memory::reserved(springs.len())?,
            limits: memory::reserved(springs.len())?,
            first,
            chunks: memory::reserved(springs.len().div_ceil(CHUNK))?,
            measured: Vectors::zeros(node_count)?,
            is_measured: false,
            looked: 0,
            drifts: memory::reserved(tile_count(node_count + definition.spare_nodes as usize))?,
            beyond: Vec::new(),
            seen: 0,
            tried: 0,
            torn: Vec::new(),
            report: TearReport::default(),
        };
        tears.measured.reserve(node_count + definition.spare_nodes as usize)?;
        tears.drifts.resize(tile_count(node_count), Bounds::EMPTY);
        // In the order of their nodes, which is that of their places in memory.
        let mut order = memory::reserved(springs.len())?;
        order.extend(0..springs.len() as u32);
        order.sort_unstable_by_key(|&at| sorted(springs[at as usize].nodes));
        for at in order {
            let spring = springs[at as usize];
            tears.add(
                sorted(spring.nodes),
                [asked.strain, asked.force],
                &Link::ends(&spring)[0],
            );
        }
        Ok(Some(Box::new(tears)))
    }

    /// A tear that would part a piece with less area is not to be made, m².
    pub fn smallest_piece(&self) -> f64 {
        f64::from(self.asked.smallest_piece)
    }

    /// Makes room for so many more springs.
    pub fn reserve(&mut self, springs: usize) -> Result<()> {
        self.springs.try_reserve(springs)?;
        self.chunks.try_reserve(springs.div_ceil(CHUNK))?;
        Ok(self.limits.try_reserve(springs)?)
    }

    /// Nodes have come, for which there is room, up to so many in all.
    pub fn grow(&mut self, node_count: usize) {
        self.first.resize(node_count, NONE);
        self.measured.grow(node_count);
        self.drifts.resize(tile_count(node_count), Bounds::EMPTY);
        self.is_measured = false;
    }

    /// Gives a spring its limits, strain and force, for which there is room if it has none yet.
    pub fn set(&mut self, nodes: [u32; 2], [strain, force]: [Option<f32>; 2], link: &Link) {
        match self.find(nodes) {
            Some(at) => {
                let limits = &mut self.limits[at];
                limits.strain = strain.unwrap_or(limits.strain);
                limits.force = force.unwrap_or(limits.force);
                limits.withheld = None;
                self.springs[at].longest_squared = longest_squared(limits, link);
                self.is_measured = false;
            }
            None => self.add(sorted(nodes), [strain, force].map(|limit| limit.unwrap_or(0.0)), link),
        }
    }

    /// A spring is no more.
    pub fn remove(&mut self, nodes: [u32; 2]) {
        let Some(at) = self.find(nodes) else {
            return;
        };
        self.rename(at, self.limits[at].next);
        let last = self.springs.len() - 1;
        if at < last {
            self.rename(last, at as u32);
        }
        self.springs.swap_remove(at);
        self.limits.swap_remove(at);
        self.is_measured = false;
    }

    /// Springs have other stiffnesses or rest lengths; limits stay.
    pub fn change(&mut self, changes: &[Change]) {
        for change in changes {
            if let Some(at) = self.find([change.node, change.after.neighbour]) {
                self.springs[at].longest_squared = longest_squared(&self.limits[at], &change.after);
                self.is_measured = false;
            }
        }
    }

    /// A cut has changed springs: each part of one bears its part. There is room for those that are new.
    pub fn follow(&mut self, changes: &Changes, rewiring: &Rewiring, order: &NodeOrder) {
        let own = |nodes: [u32; 2]| nodes.map(|node| order.own(node));
        for piece in changes.springs.iter().filter(|piece| piece.nodes != piece.source) {
            if let Some(at) = self.find(own(piece.source)) {
                let (spring, limits) = (self.springs[at], self.limits[at]);
                // As long as the whole.
                self.link(
                    Watched {
                        nodes: sorted(own(piece.nodes)),
                        ..spring
                    },
                    Limits {
                        force: (f64::from(limits.force) * piece.part) as f32,
                        withheld: None,
                        ..limits
                    },
                );
            }
        }
        for spring in &rewiring.removed {
            self.remove(spring.nodes);
        }
        for Change { node, before, after } in &rewiring.changed {
            if let Some(at) = self.find([*node, after.neighbour])
                && before.stiffness > 0.0
            {
                self.limits[at].force *= after.stiffness / before.stiffness;
            }
        }
    }

    /// Finds the springs beyond their limits: whether there are any that may be torn with this version of the topology. Without memory for
    /// all of them some wait for the next step.
    pub fn begin(&mut self, positions: &Vectors, version: u64, order: &NodeOrder, team: (ChosenKernel, &Team)) -> bool {
        self.beyond.clear();
        self.torn.clear();
        (self.seen, self.tried) = (0, 0);
        self.report = TearReport::default();
        self.look(positions, team);
        for chunk in 0..self.springs.len().div_ceil(CHUNK) {
            if !self.chunks[chunk].is_any_beyond {
                continue;
            }
            for (at, spring) in (chunk * CHUNK..).zip(of_chunk(&self.springs, chunk)) {
                let [a, b] = spring.nodes.map(|node| positions.get(node as usize));
                let squared = a.distance_squared(b);
                let is_beyond = squared > spring.longest_squared;
                if !is_beyond {
                    continue;
                }
                let withheld = self.limits[at].withheld;
                if let Some((_, why)) = withheld.filter(|&(since, _)| since == version as u32) {
                    self.report.withhold(why);
                    continue;
                }
                let beyond = Beyond {
                    load: squared / spring.longest_squared,
                    callers: sorted(spring.nodes.map(|node| order.caller(node))),
                    nodes: spring.nodes,
                };
                if memory::push(&mut self.beyond, beyond).is_err() {
                    self.report.waiting += 1;
                }
            }
        }
        !self.beyond.is_empty()
    }

    /// Finds the chunks with springs beyond their limits. Those of which nodes have not gone far enough since they were measured are not looked
    /// through.
    fn look(&mut self, positions: &Vectors, (kernel, team): (ChosenKernel, &Team)) {
        let (springs, axes) = (&self.springs, positions.axes());
        let count = springs.len().div_ceil(CHUNK);
        let chunks = &mut self.chunks[..count];
        if !self.is_measured || self.looked >= count {
            team.pass(count, Items::new(chunks), |chunk, it| {
                *it = measured(of_chunk(springs, chunk), axes);
            });
            self.measured.copy_from(positions);
            (self.is_measured, self.looked) = (true, 0);
            return;
        }
        let nodes = positions.len();
        let before = &self.measured;
        team.pass(tile_count(nodes), Items::new(&mut self.drifts), |tile, drift| {
            let [now, before] = [positions, before].map(|places| places.slices(tile_nodes(tile, nodes)));
            *drift = kernel.run(Drift { now, before });
        });
        let drift = self.drifts.iter().fold(Bounds::EMPTY, |all, drift| all.and(drift));
        let furthest = drift.min.abs().max(drift.max.abs()).max_element();
        let spread = (drift.max - drift.min).length() * (1.0 + ROUNDING) + furthest * ROUNDING;
        // What is no number is looked at.
        let is_looked_at = |chunk: &Chunk| !(spread < chunk.slack);
        self.looked += chunks.iter().filter(|chunk| is_looked_at(chunk)).count();
        team.pass(count, Items::new(chunks), |chunk, it| {
            it.is_any_beyond = is_looked_at(it) && measured(of_chunk(springs, chunk), axes).is_any_beyond;
        });
    }

    /// Puts the most loaded first, given what each spring is like.
    pub fn sort(&mut self, link: impl Fn([u32; 2]) -> Option<Link>) {
        for at in 0..self.beyond.len() {
            let nodes = self.beyond[at].nodes;
            if let (Some(link), Some(spring)) = (link(nodes), self.find(nodes)) {
                let longest = self.springs[spring].longest_squared;
                let length = (self.beyond[at].load * longest).sqrt();
                self.beyond[at].load = (length - link.rest_length) / (longest.sqrt() - link.rest_length);
            }
        }
        self.beyond
            .sort_unstable_by(|a, b| b.load.total_cmp(&a.load).then(a.callers.cmp(&b.callers)));
    }

    /// The next spring that is to tear.
    pub fn next(&mut self) -> Option<[u32; 2]> {
        while let Some(&Beyond { nodes, .. }) = self.beyond.get(self.seen) {
            self.seen += 1;
            if self.find(nodes).is_none() {
                continue;
            }
            let is_beside = nodes.iter().any(|node| self.torn.contains(node));
            let most = self.asked.most_per_step;
            // As many again may be tried in vain.
            if is_beside || self.report.tears >= most || self.tried >= most.saturating_mul(2) {
                self.report.waiting += 1;
                continue;
            }
            self.tried += 1;
            return Some(nodes);
        }
        None
    }

    /// A tear was made, through cells of these nodes.
    pub fn made(&mut self, pieces_parted: u32, nodes: impl Iterator<Item = u32>) {
        self.report.tears += 1;
        self.report.pieces_parted += pieces_parted;
        for node in nodes {
            // Out of memory: another tear may come beside it.
            let _ = memory::push(&mut self.torn, node);
        }
    }

    /// A spring was not torn.
    pub fn withhold(&mut self, nodes: [u32; 2], why: Withheld, version: u64) {
        self.report.withhold(why);
        if let Some(at) = self.find(nodes) {
            self.limits[at].withheld = Some((version as u32, why));
        }
    }

    pub fn hash(&self, hasher: &mut StateHasher) {
        for (spring, limits) in self.springs.iter().zip(&self.limits) {
            let [a, b] = spring.nodes;
            hasher.write_u64(u64::from(a) << 32 | u64::from(b));
            hasher.write_floats(&[spring.longest_squared, limits.strain, limits.force]);
            let withheld = limits
                .withheld
                .map_or(0, |(since, why)| u64::from(since) << 2 | (1 + why as u64));
            hasher.write_u64(withheld);
        }
    }

    fn add(&mut self, nodes: [u32; 2], [strain, force]: [f32; 2], link: &Link) {
        let limits = Limits {
            strain,
            force,
            next: NONE,
            withheld: None,
        };
        let longest_squared = longest_squared(&limits, link);
        self.link(Watched { nodes, longest_squared }, limits);
    }

    /// Appends a spring, for which there is room.
    fn link(&mut self, spring: Watched, limits: Limits) {
        let number = self.springs.len() as u32;
        let next = std::mem::replace(&mut self.first[spring.nodes[0] as usize], number);
        if self.chunks.len() * CHUNK <= self.springs.len() {
            self.chunks.push(Chunk::default());
        }
        self.is_measured = false;
        self.springs.push(spring);
        self.limits.push(Limits { next, ..limits });
    }

    /// The place of a spring.
    fn find(&self, nodes: [u32; 2]) -> Option<usize> {
        let nodes = sorted(nodes);
        let mut at = self.first[nodes[0] as usize];
        while at != NONE {
            if self.springs[at as usize].nodes == nodes {
                return Some(at as usize);
            }
            at = self.limits[at as usize].next;
        }
        None
    }

    /// What named the spring at a place names another.
    fn rename(&mut self, at: usize, to: u32) {
        let mut name = &mut self.first[self.springs[at].nodes[0] as usize];
        while *name != at as u32 {
            let before = *name as usize;
            name = &mut self.limits[before].next;
        }
        *name = to;
    }
}

fn of_chunk(springs: &[Watched], chunk: usize) -> &[Watched] {
    &springs[chunk * CHUNK..springs.len().min((chunk + 1) * CHUNK)]
}

/// What is to be known of some springs.
fn measured(springs: &[Watched], [x, y, z]: [&[f32]; 3]) -> Chunk {
    let (y, z) = (&y[..x.len()], &z[..x.len()]);
    let mut chunk = Chunk {
        slack: f32::INFINITY,
        is_any_beyond: false,
    };
    for spring in springs {
        let [a, b] = spring.nodes.map(|node| node as usize);
        let (u, v, w) = (x[b] - x[a], y[b] - y[a], z[b] - z[a]);
        let squared = u * u + v * v + w * w;
        chunk.is_any_beyond |= squared > spring.longest_squared;
        let slack = spring.longest_squared.sqrt() * (1.0 - ROUNDING) - squared.sqrt() * (1.0 + ROUNDING);
        chunk.slack = chunk.slack.min(slack);
    }
    chunk
}

/// How far nodes have gone.
struct Drift<'a> {
    now: [&'a [f32]; 3],
    before: [&'a [f32]; 3],
}

impl Loops for Drift<'_> {
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

impl TearReport {
    fn withhold(&mut self, why: Withheld) {
        *match why {
            Withheld::SmallPiece => &mut self.small_pieces,
            Withheld::NoRoom => &mut self.no_room,
            Withheld::NoWay => &mut self.waiting,
        } += 1;
    }
}

fn sorted([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// The square of the longest that a spring may be, m²; infinity: any length.
fn longest_squared(limits: &Limits, link: &Link) -> f32 {
    let [rest, stiffness] = [link.rest_length, link.stiffness].map(f64::from);
    let mut longest = f64::INFINITY;
    if limits.strain > 0.0 && rest > 0.0 {
        longest = rest * (1.0 + f64::from(limits.strain));
    }
    if limits.force > 0.0 && stiffness > 0.0 {
        longest = longest.min(rest + f64::from(limits.force) / stiffness);
    }
    (longest * longest) as f32
}
