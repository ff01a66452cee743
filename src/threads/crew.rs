//! How the tiles of a pass are claimed, and how followers wait for the next.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicPtr, AtomicU64, AtomicUsize, Ordering};
use std::thread::{JoinHandle, park, yield_now};
use std::time::{Duration, Instant};

/// How long a follower waits for the next step before it sleeps: waking it takes about as long.
const PATIENCE: Duration = Duration::from_micros(50);

/// How often a follower looks for work before it lets others have the processor for a moment.
const LOOKS: u32 = 256;

/// Bits of a ticket for the number of tiles, and for the next one.
const TILE_BITS: u32 = 26;
const TILE_MASK: u64 = (1 << TILE_BITS) - 1;

/// What leader and followers share.
#[derive(Debug)]
pub(super) struct Crew {
    /// The pass, its number of tiles, and the next tile to be claimed.
    ticket: AtomicU64,
    /// The work of the pass; only who has claimed a tile may look at it.
    job: AtomicPtr<Job<'static>>,
    /// Tiles of the pass that are done.
    done: AtomicUsize,
    /// Whether a step is on.
    leading: AtomicBool,
    closing: AtomicBool,
    /// Whether some follower sleeps, or is about to.
    sleepers: AtomicUsize,
    panicked: AtomicBool,
    panic: Mutex<Option<Box<dyn Any + Send>>>,
}

/// The work on one tile.
struct Job<'a> {
    take: &'a (dyn Fn(usize) + Sync),
}

impl Crew {
    pub fn new() -> Self {
        Self {
            ticket: AtomicU64::new(0),
            job: AtomicPtr::new(std::ptr::null_mut()),
            done: AtomicUsize::new(0),
            leading: AtomicBool::new(false),
            closing: AtomicBool::new(false),
            sleepers: AtomicUsize::new(0),
            panicked: AtomicBool::new(false),
            panic: Mutex::new(None),
        }
    }

    /// Runs `take` for every tile, with whoever comes to help.
    pub fn share(&self, tiles: usize, take: &(dyn Fn(usize) + Sync)) {
        assert!((tiles as u64) < TILE_MASK, "{tiles} tiles");
        let mut job = Job { take };
        self.job.store((&raw mut job).cast(), Ordering::Relaxed);
        self.done.store(0, Ordering::Relaxed);
        let pass = (self.ticket.load(Ordering::Relaxed) >> (2 * TILE_BITS)).wrapping_add(1);
        let ticket = pass << (2 * TILE_BITS) | (tiles as u64) << TILE_BITS;
        self.ticket.store(ticket, Ordering::Release);
        while self.help() {}
        // From here on no tile can be claimed; those that others have claimed are waited for.
        let mut looks = 0;
        while self.done.load(Ordering::Acquire) < tiles {
            wait(&mut looks);
        }
        if self.panicked.load(Ordering::Relaxed) {
            self.panicked.store(false, Ordering::Relaxed);
            let payload = self.panic.lock().ok().and_then(|mut panic| panic.take());
            resume_unwind(payload.unwrap_or_else(|| Box::new("a tile panicked")));
        }
    }

    /// Claims a tile and works on it; whether there was one.
    pub fn help(&self) -> bool {
        let mut ticket = self.ticket.load(Ordering::Acquire);
        loop {
            let (tiles, next) = (ticket >> TILE_BITS & TILE_MASK, ticket & TILE_MASK);
            if next == tiles {
                return false;
            }
            match self
                .ticket
                .compare_exchange_weak(ticket, ticket + 1, Ordering::AcqRel, Ordering::Acquire)
            {
                Ok(_) => {
                    self.work(next as usize);
                    return true;
                }
                Err(newer) => ticket = newer,
            }
        }
    }

    /// Works on a tile that was claimed.
    fn work(&self, tile: usize) {
        // SAFETY: the leader waits for the tile that was just claimed before it lets go of the job, and has stored it
        // before the ticket that was claimed from.
        let job = unsafe { &*self.job.load(Ordering::Relaxed) };
        if let Err(payload) = catch_unwind(AssertUnwindSafe(|| (job.take)(tile))) {
            if let Ok(mut panic) = self.panic.lock() {
                panic.get_or_insert(payload);
            }
            self.panicked.store(true, Ordering::Relaxed);
        }
        self.done.fetch_add(1, Ordering::AcqRel);
    }

    /// Lets followers know that there is going to be work, and wakes those that sleep.
    pub fn call(&self, workers: &[JoinHandle<()>]) {
        self.leading.store(true, Ordering::SeqCst);
        if self.sleepers.load(Ordering::SeqCst) > 0 {
            for worker in workers {
                worker.thread().unpark();
            }
        }
    }

    /// Lets followers know that there is no more work for now.
    pub fn dismiss(&self) {
        self.leading.store(false, Ordering::SeqCst);
    }

    /// Whether a step is on.
    pub fn is_leading(&self) -> bool {
        self.leading.load(Ordering::SeqCst)
    }

    /// Sends the workers home.
    pub fn close(&self, workers: &[JoinHandle<()>]) {
        self.closing.store(true, Ordering::SeqCst);
        for worker in workers {
            worker.thread().unpark();
        }
    }

    /// What a worker does all its life.
    pub fn follow(&self) {
        let mut looks = 0;
        let mut idle_since = None;
        while !self.closing.load(Ordering::Relaxed) {
            if self.help() {
                (looks, idle_since) = (0, None);
                continue;
            }
            wait(&mut looks);
            if looks > 0 || self.is_leading() {
                continue;
            }
            let since = *idle_since.get_or_insert_with(Instant::now);
            if since.elapsed() > PATIENCE {
                self.sleep();
                idle_since = None;
            }
        }
    }

    /// Sleeps until called, unless that has happened already.
    fn sleep(&self) {
        self.sleepers.fetch_add(1, Ordering::SeqCst);
        if !self.is_leading() && !self.closing.load(Ordering::SeqCst) {
            park();
        }
        self.sleepers.fetch_sub(1, Ordering::SeqCst);
    }
}

/// Waits a moment; for longer once in [`LOOKS`] times, and begins to count anew.
pub(super) fn wait(looks: &mut u32) {
    *looks += 1;
    if *looks < LOOKS {
        std::hint::spin_loop();
    } else {
        *looks = 0;
        yield_now();
    }
}
