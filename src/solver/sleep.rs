//! Tissue at rest is left alone, tile by tile, until something reaches it.
//!
//! The nodes of a tile that sleeps stand still in every place that the solver writes, so that a pass only has to leave it out.
//! Forces that would make a tile as fast as the speed of rest within the time of rest, or move a node of it by about as far as that speed
//! leads in that time, wake it: neighbours of what is awake are asked for them after each step.

use glam::Vec3;

use super::System;
use crate::base::{Result, StateHasher, memory};
use crate::codec::saved;
use crate::contact::ToolPath;
use crate::def::Sleep;
use crate::geometry::Bounds;
use crate::soa::{PerNode, TILE, TileForces, WriteRecords, tile_count, tile_nodes};
use crate::springs::Motion;
use crate::threads::{Items, Team};

/// Forces on what falls asleep are so much less than those that wake it: it does not wake at once.
const SOUNDLY: f32 = 0.5;

/// The mean of what rounding makes of the forces on a tile, as a part of that on one of its nodes.
const NOISE: f32 = 0.05;

/// A node is drawn by as many neighbours: where one of them goes a way, it is drawn by this part of that.
const FEW: f32 = 0.25;

/// Tools wake what they come near to, by this part of the body's extent.
const NEAR: f32 = 0.02;

#[derive(Clone, Copy, Debug, Default)]
struct Tile {
    /// For how long it has been at rest, s.
    quiet: f32,
    /// Whether a tool is near.
    is_touched: bool,
    /// What the forces on its nodes come to, as a part of what wakes it: as far as that was asked for in this step.
    pull: f32,
}

saved! { Tile { quiet, is_touched, pull } }

/// What of a body sleeps.
#[derive(Debug)]
pub(crate) struct Sleeper {
    sleep: Sleep,
    tiles: Vec<Tile>,
    /// Which of them sleep, and how many.
    asleep: Vec<bool>,
    asleep_count: usize,
    /// The tiles that springs and elements join to each, from one start to the next.
    neighbours: Vec<u32>,
    starts: Vec<u32>,
    /// Whether tiles may sleep by themselves: not where what moves any node is asked for all of them.
    in_parts: bool,
    /// The box that tools wake it in, and how far about a tile they do, m.
    bounds: Bounds,
    margin: f32,
    /// The length of the last step that was taken, s: what tools felt in it they feel for as long as the body sleeps.
    step: f32,
    /// What a step that is tried has woken: for how long each tile had been at rest, and whether it slept; nothing where nothing was.
    before: Vec<(f32, bool)>,
    /// Whether the body's forces were known then.
    knew_forces: bool,
}

saved! { Sleeper {
    sleep, tiles, asleep, asleep_count, neighbours, starts, in_parts, bounds, margin, step, before, knew_forces,
} }

impl PerNode for Sleeper {
    fn reserve_nodes(&mut self, count: usize) -> Result<()> {
        let tiles = tile_count(count);
        memory::reserve(&mut self.tiles, tiles)?;
        memory::reserve(&mut self.before, tiles)?;
        memory::reserve(&mut self.asleep, tiles)
    }

    /// Tiles are joined otherwise than before, and all of them are awake: from now on the body sleeps as a whole.
    fn grow(&mut self, count: usize) {
        self.tiles.grow(tile_count(count));
        self.asleep.grow(tile_count(count));
        self.in_parts = false;
    }
}

impl Sleeper {
    #[inline]
    pub fn is_asleep(&self, tile: usize) -> bool {
        self.asleep[tile]
    }

    /// Whether each tile sleeps.
    pub fn asleep(&self) -> &[bool] {
        &self.asleep
    }

    fn all(&self) -> bool {
        self.asleep_count == self.tiles.len()
    }

    /// When it sleeps.
    pub fn sleep(&self) -> Sleep {
        self.sleep
    }

    /// Has it sleep otherwise.
    pub fn set_sleep(&mut self, sleep: Sleep) {
        self.sleep = sleep;
    }

    /// Wakes a tile; whether it slept.
    fn wake(&mut self, tile: usize) -> bool {
        self.tiles[tile].quiet = 0.0;
        let slept = std::mem::replace(&mut self.asleep[tile], false);
        self.asleep_count -= usize::from(slept);
        slept
    }

    /// Lets a tile sleep that is awake.
    fn rest(&mut self, tile: usize) {
        self.asleep[tile] = true;
        self.asleep_count += 1;
    }

    /// A spring joins these of its own nodes now. Where tiles become neighbours that were not, the body sleeps as a whole.
    pub fn join(&mut self, nodes: [u32; 2]) {
        let [a, b] = nodes.map(|node| node as usize / TILE);
        self.in_parts = self.in_parts && (a == b || self.neighbours(a).contains(&(b as u32)));
    }

    fn neighbours(&self, tile: usize) -> &[u32] {
        &self.neighbours[self.starts[tile] as usize..self.starts[tile + 1] as usize]
    }

    pub fn hash(&self, hasher: &mut StateHasher) {
        for (tile, &is_asleep) in self.tiles.iter().zip(&self.asleep) {
            hasher.write_floats(&[tile.quiet]);
            hasher.write_u64(u64::from(is_asleep));
        }
    }
}

impl System {
    /// Has all of it be stepped again, until it has been at rest for as long as it takes.
    pub fn wake(&mut self) {
        let Some(sleeper) = &mut self.sleeper else {
            return;
        };
        let mut woken = false;
        for tile in 0..sleeper.tiles.len() {
            woken |= sleeper.wake(tile);
        }
        if woken {
            self.forces_current = false;
        }
    }

    /// The same for what is about one of its own nodes.
    pub(crate) fn wake_at(&mut self, own: u32) {
        let Some(sleeper) = &mut self.sleeper else {
            return;
        };
        if !sleeper.in_parts {
            self.wake();
        } else if sleeper.wake(own as usize / TILE) {
            self.forces_current = false;
            self.wake_touched();
        }
    }

    /// The same for a step that is tried: where it is not taken, [`System::sleep_again`] puts back what was.
    pub(crate) fn wake_to_step(&mut self) {
        self.note_sleep();
        self.wake();
    }

    /// Keeps what sleeps before a step that is tried wakes it.
    fn note_sleep(&mut self) {
        if let Some(sleeper) = &mut self.sleeper
            && sleeper.before.is_empty()
        {
            let tiles = sleeper.tiles.iter().zip(&sleeper.asleep);
            sleeper
                .before
                .extend(tiles.map(|(it, &is_asleep)| (it.quiet, is_asleep)));
            sleeper.knew_forces = self.forces_current;
        }
    }

    /// The step that was tried is not taken: what it woke is as it was.
    pub(crate) fn sleep_again(&mut self) {
        if let Some(sleeper) = &mut self.sleeper
            && !sleeper.before.is_empty()
        {
            let Sleeper {
                tiles, asleep, before, ..
            } = &mut **sleeper;
            for ((it, is_asleep), (quiet, slept)) in tiles.iter_mut().zip(asleep).zip(before.drain(..)) {
                (it.quiet, *is_asleep) = (quiet, slept);
            }
            sleeper.asleep_count = sleeper.asleep.iter().filter(|&&is_asleep| is_asleep).count();
            self.forces_current = sleeper.knew_forces;
        }
    }

    /// The step that was tried is taken.
    pub(crate) fn forget_sleep(&mut self) {
        if let Some(sleeper) = &mut self.sleeper {
            sleeper.before.clear();
        }
    }

    /// What tools hold up is awake as long as anything is: what they feel is worked out anew.
    fn wake_touched(&mut self) {
        if let Some(sleeper) = &mut self.sleeper {
            for tile in 0..sleeper.tiles.len() {
                if sleeper.tiles[tile].is_touched {
                    sleeper.wake(tile);
                }
            }
        }
    }

    /// Whether no part of it is awake.
    pub(crate) fn is_asleep(&self) -> bool {
        self.sleeper.as_ref().is_some_and(|sleeper| sleeper.all())
    }

    /// Whether a part of it sleeps.
    pub(crate) fn sleeps(&self) -> bool {
        self.sleeper.as_ref().is_some_and(|sleeper| sleeper.asleep_count > 0)
    }

    /// The step is over in which nothing of it changed.
    pub(crate) fn sleep_on(&mut self) {
        self.forget_sleep();
        if let Some(contacts) = &mut self.contacts {
            contacts.sleep_on();
        }
    }

    /// The length of the step that sleeping bodies took last, s.
    pub(crate) fn last_step(&self) -> f32 {
        self.sleeper.as_ref().map_or(0.0, |sleeper| sleeper.step)
    }

    /// Makes it one that sleeps, with room for the tiles that cuts may add. Changes nothing where it fails.
    pub(crate) fn make_sleeper(&mut self, sleep: Sleep) -> Result<()> {
        if sleep.speed > 0.0 {
            let tiles = tile_count(self.node_count());
            let mut sleeper = Sleeper {
                sleep,
                tiles: memory::filled(Tile::default(), tiles)?,
                asleep: memory::filled(false, tiles)?,
                asleep_count: 0,
                neighbours: Vec::new(),
                starts: Vec::new(),
                in_parts: self.integrator.solution().is_none() && !self.forces.beside.is_any(),
                bounds: Bounds::EMPTY,
                margin: 0.0,
                step: 0.0,
                before: memory::reserved(tiles)?,
                knew_forces: false,
            };
            self.join_tiles(&mut sleeper)?;
            sleeper.reserve_nodes(self.node_count().max(self.node_room))?;
            self.sleeper = Some(memory::boxed(sleeper)?);
        }
        Ok(())
    }

    /// Finds which tiles act on which.
    fn join_tiles(&self, sleeper: &mut Sleeper) -> Result<()> {
        let mut pairs: Vec<[u32; 2]> = Vec::new();
        let mut result = Ok(());
        self.forces.show_joined(&mut |a, b| {
            let [a, b] = [a, b].map(|node| node / TILE as u32);
            if a != b && result.is_ok() {
                result = memory::push(&mut pairs, [a, b]).and_then(|()| memory::push(&mut pairs, [b, a]));
            }
        });
        result?;
        memory::sort_once(&mut pairs);
        sleeper.starts = memory::reserved(sleeper.tiles.len() + 1)?;
        let start = |tile: usize| pairs.partition_point(|pair| (pair[0] as usize) < tile) as u32;
        sleeper.starts.extend((0..=sleeper.tiles.len()).map(start));
        sleeper.neighbours = memory::reserved(pairs.len())?;
        sleeper.neighbours.extend(pairs.iter().map(|pair| pair[1]));
        Ok(())
    }

    /// Wakes what tools come near to in the step that begins.
    pub(crate) fn rouse(&mut self, tools: &[ToolPath]) {
        if !self.sleeps() {
            return;
        }
        if self.is_grasped() {
            self.wake_to_step();
            return;
        }
        for tool in tools {
            if tool.moves() && self.may_touch(tool) {
                self.note_sleep();
                self.wake_near(tool);
            }
        }
    }

    /// Whether a tool meets it and comes near to what sleeps of it.
    fn may_touch(&self, tool: &ToolPath) -> bool {
        let is_near = |sleeper: &Sleeper| tool.is_near(&sleeper.bounds, self.origin, 0.0);
        tool.filter.meets(self.contact.filter) && self.sleeps() && self.sleeper.as_deref().is_some_and(is_near)
    }

    /// Wakes what a tool that meets it is near to.
    pub(crate) fn wake_near(&mut self, tool: &ToolPath) {
        if !self.may_touch(tool) {
            return;
        }
        let Some(sleeper) = &mut self.sleeper else {
            return;
        };
        let margin = sleeper.margin;
        let mut woken = false;
        for (tile, bounds) in self.boxes.iter().enumerate() {
            woken |= sleeper.is_asleep(tile) && tool.is_near(bounds, self.origin, margin) && sleeper.wake(tile);
        }
        if woken && sleeper.in_parts {
            self.forces_current = false;
            self.wake_touched();
        } else if woken {
            self.wake();
        }
    }

    /// After a step of `dt` seconds: what has been at rest for long enough falls asleep, and what its neighbours pull at wakes.
    pub(crate) fn doze(&mut self, dt: f32, (tools, gravity): (&[ToolPath], Vec3), team: &Team) {
        self.forget_sleep();
        let Some(mut sleeper) = self.sleeper.take() else {
            return;
        };
        self.stand_about(&mut sleeper, dt);
        self.touch(&mut sleeper, tools);
        self.see_rest(&mut sleeper, dt);
        self.feel(&mut sleeper, gravity, team);
        let time = sleeper.sleep.time;
        let mut woken = false;
        for tile in 0..sleeper.tiles.len() {
            let it = sleeper.tiles[tile];
            if sleeper.is_asleep(tile) && (it.is_touched || it.pull > 1.0) {
                woken |= sleeper.wake(tile);
            }
        }
        let is_calm = |it: &Tile| it.quiet >= time && it.pull <= SOUNDLY;
        let goes_on = sleeper.tiles.iter().zip(&sleeper.asleep);
        let all = { goes_on }.all(|(it, &is_asleep)| is_asleep || is_calm(it) || it.is_touched && it.quiet >= time);
        for tile in 0..sleeper.tiles.len() {
            let it = sleeper.tiles[tile];
            if sleeper.is_asleep(tile) {
                continue;
            }
            if all || sleeper.in_parts && !it.is_touched && is_calm(&it) {
                self.stand_still(tile);
                sleeper.rest(tile);
            } else if it.quiet >= time && it.pull > SOUNDLY && !it.is_touched {
                // It is asked again after as long a time.
                sleeper.tiles[tile].quiet = 0.0;
            }
        }
        if woken {
            self.forces_current = false;
        }
        self.sleeper = Some(sleeper);
    }

    /// The same of a body that takes its steps together with others, which may hold it up: it falls asleep with all of them.
    pub(crate) fn doze_together(&mut self, dt: f32) {
        self.forget_sleep();
        let Some(mut sleeper) = self.sleeper.take() else {
            return;
        };
        self.stand_about(&mut sleeper, dt);
        self.see_rest(&mut sleeper, dt);
        self.sleeper = Some(sleeper);
    }

    /// Whether all of it has been at rest for long enough to sleep.
    pub(crate) fn is_at_rest(&self) -> bool {
        self.sleeper.as_ref().is_some_and(|sleeper| {
            let mut tiles = sleeper.tiles.iter().zip(&sleeper.asleep);
            tiles.all(|(it, &is_asleep)| is_asleep || it.quiet >= sleeper.sleep.time)
        })
    }

    /// Has all of it sleep.
    pub(crate) fn fall_asleep(&mut self) {
        let Some(mut sleeper) = self.sleeper.take() else {
            return;
        };
        for tile in 0..sleeper.tiles.len() {
            if !sleeper.is_asleep(tile) {
                self.stand_still(tile);
                sleeper.rest(tile);
            }
        }
        self.sleeper = Some(sleeper);
    }

    /// Keeps the length of the last step, and where tools wake it.
    fn stand_about(&self, sleeper: &mut Sleeper, dt: f32) {
        sleeper.step = dt;
        sleeper.margin = self.contact.thickness + NEAR * self.extent();
        sleeper.bounds = self.local_bounds().extended(sleeper.margin);
    }

    /// Has the nodes of a tile stand still in all that a step reads.
    fn stand_still(&mut self, tile: usize) {
        let nodes = tile_nodes(tile, self.node_count());
        self.state.stand_still(nodes.clone());
        if let Some(records) = &mut self.forces.records {
            let axes = self.state.positions().slices(nodes.clone());
            let records = &mut records.as_mut_slice()[nodes];
            self.kernel.run(WriteRecords { axes, records });
        }
    }

    /// Finds the tiles that tools are near to.
    fn touch(&self, sleeper: &mut Sleeper, tools: &[ToolPath]) {
        for (tile, bounds) in sleeper.tiles.iter_mut().zip(&self.boxes) {
            let mut met = tools.iter().filter(|tool| tool.filter.meets(self.contact.filter));
            tile.is_touched = met.any(|tool| tool.is_near(bounds, self.origin, sleeper.margin));
        }
    }

    /// For how long tiles that are awake have been at rest.
    fn see_rest(&self, sleeper: &mut Sleeper, dt: f32) {
        let velocities = self.state.velocities();
        let awake = sleeper
            .tiles
            .iter_mut()
            .enumerate()
            .filter(|&(tile, _)| !sleeper.asleep[tile]);
        for (tile, it) in awake {
            let nodes = tile_nodes(tile, velocities.len());
            let bounds = Bounds::from(self.kernel.ranges(velocities.slices(nodes)));
            let fastest = bounds.magnitudes().length();
            it.quiet = if fastest < sleeper.sleep.speed {
                it.quiet + dt
            } else {
                0.0
            };
        }
    }

    /// Finds what forces would make of nodes whose tiles sleep beside some that are awake, or may fall asleep.
    fn feel(&self, sleeper: &mut Sleeper, gravity: Vec3, team: &Team) {
        if self.integrator.solution().is_some() {
            return;
        }
        let mut tiles = std::mem::take(&mut sleeper.tiles);
        let sleeper_now = &*sleeper;
        team.pass(tiles.len(), Items::new(&mut tiles), |tile, it: &mut Tile| {
            let is_asked = if sleeper_now.is_asleep(tile) {
                let mut neighbours = sleeper_now.neighbours(tile).iter();
                neighbours.any(|&other| !sleeper_now.is_asleep(other as usize))
            } else {
                it.quiet >= sleeper_now.sleep.time
            };
            if is_asked {
                it.pull = self.pull_at(tile, sleeper_now.sleep, gravity);
            }
        });
        sleeper.tiles = tiles;
    }

    /// What forces on the free nodes of a tile come to, as a part of what wakes it.
    fn pull_at(&self, tile: usize, sleep: Sleep, gravity: Vec3) -> f32 {
        let nodes = tile_nodes(tile, self.node_count());
        let mut forces = TileForces::ZERO;
        let velocities = self.forces.springs.damped().then(|| self.state.velocities());
        let motion = Motion::at(self.state.positions(), velocities);
        self.forces.sum().write(tile, nodes.clone(), &motion, &mut forces);
        let (mut largest, mut sum, mut count) = (0.0_f32, Vec3::ZERO, 0.0);
        for (place, node) in nodes.enumerate() {
            let inverse_mass = self.inverse_masses[node];
            if inverse_mass > 0.0 {
                let pull = forces.get(place) * inverse_mass + self.gravity_at(node, gravity);
                let held = self.pins.partial_axes_of(node as u32);
                let pull = Vec3::select(held, Vec3::ZERO, pull);
                largest = largest.max(pull.length());
                sum += pull;
                count += 1.0;
            }
        }
        // By 4 over the square of the longest stable substep a node is drawn back to its place, at most.
        let of_springs = self.carry.limit().unwrap_or(f32::INFINITY);
        let substep = of_springs.min(self.forces.newest_limit_beside_springs());
        let stiffest = 4.0 / (substep * substep);
        let least = sleep.speed / sleep.time + NOISE * stiffest * self.extent() * f32::EPSILON;
        // Where nothing is drawn back it is the mean that counts.
        let way = if stiffest > 0.0 { largest / stiffest } else { 0.0 };
        (sum.length() / f32::max(count, 1.0) / least).max(way / (FEW * sleep.speed * sleep.time))
    }
}
