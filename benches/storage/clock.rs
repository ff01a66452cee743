//! Clocks: wall time, and the processor time of the calling thread, which excludes other programs.
#![allow(unsafe_code)]

use std::time::Instant;

/// Times of a piece of work [s].
#[derive(Clone, Copy, Debug, Default)]
pub struct Elapsed {
    pub wall: f64,
    /// Processor time of the calling thread; wall time if there is no such clock.
    pub processor: f64,
}

/// Times `work`.
pub fn time(work: impl FnOnce()) -> Elapsed {
    let (wall, processor) = (Instant::now(), thread_seconds());
    work();
    let end = thread_seconds();
    let wall = wall.elapsed().as_secs_f64();
    let processor = match (processor, end) {
        (Some(start), Some(end)) => end - start,
        _ => wall,
    };
    Elapsed { wall, processor }
}

#[cfg(unix)]
fn thread_seconds() -> Option<f64> {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: `time` is a valid destination.
    let answer = unsafe { libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &mut time) };
    (answer == 0).then_some(time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64)
}

#[cfg(not(unix))]
fn thread_seconds() -> Option<f64> {
    None
}
