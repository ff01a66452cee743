//! Parallel passes of a step.

use std::marker::PhantomData;

use super::dispatcher::Dispatcher;
use super::split::Split;
use super::workers::Workers;

/// Threads that execute a step, from the leader's view. It is neither Send nor Sync, so the work on a tile cannot use
/// it.
pub(crate) struct Team<'a> {
    helpers: Option<(&'a Dispatcher, Option<&'a Workers>)>,
    not_send: PhantomData<*const ()>,
}

impl Team<'static> {
    /// A team of the caller's thread only.
    pub fn alone() -> Self {
        Self {
            helpers: None,
            not_send: PhantomData,
        }
    }
}

impl<'a> Team<'a> {
    /// A team of the leader and the followers of this dispatcher. Sleeping workers are woken for passes.
    ///
    /// # Safety
    /// The dispatcher must have no other team.
    pub(super) unsafe fn with_dispatcher(dispatcher: &'a Dispatcher, workers: Option<&'a Workers>) -> Self {
        Self {
            helpers: Some((dispatcher, workers)),
            not_send: PhantomData,
        }
    }

    /// Maximum number of threads.
    pub fn count(&self) -> usize {
        self.helpers.map_or(1, |(dispatcher, _)| dispatcher.count())
    }

    /// Runs `work` once for every tile below `tiles` with that tile's part of `data`, on any thread and in any order.
    /// Returns when all tiles are done. A single tile runs on the leader without overhead.
    ///
    /// Distribution takes about half a microsecond, and more if threads sleep. A tile should take longer than that.
    ///
    /// # Panics
    /// If `data` does not have one part per tile, or if `work` panics.
    pub fn pass<D: Split>(&self, tiles: usize, data: D, work: impl Fn(usize, D::Part) + Sync) {
        assert!(data.fits(tiles), "the data of a pass has not {tiles} parts");
        assert!(tiles <= u32::MAX as usize, "a pass has {tiles} tiles");
        let run = |tile| {
            // SAFETY: the tile is within the parts, and each part is requested once.
            work(tile, unsafe { data.part(tile) });
        };
        match self.helpers {
            Some((dispatcher, workers)) if tiles > 1 => {
                let wake = |thread_index| {
                    if let Some(workers) = workers {
                        workers.wake(thread_index);
                    }
                };
                // SAFETY: `run` cannot use this team, and there is no other one.
                unsafe { dispatcher.lead(tiles, &run, wake) };
            }
            _ => (0..tiles).for_each(run),
        }
    }
}
