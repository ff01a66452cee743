//! Readers: what a body shows to other threads while its world steps.

use std::sync::Arc;

use glam::Vec3;

use crate::base::{Error, Result, memory};
use crate::codec::saved;
use crate::soa::{TILE, tile_count, tile_nodes};
use crate::sync::pool::{PoolReader, PoolWriter};
use crate::threads::{Team, Tiles};

/// So many readers of one body at a time.
const MOST_READERS: usize = 126;

/// A body as other threads see it: the latest complete positions, without a lock, while its world steps and changes.
///
/// Made by [`World::create_reader`](crate::World::create_reader), and owned by the thread that reads, to which it may be sent. It outlives the body
/// and the world, and ends on any thread.
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

/// What a reader sees of a body: all of one moment.
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
    /// Where each node is, m, in the caller's order, with those that cuts have added: [`Body::positions`](crate::Body::positions).
    pub positions: &'a [Vec3],
    /// The triangles that were drawn then: [`Body::surface`](crate::Body::surface). They change with `topology_version` alone.
    pub triangles: &'a [[u32; 3]],
    /// Above that of earlier frames; the same as long as nothing has moved the body.
    pub version: u64,
    /// [`Body::topology_version`](crate::Body::topology_version) then.
    pub topology_version: u64,
    /// How many steps the world had taken.
    pub step: u64,
    /// The sum of their lengths, s.
    pub time: f64,
    /// Whether this reader did not read this frame before.
    pub is_new: bool,
    /// Whether the body, or its world, is no more: this is its last frame.
    pub is_over: bool,
}

impl BodyReader {
    /// The latest frame, which stays as it is until the next call.
    ///
    /// Nothing is copied, allocated or locked, and nobody waits: it is the same frame again where there is none later.
    pub fn read(&mut self) -> Frame<'_> {
        // First: what is over does not change any more.
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

/// How far a world has come.
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

    /// The mean length of the steps that were taken, s; `None` before the first.
    pub fn mean_step(&self) -> Option<f32> {
        (self.step > 0).then(|| (self.time / self.step as f64) as f32)
    }
}

/// A buffer of a reader's.
#[derive(Debug)]
struct Snapshot {
    /// With room for all that may come.
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

/// What a body keeps for its readers, from the first on.
#[derive(Debug)]
pub(crate) struct Shown {
    writer: PoolWriter<Snapshot>,
    triangles: TriangleLists,
    pub clock: Clock,
    /// What was shown last.
    topology_version: u64,
    /// Whether it moved while nobody read.
    is_behind: bool,
}

/// What is shown of a body.
#[derive(Clone, Copy)]
pub(crate) struct View<'a> {
    pub positions: &'a [Vec3],
    pub triangles: &'a [[u32; 3]],
    pub topology_version: u64,
}

impl Shown {
    /// For a body with these triangles, and room for so many nodes.
    pub fn new(room: usize, triangles: &[[u32; 3]]) -> Result<Self> {
        let triangles = TriangleLists::new(triangles)?;
        let snapshot = || Snapshot::new(room, triangles.current());
        Ok(Self {
            writer: PoolWriter::new(MOST_READERS, [snapshot()?, snapshot()?])?,
            triangles,
            clock: Clock::default(),
            topology_version: 0,
            is_behind: true,
        })
    }

    pub fn create_reader(&mut self, room: usize, view: View) -> Result<BodyReader> {
        let triangles = self.triangles.current();
        let reader = self.writer.add_reader(|| Snapshot::new(room, triangles))?;
        self.triangles.lend_to(self.writer.buffer_count())?;
        let reader =
            reader.ok_or_else(|| Error::Capacity(format!("the body has {MOST_READERS} readers: no more can be")))?;
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

    /// Makes room for so many triangles, which are to be shown next.
    pub fn reserve_triangles(&mut self, count: usize) -> Result<()> {
        if self.writer.reader_count() == 0 {
            return Ok(());
        }
        self.triangles.reserve(count)
    }

    /// There are other triangles than those that were shown last.
    pub fn forget_triangles(&mut self) {
        self.triangles.are_old = true;
    }

    pub fn topology_version(&self) -> u64 {
        self.topology_version
    }

    /// Shows readers the body as it is now; nothing where there are none.
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
            // Within its room.
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

/// Lists of triangles that snapshots share: one more than there are snapshots, each used again when no snapshot has it, so that none ends in a step.
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

    /// The lists that no snapshot has, with their places.
    fn unused(&mut self) -> impl Iterator<Item = (usize, &mut Vec<[u32; 3]>)> {
        let lists = self.lists.iter_mut().enumerate();
        let current = self.current;
        lists.filter_map(move |(place, list)| (place != current).then_some(place).zip(Arc::get_mut(list)))
    }

    /// Makes lists for so many snapshots.
    fn lend_to(&mut self, snapshots: usize) -> Result<()> {
        while self.lists.len() <= snapshots {
            memory::push(&mut self.lists, Arc::new(Vec::new()))?;
        }
        Ok(())
    }

    /// Makes room for so many triangles in the list that is the next.
    fn reserve(&mut self, count: usize) -> Result<()> {
        let next = self.unused().next();
        next.map_or(Ok(()), |(_, list)| memory::reserve(list, count))
    }

    /// Makes the current list this one, if the triangles have changed; there is room.
    fn renew(&mut self, triangles: &[[u32; 3]]) {
        if !self.are_old {
            return;
        }
        let mut unused = self.unused();
        let Some((place, list)) = unused.find(|(_, list)| list.capacity() >= triangles.len()) else {
            return;
        };
        drop(unused);
        list.clear();
        list.extend_from_slice(triangles);
        self.current = place;
        self.are_old = false;
    }
}
