//! Sleeping: tissue at rest is not stepped, tile by tile, until something wakes it.
//!
//! The nodes of a sleeping tile have constant values in all buffers that the solver writes, so that a pass can skip the
//! tile. A tile wakes if the forces on it would accelerate it to the sleep speed within the sleep time. It also wakes
//! if they would move a node by about the sleep speed times the sleep time. The forces on neighbors of awake tiles are
//! tested after each step.

use glam::Vec3;

use super::System;
use crate::base::{Result, StateHasher, memory};
use crate::codec::saved;
use crate::contact::ToolPath;
use crate::def::Sleep;
use crate::geometry::Aabb;
use crate::soa::{PerNode, TILE, TileForces, WriteRecords, tile_count, tile_nodes};
use crate::springs::ForceInput;
use crate::threads::{Items, Team};

/// A tile falls asleep only if its forces are below this fraction of the waking threshold. This hysteresis prevents
/// immediate waking.
const HYSTERESIS: f32 = 0.5;

/// The mean rounding error of the forces on a tile, relative to that on one node.
const ROUNDING: f32 = 0.05;

/// How far the equilibrium of a node moves if one neighbor moves by 1. A node has at least about four neighbors.
const NEIGHBOR_RESPONSE: f32 = 0.25;

/// The distance at which tools wake tissue, as a fraction of the body's extent.
const WAKE_DISTANCE: f32 = 0.02;

#[derive(Clone, Copy, Debug, Default)]
struct SleepTile {
    /// The time at rest, s.
    rest_time: f32,
    /// True if a tool is near.
    is_touched: bool,
    /// The net force on its nodes relative to the waking threshold, if this step has computed it.
    relative_force: f32,
}

saved! { SleepTile { rest_time, is_touched, relative_force } }

/// The sleep state of a body.
#[derive(Debug)]
pub(crate) struct SleepState {
    sleep: Sleep,
    tiles: Vec<SleepTile>,
    /// The sleep flag of each tile, and the number of sleeping tiles.
    asleep: Vec<bool>,
    asleep_count: usize,
    /// Adjacent tiles, joined by springs or elements, in compressed row format.
    neighbors: Vec<u32>,
    starts: Vec<u32>,
    /// True if single tiles may sleep. A body whose solver or forces couple all nodes sleeps as a whole.
    by_tile: bool,
    /// The box in which tools wake the body, and the distance at which they wake a tile, m.
    bounds: Aabb,
    margin: f32,
    /// The length of the last step, s. Tools keep the wrench of that step while the body sleeps.
    step: f32,
    /// The rest time and sleep flag of each tile before an attempted step woke tiles. Empty if it woke none.
    saved: Vec<(f32, bool)>,
    /// True if the forces were current before.
    saved_forces_current: bool,
}

saved! { SleepState {
    sleep, tiles, asleep, asleep_count, neighbors, starts, by_tile, bounds, margin, step, saved, saved_forces_current,
} }

impl PerNode for SleepState {
    fn reserve_nodes(&mut self, count: usize) -> Result<()> {
        let tiles = tile_count(count);
        memory::reserve(&mut self.tiles, tiles)?;
        memory::reserve(&mut self.saved, tiles)?;
        memory::reserve(&mut self.asleep, tiles)
    }

    /// All tiles are awake, and their adjacency is out of date. From now on the body sleeps as a whole.
    fn grow(&mut self, count: usize) {
        self.tiles.grow(tile_count(count));
        self.asleep.grow(tile_count(count));
        self.by_tile = false;
    }
}

impl SleepState {
    #[inline]
    pub fn is_asleep(&self, tile: usize) -> bool {
        self.asleep[tile]
    }

    /// The sleep flag of each tile.
    pub fn asleep(&self) -> &[bool] {
        &self.asleep
    }

    fn all_asleep(&self) -> bool {
        self.asleep_count == self.tiles.len()
    }

    /// The sleep settings.
    pub fn sleep(&self) -> Sleep {
        self.sleep
    }

    /// Changes the sleep settings.
    pub fn set_sleep(&mut self, sleep: Sleep) {
        self.sleep = sleep;
    }

    /// Wakes a tile. Returns true if it was asleep.
    fn wake(&mut self, tile: usize) -> bool {
        self.tiles[tile].rest_time = 0.0;
        let slept = std::mem::replace(&mut self.asleep[tile], false);
        self.asleep_count -= usize::from(slept);
        slept
    }

    /// Puts an awake tile to sleep.
    fn put_to_sleep(&mut self, tile: usize) {
        self.asleep[tile] = true;
        self.asleep_count += 1;
    }

    /// Accounts for a new spring between own nodes. If it joins tiles that were not adjacent, the body sleeps as a
    /// whole from now on.
    pub fn join(&mut self, nodes: [u32; 2]) {
        let [a, b] = nodes.map(|node| node as usize / TILE);
        self.by_tile = self.by_tile && (a == b || self.neighbors(a).contains(&(b as u32)));
    }

    fn neighbors(&self, tile: usize) -> &[u32] {
        &self.neighbors[self.starts[tile] as usize..self.starts[tile + 1] as usize]
    }

    pub fn hash(&self, hasher: &mut StateHasher) {
        for (tile, &is_asleep) in self.tiles.iter().zip(&self.asleep) {
            hasher.write_floats(&[tile.rest_time]);
            hasher.write_u64(u64::from(is_asleep));
        }
    }
}

impl System {
    /// Wakes all tiles.
    pub fn wake(&mut self) {
        let Some(sleep_state) = &mut self.sleep_state else {
            return;
        };
        let mut woken = false;
        for tile in 0..sleep_state.tiles.len() {
            woken |= sleep_state.wake(tile);
        }
        if woken {
            self.forces_current = false;
        }
    }

    /// Wakes the tile of one of its own nodes, and the tiles near tools.
    pub(crate) fn wake_at(&mut self, own: u32) {
        let Some(sleep_state) = &mut self.sleep_state else {
            return;
        };
        if !sleep_state.by_tile {
            self.wake();
        } else if sleep_state.wake(own as usize / TILE) {
            self.forces_current = false;
            self.wake_touched();
        }
    }

    /// Wakes all tiles for an attempted step. [`System::restore_sleep`] undoes this if the step is not committed.
    pub(crate) fn wake_for_step(&mut self) {
        self.save_sleep();
        self.wake();
    }

    /// Saves the sleep state before an attempted step wakes tiles.
    fn save_sleep(&mut self) {
        if let Some(sleep_state) = &mut self.sleep_state
            && sleep_state.saved.is_empty()
        {
            let tiles = sleep_state.tiles.iter().zip(&sleep_state.asleep);
            sleep_state
                .saved
                .extend(tiles.map(|(tile_state, &is_asleep)| (tile_state.rest_time, is_asleep)));
            sleep_state.saved_forces_current = self.forces_current;
        }
    }

    /// Restores the sleep state after an attempted step that is not committed.
    pub(crate) fn restore_sleep(&mut self) {
        if let Some(sleep_state) = &mut self.sleep_state
            && !sleep_state.saved.is_empty()
        {
            let SleepState {
                tiles, asleep, saved, ..
            } = &mut **sleep_state;
            for ((tile_state, is_asleep), (rest_time, slept)) in tiles.iter_mut().zip(asleep).zip(saved.drain(..)) {
                (tile_state.rest_time, *is_asleep) = (rest_time, slept);
            }
            sleep_state.asleep_count = sleep_state.asleep.iter().filter(|&&is_asleep| is_asleep).count();
            self.forces_current = sleep_state.saved_forces_current;
        }
    }

    /// Discards the saved sleep state of a committed step.
    pub(crate) fn discard_saved_sleep(&mut self) {
        if let Some(sleep_state) = &mut self.sleep_state {
            sleep_state.saved.clear();
        }
    }

    /// Wakes all tiles near tools, because the tools' wrenches are recomputed while anything is awake.
    fn wake_touched(&mut self) {
        if let Some(sleep_state) = &mut self.sleep_state {
            for tile in 0..sleep_state.tiles.len() {
                if sleep_state.tiles[tile].is_touched {
                    sleep_state.wake(tile);
                }
            }
        }
    }

    /// True if all tiles sleep.
    pub(crate) fn is_asleep(&self) -> bool {
        self.sleep_state
            .as_ref()
            .is_some_and(|sleep_state| sleep_state.all_asleep())
    }

    /// True if any tile sleeps.
    pub(crate) fn any_tile_asleep(&self) -> bool {
        self.sleep_state
            .as_ref()
            .is_some_and(|sleep_state| sleep_state.asleep_count > 0)
    }

    /// Commits a step of a sleeping body.
    pub(crate) fn step_asleep(&mut self) {
        self.discard_saved_sleep();
        if let Some(contacts) = &mut self.contacts {
            contacts.commit_asleep();
        }
    }

    /// The length of the last step of a sleeping body, s.
    pub(crate) fn last_step(&self) -> f32 {
        self.sleep_state.as_ref().map_or(0.0, |sleep_state| sleep_state.step)
    }

    /// Enables sleeping and reserves memory for the tiles that cuts may add. Changes nothing on failure.
    pub(crate) fn enable_sleep(&mut self, sleep: Sleep) -> Result<()> {
        if sleep.speed > 0.0 {
            let tiles = tile_count(self.node_count());
            let mut sleep_state = SleepState {
                sleep,
                tiles: memory::filled(SleepTile::default(), tiles)?,
                asleep: memory::filled(false, tiles)?,
                asleep_count: 0,
                neighbors: Vec::new(),
                starts: Vec::new(),
                by_tile: self.integrator.solution().is_none() && !self.forces.auxiliary.is_any(),
                bounds: Aabb::EMPTY,
                margin: 0.0,
                step: 0.0,
                saved: memory::reserved(tiles)?,
                saved_forces_current: false,
            };
            self.join_tiles(&mut sleep_state)?;
            sleep_state.reserve_nodes(self.node_count().max(self.node_capacity))?;
            self.sleep_state = Some(memory::boxed(sleep_state)?);
        }
        Ok(())
    }

    /// Finds adjacent tiles.
    fn join_tiles(&self, sleep_state: &mut SleepState) -> Result<()> {
        let mut pairs: Vec<[u32; 2]> = Vec::new();
        let mut result = Ok(());
        self.forces.visit_joined(&mut |a, b| {
            let [a, b] = [a, b].map(|node| node / TILE as u32);
            if a != b && result.is_ok() {
                result = memory::push(&mut pairs, [a, b]).and_then(|()| memory::push(&mut pairs, [b, a]));
            }
        });
        result?;
        memory::sort_once(&mut pairs);
        sleep_state.starts = memory::reserved(sleep_state.tiles.len() + 1)?;
        let start = |tile: usize| pairs.partition_point(|pair| (pair[0] as usize) < tile) as u32;
        sleep_state.starts.extend((0..=sleep_state.tiles.len()).map(start));
        sleep_state.neighbors = memory::reserved(pairs.len())?;
        sleep_state.neighbors.extend(pairs.iter().map(|pair| pair[1]));
        Ok(())
    }

    /// Wakes the tiles near moving tools at the beginning of a step.
    pub(crate) fn wake_near_tools(&mut self, tools: &[ToolPath]) {
        if !self.any_tile_asleep() {
            return;
        }
        if self.has_tool_attachments() {
            self.wake_for_step();
            return;
        }
        for tool in tools {
            if tool.moves() && self.may_touch(tool) {
                self.save_sleep();
                self.wake_near(tool);
            }
        }
    }

    /// True if a tool collides with the body and is near a sleeping part.
    fn may_touch(&self, tool: &ToolPath) -> bool {
        let is_near = |sleep_state: &SleepState| tool.is_near(&sleep_state.bounds, self.origin, 0.0);
        tool.filter.meets(self.contact.filter)
            && self.any_tile_asleep()
            && self.sleep_state.as_deref().is_some_and(is_near)
    }

    /// Wakes the tiles near a tool that collides with the body.
    pub(crate) fn wake_near(&mut self, tool: &ToolPath) {
        if !self.may_touch(tool) {
            return;
        }
        let Some(sleep_state) = &mut self.sleep_state else {
            return;
        };
        let margin = sleep_state.margin;
        let mut woken = false;
        for (tile, bounds) in self.boxes.iter().enumerate() {
            woken |= sleep_state.is_asleep(tile) && tool.is_near(bounds, self.origin, margin) && sleep_state.wake(tile);
        }
        if woken && sleep_state.by_tile {
            self.forces_current = false;
            self.wake_touched();
        } else if woken {
            self.wake();
        }
    }

    /// Puts tiles to sleep and wakes tiles after a step of `dt` seconds.
    pub(crate) fn update_sleep(&mut self, dt: f32, (tools, gravity): (&[ToolPath], Vec3), team: &Team) {
        self.discard_saved_sleep();
        let Some(mut sleep_state) = self.sleep_state.take() else {
            return;
        };
        self.update_wake_bounds(&mut sleep_state, dt);
        self.find_touched(&mut sleep_state, tools);
        self.update_rest_times(&mut sleep_state, dt);
        self.update_relative_forces(&mut sleep_state, gravity, team);
        let time = sleep_state.sleep.time;
        let mut woken = false;
        for tile in 0..sleep_state.tiles.len() {
            let tile_state = sleep_state.tiles[tile];
            if sleep_state.is_asleep(tile) && (tile_state.is_touched || tile_state.relative_force > 1.0) {
                woken |= sleep_state.wake(tile);
            }
        }
        let is_calm = |tile_state: &SleepTile| tile_state.rest_time >= time && tile_state.relative_force <= HYSTERESIS;
        let states = sleep_state.tiles.iter().zip(&sleep_state.asleep);
        let all_rest = { states }.all(|(tile_state, &is_asleep)| {
            is_asleep || is_calm(tile_state) || tile_state.is_touched && tile_state.rest_time >= time
        });
        for tile in 0..sleep_state.tiles.len() {
            let tile_state = sleep_state.tiles[tile];
            if sleep_state.is_asleep(tile) {
                continue;
            }
            if all_rest || sleep_state.by_tile && !tile_state.is_touched && is_calm(&tile_state) {
                self.freeze_tile(tile);
                sleep_state.put_to_sleep(tile);
            } else if tile_state.rest_time >= time && tile_state.relative_force > HYSTERESIS && !tile_state.is_touched {
                // It is tested again after the same time.
                sleep_state.tiles[tile].rest_time = 0.0;
            }
        }
        if woken {
            self.forces_current = false;
        }
        self.sleep_state = Some(sleep_state);
    }

    /// Updates the rest times of a body in a coupled step. Coupled bodies fall asleep together, because they may
    /// support each other.
    pub(crate) fn update_sleep_coupled(&mut self, dt: f32) {
        self.discard_saved_sleep();
        let Some(mut sleep_state) = self.sleep_state.take() else {
            return;
        };
        self.update_wake_bounds(&mut sleep_state, dt);
        self.update_rest_times(&mut sleep_state, dt);
        self.sleep_state = Some(sleep_state);
    }

    /// True if all tiles have been at rest long enough to sleep.
    pub(crate) fn is_at_rest(&self) -> bool {
        self.sleep_state.as_ref().is_some_and(|sleep_state| {
            let mut tiles = sleep_state.tiles.iter().zip(&sleep_state.asleep);
            tiles.all(|(tile_state, &is_asleep)| is_asleep || tile_state.rest_time >= sleep_state.sleep.time)
        })
    }

    /// Puts all tiles to sleep.
    pub(crate) fn fall_asleep(&mut self) {
        let Some(mut sleep_state) = self.sleep_state.take() else {
            return;
        };
        for tile in 0..sleep_state.tiles.len() {
            if !sleep_state.is_asleep(tile) {
                self.freeze_tile(tile);
                sleep_state.put_to_sleep(tile);
            }
        }
        self.sleep_state = Some(sleep_state);
    }

    /// Stores the length of the last step and the box in which tools wake the body.
    fn update_wake_bounds(&self, sleep_state: &mut SleepState, dt: f32) {
        sleep_state.step = dt;
        sleep_state.margin = self.contact.thickness + WAKE_DISTANCE * self.extent();
        sleep_state.bounds = self.local_bounds().extended(sleep_state.margin);
    }

    /// Makes the nodes of a tile constant in all buffers that a step reads.
    fn freeze_tile(&mut self, tile: usize) {
        let nodes = tile_nodes(tile, self.node_count());
        self.state.freeze(nodes.clone());
        if let Some(records) = &mut self.forces.records {
            let axes = self.state.positions().slices(nodes.clone());
            let records = &mut records.as_mut_slice()[nodes];
            self.kernel.run(WriteRecords { axes, records });
        }
    }

    /// Finds the tiles near tools.
    fn find_touched(&self, sleep_state: &mut SleepState, tools: &[ToolPath]) {
        for (tile, bounds) in sleep_state.tiles.iter_mut().zip(&self.boxes) {
            let mut colliding = tools.iter().filter(|tool| tool.filter.meets(self.contact.filter));
            tile.is_touched = colliding.any(|tool| tool.is_near(bounds, self.origin, sleep_state.margin));
        }
    }

    /// Updates the rest times of awake tiles.
    fn update_rest_times(&self, sleep_state: &mut SleepState, dt: f32) {
        let velocities = self.state.velocities();
        let awake = sleep_state
            .tiles
            .iter_mut()
            .enumerate()
            .filter(|&(tile, _)| !sleep_state.asleep[tile]);
        for (tile, tile_state) in awake {
            let nodes = tile_nodes(tile, velocities.len());
            let bounds = Aabb::from(self.kernel.ranges(velocities.slices(nodes)));
            let fastest = bounds.magnitudes().length();
            tile_state.rest_time = if fastest < sleep_state.sleep.speed {
                tile_state.rest_time + dt
            } else {
                0.0
            };
        }
    }

    /// Computes the net forces on sleeping tiles next to awake ones, and on tiles that may fall asleep.
    fn update_relative_forces(&self, sleep_state: &mut SleepState, gravity: Vec3, team: &Team) {
        if self.integrator.solution().is_some() {
            return;
        }
        let mut tiles = std::mem::take(&mut sleep_state.tiles);
        let shared = &*sleep_state;
        team.pass(
            tiles.len(),
            Items::new(&mut tiles),
            |tile, tile_state: &mut SleepTile| {
                let is_tested = if shared.is_asleep(tile) {
                    let mut neighbors = shared.neighbors(tile).iter();
                    neighbors.any(|&other| !shared.is_asleep(other as usize))
                } else {
                    tile_state.rest_time >= shared.sleep.time
                };
                if is_tested {
                    tile_state.relative_force = self.relative_force_at(tile, shared.sleep, gravity);
                }
            },
        );
        sleep_state.tiles = tiles;
    }

    /// The net force on the free nodes of a tile relative to the waking threshold.
    fn relative_force_at(&self, tile: usize, sleep: Sleep, gravity: Vec3) -> f32 {
        let nodes = tile_nodes(tile, self.node_count());
        let mut forces = TileForces::ZERO;
        let velocities = self.forces.springs.damped().then(|| self.state.velocities());
        let motion = ForceInput::at(self.state.positions(), velocities);
        self.forces.sum().write(tile, nodes.clone(), &motion, &mut forces);
        let (mut largest, mut sum, mut count) = (0.0_f32, Vec3::ZERO, 0.0);
        for (index, node) in nodes.enumerate() {
            let inverse_mass = self.inverse_masses[node];
            if inverse_mass > 0.0 {
                let acceleration = forces.get(index) * inverse_mass + self.gravity_at(node, gravity);
                let constrained = self.pins.partial_axes_of(node as u32);
                let acceleration = Vec3::select(constrained, Vec3::ZERO, acceleration);
                largest = largest.max(acceleration.length());
                sum += acceleration;
                count += 1.0;
            }
        }
        // The restoring acceleration per displacement is at most 4 over the square of the longest stable substep.
        let spring_limit = self.carry.limit().unwrap_or(f32::INFINITY);
        let substep = spring_limit.min(self.forces.latest_non_spring_dt_limit());
        let max_rate = 4.0 / (substep * substep);
        let threshold = sleep.speed / sleep.time + ROUNDING * max_rate * self.extent() * f32::EPSILON;
        // Without restoring forces only the mean force counts.
        let displacement = if max_rate > 0.0 { largest / max_rate } else { 0.0 };
        (sum.length() / f32::max(count, 1.0) / threshold)
            .max(displacement / (NEIGHBOR_RESPONSE * sleep.speed * sleep.time))
    }
}
