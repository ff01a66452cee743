//! Readers: a body as other threads see it while its world steps.

use super::body::{sinew_body_id, sinew_vec3_view};
use super::cut::sinew_triangle_view;
use super::guard::{guard, sinew_world, with_world_mut};
use super::memory::{self, Versioned};
use super::status::sinew_status;
use crate::readers::BodyReader;

/// A reader of a body: the latest complete positions for one thread, without a lock, while another thread steps the world.
///
/// It is the exception to the rule of threads: made by who has the world, it is then used by one thread at a time, any, whatever others do to the
/// world meanwhile, until its end; it outlives body and world. A thread more needs a reader more.
pub struct sinew_reader {
    reader: BodyReader,
}

/// What a reader sees of a body: all of one moment. What it points to is valid, and stays as it is, until the next sinew_reader_read of the same
/// reader, or the reader's end.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_frame {
    /// Set by the caller.
    pub struct_size: usize,
    /// Where each node is, m, in the caller's order, with those that cuts have added.
    pub positions: sinew_vec3_view,
    /// The triangles that were drawn then, as sinew_body_get_triangles gives them; they change with topology_version alone.
    pub triangles: sinew_triangle_view,
    /// Above that of earlier frames; the same as long as nothing has moved the body.
    pub version: u64,
    /// What sinew_body_get_topology_changes told as `version` then.
    pub topology_version: u64,
    /// How many steps the world had taken.
    pub step: u64,
    /// The sum of their lengths, s.
    pub time: f64,
    /// 1: this reader did not read this frame before.
    pub is_new: u32,
    /// 1: the body, or its world, is no more: this is its last frame.
    pub is_over: u32,
}

// SAFETY: repr(C), begins with struct_size, numbers and pointers alone.
unsafe impl Versioned for sinew_frame {
    const SIZES: &'static [usize] = &[size_of::<Self>()];
    const NAME: &'static str = "sinew_frame";
}

/// Creates a reader of a body, which the caller destroys with sinew_reader_destroy. No more than 126 of one body live at a time.
///
/// Each step that moves the body shows it to its readers when it has been taken, and so does what moves or cuts it between steps, at once. A step
/// that is refused is never seen, nor one that is not complete. A body without readers takes no time or memory for them; one that has keeps two
/// copies of its positions more than it has readers, writes one of them each step, and copies its triangles when cuts or tears have changed them.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID, SINEW_STATUS_CAPACITY (126 readers), SINEW_STATUS_OUT_OF_MEMORY.
///
/// # Safety
/// `world` is NULL or a world nobody else uses; `out` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_reader_create(
    world: *mut sinew_world,
    body: sinew_body_id,
    out: *mut *mut sinew_reader,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_world_mut(world, |world| {
            let out = memory::output("out", out)?;
            let reader = world.create_reader(body.id())?;
            *out = Box::into_raw(crate::base::memory::boxed(sinew_reader { reader })?);
            Ok(())
        })
    }
}

/// Destroys a reader, on any thread, before or after its body and its world. NULL: nothing.
///
/// # Safety
/// `reader` is NULL or a reader that is not destroyed and that nobody uses any more.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_reader_destroy(reader: *mut sinew_reader) {
    if !reader.is_null() {
        guard(|| {
            // SAFETY: made by Box::into_raw in sinew_reader_create, and given back once.
            drop(unsafe { Box::from_raw(reader) });
            Ok(())
        });
    }
}

/// Writes the latest frame; `out->struct_size` is set by the caller. What the frame before pointed to ends. Nothing is copied, allocated or locked,
/// and nobody waits: it is the same frame again where there is none later.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT.
///
/// # Safety
/// `reader` is NULL or a reader nobody else uses, whatever happens to the world; `out` is NULL or writable for the size that it states.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_reader_read(reader: *mut sinew_reader, out: *mut sinew_frame) -> sinew_status {
    guard(|| {
        // SAFETY: the same contract.
        let reader = unsafe { memory::output("reader", reader) }?;
        // SAFETY: the same contract.
        let out = unsafe { memory::report("out", out) }?;
        let frame = reader.reader.read();
        let value = sinew_frame {
            struct_size: size_of::<sinew_frame>(),
            positions: sinew_vec3_view::of(frame.positions),
            triangles: sinew_triangle_view {
                data: frame.triangles.as_ptr().cast(),
                count: frame.triangles.len(),
            },
            version: frame.version,
            topology_version: frame.topology_version,
            step: frame.step,
            time: frame.time,
            is_new: frame.is_new.into(),
            is_over: frame.is_over.into(),
        };
        // SAFETY: still there, by the same contract.
        unsafe { out.fill(value) };
        Ok(())
    })
}
