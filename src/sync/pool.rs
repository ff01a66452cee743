//! From one thread to any number of others: the latest complete value, in two buffers more than there are readers.
//!
//! The writer announces each version in one word, with the buffer it is in. A buffer's own word has its version too, and how many readers hold it. A
//! reader claims the buffer by exchanging that word for one with a claim more, which fails unless the buffer still holds just what was announced.
//! The writer takes a buffer that is neither claimed nor the latest by exchanging its word for 0, which is no version that anybody looks for.
//!
//! While the writer looks for such a buffer, a reader keeps it from one at most: the one that it holds, or, where it held none, one whose
//! announcement it heard before; what it claims after that is the latest. So one is always free, and the writer, which goes past each once, is
//! wait-free. A reader tries again only when another reader came or went, or there is a later version: it is lock-free.

// Buffers that threads share; each access has its reason.
#![allow(unsafe_code)]

use std::collections::TryReserveError;
use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;

use super::sync::{ANNOUNCE, AtomicU64, LET_GO, LISTEN, TAKE_BACK, TELL_BEFORE_LOOKING, UnsafeCell, fence};

/// Words have a version above these bits; in a buffer's they count claims.
const VERSION: u32 = 16;
const CLAIMS: u64 = (1 << VERSION) - 1;
/// In the word that is announced: there is nobody to write any more,
const OVER: u64 = 1 << (VERSION - 1);
/// and which buffer it is.
const WHICH: u64 = OVER - 1;

#[derive(Debug)]
struct Buffer<T> {
    word: AtomicU64,
    /// `None` while there are not so many readers.
    content: UnsafeCell<Option<T>>,
}

#[derive(Debug)]
struct PoolShared<T> {
    latest: AtomicU64,
    buffers: Vec<Buffer<T>>,
}

// SAFETY: a buffer is read by those who claimed it, and written by the one writer while its word says that nobody can.
unsafe impl<T: Send + Sync> Sync for PoolShared<T> {}
// SAFETY: it owns what it holds.
unsafe impl<T: Send> Send for PoolShared<T> {}

/// The writing side; its end is told.
#[derive(Debug)]
pub(crate) struct PoolWriter<T> {
    shared: Arc<PoolShared<T>>,
    /// The version and the buffer that are the latest.
    version: u64,
    latest: usize,
    /// How many buffers have a content.
    filled: usize,
}

/// A reading side, which always holds a buffer.
#[derive(Debug)]
pub(crate) struct PoolReader<T> {
    shared: Arc<PoolShared<T>>,
    version: u64,
    own: usize,
}

impl<T: Send + Sync> PoolWriter<T> {
    /// A pool for so many readers at most, which has none yet. The first of these values is version 1.
    pub fn new(most_readers: usize, contents: [T; 2]) -> Result<Self, TryReserveError> {
        let count = most_readers + 2;
        debug_assert!(count as u64 <= WHICH);
        let mut buffers = Vec::new();
        buffers.try_reserve_exact(count)?;
        let mut contents = contents.into_iter();
        buffers.extend((0..count as u64).map(|index| Buffer {
            word: AtomicU64::new(u64::from(index == 0) << VERSION),
            content: UnsafeCell::new(contents.next()),
        }));
        Ok(Self {
            shared: Arc::new(PoolShared {
                latest: AtomicU64::new(1 << VERSION),
                buffers,
            }),
            version: 1,
            latest: 0,
            filled: 2,
        })
    }

    /// How many readers there are: at most so many, if none is added.
    pub fn reader_count(&self) -> usize {
        Arc::strong_count(&self.shared) - 1
    }

    /// How many buffers it has.
    pub fn buffer_count(&self) -> usize {
        self.filled
    }

    /// A reader more, which holds the latest, with one more buffer if it needs one; `None` where there are as many as can be.
    pub fn add_reader<E>(&mut self, make: impl FnOnce() -> Result<T, E>) -> Result<Option<PoolReader<T>>, E> {
        let needed = self.reader_count() + 3;
        if needed > self.shared.buffers.len() {
            return Ok(None);
        }
        if needed > self.filled {
            let content = make()?;
            self.shared.buffers[self.filled].content.with_mut(|place| {
                // SAFETY: no buffer beyond those filled was ever announced, and nobody else writes.
                unsafe { *place = Some(content) }
            });
            self.filled += 1;
        }
        // It cannot change: this is the writer.
        self.shared.buffers[self.latest].word.fetch_add(1, Relaxed);
        Ok(Some(PoolReader {
            shared: Arc::clone(&self.shared),
            version: self.version,
            own: self.latest,
        }))
    }

    /// Writes over what an earlier call wrote, and makes it the latest. Answers whether there was a buffer, which there always is.
    pub fn write(&mut self, write: impl FnOnce(&mut T)) -> bool {
        // What was announced last is known to those who let go of buffers from here on.
        fence(TELL_BEFORE_LOOKING);
        for (index, buffer) in self.shared.buffers[..self.filled].iter().enumerate() {
            // The version is the writer's own; claims come and go.
            let unclaimed = buffer.word.load(Relaxed) & !CLAIMS;
            let is_free = || buffer.word.compare_exchange(unclaimed, 0, TAKE_BACK, Relaxed).is_ok();
            if index != self.latest && is_free() {
                buffer.content.with_mut(|content| {
                    // SAFETY: it was unclaimed, and cannot be claimed with version 0, which is never announced.
                    if let Some(content) = unsafe { &mut *content } {
                        write(content);
                    }
                });
                self.version += 1;
                self.latest = index;
                buffer.word.store(self.version << VERSION, Relaxed);
                self.shared
                    .latest
                    .store(self.version << VERSION | index as u64, ANNOUNCE);
                return true;
            }
        }
        false
    }
}

impl<T> Drop for PoolWriter<T> {
    fn drop(&mut self) {
        self.shared.latest.fetch_or(OVER, ANNOUNCE);
    }
}

impl<T> PoolReader<T> {
    /// Lets go of what it holds for the latest, if there is a later one: whether there is.
    pub fn take(&mut self) -> bool {
        let shared = &*self.shared;
        if shared.latest.load(LISTEN) >> VERSION == self.version {
            return false;
        }
        shared.buffers[self.own].word.fetch_sub(1, LET_GO);
        // The writer sees that, or this reader what the writer announced before it looked.
        fence(TELL_BEFORE_LOOKING);
        (self.version, self.own) = shared.claim();
        true
    }

    /// What it holds.
    pub fn get(&self) -> &T {
        let buffer = &self.shared.buffers[self.own];
        let content = buffer.content.with(|content| {
            // SAFETY: it is claimed until `take`, which needs `self` to be borrowed by nobody.
            unsafe { &*content }
        });
        content.as_ref().expect("what was announced has a content")
    }

    /// Its version: 1 of what the pool began with, one more of each that was written since.
    pub fn version(&self) -> u64 {
        self.version
    }

    /// Whether there is nobody to write any more.
    pub fn is_over(&self) -> bool {
        self.shared.latest.load(LISTEN) & OVER != 0
    }
}

impl<T> Drop for PoolReader<T> {
    fn drop(&mut self) {
        self.shared.buffers[self.own].word.fetch_sub(1, LET_GO);
    }
}

impl<T> PoolShared<T> {
    /// Claims the latest: its version, and where it is.
    fn claim(&self) -> (u64, usize) {
        loop {
            let latest = self.latest.load(LISTEN);
            let (version, index) = (latest >> VERSION, (latest & WHICH) as usize);
            let word = &self.buffers[index].word;
            let mut expected = version << VERSION;
            while expected >> VERSION == version {
                match word.compare_exchange(expected, expected + 1, Relaxed, LISTEN) {
                    Ok(_) => return (version, index),
                    Err(found) => expected = found,
                }
            }
        }
    }
}
