//! Worlds as bytes.

use libc::c_void;

use super::guard::{guard, sinew_world, with_world};
use super::memory;
use super::status::sinew_status;
use super::world::sinew_run_tasks;
use crate::threads::RunTasks;
use crate::world::World;

/// How many bytes sinew_world_save_snapshot writes of the world as it is now.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_UNSUPPORTED (a haptic handle leads a tool; or more room is kept for what may come
/// than bytes can ask for).
///
/// # Safety
/// `world` is NULL or a world nobody changes; `out` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_get_snapshot_size(world: *const sinew_world, out: *mut usize) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_world(world, |world| {
            let out = memory::output("out", out)?;
            *out = world.snapshot_size()?;
            Ok(())
        })
    }
}

/// Writes the world as bytes, of which sinew_world_load_snapshot makes one that goes on just as this one does, to the bit: with bodies as
/// they were cut and torn, contacts, what is held and sewn, blades in mid stroke, forces applied for the next step, and ids, which name the
/// same things there. `size` is what sinew_world_get_snapshot_size tells. The bytes are the same for any number of threads.
///
/// What is not of the world is not in them: threads, readers, detectors and embeddings, which are made again. They are for this version of
/// the library alone. A checksum tells whether they are as they were written, not who wrote them.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT (also another size), SINEW_STATUS_UNSUPPORTED as above.
///
/// # Safety
/// `world` is NULL or a world nobody changes; `bytes` is NULL or as long as stated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_save_snapshot(
    world: *const sinew_world,
    bytes: *mut u8,
    size: usize,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_world(world, |world| {
            let bytes = memory::output_array("bytes", bytes, size)?;
            world.save_into(bytes)
        })
    }
}

/// Creates a world of the bytes that sinew_world_save_snapshot wrote, which the caller destroys with sinew_world_destroy. `thread_count`,
/// `run_tasks`, nullable, and `tasks_context` are as in sinew_world_def.
///
/// It goes on to the bit where the processor offers the kernel that the world was stepped with; else SINEW_KERNEL_BEST is the best of this
/// one. What was cut short, has changed or never was a world is refused as a whole.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_UNSUPPORTED (bytes of another version of the library; a thread could not be started,
/// or the processor does not offer the kernel that the world was created with), SINEW_STATUS_OUT_OF_MEMORY.
///
/// # Safety
/// `bytes` is NULL or as long as stated; `run_tasks` is NULL or keeps its word, as long as the world lives; `out` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_load_snapshot(
    bytes: *const u8,
    size: usize,
    thread_count: u32,
    run_tasks: sinew_run_tasks,
    tasks_context: *mut c_void,
    out: *mut *mut sinew_world,
) -> sinew_status {
    guard(|| {
        // SAFETY: the same contract.
        let (out, bytes) = unsafe { (memory::output("out", out)?, memory::array("bytes", bytes, size)?) };
        // SAFETY: the same contract.
        let tasks = run_tasks.map(|run| unsafe { RunTasks::from_c(run, tasks_context) });
        let world = World::load(bytes, thread_count, tasks)?;
        *out = Box::into_raw(crate::base::memory::boxed(sinew_world::new(world))?);
        Ok(())
    })
}
