//! Threads of our own: they look for work as long as some comes, and sleep between steps that are far apart.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::{self, JoinHandle};

use super::board::{Apart, Board, Patience};
use super::team::Team;
use crate::base::{Error, Result, memory};

/// What the threads share.
struct Shared {
    board: Board,
    /// For each seat.
    asleep: Vec<Apart<AtomicBool>>,
    /// How many workers have begun.
    begun: AtomicUsize,
    state: Apart<IdleState>,
}

/// Looked at by workers that find nothing to do.
#[derive(Default)]
struct IdleState {
    leading: AtomicBool,
    closing: AtomicBool,
}

/// Threads that end with this.
pub(super) struct Workers {
    shared: Arc<Shared>,
    /// Of all seats but the leader's.
    handles: Vec<JoinHandle<()>>,
}

impl Workers {
    /// `count` threads, of which the caller's is one.
    pub fn start(count: usize) -> Result<Self> {
        let mut asleep = memory::reserved(count)?;
        asleep.resize_with(count, Apart::default);
        let mut workers = Self {
            shared: Arc::new(Shared {
                board: Board::new(count)?,
                asleep,
                begun: AtomicUsize::new(0),
                state: Apart::default(),
            }),
            handles: memory::reserved(count - 1)?,
        };
        for seat in 1..count {
            let shared = Arc::clone(&workers.shared);
            let started = thread::Builder::new()
                .name("sinew".into())
                .spawn(move || shared.work(seat));
            workers.handles.push(started.map_err(|error| {
                Error::Unsupported(format!(
                    "thread_count is {count}: only {seat} could be had, the next was not started: {error}"
                ))
            })?);
        }
        // What the system allocates as a thread begins is not to fall into a step.
        while workers.shared.begun.load(Ordering::Relaxed) < count - 1 {
            thread::yield_now();
        }
        Ok(workers)
    }

    pub fn board(&self) -> &Board {
        &self.shared.board
    }

    pub fn lead<R>(&mut self, lead: impl FnOnce(&Team) -> R) -> R {
        let leading = Leading(&self.shared.state.0.leading);
        leading.0.store(true, Ordering::Relaxed);
        // SAFETY: this is borrowed mutably as long as the team lives.
        lead(&unsafe { Team::of(&self.shared.board, Some(self)) })
    }

    /// Sees to it that the worker of this seat looks for work. One that falls asleep at this very moment may not be seen:
    /// it is woken by the next pass.
    pub fn wake(&self, seat: usize) {
        let asleep = &self.shared.asleep[seat].0;
        if asleep.load(Ordering::Relaxed) && asleep.swap(false, Ordering::Relaxed) {
            self.handles[seat - 1].thread().unpark();
        }
    }
}

impl Drop for Workers {
    fn drop(&mut self) {
        self.shared.state.0.closing.store(true, Ordering::Relaxed);
        for handle in &self.handles {
            handle.thread().unpark();
        }
        for handle in self.handles.drain(..) {
            // A worker does not panic, and its end is all that is wanted.
            drop(handle.join());
        }
    }
}

/// Ends with the step, however that ends.
struct Leading<'a>(&'a AtomicBool);

impl Drop for Leading<'_> {
    fn drop(&mut self) {
        self.0.store(false, Ordering::Relaxed);
    }
}

impl Shared {
    /// What the worker of this seat does in its life.
    fn work(&self, seat: usize) {
        let IdleState { leading, closing } = &self.state.0;
        self.begun.fetch_add(1, Ordering::Relaxed);
        let mut seen = 0;
        let mut patience = Patience::new();
        while !closing.load(Ordering::Relaxed) {
            if self.board.generation(seat) != seen {
                seen = self.board.generation(seat);
                self.board.follow(seat);
                patience = Patience::new();
            } else if patience.ends() {
                if leading.load(Ordering::Relaxed) {
                    thread::yield_now();
                } else {
                    self.sleep(seat, seen);
                    patience = Patience::new();
                }
            }
        }
    }

    fn sleep(&self, seat: usize, seen: u32) {
        let asleep = &self.asleep[seat].0;
        asleep.store(true, Ordering::Relaxed);
        if self.board.generation(seat) == seen {
            thread::park();
        }
        asleep.store(false, Ordering::Relaxed);
    }
}
