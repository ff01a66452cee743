//! Positions and velocities for the caller, in the caller's order and in world coordinates.

use std::ops::Range;
use std::sync::{Mutex, OnceLock, PoisonError};

use glam::{DVec3, Vec3};

use super::Body;
use crate::base::{Error, Result, memory};
use crate::codec::{Reader, Saved, Writer};
use crate::geometry::Aabb;
use crate::nodes::{Bindings, NewNode};
use crate::simd::{Loops, prefetch};
use crate::soa::{TILE, tile_count, tile_nodes};
use crate::solver::visit_flushed;
use crate::threads::{Items, Team, Tiles};

/// Positions in another order are prefetched in bodies with at least this many nodes.
const PREFETCH_NODES: usize = 1 << 16;

/// Positions, written at the end of each step, and velocities, written at the first query.
#[derive(Debug)]
pub(super) struct Readback {
    positions: Vec<Vec3>,
    velocities: OnceLock<Vec<Vec3>>,
    /// The buffer for the next velocities, while there are none. Only queries of velocities lock it.
    buffer: Mutex<Vec<Vec3>>,
}

/// Saves positions only. The first query writes velocities again.
impl Saved for Readback {
    const SHAPE: u64 = Vec::<Vec3>::SHAPE;
    const LEAST: usize = Vec::<Vec3>::LEAST;

    fn save(&self, to: &mut Writer) {
        let Self {
            positions,
            velocities: _,
            buffer: _,
        } = self;
        to.needs(positions.capacity() * size_of::<Vec3>());
        positions.save(to);
    }

    fn load(from: &mut Reader) -> Result<Self> {
        let positions: Vec<Vec3> = Saved::load(from)?;
        let mut buffer = from.reserved(positions.capacity())?;
        buffer.resize(positions.len(), Vec3::ZERO);
        Ok(Self {
            positions,
            velocities: OnceLock::new(),
            buffer: Mutex::new(buffer),
        })
    }
}

impl Readback {
    pub fn new(node_count: usize) -> Result<Self> {
        Ok(Self {
            positions: memory::filled(Vec3::ZERO, node_count)?,
            velocities: OnceLock::new(),
            buffer: Mutex::new(memory::filled(Vec3::ZERO, node_count)?),
        })
    }

    /// True if there is an entry for each node.
    pub fn is_valid(&self, node_count: usize) -> bool {
        self.positions.len() == node_count
    }

    /// Reserves space for this many nodes in total.
    pub fn reserve(&mut self, node_count: usize) -> Result<()> {
        self.discard_velocities();
        let buffer = self.buffer.get_mut().unwrap_or_else(PoisonError::into_inner);
        memory::reserve(buffer, node_count)?;
        memory::reserve(&mut self.positions, node_count)
    }

    /// Extends the lists to this many nodes, for which space is reserved.
    pub fn resize_nodes(&mut self, node_count: usize) {
        self.discard_velocities();
        let buffer = self.buffer.get_mut().unwrap_or_else(PoisonError::into_inner);
        buffer.resize(node_count, Vec3::ZERO);
        self.positions.resize(node_count, Vec3::ZERO);
    }

    pub fn positions(&self) -> &[Vec3] {
        &self.positions
    }

    pub fn positions_mut(&mut self) -> &mut [Vec3] {
        &mut self.positions
    }

    /// The list of positions, and a buffer of the same length.
    fn positions_and_buffer(&mut self) -> [&mut [Vec3]; 2] {
        self.discard_velocities();
        let buffer = self.buffer.get_mut().unwrap_or_else(PoisonError::into_inner);
        [&mut self.positions, buffer]
    }

    /// The velocities. `write` fills them if they changed since the last query.
    fn velocities(&self, write: impl FnOnce(&mut [Vec3])) -> &[Vec3] {
        self.velocities.get_or_init(|| {
            let mut buffer = self.buffer.lock().unwrap_or_else(PoisonError::into_inner);
            let mut velocities = std::mem::take(&mut *buffer);
            write(&mut velocities);
            velocities
        })
    }

    /// Discards the velocities, so that the next query writes them again.
    pub fn discard_velocities(&mut self) {
        if let Some(velocities) = self.velocities.take() {
            *self.buffer.get_mut().unwrap_or_else(PoisonError::into_inner) = velocities;
        }
    }
}

impl Body {
    /// Discards the published velocities. Call it when velocities change.
    pub(super) fn discard_velocities(&mut self) {
        self.readback.discard_velocities();
        self.system.hide_pre_kick_velocities();
    }

    /// The position of each node in the caller's order, m.
    pub fn positions(&self) -> &[Vec3] {
        self.readback.positions()
    }

    /// The velocity of each node at the time of the positions, in the caller's order, m/s. A pinned node has the
    /// prescribed velocity of the last step.
    ///
    /// The first call after a step computes the velocities, which takes about as long as a substep on one thread. A
    /// concurrent call waits for that.
    pub fn velocities(&self) -> &[Vec3] {
        self.readback.velocities(|to| {
            let mut write_nodes = |nodes: Range<usize>, from: [&[f32]; 3]| {
                if self.system.order.is_identity() {
                    let (origin, to) = (DVec3::ZERO, &mut to[nodes]);
                    self.system.kernel.run(InterleavePositions { from, origin, to });
                } else {
                    for (offset, node) in nodes.enumerate() {
                        to[self.system.order.caller(node as u32) as usize] = Vec3::from(from.map(|axis| axis[offset]));
                    }
                }
            };
            let closing = self.system.carry.deferred_kick;
            if let Some(early) = self.system.visible_pre_kick_velocities() {
                write_nodes(0..self.node_count(), early.axes());
            } else if !closing.is_some_and(|closing| visit_flushed(&self.system, &closing, &mut write_nodes)) {
                write_nodes(0..self.node_count(), self.system.state.velocities().axes());
            }
            for bound in self.system.bindings.iter().flat_map(Bindings::iter) {
                let velocity = bound.interpolate(|node| to[self.system.order.caller(node as u32) as usize]);
                to[self.system.order.caller(bound.node) as usize] = velocity;
            }
        })
    }

    /// Reserves space for this many additional nodes.
    pub(super) fn reserve_nodes(&mut self, more: usize) -> Result<()> {
        let count = self.node_count().checked_add(more).ok_or(Error::OutOfMemory)?;
        self.readback.reserve(count)?;
        self.system.reserve_added_nodes(more)
    }

    /// Appends nodes, for which space is reserved, in internal indices.
    pub(super) fn add_nodes(&mut self, nodes: &[NewNode]) {
        self.system.add_nodes(nodes);
        self.readback.resize_nodes(self.node_count());
    }

    /// Publishes the positions of new nodes, from this index on.
    pub(super) fn publish_new_nodes(&mut self, first: usize) {
        self.query_tree.mark_outdated();
        for node in first..self.node_count() {
            let local = self.system.state.positions().get(node);
            self.readback.positions_mut()[node] = (local.as_dvec3() + self.system.origin).as_vec3();
            let bounds = &mut self.system.boxes[node / TILE];
            *bounds = bounds.with(local);
        }
    }

    /// The buffer of the velocities, which [`Self::velocities`] fills.
    pub(crate) fn published_velocities(&mut self) -> Range<*const Vec3> {
        let [_, velocities] = self.readback.positions_and_buffer();
        velocities.as_ptr_range()
    }

    /// Publishes positions to the caller and to readers, and updates the bounding box of each tile.
    pub(super) fn publish(&mut self, team: &Team) {
        self.query_tree.mark_outdated();
        let (kernel, origin, order) = (self.system.kernel, self.system.origin, &self.system.order);
        let positions = self.system.state.positions();
        let count = positions.len();
        let [published, buffer] = self.readback.positions_and_buffer();
        let is_identity = order.is_identity();
        let first = if is_identity { &mut *published } else { &mut *buffer };
        let written = (Tiles::new(first, TILE), Items::new(&mut self.system.boxes));
        let sleep_state = self.system.sleep_state.as_deref();
        let is_asleep = |tile: usize| sleep_state.is_some_and(|sleep_state| sleep_state.is_asleep(tile));
        team.pass(tile_count(count), written, |tile, (to, bounds): (_, &mut Aabb)| {
            if is_asleep(tile) {
                return;
            }
            let from = positions.slices(tile_nodes(tile, count));
            *bounds = kernel.ranges(from).into();
            kernel.run(InterleavePositions { from, origin, to });
        });
        if !is_identity {
            // One pass through memory for each node, instead of one for each coordinate.
            let buffer = &*buffer;
            team.pass(tile_count(count), Tiles::new(published, TILE), |tile, to| {
                let own = order.own_range(tile_nodes(tile, count));
                // Prefetches all at once. Data that fits into a cache does not need it.
                if count >= PREFETCH_NODES {
                    for &own in own {
                        prefetch(&raw const buffer[own as usize]);
                    }
                }
                for (to, &own) in to.iter_mut().zip(own) {
                    if !is_asleep(own as usize / TILE) {
                        *to = buffer[own as usize];
                    }
                }
            });
        }
        self.publish_frame(team);
    }
}

/// Writes interleaved vectors in world coordinates.
struct InterleavePositions<'a> {
    from: [&'a [f32]; 3],
    origin: DVec3,
    to: &'a mut [Vec3],
}

impl Loops for InterleavePositions<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let [x, y, z] = self.from;
        let origin = self.origin;
        let to_world = |local: f32, origin: f64| (f64::from(local) + origin) as f32;
        for (((to, &x), &y), &z) in self.to.iter_mut().zip(x).zip(y).zip(z) {
            *to = Vec3::new(to_world(x, origin.x), to_world(y, origin.y), to_world(z, origin.z));
        }
    }
}
