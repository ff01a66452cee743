//! Whatever is asked of a world is done or not, and nothing is lost, however little memory there is. Alone in its program.
#![allow(unsafe_code)]
#![allow(clippy::expect_used)]

#[path = "snapshots/acts.rs"]
mod acts;

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use acts::Caller;
use sinew::{Error, World, WorldDefinition};

thread_local! {
    /// How many more times this thread is given memory; `None`: as often as it asks.
    static LEFT: Cell<Option<usize>> = const { Cell::new(None) };
    /// What it holds, bytes.
    static HELD: Cell<isize> = const { Cell::new(0) };
}

struct Scarce;

// SAFETY: what is not refused goes to the system's allocator unchanged.
unsafe impl GlobalAlloc for Scarce {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let left = LEFT.get();
        LEFT.set(left.map(|left| left.saturating_sub(1)));
        if left == Some(0) {
            return std::ptr::null_mut();
        }
        HELD.set(HELD.get() + layout.size() as isize);
        // SAFETY: the same contract.
        unsafe { System.alloc(layout) }
    }

    /// What shrinks stays where it is, as with any allocator.
    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        let left = LEFT.get();
        if size > layout.size() {
            LEFT.set(left.map(|left| left.saturating_sub(1)));
            if left == Some(0) {
                return std::ptr::null_mut();
            }
        }
        HELD.set(HELD.get() + size as isize - layout.size() as isize);
        // SAFETY: the same contract.
        unsafe { System.realloc(pointer, layout, size) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        HELD.set(HELD.get() - layout.size() as isize);
        // SAFETY: the same contract.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Scarce = Scarce;

/// Does something with memory for so many requests.
fn with<T>(requests: usize, act: impl FnOnce() -> T) -> T {
    LEFT.set(Some(requests));
    let done = act();
    LEFT.set(None);
    done
}

#[test]
fn a_world_is_loaded_whole_or_not_at_all() {
    let mut failed = 0;
    for seed in [1, 4, 9] {
        let mut caller = Caller::new(seed);
        let mut worlds = [World::new(WorldDefinition {
            max_substeps: 40,
            ..WorldDefinition::default()
        })
        .expect("a world")];
        for _ in 0..6 {
            for _ in 0..4 {
                caller.act(&mut worlds);
            }
            caller.step(&mut worlds);
        }
        let world = &worlds[0];
        assert!(matches!(with(0, || world.save()), Err(Error::OutOfMemory)));
        let bytes = world.save().expect("bytes");
        let mut requests = 0;
        let loaded = loop {
            let before = HELD.get();
            match with(requests, || World::load(&bytes, 1, None)) {
                Ok(world) => break world,
                Err(error) => assert!(matches!(error, Error::OutOfMemory), "request {requests}: {error}"),
            }
            assert_eq!(HELD.get(), before, "what was loaded of it is given back");
            requests += 1;
            failed += 1;
        };
        assert!(loaded.save().expect("bytes") == bytes);
    }
    assert!(failed > 100, "{failed} requests failed");
}

#[test]
fn what_there_is_no_memory_for_changes_nothing() {
    let mut failed = 0;
    let mut done = std::collections::BTreeMap::<&str, usize>::new();
    for seed in 10..18 {
        let mut caller = Caller::new(seed);
        caller.scarce = Some(|requests| LEFT.set(requests));
        let mut worlds = [World::new(WorldDefinition {
            max_substeps: 40,
            ..WorldDefinition::default()
        })
        .expect("a world")];
        for _ in 0..12 {
            for _ in 0..3 {
                caller.act(&mut worlds);
            }
            caller.step(&mut worlds);
        }
        failed += caller.failed;
        for (what, count) in caller.done {
            *done.entry(what).or_default() += count;
        }
    }
    for what in [
        "a plainer body",
        "a tool",
        "a cut",
        "a blade",
        "a spring added",
        "a suture",
        "an attachment",
        "springs set",
    ] {
        assert!(done.get(what).is_some_and(|&count| count > 0), "{what}: never");
    }
    assert!(failed > 1000, "{failed}");
}
