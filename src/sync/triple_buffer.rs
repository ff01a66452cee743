//! From one thread to one other: three buffers, of which the writer has one, the reader one, and one lies between them.
//!
//! Whoever is ready exchanges its own for the one between with a single atomic instruction: both sides are wait-free.

// Three cells that two threads share; each access has its reason.
#![allow(unsafe_code)]

use std::sync::Arc;

use super::sync::{ACQUIRE_RELEASE, AtomicU8, UnsafeCell};

/// Set in the word between when what lies there was not read yet.
const NEW: u8 = 4;
/// The part of that word that says which buffer it is.
const WHICH: u8 = 3;

#[derive(Debug)]
struct BufferShared<T> {
    buffers: [UnsafeCell<T>; 3],
    between: AtomicU8,
}

// SAFETY: which thread uses a buffer is settled by exchanges of `between`: never two the same.
unsafe impl<T: Send> Sync for BufferShared<T> {}
// SAFETY: it owns what it holds.
unsafe impl<T: Send> Send for BufferShared<T> {}

/// The writing side.
#[derive(Debug)]
pub(crate) struct BufferWriter<T> {
    shared: Arc<BufferShared<T>>,
    own: u8,
}

/// The reading side.
#[derive(Debug)]
pub(crate) struct BufferReader<T> {
    shared: Arc<BufferShared<T>>,
    own: u8,
}

/// Both sides of a hand-over of values that begin as these.
pub(crate) fn triple_buffer<T: Send>(contents: [T; 3]) -> (BufferWriter<T>, BufferReader<T>) {
    let shared = Arc::new(BufferShared {
        buffers: contents.map(UnsafeCell::new),
        between: AtomicU8::new(1),
    });
    let writer = BufferWriter {
        shared: Arc::clone(&shared),
        own: 0,
    };
    (writer, BufferReader { shared, own: 2 })
}

impl<T> BufferWriter<T> {
    /// Writes over what one of the last three calls wrote, and hands it over.
    pub fn write<R>(&mut self, write: impl FnOnce(&mut T) -> R) -> R {
        let result = self.shared.buffers[usize::from(self.own)].with_mut(|buffer| {
            // SAFETY: the buffer is the writer's own until the exchange below, and `self` is borrowed by this call alone.
            write(unsafe { &mut *buffer })
        });
        self.own = self.shared.between.swap(self.own | NEW, ACQUIRE_RELEASE) & WHICH;
        result
    }
}

impl<T> BufferReader<T> {
    /// Takes what was written last: whether there was something that had not been read.
    pub fn take(&mut self) -> bool {
        // Only the reader takes NEW away, so what is seen here is still there when it exchanges.
        if self.shared.between.load(std::sync::atomic::Ordering::Relaxed) & NEW == 0 {
            return false;
        }
        self.own = self.shared.between.swap(self.own, ACQUIRE_RELEASE) & WHICH;
        true
    }

    /// Reads what was taken last, or what the buffers began with.
    pub fn read<R>(&self, read: impl FnOnce(&T) -> R) -> R {
        self.shared.buffers[usize::from(self.own)].with(|buffer| {
            // SAFETY: the buffer is the reader's own until `take` exchanges it, which borrows `self` alone.
            read(unsafe { &*buffer })
        })
    }

    /// Whether there is nobody to write any more.
    pub fn is_alone(&self) -> bool {
        Arc::strong_count(&self.shared) == 1
    }
}
