//! Publishes the latest complete value from one thread to several others, in two more buffers than there are readers.
//!
//! The writer announces each version, with its buffer, in one atomic word. Each buffer has a word with its version and
//! its number of claims. A reader claims a buffer by incrementing the claims in a compare-exchange, which fails unless
//! the buffer still has the announced version. The writer takes a buffer without claims that is not the latest by
//! setting its word to 0, a version that is never announced.
//!
//! While the writer searches, each reader can block at most one buffer: the one that it holds, or one whose
//! announcement it read earlier; a later claim is of the latest buffer. One buffer is therefore always free, and the
//! writer, which visits each once, is wait-free. A reader repeats its claim only after another reader's claim or
//! release, or a later version: it is lock-free.

// Threads share the buffers; each access states its reason.
#![allow(unsafe_code)]

use std::collections::TryReserveError;
use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;

use super::atomics::{ANNOUNCE, AtomicU64, LET_GO, LISTEN, TAKE_BACK, TELL_BEFORE_LOOKING, UnsafeCell, fence};

/// The bits below the version in a word; in a buffer's word they count claims.
const VERSION: u32 = 16;
const CLAIMS: u64 = (1 << VERSION) - 1;
/// In the announced word: the writer was dropped.
const OVER: u64 = 1 << (VERSION - 1);
/// In the announced word: the index of the buffer.
const WHICH: u64 = OVER - 1;

#[derive(Debug)]
struct Buffer<T> {
    word: AtomicU64,
    /// `None` until there are enough readers.
    content: UnsafeCell<Option<T>>,
}

#[derive(Debug)]
struct PoolShared<T> {
    latest: AtomicU64,
    buffers: Vec<Buffer<T>>,
}

// SAFETY: only readers with a claim read a buffer, and only the writer writes one, while its word allows no claim.
unsafe impl<T: Send + Sync> Sync for PoolShared<T> {}
// SAFETY: it owns what it holds.
unsafe impl<T: Send> Send for PoolShared<T> {}

/// The writing side. Readers can see that it was dropped.
#[derive(Debug)]
pub(crate) struct PoolWriter<T> {
    shared: Arc<PoolShared<T>>,
    /// The latest version and its buffer.
    version: u64,
    latest: usize,
    /// The number of buffers with a content.
    filled: usize,
}

/// A reading side. It always holds a claim on a buffer.
#[derive(Debug)]
pub(crate) struct PoolReader<T> {
    shared: Arc<PoolShared<T>>,
    version: u64,
    own: usize,
}

impl<T: Send + Sync> PoolWriter<T> {
    /// A pool for at most `max_readers` readers, without a reader yet. The first value is version 1.
    pub fn new(max_readers: usize, contents: [T; 2]) -> Result<Self, TryReserveError> {
        let count = max_readers + 2;
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

    /// An upper bound on the number of readers; dropping a reader reduces it.
    pub fn reader_count(&self) -> usize {
        Arc::strong_count(&self.shared) - 1
    }

    /// The number of buffers.
    pub fn buffer_count(&self) -> usize {
        self.filled
    }

    /// Adds a reader, and a buffer if it needs one; `None` if the largest number is reached.
    pub fn add_reader<E>(&mut self, make: impl FnOnce() -> Result<T, E>) -> Result<Option<PoolReader<T>>, E> {
        let needed = self.reader_count() + 3;
        if needed > self.shared.buffers.len() {
            return Ok(None);
        }
        if needed > self.filled {
            let content = make()?;
            self.shared.buffers[self.filled].content.with_mut(|slot| {
                // SAFETY: an unfilled buffer was never announced, and there is no other writer.
                unsafe { *slot = Some(content) }
            });
            self.filled += 1;
        }
        // Only this writer changes the latest buffer.
        self.shared.buffers[self.latest].word.fetch_add(1, Relaxed);
        Ok(Some(PoolReader {
            shared: Arc::clone(&self.shared),
            version: self.version,
            own: self.latest,
        }))
    }

    /// Overwrites an old value and makes it the latest. Returns true if a buffer was free, which is always so.
    pub fn write(&mut self, write: impl FnOnce(&mut T)) -> bool {
        // Readers that release a buffer from here on see the last announcement.
        fence(TELL_BEFORE_LOOKING);
        for (index, buffer) in self.shared.buffers[..self.filled].iter().enumerate() {
            // Only the writer changes the version; readers change the claims.
            let unclaimed = buffer.word.load(Relaxed) & !CLAIMS;
            let is_free = || buffer.word.compare_exchange(unclaimed, 0, TAKE_BACK, Relaxed).is_ok();
            if index != self.latest && is_free() {
                buffer.content.with_mut(|content| {
                    // SAFETY: the buffer had no claim, and version 0 is never announced, so that it cannot be claimed.
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
    /// Claims the latest buffer instead of the current one, if it is newer. Returns true if it is.
    pub fn take(&mut self) -> bool {
        let shared = &*self.shared;
        if shared.latest.load(LISTEN) >> VERSION == self.version {
            return false;
        }
        shared.buffers[self.own].word.fetch_sub(1, LET_GO);
        // Either the writer sees the release, or this reader sees the announcement before the writer's search.
        fence(TELL_BEFORE_LOOKING);
        (self.version, self.own) = shared.claim();
        true
    }

    /// The claimed value.
    pub fn get(&self) -> &T {
        let buffer = &self.shared.buffers[self.own];
        let content = buffer.content.with(|content| {
            // SAFETY: the buffer stays claimed until `take`, which borrows `self` mutably.
            unsafe { &*content }
        });
        content.as_ref().expect("what was announced has a content")
    }

    /// The version of the claimed value: 1 for the first, and one more for each write.
    pub fn version(&self) -> u64 {
        self.version
    }

    /// True if the writer was dropped.
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
    /// Claims the latest buffer and returns its version and index.
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
