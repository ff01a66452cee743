//! Worlds as bytes.

use super::guard::{guard, sinew_world, with_world};
use super::memory;
use super::status::sinew_status;
use super::world::sinew_world_def;
use crate::world::World;

/// Writes the number of bytes that sinew_world_save_snapshot needs now.
///
/// Errors: SINEW_STATUS_UNSUPPORTED if a haptic handle drives a tool, or the size is too large.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_get_snapshot_size(world: *const sinew_world, out: *mut usize) -> sinew_status {
    with_world(world, |world| {
        let out = memory::output("out", out)?;
        *out = world.snapshot_size()?;
        Ok(())
    })
}

/// Saves a world as bytes, from which sinew_world_load_snapshot continues bitwise identically.
///
/// `size` is that of sinew_world_get_snapshot_size. Threads, readers, detectors and embeddings are not saved. Only this
/// library version can read it. A checksum detects damage, not tampering.
///
/// Errors: SINEW_STATUS_UNSUPPORTED if a haptic handle drives a tool.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_save_snapshot(
    world: *const sinew_world,
    out_bytes: *mut u8,
    size: usize,
) -> sinew_status {
    with_world(world, |world| {
        let out_bytes = memory::output_array("out_bytes", out_bytes, size)?;
        world.save_into(out_bytes)
    })
}

/// Creates a world from the bytes of a snapshot.
///
/// `def` is nullable: the defaults. Its thread_count, run_tasks and tasks_context apply; the snapshot holds the rest.
/// Results are bitwise identical only with the kernel of the saved world.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT if the bytes are damaged; SINEW_STATUS_UNSUPPORTED for another library version
/// or kernel, or if a thread cannot start.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_load_snapshot(
    bytes: *const u8,
    size: usize,
    def: *const sinew_world_def,
    out: *mut *mut sinew_world,
) -> sinew_status {
    guard(|| {
        let (out, bytes) = (memory::output("out", out)?, memory::array("bytes", bytes, size)?);
        let def = sinew_world_def::read_or_default(def)?;
        let world = World::load(bytes, def.thread_count, def.tasks)?;
        *out = Box::into_raw(crate::base::memory::boxed(sinew_world::new(world))?);
        Ok(())
    })
}
