//! The threads of a world, and the passes they share.
//!
//! A step is one [`Threads::lead`]: the leader runs the step, and whenever it comes to a [`Team::pass`] the others help.
//! A step must neither allocate nor lock, which no pool made for jobs of any kind promises; passes over tiles need no
//! more than a counter for each thread.
//!
//! Which thread works on a tile is left to chance; what a tile's work is, never: it sees its own part of the data alone
//! beside what nobody changes, so results do not depend on the number of threads.
#![allow(unsafe_code)]

mod board;
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

/// The most threads a world can have.
const MAX_THREADS: u32 = 256;

/// The threads of a world, the caller's among them.
#[derive(Default)]
pub(crate) struct Threads(Others);

/// Who helps the leader.
#[derive(Default)]
enum Others {
    #[default]
    Nobody,
    Workers(Workers),
    Tasks(Box<Tasks>),
}

impl Threads {
    /// So many threads, 0: one per core. The caller's is one of them; the others are started here, and sleep.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: more than 256. [`Error::Unsupported`]: a thread could not be started.
    /// [`Error::OutOfMemory`].
    pub fn new(count: u32) -> Result<Self> {
        Ok(Self(match resolved(count)? {
            1 => Others::Nobody,
            count => Others::Workers(Workers::start(count)?),
        }))
    }

    /// The threads of the caller's job system, which is asked for `count` tasks a step, 0: one per core. It is never
    /// asked for one alone.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: more than 256. [`Error::OutOfMemory`].
    pub fn of_tasks(run_tasks: RunTasks, count: u32) -> Result<Self> {
        Ok(Self(match resolved(count)? {
            1 => Others::Nobody,
            count => Others::Tasks(memory::boxed(Tasks::new(run_tasks, count)?)?),
        }))
    }

    /// How many threads take part at most.
    pub fn count(&self) -> usize {
        match &self.0 {
            Others::Nobody => 1,
            Others::Workers(workers) => workers.board().count(),
            Others::Tasks(tasks) => tasks.count(),
        }
    }

    /// Runs `lead` once, on this thread or on one of a job system's; the others help with its passes.
    pub fn lead<R: Send>(&mut self, lead: impl FnOnce(&Team) -> R + Send) -> R {
        match &mut self.0 {
            Others::Nobody => lead(&Team::alone()),
            Others::Workers(workers) => workers.lead(lead),
            Others::Tasks(tasks) => tasks.lead(lead),
        }
    }
}

impl fmt::Debug for Threads {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let who = match &self.0 {
            Others::Nobody => "Nobody",
            Others::Workers(_) => "Workers",
            Others::Tasks(_) => "Tasks",
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
