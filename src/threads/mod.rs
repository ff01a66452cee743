//! Threads of a world, and parallel passes.
//!
//! A step is one [`Threads::lead`]. The leader runs the step, and the other threads help with each [`Team::pass`]. A
//! step must neither allocate nor lock, which general-purpose thread pools do not guarantee. A pass over tiles needs
//! only one counter per thread.
//!
//! The thread that processes a tile is arbitrary, but the work on a tile is not. It has exclusive access to its own
//! part of the data and shared access to data that do not change. Therefore results do not depend on the number of
//! threads.
#![allow(unsafe_code)]

mod dispatcher;
mod split;
mod tasks;
mod team;
#[cfg(test)]
mod tests;
mod workers;

use std::fmt;

pub(crate) use split::{Items, Ragged, Tiles};
pub use tasks::RunTasks;
pub(crate) use team::Team;

use crate::base::{Error, Result, memory};
use tasks::Tasks;
use workers::Workers;

/// Maximum number of threads of a world.
const MAX_THREADS: u32 = 256;

/// Threads of a world, including the caller's.
#[derive(Default)]
pub(crate) struct Threads(Helpers);

/// Helpers of the leader.
#[derive(Default)]
enum Helpers {
    #[default]
    Nobody,
    Workers(Workers),
    Tasks(Box<Tasks>),
}

impl Threads {
    /// Creates `count` threads; 0: one per core. One of them is the caller's. The others are started here and sleep.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: more than 256. [`Error::Unsupported`]: a thread could not be started.
    /// [`Error::OutOfMemory`].
    pub fn new(count: u32) -> Result<Self> {
        Ok(Self(match resolved(count)? {
            1 => Helpers::Nobody,
            count => Helpers::Workers(Workers::start(count)?),
        }))
    }

    /// Uses the threads of the caller's job system, with `count` tasks per step; 0: one per core. A single task is
    /// never submitted.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: more than 256. [`Error::OutOfMemory`].
    pub fn with_tasks(run_tasks: RunTasks, count: u32) -> Result<Self> {
        Ok(Self(match resolved(count)? {
            1 => Helpers::Nobody,
            count => Helpers::Tasks(memory::boxed(Tasks::new(run_tasks, count)?)?),
        }))
    }

    /// Maximum number of threads that take part.
    pub fn count(&self) -> usize {
        match &self.0 {
            Helpers::Nobody => 1,
            Helpers::Workers(workers) => workers.dispatcher().count(),
            Helpers::Tasks(tasks) => tasks.count(),
        }
    }

    /// Runs `lead` once, on this thread or on one of the job system. The others help with its passes.
    pub fn lead<R: Send>(&mut self, lead: impl FnOnce(&Team) -> R + Send) -> R {
        match &mut self.0 {
            Helpers::Nobody => lead(&Team::alone()),
            Helpers::Workers(workers) => workers.lead(lead),
            Helpers::Tasks(tasks) => tasks.lead(lead),
        }
    }
}

impl fmt::Debug for Threads {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let who = match &self.0 {
            Helpers::Nobody => "Nobody",
            Helpers::Workers(_) => "Workers",
            Helpers::Tasks(_) => "Tasks",
        };
        write!(f, "Threads({who}, {})", self.count())
    }
}

fn resolved(count: u32) -> Result<usize> {
    match count {
        0 => {
            let cores = std::thread::available_parallelism().map_or(1, usize::from);
            Ok(cores.min(MAX_THREADS as usize))
        }
        1..=MAX_THREADS => Ok(count as usize),
        _ => Err(Error::invalid(format!(
            "thread_count is {count}: at most {MAX_THREADS}, 0: one per core"
        ))),
    }
}
