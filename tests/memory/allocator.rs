//! The system allocator with a count of each thread's calls, which refuses memory to a thread that has used up its
//! requests.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

thread_local! {
    static CALLS: Cell<u64> = const { Cell::new(0) };
    static HELD: Cell<isize> = const { Cell::new(0) };
    static LEFT: Cell<Option<usize>> = const { Cell::new(None) };
}

/// Counts the allocator calls of `call` on this thread.
pub fn allocator_calls(call: impl FnOnce()) -> u64 {
    let before = CALLS.get();
    call();
    CALLS.get() - before
}

/// Returns the memory that this thread has allocated and not freed [bytes].
pub fn held() -> isize {
    HELD.get()
}

/// Lets this thread make `requests` more successful requests; `None` removes the limit.
pub fn allow(requests: Option<usize>) {
    LEFT.set(requests);
}

/// Calls `act` with memory for `requests` requests of this thread.
pub fn with<T>(requests: usize, act: impl FnOnce() -> T) -> T {
    allow(Some(requests));
    let result = act();
    allow(None);
    result
}

pub struct Watched;

impl Watched {
    /// Uses up a request. Returns true if one was left.
    fn grants() -> bool {
        let remaining = LEFT.get();
        LEFT.set(remaining.map(|remaining| remaining.saturating_sub(1)));
        remaining != Some(0)
    }

    fn note(bytes: isize) {
        CALLS.set(CALLS.get() + 1);
        HELD.set(HELD.get() + bytes);
    }
}

// SAFETY: every granted call goes to the system allocator unchanged.
unsafe impl GlobalAlloc for Watched {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        if !Self::grants() {
            return std::ptr::null_mut();
        }
        Self::note(layout.size() as isize);
        // SAFETY: the same contract.
        unsafe { System.alloc(layout) }
    }

    /// Shrinking succeeds in place, as with any allocator. With a larger alignment than the allocator's own, the
    /// standard library copies instead.
    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        if (size > layout.size() || layout.align() > 16) && !Self::grants() {
            return std::ptr::null_mut();
        }
        Self::note(size as isize - layout.size() as isize);
        // SAFETY: the same contract.
        unsafe { System.realloc(pointer, layout, size) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        Self::note(-(layout.size() as isize));
        // SAFETY: the same contract.
        unsafe { System.dealloc(pointer, layout) }
    }
}
