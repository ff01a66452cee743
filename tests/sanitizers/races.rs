//! Checks that the thread sanitizer, under which `.ci/abuse` runs the tests with threads, detects a data race: this
//! test must end the program.
#![allow(unsafe_code)]

use std::cell::UnsafeCell;
use std::thread;

struct Shared(UnsafeCell<u32>);

// SAFETY: there is none, which is to be found.
unsafe impl Sync for Shared {}

impl Shared {
    fn count(&self) {
        for _ in 0..1000 {
            // SAFETY: as above.
            unsafe { *std::hint::black_box(self.0.get()) += 1 };
        }
    }
}

#[test]
#[ignore = "ends the program"]
fn a_race_is_found() {
    let shared = Shared(UnsafeCell::new(0));
    thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| shared.count());
        }
    });
}
