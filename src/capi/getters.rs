//! Settings that were made, what the caller keeps with things, and whether ids are valid.

use std::ffi::c_void;

use super::attachment::sinew_attachment_id;
use super::blade::sinew_blade_id;
use super::body::{sinew_body_id, with_body};
use super::guard::{sinew_world, with_world, with_world_mut};
use super::memory;
use super::status::sinew_status;
use super::tool::{sinew_tool_id, write_pose};
use crate::base::Result;
use crate::def::CollisionFilter;
use crate::world::World;

/// 1 where there is a world that has something, else 0.
///
/// # Safety
/// As of what calls it.
unsafe fn is_there(world: *const sinew_world, mut has: impl FnMut(&World) -> bool) -> u32 {
    let mut is_there = false;
    with_world(world, |world| {
        is_there = has(world);
        Ok(())
    });
    u32::from(is_there)
}

/// Writes what a filter holds.
///
/// # Safety
/// As of what calls it.
unsafe fn write_filter(filter: CollisionFilter, out_category: *mut u32, out_mask: *mut u32) -> Result<()> {
    let category = ("out_category", out_category, filter.category);
    memory::write_both(category, ("out_mask", out_mask, filter.mask))
}

/// Returns 1 if a body with this id exists in the world, else 0; also for a NULL world.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_is_valid(world: *const sinew_world, body: sinew_body_id) -> u32 {
    is_there(world, |world| world.has_body(body.id()))
}

/// Returns 1 if a tool with this id exists in the world, else 0; also for a NULL world.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_tool_is_valid(world: *const sinew_world, tool: sinew_tool_id) -> u32 {
    is_there(world, |world| world.has_tool(tool.id()))
}

/// Returns 1 if a blade with this id exists in the world, else 0; also for a NULL world.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_blade_is_valid(world: *const sinew_world, blade: sinew_blade_id) -> u32 {
    is_there(world, |world| world.has_blade(blade.id()))
}

/// Returns 1 if an attachment with this id exists in the world, else 0; also for a NULL world.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_attachment_is_valid(world: *const sinew_world, attachment: sinew_attachment_id) -> u32 {
    is_there(world, |world| world.has_attachment(attachment.id()))
}

/// Stores a pointer of the caller, nullable, with a world; snapshots do not hold it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_set_user_data(world: *mut sinew_world, user_data: *mut c_void) -> sinew_status {
    with_world_mut(world, |world| {
        world.set_user_data(user_data as usize);
        Ok(())
    })
}

/// Writes the pointer that is stored with a world; NULL by default.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_get_user_data(world: *const sinew_world, out: *mut *mut c_void) -> sinew_status {
    with_world(world, |world| {
        memory::write("out", out, world.user_data() as *mut c_void)
    })
}

/// Stores a pointer of the caller, nullable, with a tool; snapshots do not hold it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_tool_set_user_data(
    world: *mut sinew_world,
    tool: sinew_tool_id,
    user_data: *mut c_void,
) -> sinew_status {
    with_world_mut(world, |world| world.set_tool_user_data(tool.id(), user_data as usize))
}

/// Writes the pointer that is stored with a tool; NULL by default.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_tool_get_user_data(
    world: *const sinew_world,
    tool: sinew_tool_id,
    out: *mut *mut c_void,
) -> sinew_status {
    with_world(world, |world| {
        memory::write("out", out, world.tool_user_data(tool.id())? as *mut c_void)
    })
}

/// Writes the time [s] that a world has been stepped, and the number of steps; both are nullable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_get_time(
    world: *const sinew_world,
    out_time: *mut f64,
    out_steps: *mut u64,
) -> sinew_status {
    with_world(world, |world| {
        let time = ("out_time", out_time, world.time());
        memory::write_wanted(time, ("out_steps", out_steps, world.step_count()))
    })
}

/// Writes the gravitational acceleration [m/s^2] of a world, 3 floats.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_get_gravity(world: *const sinew_world, out_gravity: *mut f32) -> sinew_status {
    with_world(world, |world| {
        memory::write("out_gravity", out_gravity.cast(), world.gravity().to_array())
    })
}

/// Writes the friction coefficient of a tool.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_tool_get_friction(
    world: *const sinew_world,
    tool: sinew_tool_id,
    out: *mut f32,
) -> sinew_status {
    with_world(world, |world| memory::write("out", out, world.friction(tool.id())?))
}

/// Writes the largest force [N] that moves a tool; infinity: unlimited.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_tool_get_force_limit(
    world: *const sinew_world,
    tool: sinew_tool_id,
    out: *mut f32,
) -> sinew_status {
    with_world(world, |world| memory::write("out", out, world.force_limit(tool.id())?))
}

/// Writes the collision category and mask of a tool.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_tool_get_collision(
    world: *const sinew_world,
    tool: sinew_tool_id,
    out_category: *mut u32,
    out_mask: *mut u32,
) -> sinew_status {
    with_world(world, |world| {
        write_filter(world.collision_filter(tool.id())?, out_category, out_mask)
    })
}

/// Writes the collision category and mask of a body.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_collision(
    world: *const sinew_world,
    body: sinew_body_id,
    out_category: *mut u32,
    out_mask: *mut u32,
) -> sinew_status {
    with_body(world, body, |body| {
        write_filter(body.collision_filter(), out_category, out_mask)
    })
}

/// Writes the overpressure [Pa] of the cavities of a body at rest volume; 0 without cavities.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_pressure(
    world: *const sinew_world,
    body: sinew_body_id,
    out: *mut f32,
) -> sinew_status {
    with_body(world, body, |body| memory::write("out", out, body.pressure()))
}

/// Writes the current pose of a blade; see sinew_tool_get_pose.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_blade_get_pose(
    world: *const sinew_world,
    blade: sinew_blade_id,
    out_position: *mut f32,
    out_orientation: *mut f32,
) -> sinew_status {
    with_world(world, |world| {
        write_pose(world.blade_pose(blade.id())?, out_position, out_orientation)
    })
}

/// Writes the collision category and mask of a blade.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_blade_get_collision(
    world: *const sinew_world,
    blade: sinew_blade_id,
    out_category: *mut u32,
    out_mask: *mut u32,
) -> sinew_status {
    with_world(world, |world| {
        write_filter(world.blade_collision_filter(blade.id())?, out_category, out_mask)
    })
}
