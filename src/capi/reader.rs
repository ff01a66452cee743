//! Readers: a body as other threads see it while its world steps.

use super::body::{sinew_body_id, sinew_vec3_view};
use super::cut::sinew_triangle_view;
use super::guard::{destroy, guard, sinew_world, with_world_mut};
use super::memory::{self, versioned};
use super::status::sinew_status;
use crate::readers::BodyReader;

/// Reader of a body: its latest complete positions for one thread, without locks.
///
/// One thread at a time may use it, while other threads step or use the world. It may outlive the body and the
/// world. Create one reader per reading thread.
pub struct sinew_reader {
    reader: BodyReader,
}

/// State of a body that a reader read, all from the same moment.
///
/// Lifetime of its views: until the next sinew_reader_read of this reader, or its destruction.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_frame {
    /// Set to sizeof(sinew_frame) before the call.
    pub struct_size: usize,
    /// [m] Node positions, with the nodes added by cuts.
    pub positions: sinew_vec3_view,
    /// Triangles of the body, which change with topology_version.
    pub triangles: sinew_triangle_view,
    /// Number of the frame; larger than before if the body was moved.
    pub version: u64,
    /// Version of sinew_body_get_topology_changes at that moment.
    pub topology_version: u64,
    /// Number of steps that the world had taken.
    pub step: u64,
    /// [s] Sum of the lengths of these steps.
    pub time: f64,
    /// 1: this reader did not read this frame before.
    pub is_new: u32,
    /// 1: the body or its world was destroyed; this is its last frame.
    pub is_over: u32,
}

versioned! { sinew_frame }

/// Creates a reader of a body; destroy it with sinew_reader_destroy.
///
/// Each successful step and each change between steps is published to it. A body with readers keeps two copies of its
/// positions more than it has readers.
///
/// Errors: SINEW_STATUS_CAPACITY if the body has 126 readers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_reader_create(
    world: *mut sinew_world,
    body: sinew_body_id,
    out: *mut *mut sinew_reader,
) -> sinew_status {
    with_world_mut(world, |world| {
        let out = memory::output("out", out)?;
        let reader = world.create_reader(body.id())?;
        *out = Box::into_raw(crate::base::memory::boxed(sinew_reader { reader })?);
        Ok(())
    })
}

/// Destroys a reader on any thread, before or after its body and world; NULL has no effect.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_reader_destroy(reader: *mut sinew_reader) {
    destroy(reader);
}

/// Writes the latest frame of the body without copying, allocating, locking or waiting.
///
/// Without a newer one it is the same again. It ends the views of the previous frame.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_reader_read(reader: *mut sinew_reader, out: *mut sinew_frame) -> sinew_status {
    guard(|| {
        let reader = memory::output("reader", reader)?;
        let out = memory::report("out", out)?;
        let frame = reader.reader.read();
        let value = sinew_frame {
            struct_size: size_of::<sinew_frame>(),
            positions: sinew_vec3_view::of(frame.positions),
            triangles: sinew_triangle_view::of(frame.triangles),
            version: frame.version,
            topology_version: frame.topology_version,
            step: frame.step,
            time: frame.time,
            is_new: frame.is_new.into(),
            is_over: frame.is_over.into(),
        };
        out.fill(value);
        Ok(())
    })
}
