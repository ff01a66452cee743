//! A triple buffer from one thread to another: the writer has a buffer, the reader has one, and one is between them.
//!
//! Each side exchanges its buffer for the middle one by a single atomic instruction, so both are wait-free.

// Two threads share three cells; each access states its reason.
#![allow(unsafe_code)]

use std::sync::Arc;

use super::atomics::{ACQUIRE_RELEASE, AtomicU8, UnsafeCell};

/// Set if the middle buffer was not read yet.
const NEW: u8 = 4;
/// The bits for the index of the middle buffer.
const WHICH: u8 = 3;

#[derive(Debug)]
struct BufferShared<T> {
    buffers: [UnsafeCell<T>; 3],
    between: AtomicU8,
}

// SAFETY: exchanges of `between` decide which thread uses a buffer: never both.
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

/// Both sides of a triple buffer with these initial values.
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
    /// Overwrites an old value and publishes it.
    pub fn write<R>(&mut self, write: impl FnOnce(&mut T) -> R) -> R {
        let result = self.shared.buffers[usize::from(self.own)].with_mut(|buffer| {
            // SAFETY: the buffer is the writer's own until the exchange below, and `self` is borrowed by this call
            // alone.
            write(unsafe { &mut *buffer })
        });
        self.own = self.shared.between.swap(self.own | NEW, ACQUIRE_RELEASE) & WHICH;
        result
    }
}

impl<T> BufferReader<T> {
    /// Takes the latest value. Returns true if it was not read before.
    pub fn take(&mut self) -> bool {
        // Only the reader clears NEW, so it is still set at the exchange.
        if self.shared.between.load(std::sync::atomic::Ordering::Relaxed) & NEW == 0 {
            return false;
        }
        self.own = self.shared.between.swap(self.own, ACQUIRE_RELEASE) & WHICH;
        true
    }

    /// Reads the value taken last, or the initial one.
    pub fn read<R>(&self, read: impl FnOnce(&T) -> R) -> R {
        self.shared.buffers[usize::from(self.own)].with(|buffer| {
            // SAFETY: the buffer is the reader's own until `take` exchanges it, which borrows `self` alone.
            read(unsafe { &*buffer })
        })
    }

    /// True if the other side was dropped.
    pub fn is_alone(&self) -> bool {
        Arc::strong_count(&self.shared) == 1
    }
}
