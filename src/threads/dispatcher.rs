//! Distribution of a pass's tiles to threads.
//!
//! Each thread has a queue, a range of the tiles. It is the same in every pass with the same number of tiles, so that
//! the data of a tile stay in the cache of one core. A thread that has emptied its own queue continues with those of
//! the others.
//!
//! A queue is one word: the number of tiles left. A thread first claims a tile by decrementing it, and only then reads
//! the pass, which cannot end before that tile is finished. A late thread therefore either finds nothing and touches
//! nothing, or takes part in the current pass.

use std::any::Any;
use std::cell::UnsafeCell;
use std::hint::spin_loop;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use crate::base::{Result, memory};

/// Time for which an idle thread spins before it yields its core.
const SPIN_TIME: Duration = Duration::from_micros(50);

/// Pads a value to two cache lines to avoid false sharing; processors fetch lines in pairs.
#[derive(Default)]
#[repr(align(128))]
pub(super) struct CachePadded<T>(pub T);

/// A pass in progress.
#[derive(Clone, Copy)]
struct DispatchedPass {
    tiles: usize,
    /// Work on a tile. It lives as long as the pass.
    run: &'static (dyn Fn(usize) + Sync),
}

/// State that the threads of a team share.
pub(super) struct Dispatcher {
    queues: Vec<CachePadded<TileQueue>>,
    /// Written by the leader while all queues are empty and no tile is in progress; read by a thread that has claimed a
    /// tile.
    pass: CachePadded<UnsafeCell<DispatchedPass>>,
    /// Number of the pass, used by the leader only.
    generation: AtomicU32,
    /// Number of tiles of this pass that followers have finished.
    finished: CachePadded<AtomicUsize>,
    panicked: AtomicBool,
    /// First panic of a pass. It is locked only during a panic.
    panic: Mutex<Option<Box<dyn Any + Send>>>,
}

// SAFETY: only `pass` is not Sync. The leader, one thread at a time, writes it before it fills the queues (release).
// Threads that have claimed a tile read it (acquire). It is written again after all of them have reported (release) to
// the leader (acquire).
unsafe impl Sync for Dispatcher {}
// SAFETY: the target of `pass` is Sync.
unsafe impl Send for Dispatcher {}

impl Dispatcher {
    /// Creates a dispatcher for `count` threads.
    pub fn new(count: usize) -> Result<Self> {
        let mut queues = memory::reserved(count)?;
        queues.resize_with(count, CachePadded::default);
        Ok(Self {
            queues,
            pass: CachePadded(UnsafeCell::new(DispatchedPass { tiles: 0, run: &|_| {} })),
            generation: AtomicU32::new(0),
            finished: CachePadded::default(),
            panicked: AtomicBool::new(false),
            panic: Mutex::new(None),
        })
    }

    pub fn count(&self) -> usize {
        self.queues.len()
    }

    /// Number of the last pass with tiles in this thread's queue.
    pub fn generation(&self, thread_index: usize) -> u32 {
        self.queues[thread_index].0.generation()
    }

    /// Runs `run` once for each tile, on this thread and on helpers. `wake` is called with the index of each thread
    /// that has tiles. If `run` panics, tiles that are not in progress are canceled, and the panic resumes here after
    /// the others are finished.
    ///
    /// # Safety
    /// Only one thread at a time may call this, and not from within `run`.
    pub unsafe fn lead(&self, tiles: usize, run: &(dyn Fn(usize) + Sync), wake: impl Fn(usize)) {
        // SAFETY: only the lifetime changes. This function returns after every claimed tile is finished and no tile is
        // left, and `run` is used only for claimed tiles.
        let run = unsafe { std::mem::transmute::<&(dyn Fn(usize) + Sync), &'static (dyn Fn(usize) + Sync)>(run) };
        let pass = DispatchedPass { tiles, run };
        // SAFETY: all queues are empty, so no thread reads this.
        unsafe { *self.pass.0.get() = pass };
        self.finished.0.store(0, Ordering::Relaxed);
        let generation = self.generation.load(Ordering::Relaxed).wrapping_add(1);
        self.generation.store(generation, Ordering::Relaxed);
        for thread_index in (0..self.count()).rev() {
            let (start, end) = (
                self.queue_start(tiles, thread_index),
                self.queue_start(tiles, thread_index + 1),
            );
            if start < end {
                self.queues[thread_index].0.fill(generation, (end - start) as u32);
                if thread_index > 0 {
                    wake(thread_index);
                }
            }
        }
        let helpers = tiles - self.work(0);
        let mut wait = SpinWait::new();
        while self.finished.0.load(Ordering::Acquire) < helpers {
            if wait.is_over() {
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

    /// Helps with the current pass, if there is one. Does not panic.
    pub fn follow(&self, thread_index: usize) {
        let finished = self.work(thread_index);
        if finished > 0 {
            self.finished.0.fetch_add(finished, Ordering::Release);
        }
    }

    /// Works until no tile is left. Returns the number of tiles that were finished or canceled.
    fn work(&self, thread_index: usize) -> usize {
        let mut finished = 0;
        for queue in (thread_index..self.count()).chain(0..thread_index) {
            while let Some(left) = self.queues[queue].0.claim() {
                // SAFETY: a tile is claimed but not finished, so the pass cannot end. The pass was written before the
                // queue was filled.
                let DispatchedPass { tiles, run } = unsafe { *self.pass.0.get() };
                let tile = self.queue_start(tiles, queue + 1) - left as usize;
                // Incomplete data are never read, because the leader panics, too.
                if let Err(panic) = catch_unwind(AssertUnwindSafe(|| run(tile))) {
                    self.panic
                        .lock()
                        .unwrap_or_else(PoisonError::into_inner)
                        .get_or_insert(panic);
                    self.panicked.store(true, Ordering::Relaxed);
                    finished += self.queues.iter().map(|queue| queue.0.clear()).sum::<usize>();
                }
                finished += 1;
            }
        }
        finished
    }

    /// First tile of a queue. If there are fewer tiles than queues, the first queues have one each.
    fn queue_start(&self, tiles: usize, queue: usize) -> usize {
        let queues = self.count().min(tiles);
        (tiles * queue.min(queues)).div_ceil(queues)
    }
}

/// Number of tiles left (low half) and number of their pass (high half), by which threads detect new work.
#[derive(Default)]
struct TileQueue(AtomicU64);

impl TileQueue {
    fn generation(&self) -> u32 {
        (self.0.load(Ordering::Relaxed) >> 32) as u32
    }

    fn fill(&self, generation: u32, tiles: u32) {
        let word = u64::from(generation) << 32 | u64::from(tiles);
        self.0.store(word, Ordering::Release);
    }

    /// Claims a tile. Returns the number of tiles left, including this one.
    fn claim(&self) -> Option<u32> {
        let one_less = |word: u64| (word as u32 > 0).then(|| word - 1);
        let word = self.0.fetch_update(Ordering::Acquire, Ordering::Relaxed, one_less);
        word.ok().map(|word| word as u32)
    }

    /// Claims all tiles. Returns their number.
    fn clear(&self) -> usize {
        let word = self.0.fetch_and(!u64::from(u32::MAX), Ordering::Acquire);
        word as u32 as usize
    }
}

/// Spins for a limited time.
pub(super) struct SpinWait {
    spins: u32,
    since: Option<Instant>,
}

impl SpinWait {
    pub fn new() -> Self {
        Self { spins: 0, since: None }
    }

    /// Spins once. Returns true if the time limit is exceeded. Reading the clock is slower than looking for work, so it
    /// is read rarely.
    pub fn is_over(&mut self) -> bool {
        spin_loop();
        self.spins = self.spins.wrapping_add(1);
        self.spins.is_multiple_of(64) && self.since.get_or_insert_with(Instant::now).elapsed() > SPIN_TIME
    }
}
