//! What hand-overs are made of. `tests/handover.rs` puts loom's in its place, and orderings too weak, which loom must find.

use std::cell;
use std::sync::atomic::Ordering;
pub(super) use std::sync::atomic::{AtomicU8, AtomicU64, fence};

/// Publishes what was written before, and sees what others published.
pub(super) const ACQUIRE_RELEASE: Ordering = Ordering::AcqRel;

/// A pool's writer says which version is the latest: it is complete.
pub(super) const ANNOUNCE: Ordering = Ordering::Release;
/// A pool's reader hears that.
pub(super) const LISTEN: Ordering = Ordering::Acquire;
/// A pool's reader is through with a buffer.
pub(super) const LET_GO: Ordering = Ordering::Release;
/// A pool's writer takes a buffer that readers are through with; those who find it taken know that a later version was announced.
pub(super) const TAKE_BACK: Ordering = Ordering::AcqRel;
/// Between what a thread of a pool has told the others and what it looks at next.
pub(super) const TELL_BEFORE_LOOKING: Ordering = Ordering::SeqCst;

/// A cell that several threads can reach; used as loom's is, which watches it.
#[derive(Debug)]
pub(super) struct UnsafeCell<T>(cell::UnsafeCell<T>);

impl<T> UnsafeCell<T> {
    pub fn new(content: T) -> Self {
        Self(cell::UnsafeCell::new(content))
    }

    /// Reads through a pointer that is valid if nobody writes meanwhile.
    #[inline]
    pub fn with<R>(&self, read: impl FnOnce(*const T) -> R) -> R {
        read(self.0.get())
    }

    /// Writes through a pointer that is valid if nobody else has one meanwhile.
    #[inline]
    pub fn with_mut<R>(&self, write: impl FnOnce(*mut T) -> R) -> R {
        write(self.0.get())
    }
}
