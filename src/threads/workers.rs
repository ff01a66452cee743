//! The library's own threads. They spin while there is work, and sleep between steps that are far apart.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::{self, JoinHandle};

use super::dispatcher::{CachePadded, Dispatcher, SpinWait};
use super::team::Team;
use crate::base::{Error, Result, memory};

/// State that all workers share.
struct Shared {
    dispatcher: Dispatcher,
    /// One flag per thread.
    asleep: Vec<CachePadded<AtomicBool>>,
    /// Number of workers that have started.
    started: AtomicUsize,
    state: CachePadded<IdleState>,
}

/// State that idle workers poll.
#[derive(Default)]
struct IdleState {
    leading: AtomicBool,
    closing: AtomicBool,
}

/// Worker threads, joined when dropped.
pub(super) struct Workers {
    shared: Arc<Shared>,
    /// Handles of all threads except the leader's.
    handles: Vec<JoinHandle<()>>,
}

impl Workers {
    /// Starts `count - 1` threads; the caller's is one more.
    pub fn start(count: usize) -> Result<Self> {
        let mut asleep = memory::reserved(count)?;
        asleep.resize_with(count, CachePadded::default);
        let mut workers = Self {
            shared: Arc::new(Shared {
                dispatcher: Dispatcher::new(count)?,
                asleep,
                started: AtomicUsize::new(0),
                state: CachePadded::default(),
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
        // Allocations of a starting thread must not fall into a step.
        while workers.shared.started.load(Ordering::Relaxed) < count - 1 {
            thread::yield_now();
        }
        Ok(workers)
    }

    pub fn dispatcher(&self) -> &Dispatcher {
        &self.shared.dispatcher
    }

    pub fn lead<R>(&mut self, lead: impl FnOnce(&Team) -> R) -> R {
        let leading = LeadingGuard(&self.shared.state.0.leading);
        leading.0.store(true, Ordering::Relaxed);
        // SAFETY: `self` is borrowed mutably while the team exists.
        lead(&unsafe { Team::with_dispatcher(&self.shared.dispatcher, Some(self)) })
    }

    /// Wakes the worker of this index if it sleeps. A worker that falls asleep at the same time may be missed; the next
    /// pass wakes it.
    pub fn wake(&self, thread_index: usize) {
        let asleep = &self.shared.asleep[thread_index].0;
        if asleep.load(Ordering::Relaxed) && asleep.swap(false, Ordering::Relaxed) {
            self.handles[thread_index - 1].thread().unpark();
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
            // Workers do not panic, so the result is irrelevant.
            drop(handle.join());
        }
    }
}

/// Clears the flag when the step ends, even by a panic.
struct LeadingGuard<'a>(&'a AtomicBool);

impl Drop for LeadingGuard<'_> {
    fn drop(&mut self) {
        self.0.store(false, Ordering::Relaxed);
    }
}

impl Shared {
    /// Main loop of a worker.
    fn work(&self, thread_index: usize) {
        let IdleState { leading, closing } = &self.state.0;
        self.started.fetch_add(1, Ordering::Relaxed);
        let mut last_generation = 0;
        let mut wait = SpinWait::new();
        while !closing.load(Ordering::Relaxed) {
            if self.dispatcher.generation(thread_index) != last_generation {
                last_generation = self.dispatcher.generation(thread_index);
                self.dispatcher.follow(thread_index);
                wait = SpinWait::new();
            } else if wait.is_over() {
                if leading.load(Ordering::Relaxed) {
                    thread::yield_now();
                } else {
                    self.sleep(thread_index, last_generation);
                    wait = SpinWait::new();
                }
            }
        }
    }

    fn sleep(&self, thread_index: usize, last_generation: u32) {
        let asleep = &self.asleep[thread_index].0;
        asleep.store(true, Ordering::Relaxed);
        if self.dispatcher.generation(thread_index) == last_generation {
            thread::park();
        }
        asleep.store(false, Ordering::Relaxed);
    }
}
