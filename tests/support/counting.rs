//! The system's allocator, with an eye on who asks it.

use std::alloc::{GlobalAlloc, Layout, System};

/// Calls its function whenever memory is asked for or given back.
pub struct Counting(pub fn());

// SAFETY: every call goes to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        (self.0)();
        // SAFETY: the same contract.
        unsafe { System.alloc(layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        (self.0)();
        // SAFETY: the same contract.
        unsafe { System.realloc(pointer, layout, size) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        (self.0)();
        // SAFETY: the same contract.
        unsafe { System.dealloc(pointer, layout) }
    }
}
