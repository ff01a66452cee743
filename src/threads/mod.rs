//! Threads that share the tiles of a pass.
//!
//! A world steps on the caller's thread, the leader. Its passes over a body's tiles are shared with followers: threads
//! of its own, or tasks of the caller's job system. Tiles are claimed one by one; which thread works on a tile changes
//! nothing in what comes of it, so results are the same for any number of threads. Nothing here allocates or takes a lock
//! in a step. That, and data that is cut into parts for threads to write, is why this room exists, and may hold unsafe
//! code: what thread pools are at hand lock and allocate where work is handed in.
#![allow(unsafe_code)]

mod crew;
mod jobs;
mod split;
#[cfg(test)]
mod tests;

use std::cell::Cell;
use std::sync::Arc;
use std::thread::JoinHandle;

use crew::Crew;
pub use jobs::{JobSystem, RunTasks, Task};
pub(crate) use split::{Each, Ragged, Split, Tiles};

use crate::error::{Error, Result};

/// The most threads that a world may have.
const MOST_THREADS: u32 = 256;

/// The threads of a world.
#[derive(Debug)]
pub(crate) struct Threads {
    crew: Arc<Crew>,
    workers: Vec<JoinHandle<()>>,
    jobs: Option<JobSystem>,
    count: u32,
}

impl Threads {
    /// `count` threads with the caller's own, 0: one per core; or so many tasks of `jobs`.
    pub fn new(count: u32, jobs: Option<JobSystem>) -> Result<Self> {
        if count > MOST_THREADS {
            return Err(Error::invalid(format!(
                "thread_count is {count}: must be at most {MOST_THREADS}"
            )));
        }
        let count = match count {
            0 => std::thread::available_parallelism()
                .map_or(1, |cores| cores.get() as u32)
                .min(MOST_THREADS),
            count => count,
        };
        let mut threads = Self {
            crew: Arc::new(Crew::new()),
            workers: Vec::new(),
            jobs,
            count,
        };
        if threads.jobs.is_none() {
            for _ in 1..count {
                let crew = Arc::clone(&threads.crew);
                let worker = std::thread::Builder::new()
                    .name("sinew".into())
                    .spawn(move || crew.follow())
                    .map_err(|error| Error::Unsupported(format!("thread_count is {count}: {error}")))?;
                threads.workers.push(worker);
            }
        }
        Ok(threads)
    }

    /// Runs `work` with a team that shares its passes.
    pub fn lead<R: Send>(&mut self, work: impl FnOnce(&Team) -> R + Send) -> R {
        if self.count == 1 {
            return work(&Team::alone());
        }
        let crew = &*self.crew;
        match &self.jobs {
            Some(jobs) => jobs.lead(crew, self.count, work),
            None => {
                let team = Team {
                    crew: Some(crew),
                    workers: &self.workers,
                    called: Cell::new(false),
                };
                let dismissal = Dismissal(crew);
                let result = work(&team);
                drop(dismissal);
                result
            }
        }
    }
}

/// Lets the followers rest, also when the work panics.
struct Dismissal<'a>(&'a Crew);

impl Drop for Dismissal<'_> {
    fn drop(&mut self) {
        self.0.dismiss();
    }
}

impl Drop for Threads {
    fn drop(&mut self) {
        self.crew.close(&self.workers);
        for worker in self.workers.drain(..) {
            // A worker catches what panics; there is nothing to hear from it.
            let _ = worker.join();
        }
    }
}

/// The leader's hold on those who share its passes.
#[derive(Debug)]
pub(crate) struct Team<'a> {
    crew: Option<&'a Crew>,
    workers: &'a [JoinHandle<()>],
    /// Whether the workers have been called together.
    called: Cell<bool>,
}

impl Team<'_> {
    /// The caller's thread alone.
    pub fn alone() -> Self {
        Self {
            crew: None,
            workers: &[],
            called: Cell::new(false),
        }
    }

    /// Runs `work` for every tile with its part of `data`, and returns when all are done. A panic in it is passed on.
    pub fn pass<D: Split>(&self, tiles: usize, data: D, work: impl Fn(usize, D::Part) + Sync) {
        data.check(tiles);
        let take = |tile: usize| {
            // SAFETY: `check` has seen that there are so many parts, and each is taken once.
            work(tile, unsafe { data.part(tile) });
        };
        match self.crew {
            Some(crew) if tiles > 1 => {
                if !self.called.replace(true) {
                    crew.call(self.workers);
                }
                crew.share(tiles, &take);
            }
            _ => (0..tiles).for_each(take),
        }
    }
}
