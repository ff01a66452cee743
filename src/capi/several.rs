//! Pins of several nodes at once.

use glam::Vec3;

use super::body::{sinew_body_id, with_body, with_body_mut};
use super::guard::sinew_world;
use super::memory;
use super::status::sinew_status;
use crate::base::Result;
use crate::body::Body;

/// Pins `count` nodes at their current positions; see sinew_body_pin.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_pin_nodes(
    world: *mut sinew_world,
    body: sinew_body_id,
    nodes: *const u32,
    count: usize,
) -> sinew_status {
    with_body_mut(world, body, |body| {
        body.pin_nodes(memory::array("nodes", nodes, count)?)
    })
}

/// Unpins `count` nodes along all axes; see sinew_body_unpin.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_unpin_nodes(
    world: *mut sinew_world,
    body: sinew_body_id,
    nodes: *const u32,
    count: usize,
) -> sinew_status {
    with_body_mut(world, body, |body| {
        body.unpin_nodes(memory::array("nodes", nodes, count)?)
    })
}

/// Pins all nodes in a box, and writes how many nodes of the box are pinned.
///
/// `min` [m] and `max` [m] are 3 floats each. `out_count` is nullable.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT if a tool holds a node in the box.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_pin_box(
    world: *mut sinew_world,
    body: sinew_body_id,
    min: *const f32,
    max: *const f32,
    out_count: *mut usize,
) -> sinew_status {
    change_box(world, body, [min, max], out_count, Body::pin_box)
}

/// Unpins the pinned nodes in a box, except those of mass 0, and writes how many.
///
/// Arguments and errors are those of sinew_body_pin_box.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_unpin_box(
    world: *mut sinew_world,
    body: sinew_body_id,
    min: *const f32,
    max: *const f32,
    out_count: *mut usize,
) -> sinew_status {
    change_box(world, body, [min, max], out_count, Body::unpin_box)
}

/// Changes the pins in a box, and writes how many nodes that is about.
///
/// # Safety
/// As of what calls it.
unsafe fn change_box(
    world: *mut sinew_world,
    body: sinew_body_id,
    [min, max]: [*const f32; 2],
    out_count: *mut usize,
    change: impl Fn(&mut Body, Vec3, Vec3) -> Result<usize>,
) -> sinew_status {
    with_body_mut(world, body, |body| {
        let (low, high) = (memory::vector("min", min)?, memory::vector("max", max)?);
        let place = memory::optional_output_array("out_count", out_count, 1)?;
        let count = change(body, low, high)?;
        if let Some(place) = place {
            place[0] = count;
        }
        Ok(())
    })
}

/// Writes the reaction forces [N] on all nodes, 3 * node_count floats, averaged over the last step.
///
/// It is 0 for a node that is not pinned or that a tool holds.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_pin_forces(
    world: *const sinew_world,
    body: sinew_body_id,
    out_forces: *mut f32,
    node_count: usize,
) -> sinew_status {
    with_body(world, body, |body| {
        body.pin_forces(memory::output_array("out_forces", out_forces.cast(), node_count)?)
    })
}
