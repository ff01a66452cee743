//! The system's allocator, which counts what each thread asks of it and refuses a thread that has used up its requests.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

thread_local! {
    static CALLS: Cell<u64> = const { Cell::new(0) };
    static HELD: Cell<isize> = const { Cell::new(0) };
    static LEFT: Cell<Option<usize>> = const { Cell::new(None) };
}

/// How often a call asks for memory or returns it, on this thread.
pub fn asked(call: impl FnOnce()) -> u64 {
    let before = CALLS.get();
    call();
    CALLS.get() - before
}

/// What this thread has been given and has not returned [bytes].
pub fn held() -> isize {
    HELD.get()
}

/// Gives this thread memory for so many more requests; `None`: for as many as it has.
pub fn allow(requests: Option<usize>) {
    LEFT.set(requests);
}

/// Does something with memory for so many requests of this thread.
pub fn with<T>(requests: usize, act: impl FnOnce() -> T) -> T {
    allow(Some(requests));
    let done = act();
    allow(None);
    done
}

pub struct Watched;

impl Watched {
    /// Uses up a request; whether there was one.
    fn grants() -> bool {
        let left = LEFT.get();
        LEFT.set(left.map(|left| left.saturating_sub(1)));
        left != Some(0)
    }

    fn note(bytes: isize) {
        CALLS.set(CALLS.get() + 1);
        HELD.set(HELD.get() + bytes);
    }
}

// SAFETY: what is not refused goes to the system's allocator unchanged.
unsafe impl GlobalAlloc for Watched {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        if !Self::grants() {
            return std::ptr::null_mut();
        }
        Self::note(layout.size() as isize);
        // SAFETY: the same contract.
        unsafe { System.alloc(layout) }
    }

    /// What shrinks stays where it is, as with any allocator; but what is aligned by more than memory is anyway Rust has copied.
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
