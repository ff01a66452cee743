//! What callers read: side by side, in their order and their coordinates.

use std::ops::Range;
use std::sync::{Mutex, OnceLock, PoisonError};

use glam::{DVec3, Vec3};

use super::Body;
use crate::base::{Error, Result, memory};
use crate::codec::{Reader, Saved, Writer};
use crate::geometry::Bounds;
use crate::nodes::{Bindings, NewNode};
use crate::simd::{Loops, prefetch};
use crate::soa::{TILE, tile_count, tile_nodes};
use crate::solver::show_closed;
use crate::threads::{Items, Team, Tiles};

/// Positions in another order are fetched ahead in bodies of so many nodes.
const FAR: usize = 1 << 16;

/// Positions, written at the end of each step, and velocities, written when they are asked for.
#[derive(Debug)]
pub(super) struct Published {
    positions: Vec<Vec3>,
    velocities: OnceLock<Vec<Vec3>>,
    /// Where velocities are written next, while there are none. Locked by who asks for them alone.
    blank: Mutex<Vec<Vec3>>,
}

/// Positions: velocities are written again when they are asked for.
impl Saved for Published {
    const SHAPE: u64 = Vec::<Vec3>::SHAPE;
    const LEAST: usize = Vec::<Vec3>::LEAST;

    fn save(&self, to: &mut Writer) {
        let Self {
            positions,
            velocities: _,
            blank: _,
        } = self;
        to.needs(positions.capacity() * size_of::<Vec3>());
        positions.save(to);
    }

    fn load(from: &mut Reader) -> Result<Self> {
        let positions: Vec<Vec3> = Saved::load(from)?;
        let mut blank = from.reserved(positions.capacity())?;
        blank.resize(positions.len(), Vec3::ZERO);
        Ok(Self {
            positions,
            velocities: OnceLock::new(),
            blank: Mutex::new(blank),
        })
    }
}

impl Published {
    pub fn new(node_count: usize) -> Result<Self> {
        Ok(Self {
            positions: memory::filled(Vec3::ZERO, node_count)?,
            velocities: OnceLock::new(),
            blank: Mutex::new(memory::filled(Vec3::ZERO, node_count)?),
        })
    }

    /// Whether it is of so many nodes.
    pub fn is_sound(&self, node_count: usize) -> bool {
        self.positions.len() == node_count
    }

    /// Makes room for so many nodes in all.
    pub fn reserve(&mut self, node_count: usize) -> Result<()> {
        self.forget_velocities();
        let blank = self.blank.get_mut().unwrap_or_else(PoisonError::into_inner);
        memory::reserve(blank, node_count)?;
        memory::reserve(&mut self.positions, node_count)
    }

    /// Adds nodes, for which there is room, up to so many in all.
    pub fn grow(&mut self, node_count: usize) {
        self.forget_velocities();
        let blank = self.blank.get_mut().unwrap_or_else(PoisonError::into_inner);
        blank.resize(node_count, Vec3::ZERO);
        self.positions.resize(node_count, Vec3::ZERO);
    }

    pub fn positions(&self) -> &[Vec3] {
        &self.positions
    }

    pub fn positions_mut(&mut self) -> &mut [Vec3] {
        &mut self.positions
    }

    /// The list of positions, and another as long that holds nothing while velocities were not asked for.
    fn lists_mut(&mut self) -> [&mut [Vec3]; 2] {
        self.forget_velocities();
        let blank = self.blank.get_mut().unwrap_or_else(PoisonError::into_inner);
        [&mut self.positions, blank]
    }

    /// The velocities, as `write` puts them into a list of as many where that was not done since they changed.
    fn velocities(&self, write: impl FnOnce(&mut [Vec3])) -> &[Vec3] {
        self.velocities.get_or_init(|| {
            let mut blank = self.blank.lock().unwrap_or_else(PoisonError::into_inner);
            let mut velocities = std::mem::take(&mut *blank);
            write(&mut velocities);
            velocities
        })
    }

    /// Has velocities be written again when they are asked for.
    pub fn forget_velocities(&mut self) {
        if let Some(velocities) = self.velocities.take() {
            *self.blank.get_mut().unwrap_or_else(PoisonError::into_inner) = velocities;
        }
    }
}

impl Body {
    /// To be called when velocities change.
    pub(super) fn forget_velocities(&mut self) {
        self.published.forget_velocities();
        self.system.forget_early();
    }

    /// Where each node is, in metres, in the caller's order.
    pub fn positions(&self) -> &[Vec3] {
        self.published.positions()
    }

    /// How fast each node moves at the time of the positions, in m/s, in the caller's order; a pinned node moves as it
    /// was led in the last step.
    ///
    /// The first call after a step works them out, which takes about as long as a substep on one thread, or waits for
    /// another thread that does.
    pub fn velocities(&self) -> &[Vec3] {
        self.published.velocities(|to| {
            let mut put = |nodes: Range<usize>, from: [&[f32]; 3]| {
                if self.system.order.is_callers() {
                    let (origin, to) = (DVec3::ZERO, &mut to[nodes]);
                    self.system.kernel.run(Publish { from, origin, to });
                } else {
                    for (place, node) in nodes.enumerate() {
                        to[self.system.order.caller(node as u32) as usize] = Vec3::from(from.map(|axis| axis[place]));
                    }
                }
            };
            let closing = self.system.carry.closing;
            if let Some(early) = self.system.early_seen() {
                put(0..self.node_count(), early.axes());
            } else if !closing.is_some_and(|closing| show_closed(&self.system, &closing, &mut put)) {
                put(0..self.node_count(), self.system.state.velocities().axes());
            }
            for bound in self.system.bindings.iter().flat_map(Bindings::iter) {
                let velocity = bound.of(|node| to[self.system.order.caller(node as u32) as usize]);
                to[self.system.order.caller(bound.node) as usize] = velocity;
            }
        })
    }

    /// Makes room for so many nodes more than there are.
    pub(super) fn reserve_nodes(&mut self, more: usize) -> Result<()> {
        let count = self.node_count().checked_add(more).ok_or(Error::OutOfMemory)?;
        self.published.reserve(count)?;
        self.system.make_room(more)
    }

    /// Adds nodes, for which there is room, in their own numbers: they follow those that there are.
    pub(super) fn add_nodes(&mut self, nodes: &[NewNode]) {
        self.system.add_nodes(nodes);
        self.published.grow(self.node_count());
    }

    /// Shows callers the nodes from this one on, which are new.
    pub(super) fn publish_new(&mut self, first: usize) {
        self.query_tree.outdate();
        for node in first..self.node_count() {
            let local = self.system.state.positions().get(node);
            self.published.positions_mut()[node] = (local.as_dvec3() + self.system.origin).as_vec3();
            let bounds = &mut self.system.boxes[node / TILE];
            *bounds = bounds.with(local);
        }
    }

    /// Where velocities are when they have been asked for.
    pub(crate) fn published_velocities(&mut self) -> Range<*const Vec3> {
        let [_, velocities] = self.published.lists_mut();
        velocities.as_ptr_range()
    }

    /// Writes the positions for callers and shows them to readers, and finds the box of each tile.
    pub(super) fn publish(&mut self, team: &Team) {
        self.query_tree.outdate();
        let (kernel, origin, order) = (self.system.kernel, self.system.origin, &self.system.order);
        let positions = self.system.state.positions();
        let count = positions.len();
        let [published, blank] = self.published.lists_mut();
        let is_callers = order.is_callers();
        let first = if is_callers { &mut *published } else { &mut *blank };
        let written = (Tiles::new(first, TILE), Items::new(&mut self.system.boxes));
        let sleeper = self.system.sleeper.as_deref();
        let is_asleep = |tile: usize| sleeper.is_some_and(|sleeper| sleeper.is_asleep(tile));
        team.pass(tile_count(count), written, |tile, (to, bounds): (_, &mut Bounds)| {
            if is_asleep(tile) {
                return;
            }
            let from = positions.slices(tile_nodes(tile, count));
            *bounds = kernel.ranges(from).into();
            kernel.run(Publish { from, origin, to });
        });
        if !is_callers {
            // One way through memory for each node, not one for each of its coordinates.
            let blank = &*blank;
            team.pass(tile_count(count), Tiles::new(published, TILE), |tile, to| {
                let own = order.owns(tile_nodes(tile, count));
                // Fetched from memory all at once; what fits into a cache is not worth it.
                if count >= FAR {
                    for &own in own {
                        prefetch(&raw const blank[own as usize]);
                    }
                }
                for (to, &own) in to.iter_mut().zip(own) {
                    if !is_asleep(own as usize / TILE) {
                        *to = blank[own as usize];
                    }
                }
            });
        }
        self.show(team);
    }
}

/// Writes vectors side by side, in the world's coordinates.
struct Publish<'a> {
    from: [&'a [f32]; 3],
    origin: DVec3,
    to: &'a mut [Vec3],
}

impl Loops for Publish<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let [x, y, z] = self.from;
        let origin = self.origin;
        let placed = |local: f32, origin: f64| (f64::from(local) + origin) as f32;
        for (((to, &x), &y), &z) in self.to.iter_mut().zip(x).zip(y).zip(z) {
            *to = Vec3::new(placed(x, origin.x), placed(y, origin.y), placed(z, origin.z));
        }
    }
}
