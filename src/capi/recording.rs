//! Recording and replay.

use std::path::Path;

use std::ffi::c_char;

use super::guard::{guard, sinew_world, with_world_mut};
use super::memory::{self, versioned};
use super::status::sinew_status;
use crate::world::{ReplayReport, World};

/// Report of sinew_replay.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_replay_report {
    /// Set to sizeof(sinew_replay_report) before the call.
    pub struct_size: usize,
    /// Number of steps that were replayed with equal state hashes.
    pub steps: u64,
    /// Number of the first step that differs, from 1; 0: none.
    pub first_difference: u64,
    /// State hash after that step in the recording; else 0.
    pub recorded_hash: u64,
    /// State hash after that step in the replay; else 0.
    pub replayed_hash: u64,
    /// 1 if the file ends within a step, else 0.
    pub is_cut_short: u32,
}

versioned! { sinew_replay_report }

impl From<ReplayReport> for sinew_replay_report {
    fn from(report: ReplayReport) -> Self {
        let difference = report.difference;
        Self {
            struct_size: size_of::<Self>(),
            steps: report.steps,
            first_difference: difference.map_or(0, |difference| difference.step),
            recorded_hash: difference.map_or(0, |difference| difference.recorded),
            replayed_hash: difference.map_or(0, |difference| difference.replayed),
            is_cut_short: u32::from(report.is_cut_short),
        }
    }
}

/// Records all steps from the next one on into a file, for sinew_replay.
///
/// It holds the snapshot at the first step, the changes before each and a state hash after each. A file that
/// exists is replaced. `path` is UTF-8. Recorded steps may allocate; a full disk ends it.
///
/// Errors: SINEW_STATUS_IO.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_start_recording(world: *mut sinew_world, path: *const c_char) -> sinew_status {
    with_world_mut(world, |world| {
        world.start_recording(Path::new(memory::text("path", path)?))
    })
}

/// Stops a recording and writes the number of recorded steps; `out_steps` is nullable.
///
/// Errors: SINEW_STATUS_IO or SINEW_STATUS_OUT_OF_MEMORY if it ended earlier; it stops anyway.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_stop_recording(world: *mut sinew_world, out_steps: *mut u64) -> sinew_status {
    with_world_mut(world, |world| {
        let out = memory::optional_output_array("out_steps", out_steps, 1)?;
        let steps = world.stop_recording()?;
        if let Some(out) = out {
            out[0] = steps;
        }
        Ok(())
    })
}

/// Replays a recording and compares the state hash after each step, up to the first difference.
///
/// `path` is UTF-8, `thread_count` that of sinew_world_def. Use the recording's version and kernel.
///
/// Errors: SINEW_STATUS_IO; SINEW_STATUS_INVALID_ARGUMENT if the file is no recording or damaged;
/// SINEW_STATUS_UNSUPPORTED for another library version.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_replay(
    path: *const c_char,
    thread_count: u32,
    out: *mut sinew_replay_report,
) -> sinew_status {
    guard(|| {
        let out = memory::report("out", out)?;
        let report = World::replay(Path::new(memory::text("path", path)?), thread_count)?;
        out.fill(report.into());
        Ok(())
    })
}
