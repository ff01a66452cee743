//! The passes of a step.

use std::marker::PhantomData;

use super::board::Board;
use super::split::Split;
use super::workers::Workers;

/// Those who work on a step together, as its leader sees them. No tile's work can use it: it is neither Send nor Sync.
pub(crate) struct Team<'a> {
    others: Option<(&'a Board, Option<&'a Workers>)>,
    leader_alone: PhantomData<*const ()>,
}

impl Team<'static> {
    /// The caller's thread.
    pub fn alone() -> Self {
        Self {
            others: None,
            leader_alone: PhantomData,
        }
    }
}

impl<'a> Team<'a> {
    /// The leader, and those who follow this board; workers that sleep are woken.
    ///
    /// # Safety
    /// The only team of the board.
    pub(super) unsafe fn of(board: &'a Board, workers: Option<&'a Workers>) -> Self {
        Self {
            others: Some((board, workers)),
            leader_alone: PhantomData,
        }
    }

    /// How many threads it has at most.
    pub fn count(&self) -> usize {
        self.others.map_or(1, |(board, _)| board.count())
    }

    /// Runs `work` once for every tile below `tiles` with that tile's part of `data`, on any thread and in any order;
    /// returns when all are done. One tile is the leader's, and costs nothing more.
    ///
    /// Sharing takes about half a microsecond, and some more where others sleep: a tile should be worth that.
    ///
    /// # Panics
    /// Where `data` has not as many parts as there are tiles, and where `work` panics.
    pub fn pass<D: Split>(&self, tiles: usize, data: D, work: impl Fn(usize, D::Part) + Sync) {
        assert!(data.fits(tiles), "the data of a pass has not {tiles} parts");
        assert!(tiles <= u32::MAX as usize, "a pass has {tiles} tiles");
        let run = |tile| {
            // SAFETY: within the parts there are, and asked for once, whoever calls this.
            work(tile, unsafe { data.part(tile) });
        };
        match self.others {
            Some((board, workers)) if tiles > 1 => {
                let call = |seat| {
                    if let Some(workers) = workers {
                        workers.wake(seat);
                    }
                };
                // SAFETY: `run` cannot share this team, and there is no other.
                unsafe { board.lead(tiles, &run, call) };
            }
            _ => (0..tiles).for_each(run),
        }
    }
}
