//! Where a pass is put up, and its tiles are claimed.
//!
//! Every thread has a lane, a range of the tiles that is the same in every pass of as many tiles, so that what a tile
//! touches stays in the cache of one core. Who is through with its own lane goes on with the others'.
//!
//! A lane is one word: how many of its tiles are left. Claiming one takes one off, and only then is the pass looked at:
//! it cannot end before that tile is finished. A thread that comes late therefore finds nothing left and touches
//! nothing, or takes part in whatever pass is there.

use std::any::Any;
use std::cell::UnsafeCell;
use std::hint::spin_loop;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use crate::base::{Result, memory};

/// How long a thread looks for work before it lets others have its core.
const HOT: Duration = Duration::from_micros(50);

/// Something that no other thread's writing slows down: two lines of cache, as processors fetch them in pairs.
#[derive(Default)]
#[repr(align(128))]
pub(super) struct Apart<T>(pub T);

/// A pass that is going on.
#[derive(Clone, Copy)]
struct BoardPass {
    tiles: usize,
    /// It lives as long as the pass.
    run: &'static (dyn Fn(usize) + Sync),
}

/// What threads meet at.
pub(super) struct Board {
    lanes: Vec<Apart<Lane>>,
    /// Written by the leader while no tile is left in any lane and none is being worked on; read by who has claimed one.
    pass: Apart<UnsafeCell<BoardPass>>,
    /// Which pass it is; the leader's alone.
    generation: AtomicU32,
    /// Tiles of this pass that followers have finished.
    finished: Apart<AtomicUsize>,
    panicked: AtomicBool,
    /// The first panic of a pass. Locked in a panic alone.
    panic: Mutex<Option<Box<dyn Any + Send>>>,
}

// SAFETY: `pass` alone is not Sync. It is written by the leader, one thread at a time, before it puts tiles into lanes
// (release), read by those who have claimed one (acquire), and written again when all of them have reported (release) to
// the leader (acquire).
unsafe impl Sync for Board {}
// SAFETY: what `pass` refers to is Sync.
unsafe impl Send for Board {}

impl Board {
    /// For so many threads.
    pub fn new(count: usize) -> Result<Self> {
        let mut lanes = memory::reserved(count)?;
        lanes.resize_with(count, Apart::default);
        Ok(Self {
            lanes,
            pass: Apart(UnsafeCell::new(BoardPass { tiles: 0, run: &|_| {} })),
            generation: AtomicU32::new(0),
            finished: Apart::default(),
            panicked: AtomicBool::new(false),
            panic: Mutex::new(None),
        })
    }

    pub fn count(&self) -> usize {
        self.lanes.len()
    }

    /// The last pass that left something to do for this seat.
    pub fn generation(&self, seat: usize) -> u32 {
        self.lanes[seat].0.generation()
    }

    /// Runs `run` once for every tile, here and wherever somebody helps; `call` is told the seats there is work for.
    /// Where `run` panics, tiles that nobody has begun are called off, and the panic goes on here when all is quiet.
    ///
    /// # Safety
    /// One thread at a time, and not from within `run`.
    pub unsafe fn lead(&self, tiles: usize, run: &(dyn Fn(usize) + Sync), call: impl Fn(usize)) {
        // SAFETY: the lifetime alone changes. This function returns only after every claimed tile is finished and none
        // is left to claim, and nobody uses `run` but for a tile that it has claimed.
        let run = unsafe { std::mem::transmute::<&(dyn Fn(usize) + Sync), &'static (dyn Fn(usize) + Sync)>(run) };
        let pass = BoardPass { tiles, run };
        // SAFETY: no tile is left in any lane, so that nobody reads this.
        unsafe { *self.pass.0.get() = pass };
        self.finished.0.store(0, Ordering::Relaxed);
        let generation = self.generation.load(Ordering::Relaxed).wrapping_add(1);
        self.generation.store(generation, Ordering::Relaxed);
        for seat in (0..self.count()).rev() {
            let (start, end) = (self.lane_start(tiles, seat), self.lane_start(tiles, seat + 1));
            if start < end {
                self.lanes[seat].0.fill(generation, (end - start) as u32);
                if seat > 0 {
                    call(seat);
                }
            }
        }
        let others = tiles - self.work(0);
        let mut patience = Patience::new();
        while self.finished.0.load(Ordering::Acquire) < others {
            if patience.ends() {
                thread::yield_now();
            }
        }
        if self.panicked.load(Ordering::Relaxed) {
            self.panicked.store(false, Ordering::Relaxed);
            let panic = self.panic.lock().unwrap_or_else(PoisonError::into_inner).take();
            if let Some(panic) = panic {
                resume_unwind(panic);
            }
        }
    }

    /// Helps with the pass that is going on, where there is one. Does not panic.
    pub fn follow(&self, seat: usize) {
        let finished = self.work(seat);
        if finished > 0 {
            self.finished.0.fetch_add(finished, Ordering::Release);
        }
    }

    /// Works until no tile is left: how many are finished or called off.
    fn work(&self, seat: usize) -> usize {
        let mut finished = 0;
        for lane in (seat..self.count()).chain(0..seat) {
            while let Some(left) = self.lanes[lane].0.claim() {
                // SAFETY: a tile is claimed and not finished, so that the pass cannot end, and was written before the
                // lane was filled.
                let BoardPass { tiles, run } = unsafe { *self.pass.0.get() };
                let tile = self.lane_start(tiles, lane + 1) - left as usize;
                // What a panic leaves half done is looked at by nobody: the leader panics too.
                if let Err(panic) = catch_unwind(AssertUnwindSafe(|| run(tile))) {
                    self.panic
                        .lock()
                        .unwrap_or_else(PoisonError::into_inner)
                        .get_or_insert(panic);
                    self.panicked.store(true, Ordering::Relaxed);
                    finished += self.lanes.iter().map(|lane| lane.0.clear()).sum::<usize>();
                }
                finished += 1;
            }
        }
        finished
    }

    /// The first tile of a lane. Where there are fewer tiles than lanes, the first lanes have one each.
    fn lane_start(&self, tiles: usize, lane: usize) -> usize {
        let lanes = self.count().min(tiles);
        (tiles * lane.min(lanes)).div_ceil(lanes)
    }
}

/// Tiles that are left, low, and the pass they belong to, high: a thread that looks for work sees by it that there is
/// some, or was.
#[derive(Default)]
struct Lane(AtomicU64);

impl Lane {
    fn generation(&self) -> u32 {
        (self.0.load(Ordering::Relaxed) >> 32) as u32
    }

    fn fill(&self, generation: u32, tiles: u32) {
        let word = u64::from(generation) << 32 | u64::from(tiles);
        self.0.store(word, Ordering::Release);
    }

    /// Takes a tile: how many were left with it.
    fn claim(&self) -> Option<u32> {
        let one_less = |word: u64| (word as u32 > 0).then(|| word - 1);
        let word = self.0.fetch_update(Ordering::Acquire, Ordering::Relaxed, one_less);
        word.ok().map(|word| word as u32)
    }

    /// Takes all tiles: how many.
    fn clear(&self) -> usize {
        let word = self.0.fetch_and(!u64::from(u32::MAX), Ordering::Acquire);
        word as u32 as usize
    }
}

/// Waiting for something that should come soon.
pub(super) struct Patience {
    spins: u32,
    since: Option<Instant>,
}

impl Patience {
    pub fn new() -> Self {
        Self { spins: 0, since: None }
    }

    /// Waits a little; whether it was long in all. Looking at the clock takes longer than looking for work.
    pub fn ends(&mut self) -> bool {
        spin_loop();
        self.spins = self.spins.wrapping_add(1);
        self.spins.is_multiple_of(64) && self.since.get_or_insert_with(Instant::now).elapsed() > HOT
    }
}
