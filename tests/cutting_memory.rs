//! Where memory runs out, a cut is refused, and nothing has changed.
#![allow(unsafe_code)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

#[path = "cutting/sheet.rs"]
mod sheet;

use glam::vec2;
use sheet::{Body, unstructured, wavy};
use sinew::Error;
use sinew::cutting::Limits;

thread_local! {
    /// How many more times this thread gets memory; none: as often as it likes.
    static LEFT: Cell<Option<usize>> = const { Cell::new(None) };
}

struct Scarce;

fn is_refused() -> bool {
    LEFT.with(|left| match left.get() {
        Some(0) => true,
        Some(more) => {
            left.set(Some(more - 1));
            false
        }
        None => false,
    })
}

// SAFETY: it is the system's allocator, or has no memory.
unsafe impl GlobalAlloc for Scarce {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as the caller vouches.
        if is_refused() {
            std::ptr::null_mut()
        } else {
            unsafe { System.alloc(layout) }
        }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        // SAFETY: as the caller vouches.
        unsafe { System.dealloc(at, layout) }
    }
}

#[global_allocator]
static SCARCE: Scarce = Scarce;

#[test]
fn a_cut_without_memory_changes_nothing() {
    let mut body = Body::new(unstructured(8, 3), wavy);
    body.cut(vec2(-1.0, 4.2), vec2(9.0, 3.7));
    let sweep = body.sweep(vec2(2.0, 6.6), vec2(5.1, -1.0));
    let near = body.surface.near(&sweep, &body.positions).unwrap();
    let before = format!(
        "{:?} {:?} {:?}",
        body.surface.cells(),
        body.surface.triangles(),
        body.surface.vertices()
    );
    for times in 0.. {
        LEFT.with(|left| left.set(Some(times)));
        let answer = body.surface.cut(&sweep, &body.positions, &near, Limits::NONE);
        LEFT.with(|left| left.set(None));
        match answer {
            Ok(changes) => {
                assert!(times > 100, "it needs memory {times} times");
                body.apply(&changes);
                assert_eq!(body.check(), 3);
                return;
            }
            Err(error) => assert_eq!(error, Error::OutOfMemory),
        }
        let after = format!(
            "{:?} {:?} {:?}",
            body.surface.cells(),
            body.surface.triangles(),
            body.surface.vertices()
        );
        assert_eq!(before, after);
    }
}
