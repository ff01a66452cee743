//! The atomics and cells of this module. `tests/handover.rs` replaces them by loom's, and by orderings too weak, which
//! loom must detect.

use std::cell;
use std::sync::atomic::Ordering;
pub(super) use std::sync::atomic::{AtomicU8, AtomicU64, fence};

/// Publishes earlier writes, and sees the published writes of others.
pub(super) const ACQUIRE_RELEASE: Ordering = Ordering::AcqRel;

/// The writer of a pool announces a complete version.
pub(super) const ANNOUNCE: Ordering = Ordering::Release;
/// A reader of a pool reads the announcement.
pub(super) const LISTEN: Ordering = Ordering::Acquire;
/// A reader of a pool releases a buffer.
pub(super) const LET_GO: Ordering = Ordering::Release;
/// The writer of a pool takes a released buffer. Readers that find it taken see that a later version was announced.
pub(super) const TAKE_BACK: Ordering = Ordering::AcqRel;
/// A fence between what a thread of a pool publishes and what it reads next.
pub(super) const TELL_BEFORE_LOOKING: Ordering = Ordering::SeqCst;

/// A cell shared by threads, with the interface of loom's checked cell.
#[derive(Debug)]
pub(super) struct UnsafeCell<T>(cell::UnsafeCell<T>);

impl<T> UnsafeCell<T> {
    pub fn new(content: T) -> Self {
        Self(cell::UnsafeCell::new(content))
    }

    /// Reads through a pointer that is valid while nobody writes.
    #[inline]
    pub fn with<R>(&self, read: impl FnOnce(*const T) -> R) -> R {
        read(self.0.get())
    }

    /// Writes through a pointer that is valid while nobody else has one.
    #[inline]
    pub fn with_mut<R>(&self, write: impl FnOnce(*mut T) -> R) -> R {
        write(self.0.get())
    }
}
