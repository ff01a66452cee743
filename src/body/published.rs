//! What callers read: side by side, in their order and their coordinates.

use std::ops::Range;
use std::sync::{Mutex, OnceLock, PoisonError};

use glam::{DVec3, Vec3};

use super::Body;
use crate::base::{Result, memory};
use crate::codec::{Reader, Saved, Writer, saved};
use crate::geometry::Bounds;
use crate::nodes::Bindings;
use crate::simd::{Loops, prefetch};
use crate::soa::{TILE, Vectors, tile_count, tile_nodes};
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
    /// Of bodies that may press others: of the last step, and of the one that is tried.
    early: Option<[Early; 2]>,
}

/// Velocities from before the last half kick of a step.
#[derive(Debug)]
struct Early {
    velocities: Vectors,
    /// Whether callers see these.
    is_seen: bool,
}

saved!(Early { velocities, is_seen });

/// Positions, and early velocities: others are written again when they are asked for.
impl Saved for Published {
    const SHAPE: u64 = Vec::<Vec3>::SHAPE;
    const LEAST: usize = Vec::<Vec3>::LEAST;

    fn save(&self, to: &mut Writer) {
        let Self {
            positions,
            velocities: _,
            blank: _,
            early,
        } = self;
        to.needs(positions.capacity() * size_of::<Vec3>());
        positions.save(to);
        early.save(to);
    }

    fn load(from: &mut Reader) -> Result<Self> {
        let positions: Vec<Vec3> = Saved::load(from)?;
        let mut blank = from.reserved(positions.capacity())?;
        blank.resize(positions.len(), Vec3::ZERO);
        Ok(Self {
            positions,
            velocities: OnceLock::new(),
            blank: Mutex::new(blank),
            early: Saved::load(from)?,
        })
    }
}

impl Published {
    pub fn new(node_count: usize) -> Result<Self> {
        Ok(Self {
            positions: memory::filled(Vec3::ZERO, node_count)?,
            velocities: OnceLock::new(),
            blank: Mutex::new(memory::filled(Vec3::ZERO, node_count)?),
            early: None,
        })
    }

    /// The step that was tried is taken.
    pub fn commit(&mut self) {
        self.clear_velocities();
        if let Some(early) = &mut self.early {
            early.swap(0, 1);
        }
    }

    /// Whether it is of so many nodes.
    pub fn is_sound(&self, node_count: usize) -> bool {
        let mut early = self.early.iter().flatten();
        self.positions.len() == node_count && early.all(|early| early.velocities.len() == node_count)
    }

    /// Makes room for so many nodes in all.
    pub fn reserve(&mut self, node_count: usize) -> Result<()> {
        self.forget_velocities();
        let blank = self.blank.get_mut().unwrap_or_else(PoisonError::into_inner);
        memory::reserve(blank, node_count)?;
        for early in self.early.iter_mut().flatten() {
            early.velocities.reserve(node_count)?;
        }
        memory::reserve(&mut self.positions, node_count)
    }

    /// Adds nodes, for which there is room, up to so many in all.
    pub fn grow(&mut self, node_count: usize) {
        self.forget_velocities();
        let blank = self.blank.get_mut().unwrap_or_else(PoisonError::into_inner);
        blank.resize(node_count, Vec3::ZERO);
        for early in self.early.iter_mut().flatten() {
            early.velocities.grow(node_count);
        }
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
        self.clear_velocities();
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

    /// The early velocities, where callers see those.
    fn early_seen(&self) -> Option<&Vectors> {
        let [early, _] = self.early.as_ref()?;
        early.is_seen.then_some(&early.velocities)
    }

    /// To be called when velocities change.
    pub fn forget_velocities(&mut self) {
        self.clear_velocities();
        if let Some([early, _]) = &mut self.early {
            early.is_seen = false;
        }
    }

    /// Has velocities be written again when they are asked for.
    fn clear_velocities(&mut self) {
        if let Some(velocities) = self.velocities.take() {
            *self.blank.get_mut().unwrap_or_else(PoisonError::into_inner) = velocities;
        }
    }
}

impl Body {
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
                if self.order.is_callers() {
                    let (origin, to) = (DVec3::ZERO, &mut to[nodes]);
                    self.kernel.run(Publish { from, origin, to });
                } else {
                    for (place, node) in nodes.enumerate() {
                        to[self.order.caller(node as u32) as usize] = Vec3::from(from.map(|axis| axis[place]));
                    }
                }
            };
            let closing = self.carry.closing;
            if let Some(early) = self.published.early_seen() {
                put(0..self.node_count(), early.axes());
            } else if !closing.is_some_and(|closing| show_closed(self, &closing, &mut put)) {
                put(0..self.node_count(), self.state.velocities().axes());
            }
            for bound in self.bindings.iter().flat_map(Bindings::iter) {
                let velocity = bound.of(|node| to[self.order.caller(node as u32) as usize]);
                to[self.order.caller(bound.node) as usize] = velocity;
            }
        })
    }

    /// Makes room for velocities from before the last half kick of a step.
    pub(super) fn reserve_early(&mut self) -> Result<()> {
        if self.published.early.is_none() {
            let early = [self.zeros()?, self.zeros()?];
            self.published.early = Some(early.map(|velocities| Early {
                velocities,
                is_seen: false,
            }));
        }
        Ok(())
    }

    /// Has callers see the velocities that it has now, before the last half kick of the step that is tried, once that is taken.
    pub(crate) fn show_early(&mut self) {
        if let Some([_, early]) = &mut self.published.early
            && !early.is_seen
        {
            early.velocities.copy_from(self.state.newest().1);
            early.is_seen = true;
        }
    }

    /// Has callers see the velocities at the end of the step that is to be tried.
    pub(crate) fn show_late(&mut self) {
        if let Some([_, early]) = &mut self.published.early {
            early.is_seen = false;
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
        let (kernel, origin, order) = (self.kernel, self.origin, &self.order);
        let positions = self.state.positions();
        let count = positions.len();
        let [published, blank] = self.published.lists_mut();
        let is_callers = order.is_callers();
        let first = if is_callers { &mut *published } else { &mut *blank };
        let written = (Tiles::new(first, TILE), Items::new(&mut self.boxes));
        let sleeper = self.sleeper.as_deref();
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
