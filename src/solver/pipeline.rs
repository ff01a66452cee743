//! Several substeps in one go, for bodies that do not fit into a core's cache: a tile takes its next substep as soon as the
//! tiles about it have taken theirs, while all of them are still there (time skewing, Wonnacott 2000).
//!
//! A body is cut into stretches of tiles, which threads share. Of each substep a stretch takes what depends on nothing
//! beyond its ends: the later the substep, the less. What is left about the ends is taken after all of them, by stretches
//! that are cut elsewhere. Every tile does the same as it would substep by substep, so that no bit changes.

use std::array::from_fn;

use super::System;
use super::kick::{Inertia, Kick, Survey};
use super::step_request::StepRequest;
use super::substep::{Part, Pass, Written};
use crate::nodes::Pin;
use crate::soa::{TILE, TileForces, Vectors, View, tile_count, tile_nodes};
use crate::springs::Springs;
use crate::threads::{Items, Ragged, Team};

/// Substeps that are taken in one go, at most.
pub(super) const DEEPEST: usize = 16;

/// Bytes of a core's own cache that a pipeline fills: half of what processors of the last years have, or less.
const CACHE: usize = 1 << 19;

/// Bytes of a tile's state: positions of two substeps, velocities, and what its links take.
const TILE_BYTES: usize = 10 * TILE * size_of::<f32>();

/// Stretches for each thread: who is through helps the others.
const STRETCHES: usize = 4;

/// Stretches of a body at most.
const MOST_STRETCHES: usize = 64;

/// What the pipeline of a body is like.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plan {
    /// How many tiles away a substep's forces depend on.
    reach: usize,
    /// Substeps that are taken in one go at most, at least 2.
    pub depth: usize,
}

impl Plan {
    /// `None`: it is not worth it, or not possible.
    pub fn of(springs: &dyn Springs, node_count: usize) -> Option<Self> {
        let tiles = tile_count(node_count);
        // What fits is in the cache in any case.
        if tiles * TILE_BYTES <= 2 * CACHE {
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
        let depth = (CACHE / TILE_BYTES / reach).saturating_sub(2).min(DEEPEST);
        (depth >= 2).then_some(Self { reach, depth })
    }
}

/// Which tiles are taken when.
struct Schedule {
    reach: usize,
    depth: usize,
    tiles: usize,
    /// Stretches.
    count: usize,
}

impl Schedule {
    fn new(plan: Plan, depth: usize, tiles: usize, threads: usize) -> Self {
        // What is left about the ends is taken by stretches that are cut in the middle of these.
        let shortest = 4 * plan.reach * (depth + 1);
        let most = if threads == 1 { 1 } else { STRETCHES * threads };
        Self {
            reach: plan.reach,
            depth,
            tiles,
            count: most.min(MOST_STRETCHES).min(tiles / shortest).max(1),
        }
    }

    /// The first tile of a stretch; that of the one after the last is the end.
    fn start(&self, stretch: usize) -> usize {
        self.tiles * stretch / self.count
    }

    /// The tiles at which the first stretches begin.
    fn starts(&self) -> [usize; MOST_STRETCHES] {
        from_fn(|stretch| self.start(stretch.min(self.count)))
    }

    /// The tiles at which stretches begin that have an end of the first ones in their middle: one fewer.
    fn cuts(&self) -> [usize; MOST_STRETCHES] {
        from_fn(|cut| match cut.min(self.count) {
            0 => 0,
            cut => (self.start(cut) + self.start((cut + 1).min(self.count))) / 2,
        })
    }

    /// Takes of each substep the tiles that depend on nothing beyond the ends of a stretch: the later it is, the fewer. A
    /// tile may take its next substep as soon as `reach` tiles on both sides have taken the last.
    fn narrow(&self, stretch: usize, take: &mut dyn FnMut(usize, usize)) {
        let (start, end) = (self.start(stretch), self.start(stretch + 1));
        let tiles = |substep: usize| {
            let way = self.reach * (substep + 1);
            let from = if start == 0 { 0 } else { start + way };
            from..if end == self.tiles { end } else { end - way }
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

    /// Takes of each substep the tiles about the end of a stretch that were left out: the later it is, the more.
    fn widen(&self, stretch: usize, take: &mut dyn FnMut(usize, usize)) {
        let end = self.start(stretch + 1);
        for substep in 0..self.depth {
            let way = self.reach * (substep + 1);
            (end - way..end + way).for_each(|tile| take(tile, substep));
        }
    }
}

/// What a stretch changes.
struct Stretch<'a> {
    /// Its first tile.
    first: usize,
    /// The positions before and after the first substep, and so on in turn.
    positions: [[&'a mut [f32]; 3]; 2],
    velocities: [&'a mut [f32]; 3],
    /// What positions lack, where that is carried on.
    remainders: Option<[&'a mut [f32]; 3]>,
    pins: &'a mut [Pin],
    /// By substeps.
    surveys: &'a mut [Survey; DEEPEST],
}

impl Stretch<'_> {
    /// Takes a substep of a tile, after those that it depends on.
    fn take(&mut self, tile: usize, part: (usize, &Part), common: &Pass, forces: &mut TileForces) {
        let (substep, part) = part;
        let nodes = tile_nodes(tile, common.masses.len());
        let [even, odd] = &mut self.positions;
        let (before, after) = if substep.is_multiple_of(2) {
            (even, odd)
        } else {
            (odd, even)
        };
        // Positions have a margin before the first node of the body.
        let start = Vectors::piece_node(self.first);
        let padded = (nodes.start as isize - start) as usize..(nodes.end as isize - start) as usize;
        let places = nodes.start - self.first * TILE..nodes.end - self.first * TILE;
        let pins = |node: usize| self.pins.partition_point(|pin| (pin.node as usize) < node);
        let pins = pins(nodes.start)..pins(nodes.end);
        let mut written = Written {
            velocities: self.velocities.each_mut().map(|axis| &mut axis[places.clone()]),
            next_positions: after.each_mut().map(|axis| &mut axis[padded.clone()]),
            forces: [&mut [], &mut [], &mut []],
            remainders: (self.remainders.as_mut()).map(|axes| axes.each_mut().map(|axis| &mut axis[places.clone()])),
            pins: &mut self.pins[pins],
        };
        let positions = View::new(before.each_ref().map(|axis| &**axis), start);
        let Kick { inertia, damping, .. } = common.kick;
        let pass = Pass {
            part,
            kick: part.kick(common.request.gravity, inertia, damping),
            positions,
            ..*common
        };
        let survey = pass.take(tile, nodes, &mut written, forces);
        self.surveys[substep] = self.surveys[substep].and(survey);
    }
}

/// Takes these substeps, none of them the first of the step, of a body whose step stays open: what is known of the body
/// after each.
pub(super) fn run(
    body: &mut System,
    request: &StepRequest,
    parts: &[Part],
    plan: Plan,
    team: &Team,
) -> [Survey; DEEPEST] {
    let depth = parts.len();
    let schedule = Schedule::new(plan, depth, tile_count(body.node_count()), team.count());
    let mut surveys = [[Survey::NOTHING; DEEPEST]; MOST_STRETCHES];
    let starts = &schedule.starts()[..schedule.count];
    run_stretches(body, request, parts, team, starts, &mut surveys, |stretch, take| {
        schedule.narrow(stretch, take);
    });
    if schedule.count > 1 {
        let cuts = &schedule.cuts()[..schedule.count - 1];
        run_stretches(body, request, parts, team, cuts, &mut surveys, |stretch, take| {
            schedule.widen(stretch, take);
        });
    }
    from_fn(|substep| {
        let found = surveys.iter().map(|surveys| surveys[substep]);
        found.fold(Survey::NOTHING, Survey::and)
    })
}

/// Lets `order` say in which order each stretch takes its tiles' substeps; stretches begin at these tiles.
fn run_stretches(
    body: &mut System,
    request: &StepRequest,
    parts: &[Part],
    team: &Team,
    starts: &[usize],
    surveys: &mut [[Survey; DEEPEST]],
    order: impl Fn(usize, &mut dyn FnMut(usize, usize)) + Sync,
) {
    let count = starts.len();
    let inertia = Inertia::of(body.uniform_inverse_mass, &body.inverse_masses, body.scaling.as_deref());
    let common = Pass {
        forces: body.forces.sum(),
        kernel: body.kernel,
        masses: &body.masses,
        request,
        // Each substep has its own part, kick and positions.
        part: &parts[0],
        kick: parts[0].kick(request.gravity, inertia, body.damping.as_ref()),
        positions: View::new([&[]; 3], 0),
        first_velocities: None,
        first_forces: None,
        damped_velocities: None,
        first_remainders: None,
    };
    let first_pins: [usize; MOST_STRETCHES] =
        from_fn(|stretch| starts.get(stretch).map_or(0, |&tile| body.pins.start(tile)));
    let first_nodes: [usize; MOST_STRETCHES] = from_fn(|stretch| starts.get(stretch).map_or(0, |&tile| tile * TILE));
    let first_places: [usize; MOST_STRETCHES] =
        from_fn(|stretch| starts.get(stretch).map_or(0, |&tile| Vectors::piece_start(tile)));
    let ([latest, next, velocities], remainders) = body.state.two_substeps();
    let written = (
        latest.pieces_mut(&first_places[..count]),
        next.pieces_mut(&first_places[..count]),
        by_stretches(velocities, &first_nodes[..count]),
        remainders.map(|remainders| by_stretches(remainders, &first_nodes[..count])),
        body.pins.pieces_mut(&first_pins[..count]),
        Items::new(&mut surveys[..count]),
    );
    team.pass(
        count,
        written,
        |stretch, (latest, next, velocities, remainders, pins, surveys)| {
            let mut forces = TileForces::ZERO;
            let mut stretch_data = Stretch {
                first: starts[stretch],
                positions: [latest, next],
                velocities,
                remainders,
                pins,
                surveys,
            };
            order(stretch, &mut |tile, substep| {
                stretch_data.take(tile, (substep, &parts[substep]), &common, &mut forces)
            });
        },
    );
}

/// Cut into stretches that begin with these nodes.
fn by_stretches<'a>(vectors: &'a mut Vectors, first_nodes: &'a [usize]) -> [Ragged<'a, f32>; 3] {
    vectors.axes_mut().map(|axis| Ragged::new(axis, first_nodes))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Positions of two substeps in turn, by the substeps they have taken.
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
                for depth in 2..=DEEPEST {
                    for tiles in [60, 400, 1999] {
                        let plan = Plan { reach, depth };
                        let schedule = Schedule::new(plan, depth, tiles, threads);
                        let mut taken = Taken {
                            reach,
                            positions: [vec![0; tiles], vec![usize::MAX; tiles]],
                        };
                        let (starts, cuts) = (schedule.starts(), schedule.cuts());
                        for (stretch, &start) in starts[..schedule.count].iter().enumerate() {
                            let piece = start..schedule.start(stretch + 1);
                            schedule.narrow(stretch, &mut |tile, substep| taken.take(tile, substep, piece.clone()));
                        }
                        for cut in 0..schedule.count - 1 {
                            let end = if cut + 2 < schedule.count { cuts[cut + 1] } else { tiles };
                            let piece = cuts[cut]..end;
                            schedule.widen(cut, &mut |tile, substep| taken.take(tile, substep, piece.clone()));
                        }
                        assert!(taken.positions[depth % 2].iter().all(|&substep| substep == depth));
                    }
                }
            }
        }
    }
}
