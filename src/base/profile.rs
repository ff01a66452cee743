//! Times and counts of the stages of a step. A world that is not profiled has none, and reads no clock.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use super::{Error, Result};

/// A stage of a step that is timed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stage {
    /// The whole step, on the thread that called it.
    Step,
    /// Paths of tools and blades, and islands of bodies.
    Plan,
    /// VERLET: forces, velocities and positions, which a tile takes in one pass.
    Forces,
    /// IMPLICIT and NEWTON: equations and their solution, with the forces in them.
    Solver,
    /// Features near a tool or near another surface.
    BroadPhase,
    /// Contacts between near features.
    NarrowPhase,
    /// Impulses of contacts, attachments and sutures.
    ContactSolver,
    /// The new state, and publishing it to readers and haptic handles.
    Publish,
    /// Blades and tears.
    Cutting,
}

/// The number of stages.
const STAGES: usize = Stage::Cutting as usize + 1;

/// A quantity that is counted in a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Count {
    /// Bodies that were stepped.
    Bodies,
    /// Bodies that slept.
    Sleeping,
    /// Attempts of the step.
    Tries,
    /// Substeps of all bodies.
    Substeps,
    /// Matrix-vector products of IMPLICIT and NEWTON.
    Products,
    /// Features near tools, over all substeps.
    Candidates,
    /// Contacts with tools, over all substeps.
    ToolContacts,
    /// Contacts of bodies with bodies, over all substeps.
    TissueContacts,
}

/// The number of counts.
const COUNTS: usize = Count::TissueContacts as usize + 1;

/// The times and counts of a step. Several threads add to it; no result depends on it.
#[derive(Debug, Default)]
pub(crate) struct Profile {
    nanoseconds: [AtomicU64; STAGES],
    counts: [AtomicU64; COUNTS],
}

impl Profile {
    /// Clears all times and counts.
    pub fn begin(&self) {
        let all = self.nanoseconds.iter().chain(&self.counts);
        all.for_each(|sum| sum.store(0, Ordering::Relaxed));
    }

    /// The time of a stage, summed over the threads that took part, s.
    pub fn seconds(&self, stage: Stage) -> f64 {
        // A nested stage can be subtracted before the outer one has been added.
        let nanoseconds = self.nanoseconds[stage as usize].load(Ordering::Relaxed) as i64;
        nanoseconds.max(0) as f64 * 1e-9
    }

    pub fn counted(&self, count: Count) -> u64 {
        self.counts[count as usize].load(Ordering::Relaxed)
    }

    /// Adds to a count.
    pub fn count(&self, count: Count, more: usize) {
        self.counts[count as usize].fetch_add(more as u64, Ordering::Relaxed);
    }
}

/// Refuses to read a clock on a platform without one: WebAssembly without a system interface.
pub(crate) fn check_clock(reader: &str) -> Result<()> {
    if cfg!(all(target_family = "wasm", target_os = "unknown")) {
        return Err(Error::Unsupported(format!("{reader}: this platform has no clock")));
    }
    Ok(())
}

/// The start time of a stage. It borrows nothing, so that the timed code can change the world.
#[derive(Clone, Copy, Debug)]
#[must_use]
pub(crate) struct Stopwatch(Option<Instant>);

impl Stopwatch {
    /// Starts; without a profile no clock is read.
    #[inline]
    pub fn start(profile: Option<&Profile>) -> Self {
        Self(profile.map(|_| Instant::now()))
    }

    /// Adds the time since the start to a stage.
    #[inline]
    pub fn stop(self, profile: Option<&Profile>, stage: Stage) {
        if let (Some(profile), Some(start)) = (profile, self.0) {
            let passed = start.elapsed().as_nanos() as u64;
            profile.nanoseconds[stage as usize].fetch_add(passed, Ordering::Relaxed);
        }
    }

    /// Subtracts the time since the start from an outer stage, because a nested stage has it.
    #[inline]
    pub fn subtract_from(self, profile: Option<&Profile>, stage: Stage) {
        if let (Some(profile), Some(start)) = (profile, self.0) {
            let passed = start.elapsed().as_nanos() as u64;
            profile.nanoseconds[stage as usize].fetch_sub(passed, Ordering::Relaxed);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_runs_within_a_stage_is_taken_off_it() {
        let profile = Profile::default();
        let whole = Stopwatch::start(Some(&profile));
        let outer = Stopwatch::start(Some(&profile));
        let inner = Stopwatch::start(Some(&profile));
        std::thread::sleep(std::time::Duration::from_millis(2));
        inner.stop(Some(&profile), Stage::BroadPhase);
        inner.subtract_from(Some(&profile), Stage::Solver);
        outer.stop(Some(&profile), Stage::Solver);
        whole.stop(Some(&profile), Stage::Step);
        let of = |stage| profile.seconds(stage);
        assert!(of(Stage::BroadPhase) >= 2e-3);
        assert!(of(Stage::Solver) < of(Stage::Step) - of(Stage::BroadPhase));
        profile.begin();
        assert_eq!(of(Stage::Step), 0.0);
    }

    #[test]
    fn without_a_profile_no_clock_is_read() {
        assert!(Stopwatch::start(None).0.is_none());
    }
}
