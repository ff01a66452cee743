//! Readers: access from other threads to the positions of a body while its world steps.

use std::sync::Arc;

use glam::Vec3;

use crate::base::{Error, Result, memory};
use crate::codec::saved;
use crate::soa::{TILE, tile_count, tile_nodes};
use crate::sync::pool::{PoolReader, PoolWriter};
use crate::threads::{Team, Tiles};

/// The largest number of readers of a body.
const MAX_READERS: usize = 126;

/// Lock-free access from another thread to the latest complete positions of a body, while its world steps and changes.
///
/// Created by [`World::create_reader`](crate::World::create_reader), and owned by the reading thread. It can outlive
/// the body and the world, and can be dropped on any thread.
///
/// ```
#[doc = include_str!("doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition::default())?;
/// # let body = world.create_body(&cloth)?;
/// let mut reader = world.create_reader(body)?;
/// world.step(1.0 / 60.0)?;
/// let lowest = std::thread::spawn(move || reader.read().positions[12].y);
/// assert_eq!(lowest.join().expect("no panic"), world.body(body)?.positions()[12].y);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Debug)]
pub struct BodyReader {
    reader: PoolReader<Snapshot>,
    has_read: bool,
}

/// A consistent frame of a body.
///
/// ```
#[doc = include_str!("doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition::default())?;
/// # let body = world.create_body(&cloth)?;
/// let mut reader = world.create_reader(body)?;
/// world.step(1.0 / 60.0)?;
/// let frame = reader.read();
/// assert!(frame.is_new && !frame.is_over);
/// assert_eq!(frame.step, 1);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame<'a> {
    /// The positions of the nodes, m, in the caller's order, including nodes that cuts have added:
    /// [`Body::positions`](crate::Body::positions).
    pub positions: &'a [Vec3],
    /// The triangles of the render surface: [`Body::surface`](crate::Body::surface). They change only with
    /// `topology_version`.
    pub triangles: &'a [[u32; 3]],
    /// The version of the frame. It grows whenever the body moves.
    pub version: u64,
    /// [`Body::topology_version`](crate::Body::topology_version) at the time of the frame.
    pub topology_version: u64,
    /// The number of steps that the world had taken.
    pub step: u64,
    /// The simulated time, s.
    pub time: f64,
    /// True if this reader reads the frame for the first time.
    pub is_new: bool,
    /// True if the body or its world was destroyed: this is the last frame.
    pub is_over: bool,
}

impl BodyReader {
    /// The latest frame. It does not change until the next call.
    ///
    /// The call copies, allocates and locks nothing and never waits. Without a later frame it returns the same one
    /// again.
    pub fn read(&mut self) -> Frame<'_> {
        // This comes first: after the end nothing changes any more.
        let is_over = self.reader.is_over();
        let is_new = self.reader.take() || !self.has_read;
        self.has_read = true;
        let snapshot = self.reader.get();
        Frame {
            positions: &snapshot.positions,
            triangles: &snapshot.triangles,
            version: self.reader.version(),
            topology_version: snapshot.topology_version,
            step: snapshot.clock.step,
            time: snapshot.clock.time,
            is_new,
            is_over,
        }
    }
}

/// The number of steps of a world, and the simulated time, s.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Clock {
    pub step: u64,
    pub time: f64,
}

saved! { Clock { step, time } }

impl Clock {
    pub fn tick(&mut self, dt: f32) {
        self.step += 1;
        self.time += f64::from(dt);
    }

    /// The mean step length, s; `None` before the first step.
    pub fn mean_step(&self) -> Option<f32> {
        (self.step > 0).then(|| (self.time / self.step as f64) as f32)
    }
}

/// A buffer of published state.
#[derive(Debug)]
struct Snapshot {
    /// Has room for all spare nodes too.
    positions: Vec<Vec3>,
    triangles: Arc<Vec<[u32; 3]>>,
    topology_version: u64,
    clock: Clock,
}

impl Snapshot {
    fn new(room: usize, triangles: &Arc<Vec<[u32; 3]>>) -> Result<Self> {
        let mut positions = memory::filled(Vec3::ZERO, room)?;
        positions.clear();
        Ok(Self {
            positions,
            triangles: Arc::clone(triangles),
            topology_version: 0,
            clock: Clock::default(),
        })
    }
}

/// The buffers that a body publishes to its readers. They exist from the first reader on.
#[derive(Debug)]
pub(crate) struct Shown {
    writer: PoolWriter<Snapshot>,
    triangles: TriangleLists,
    pub clock: Clock,
    /// The topology version published last.
    topology_version: u64,
    /// True if the body has moved without being published.
    is_behind: bool,
}

/// The state of a body to be published.
#[derive(Clone, Copy)]
pub(crate) struct View<'a> {
    pub positions: &'a [Vec3],
    pub triangles: &'a [[u32; 3]],
    pub topology_version: u64,
}

impl Shown {
    /// Buffers for a body with these triangles, and room for `room` nodes.
    pub fn new(room: usize, triangles: &[[u32; 3]]) -> Result<Self> {
        let triangles = TriangleLists::new(triangles)?;
        let snapshot = || Snapshot::new(room, triangles.current());
        Ok(Self {
            writer: PoolWriter::new(MAX_READERS, [snapshot()?, snapshot()?])?,
            triangles,
            clock: Clock::default(),
            topology_version: 0,
            is_behind: true,
        })
    }

    pub fn create_reader(&mut self, room: usize, view: View) -> Result<BodyReader> {
        let triangles = self.triangles.current();
        let reader = self.writer.add_reader(|| Snapshot::new(room, triangles))?;
        self.triangles.reserve_lists(self.writer.buffer_count())?;
        let reader =
            reader.ok_or_else(|| Error::Capacity(format!("the body has {MAX_READERS} readers: no more can be")))?;
        if self.triangles.are_old {
            self.triangles.reserve(view.triangles.len())?;
        }
        if self.is_behind {
            self.show(view, &Team::alone());
        }
        Ok(BodyReader {
            reader,
            has_read: false,
        })
    }

    /// Reserves room for `count` triangles, to be published next.
    pub fn reserve_triangles(&mut self, count: usize) -> Result<()> {
        if self.writer.reader_count() == 0 {
            return Ok(());
        }
        self.triangles.reserve(count)
    }

    /// Marks the published triangles as outdated.
    pub fn forget_triangles(&mut self) {
        self.triangles.are_old = true;
    }

    pub fn topology_version(&self) -> u64 {
        self.topology_version
    }

    /// Publishes the current state of the body, if it has readers.
    pub fn show(&mut self, view: View, team: &Team) {
        self.is_behind = self.writer.reader_count() == 0;
        if self.is_behind {
            return;
        }
        let View {
            positions,
            topology_version,
            ..
        } = view;
        self.triangles.renew(view.triangles);
        let triangles = self.triangles.current();
        let clock = self.clock;
        self.writer.write(|snapshot| {
            let count = positions.len();
            // Never beyond the reserved room.
            snapshot.positions.resize(count, Vec3::ZERO);
            let parts = Tiles::new(&mut snapshot.positions, TILE);
            team.pass(tile_count(count), parts, |tile, to| {
                to.copy_from_slice(&positions[tile_nodes(tile, count)]);
            });
            if !Arc::ptr_eq(&snapshot.triangles, triangles) {
                snapshot.triangles = Arc::clone(triangles);
            }
            snapshot.topology_version = topology_version;
            snapshot.clock = clock;
        });
        self.topology_version = topology_version;
    }
}

/// Lists of triangles shared by snapshots: one more than there are snapshots. A list is reused once no snapshot has it,
/// so that a step frees none.
#[derive(Debug)]
struct TriangleLists {
    lists: Vec<Arc<Vec<[u32; 3]>>>,
    current: usize,
    are_old: bool,
}

impl TriangleLists {
    fn new(triangles: &[[u32; 3]]) -> Result<Self> {
        let mut lists = Vec::new();
        memory::push(&mut lists, Arc::new(memory::copied(triangles)?))?;
        Ok(Self {
            lists,
            current: 0,
            are_old: false,
        })
    }

    fn current(&self) -> &Arc<Vec<[u32; 3]>> {
        &self.lists[self.current]
    }

    /// The lists that no snapshot has, with their indices.
    fn unused(&mut self) -> impl Iterator<Item = (usize, &mut Vec<[u32; 3]>)> {
        let lists = self.lists.iter_mut().enumerate();
        let current = self.current;
        lists.filter_map(move |(index, list)| (index != current).then_some(index).zip(Arc::get_mut(list)))
    }

    /// Creates lists for `snapshots` snapshots.
    fn reserve_lists(&mut self, snapshots: usize) -> Result<()> {
        while self.lists.len() <= snapshots {
            memory::push(&mut self.lists, Arc::new(Vec::new()))?;
        }
        Ok(())
    }

    /// Reserves room for `count` triangles in the next list.
    fn reserve(&mut self, count: usize) -> Result<()> {
        let next = self.unused().next();
        next.map_or(Ok(()), |(_, list)| memory::reserve(list, count))
    }

    /// Copies the triangles to a new current list, if they have changed. Room was reserved.
    fn renew(&mut self, triangles: &[[u32; 3]]) {
        if !self.are_old {
            return;
        }
        let mut unused = self.unused();
        let Some((index, list)) = unused.find(|(_, list)| list.capacity() >= triangles.len()) else {
            return;
        };
        drop(unused);
        list.clear();
        list.extend_from_slice(triangles);
        self.current = index;
        self.are_old = false;
    }
}
