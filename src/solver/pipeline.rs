//! Time skewing: several substeps in one pass, for bodies larger than a core's cache. A tile takes its next substep as
//! soon as the adjacent tiles have taken theirs, while all of them are still in the cache (Wonnacott 2000).
//!
//! A body is divided into stretches of tiles, which threads share. In each substep, a stretch takes the tiles that
//! depend on nothing beyond its ends: fewer for each later substep. A second pass over stretches with other boundaries
//! takes the tiles that are left near the ends. Every tile does the same computation as substep by substep, so the
//! result is bitwise identical.

use std::array::from_fn;

use super::System;
use super::kick::{Inertia, Kick, TileStats};
use super::step_request::StepRequest;
use super::substep::{SubstepInput, SubstepKick, TileOutput};
use crate::nodes::Pin;
use crate::soa::{TILE, TileForces, Vectors, View, tile_count, tile_nodes};
use crate::springs::Springs;
use crate::threads::{Items, Ragged, Team};

/// The maximum number of substeps in one pass.
pub(super) const MAX_DEPTH: usize = 16;

/// The cache that a pipeline fills, at most half of a recent core's private cache (bytes).
const CACHE_BYTES: usize = 1 << 19;

/// The state of a tile: positions of two substeps, velocities and link data (bytes).
const TILE_BYTES: usize = 10 * TILE * size_of::<f32>();

/// Stretches per thread, for load balancing.
const STRETCHES_PER_THREAD: usize = 4;

/// The maximum number of stretches of a body.
const MAX_STRETCHES: usize = 64;

/// The parameters of a body's pipeline.
#[derive(Clone, Copy, Debug)]
pub(super) struct PipelinePlan {
    /// The distance in tiles up to which forces depend on positions.
    reach: usize,
    /// The maximum number of substeps in one pass, at least 2.
    pub depth: usize,
}

impl PipelinePlan {
    /// Returns `None` if a pipeline is impossible or not worthwhile.
    pub fn of(springs: &dyn Springs, node_count: usize) -> Option<Self> {
        let tiles = tile_count(node_count);
        // A small body fits into the cache without a pipeline.
        if tiles * TILE_BYTES <= 2 * CACHE_BYTES {
            return None;
        }
        let mut reach = 1;
        for tile in 0..tiles {
            let reads = springs.reads(tile)?;
            let nodes = tile_nodes(tile, node_count);
            let before = (nodes.start as isize - reads.start).min(nodes.start as isize);
            let after = (reads.end.min(node_count as isize) - nodes.end as isize).max(0);
            reach = reach.max((before.max(after) as usize).div_ceil(TILE));
        }
        let depth = (CACHE_BYTES / TILE_BYTES / reach).saturating_sub(2).min(MAX_DEPTH);
        (depth >= 2).then_some(Self { reach, depth })
    }
}

/// The order of tiles and substeps.
struct Schedule {
    reach: usize,
    depth: usize,
    tiles: usize,
    /// The number of stretches.
    count: usize,
}

impl Schedule {
    fn new(plan: PipelinePlan, depth: usize, tiles: usize, threads: usize) -> Self {
        // The stretches of the second pass begin in the middle of these.
        let shortest = 4 * plan.reach * (depth + 1);
        let max_count = if threads == 1 {
            1
        } else {
            STRETCHES_PER_THREAD * threads
        };
        Self {
            reach: plan.reach,
            depth,
            tiles,
            count: max_count.min(MAX_STRETCHES).min(tiles / shortest).max(1),
        }
    }

    /// The first tile of a stretch. After the last stretch, the end of the body.
    fn start(&self, stretch: usize) -> usize {
        self.tiles * stretch / self.count
    }

    /// The first tiles of the stretches of the first pass.
    fn starts(&self) -> [usize; MAX_STRETCHES] {
        from_fn(|stretch| self.start(stretch.min(self.count)))
    }

    /// The first tiles of the stretches of the second pass, one fewer. Each contains a boundary of the first pass.
    fn cuts(&self) -> [usize; MAX_STRETCHES] {
        from_fn(|cut| match cut.min(self.count) {
            0 => 0,
            cut => (self.start(cut) + self.start((cut + 1).min(self.count))) / 2,
        })
    }

    /// Takes the tiles of each substep that depend on nothing beyond the ends of a stretch: fewer for each later
    /// substep. A tile can take its next substep as soon as `reach` tiles on both sides have taken the previous one.
    fn take_inner(&self, stretch: usize, take: &mut dyn FnMut(usize, usize)) {
        let (start, end) = (self.start(stretch), self.start(stretch + 1));
        let tiles = |substep: usize| {
            let margin = self.reach * (substep + 1);
            let from = if start == 0 { 0 } else { start + margin };
            from..if end == self.tiles { end } else { end - margin }
        };
        for front in start..end + self.reach * (self.depth - 1) {
            for substep in 0..self.depth {
                if let Some(tile) = front.checked_sub(self.reach * substep)
                    && tiles(substep).contains(&tile)
                {
                    take(tile, substep);
                }
            }
        }
    }

    /// Takes the remaining tiles of each substep near the end of a stretch: more for each later substep.
    fn take_boundary(&self, stretch: usize, take: &mut dyn FnMut(usize, usize)) {
        let end = self.start(stretch + 1);
        for substep in 0..self.depth {
            let margin = self.reach * (substep + 1);
            (end - margin..end + margin).for_each(|tile| take(tile, substep));
        }
    }
}

/// The data that a stretch changes.
struct Stretch<'a> {
    /// The first tile.
    first: usize,
    /// The positions before and after the first substep. Later substeps swap them.
    positions: [[&'a mut [f32]; 3]; 2],
    velocities: [&'a mut [f32]; 3],
    /// The rounding remainders of positions, if they are tracked.
    remainders: Option<[&'a mut [f32]; 3]>,
    pins: &'a mut [Pin],
    /// One entry per substep.
    tile_stats: &'a mut [TileStats; MAX_DEPTH],
}

impl Stretch<'_> {
    /// Takes one substep of a tile. The substeps that it depends on must be complete.
    fn take(
        &mut self,
        tile: usize,
        substep_kick: (usize, &SubstepKick),
        common: &SubstepInput,
        forces: &mut TileForces,
    ) {
        let (substep, substep_kick) = substep_kick;
        let nodes = tile_nodes(tile, common.masses.len());
        let [even, odd] = &mut self.positions;
        let (before, after) = if substep.is_multiple_of(2) {
            (even, odd)
        } else {
            (odd, even)
        };
        // The position buffers contain a margin before the first node.
        let start = Vectors::piece_node(self.first);
        let padded = (nodes.start as isize - start) as usize..(nodes.end as isize - start) as usize;
        let slots = nodes.start - self.first * TILE..nodes.end - self.first * TILE;
        let pins = |node: usize| self.pins.partition_point(|pin| (pin.node as usize) < node);
        let pins = pins(nodes.start)..pins(nodes.end);
        let mut written = TileOutput {
            velocities: self.velocities.each_mut().map(|axis| &mut axis[slots.clone()]),
            next_positions: after.each_mut().map(|axis| &mut axis[padded.clone()]),
            forces: [&mut [], &mut [], &mut []],
            remainders: (self.remainders.as_mut()).map(|axes| axes.each_mut().map(|axis| &mut axis[slots.clone()])),
            pins: &mut self.pins[pins],
        };
        let positions = View::new(before.each_ref().map(|axis| &**axis), start);
        let Kick { inertia, damping, .. } = common.kick;
        let input = SubstepInput {
            substep_kick,
            kick: substep_kick.kick(common.request.gravity, inertia, damping),
            positions,
            ..*common
        };
        let stats = input.run_tile(tile, nodes, &mut written, forces);
        self.tile_stats[substep] = self.tile_stats[substep].merge(stats);
    }
}

/// Takes substeps that do not include the first of the step, without the closing half kick. Returns the statistics of
/// the body after each substep.
pub(super) fn run(
    body: &mut System,
    request: &StepRequest,
    substep_kicks: &[SubstepKick],
    plan: PipelinePlan,
    team: &Team,
) -> [TileStats; MAX_DEPTH] {
    let depth = substep_kicks.len();
    let schedule = Schedule::new(plan, depth, tile_count(body.node_count()), team.count());
    let mut tile_stats = [[TileStats::EMPTY; MAX_DEPTH]; MAX_STRETCHES];
    let starts = &schedule.starts()[..schedule.count];
    run_stretches(
        body,
        request,
        substep_kicks,
        team,
        starts,
        &mut tile_stats,
        |stretch, take| {
            schedule.take_inner(stretch, take);
        },
    );
    if schedule.count > 1 {
        let cuts = &schedule.cuts()[..schedule.count - 1];
        run_stretches(
            body,
            request,
            substep_kicks,
            team,
            cuts,
            &mut tile_stats,
            |stretch, take| {
                schedule.take_boundary(stretch, take);
            },
        );
    }
    from_fn(|substep| {
        let stats = tile_stats.iter().map(|tile_stats| tile_stats[substep]);
        stats.fold(TileStats::EMPTY, TileStats::merge)
    })
}

/// Runs `order` for each stretch, which calls back for tiles and substeps in its order. `starts` are the first tiles of
/// the stretches.
fn run_stretches(
    body: &mut System,
    request: &StepRequest,
    substep_kicks: &[SubstepKick],
    team: &Team,
    starts: &[usize],
    tile_stats: &mut [[TileStats; MAX_DEPTH]],
    order: impl Fn(usize, &mut dyn FnMut(usize, usize)) + Sync,
) {
    let count = starts.len();
    let inertia = Inertia::of(body.uniform_inverse_mass, &body.inverse_masses, body.scaling.as_deref());
    let common = SubstepInput {
        forces: body.forces.sum(),
        kernel: body.kernel,
        masses: &body.masses,
        request,
        // Each substep sets its own kick and positions.
        substep_kick: &substep_kicks[0],
        kick: substep_kicks[0].kick(request.gravity, inertia, body.damping.as_ref()),
        positions: View::new([&[]; 3], 0),
        first_velocities: None,
        first_forces: None,
        damped_velocities: None,
        first_remainders: None,
    };
    let first_pins: [usize; MAX_STRETCHES] =
        from_fn(|stretch| starts.get(stretch).map_or(0, |&tile| body.pins.start(tile)));
    let first_nodes: [usize; MAX_STRETCHES] = from_fn(|stretch| starts.get(stretch).map_or(0, |&tile| tile * TILE));
    let first_slots: [usize; MAX_STRETCHES] =
        from_fn(|stretch| starts.get(stretch).map_or(0, |&tile| Vectors::piece_start(tile)));
    let ([latest, next, velocities], remainders) = body.state.substep_pair();
    let written = (
        latest.pieces_mut(&first_slots[..count]),
        next.pieces_mut(&first_slots[..count]),
        split_into_stretches(velocities, &first_nodes[..count]),
        remainders.map(|remainders| split_into_stretches(remainders, &first_nodes[..count])),
        body.pins.pieces_mut(&first_pins[..count]),
        Items::new(&mut tile_stats[..count]),
    );
    team.pass(
        count,
        written,
        |stretch, (latest, next, velocities, remainders, pins, tile_stats)| {
            let mut forces = TileForces::ZERO;
            let mut stretch_data = Stretch {
                first: starts[stretch],
                positions: [latest, next],
                velocities,
                remainders,
                pins,
                tile_stats,
            };
            order(stretch, &mut |tile, substep| {
                stretch_data.take(tile, (substep, &substep_kicks[substep]), &common, &mut forces)
            });
        },
    );
}

/// Splits vectors into stretches that begin at these nodes.
fn split_into_stretches<'a>(vectors: &'a mut Vectors, first_nodes: &'a [usize]) -> [Ragged<'a, f32>; 3] {
    vectors.axes_mut().map(|axis| Ragged::new(axis, first_nodes))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The substep that the positions of two buffers belong to.
    struct Taken {
        reach: usize,
        positions: [Vec<usize>; 2],
    }

    impl Taken {
        fn take(&mut self, tile: usize, substep: usize, piece: std::ops::Range<usize>) {
            let tiles = self.positions[0].len();
            let about = tile.saturating_sub(self.reach)..tiles.min(tile + self.reach + 1);
            assert!(
                piece.start <= about.start && about.end <= piece.end,
                "tile {tile} sees beyond {piece:?}"
            );
            for seen in about {
                assert_eq!(self.positions[substep % 2][seen], substep, "tile {tile} sees {seen}");
            }
            self.positions[(substep + 1) % 2][tile] = substep + 1;
        }
    }

    #[test]
    fn every_tile_sees_the_substep_before_its_own() {
        for threads in [1, 2, 5, 40] {
            for reach in 1..5 {
                for depth in 2..=MAX_DEPTH {
                    for tiles in [60, 400, 1999] {
                        let plan = PipelinePlan { reach, depth };
                        let schedule = Schedule::new(plan, depth, tiles, threads);
                        let mut taken = Taken {
                            reach,
                            positions: [vec![0; tiles], vec![usize::MAX; tiles]],
                        };
                        let (starts, cuts) = (schedule.starts(), schedule.cuts());
                        for (stretch, &start) in starts[..schedule.count].iter().enumerate() {
                            let piece = start..schedule.start(stretch + 1);
                            schedule.take_inner(stretch, &mut |tile, substep| taken.take(tile, substep, piece.clone()));
                        }
                        for cut in 0..schedule.count - 1 {
                            let end = if cut + 2 < schedule.count { cuts[cut + 1] } else { tiles };
                            let piece = cuts[cut]..end;
                            schedule.take_boundary(cut, &mut |tile, substep| taken.take(tile, substep, piece.clone()));
                        }
                        assert!(taken.positions[depth % 2].iter().all(|&substep| substep == depth));
                    }
                }
            }
        }
    }
}
