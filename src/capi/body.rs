//! Bodies: to create them, push on them, hold them, read them and change their springs.

use glam::Vec3;

use super::definition::sinew_body_def;
use super::guard::{sinew_world, with_world, with_world_mut};
use super::memory;
use super::status::sinew_status;
use crate::base::{Error, Result};
use crate::body::Body;
use crate::def::CollisionFilter;
use crate::ids::SlotId;
use crate::world::BodyId;

/// The axis x among those that a node is held along.
pub const SINEW_AXIS_X: u32 = 1;
/// The axis y.
pub const SINEW_AXIS_Y: u32 = 2;
/// The axis z.
pub const SINEW_AXIS_Z: u32 = 4;

/// A body: a plain value, all zero is "none".
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_body_id {
    /// Which place, from 1.
    pub index1: u32,
    /// Which of the bodies that lived there.
    pub generation: u32,
}

/// Node i is at (const char *)data + i * stride, in the caller's order; valid until the next step, the next
/// set_positions, set_velocities or rest_state, the next change of topology of that body, or its end; in a sinew_frame as long
/// as that says.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_vec3_view {
    /// The first.
    pub data: *const f32,
    /// How many.
    pub count: usize,
    /// Bytes from one to the next.
    pub stride: usize,
}

impl sinew_body_id {
    pub(super) fn id(self) -> BodyId {
        BodyId(SlotId {
            index1: self.index1,
            generation: self.generation,
        })
    }
}

impl From<BodyId> for sinew_body_id {
    fn from(BodyId(id): BodyId) -> Self {
        Self {
            index1: id.index1,
            generation: id.generation,
        }
    }
}

impl sinew_vec3_view {
    pub(super) fn of(vectors: &[Vec3]) -> Self {
        Self {
            data: vectors.as_ptr().cast(),
            count: vectors.len(),
            stride: size_of::<Vec3>(),
        }
    }
}

/// Runs `call` with a body to look at.
///
/// # Safety
/// `world` is NULL or a world that nobody changes.
pub(super) unsafe fn with_body(
    world: *const sinew_world,
    body: sinew_body_id,
    call: impl FnOnce(&Body) -> Result<()>,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe { with_world(world, |world| call(world.body(body.id())?)) }
}

/// Runs `call` with a body to change.
///
/// # Safety
/// `world` is NULL or a world that nobody else uses.
pub(super) unsafe fn with_body_mut(
    world: *mut sinew_world,
    body: sinew_body_id,
    call: impl FnOnce(&mut Body) -> Result<()>,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe { with_world_mut(world, |world| call(world.body_mut(body.id())?)) }
}

/// Creates a body; copies what `def` points to.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_CAPACITY
/// (FAST_LINK: a node has more springs than springs_per_node), SINEW_STATUS_OUT_OF_MEMORY.
///
/// # Safety
/// `world` is NULL or a world nobody else uses; `def` is NULL or a definition of the size that it states, with arrays of
/// the lengths that it states; `out` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_create(
    world: *mut sinew_world,
    def: *const sinew_body_def,
    out: *mut sinew_body_id,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_world_mut(world, |world| {
            let out = memory::output("out", out)?;
            let def = memory::definition("def", def, sinew_body_def::defaults())?;
            let BodyId(id) = world.create_body(&def.definition()?)?;
            *out = sinew_body_id {
                index1: id.index1,
                generation: id.generation,
            };
            Ok(())
        })
    }
}

/// Destroys a body. Views of its positions and velocities end.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
///
/// # Safety
/// `world` is NULL or a world nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_destroy(world: *mut sinew_world, body: sinew_body_id) -> sinew_status {
    // SAFETY: the same contract.
    unsafe { with_world_mut(world, |world| world.destroy_body(body.id())) }
}

/// Adds `force`, 3 floats, N, to what acts on a node: constant over the whole next step, cleared when that is
/// SINEW_STATUS_OK; nothing on a pinned node or one that a tool holds, nor along an axis along which a node is held.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID, SINEW_STATUS_OUT_OF_MEMORY.
///
/// # Safety
/// `world` is NULL or a world nobody else uses; `force` is NULL or 3 floats.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_apply_force(
    world: *mut sinew_world,
    body: sinew_body_id,
    node: u32,
    force: *const f32,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_body_mut(world, body, |body| {
            body.apply_force(node, memory::vector("force", force)?)
        })
    }
}

/// Adds a force to what acts on each of `count` nodes, as sinew_body_apply_force does: `nodes` are `count` indices, of
/// which some may be equal, `forces` 3 `count` floats, N. Both may be NULL where `count` is 0.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID, SINEW_STATUS_OUT_OF_MEMORY; then no force is added.
///
/// # Safety
/// `world` is NULL or a world nobody else uses; the arrays are NULL or as long as stated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_apply_forces(
    world: *mut sinew_world,
    body: sinew_body_id,
    nodes: *const u32,
    forces: *const f32,
    count: usize,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_body_mut(world, body, |body| {
            let nodes = memory::array("nodes", nodes, count)?;
            body.apply_forces(nodes, memory::array("forces", forces.cast(), count)?)
        })
    }
}

/// Writes a view of where each node is, m. Nothing is copied; see sinew_vec3_view for how long it lives.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
///
/// # Safety
/// `world` is NULL or a world nobody changes; `out` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_positions(
    world: *const sinew_world,
    body: sinew_body_id,
    out: *mut sinew_vec3_view,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_body(world, body, |body| {
            *memory::output("out", out)? = sinew_vec3_view::of(body.positions());
            Ok(())
        })
    }
}

/// Writes a view of how fast each node moves at the time of the positions, m/s; a pinned node as it was led in the last
/// step. The first call after a step works them out, which takes about as long as a substep; see sinew_vec3_view for how
/// long the view lives.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
///
/// # Safety
/// `world` is NULL or a world nobody changes; `out` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_velocities(
    world: *const sinew_world,
    body: sinew_body_id,
    out: *mut sinew_vec3_view,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_body(world, body, |body| {
            *memory::output("out", out)? = sinew_vec3_view::of(body.velocities());
            Ok(())
        })
    }
}

/// Writes 1 where a body's surface encloses something, so that others can be found within it and are led out, else 0: where it is not closed,
/// and from then on that sinew_body_remove_spring has taken away an edge of it.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
///
/// # Safety
/// `world` is NULL or a world nobody changes; `out` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_is_closed(
    world: *const sinew_world,
    body: sinew_body_id,
    out: *mut u32,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_body(world, body, |body| {
            *memory::output("out", out)? = u32::from(body.is_closed());
            Ok(())
        })
    }
}

/// Has a body be of these categories and meet those of `mask`, a bit for each, from the next step on: see sinew_body_def. What of tools and
/// other bodies lies within it when they meet again is pushed out.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
///
/// # Safety
/// `world` is NULL or a world nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_set_collision(
    world: *mut sinew_world,
    body: sinew_body_id,
    category: u32,
    mask: u32,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_body_mut(world, body, |body| {
            body.set_collision_filter(CollisionFilter { category, mask });
            Ok(())
        })
    }
}

/// Puts all nodes at `positions`, 3 `node_count` floats, m. Velocities stay; pinned nodes move too; nothing is
/// swept. What tools hold they hold there.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT (also where `node_count` is not the body's), SINEW_STATUS_STALE_ID.
///
/// # Safety
/// `world` is NULL or a world nobody else uses; `positions` is NULL or as long as stated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_set_positions(
    world: *mut sinew_world,
    body: sinew_body_id,
    positions: *const f32,
    node_count: usize,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_body_mut(world, body, |body| {
            let own = body.positions().as_ptr_range();
            let positions = memory::array_apart("positions", positions.cast(), node_count, own)?;
            body.set_positions(&positions)
        })
    }
}

/// Gives all nodes `velocities`, 3 `node_count` floats, m/s; pinned nodes keep theirs, as all do along axes along which they
/// are held.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT (also where `node_count` is not the body's), SINEW_STATUS_STALE_ID.
///
/// # Safety
/// `world` is NULL or a world nobody else uses; `velocities` is NULL or as long as stated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_set_velocities(
    world: *mut sinew_world,
    body: sinew_body_id,
    velocities: *const f32,
    node_count: usize,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_body_mut(world, body, |body| {
            let own = body.published_velocities();
            let velocities = memory::array_apart("velocities", velocities.cast(), node_count, own)?;
            body.set_velocities(&velocities)
        })
    }
}

/// Holds a node where it is, from now on; nothing where it is held already.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT (also where a tool holds the node), SINEW_STATUS_STALE_ID, SINEW_STATUS_OUT_OF_MEMORY.
///
/// # Safety
/// `world` is NULL or a world nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_pin(world: *mut sinew_world, body: sinew_body_id, node: u32) -> sinew_status {
    // SAFETY: the same contract.
    unsafe { with_body_mut(world, body, |body| body.pin(node)) }
}

/// Holds a node where it is along some axes, from now on, and along no others: a symmetry plane, a rail, a sliding support.
/// `axes` is a sum of SINEW_AXIS_X, SINEW_AXIS_Y and SINEW_AXIS_Z; all three are sinew_body_pin, 0 is sinew_body_unpin.
/// Along the others the node moves as a free one does, with its mass; velocities and forces that are given to it count
/// there alone.
///
/// An axis along which it was held already stays as it is, and one that it is let go of goes on as it was led in the last
/// step. Where the axes change, what sinew_body_move_pin has asked of the node since the last step is forgotten, and so
/// are forces that act on it along an axis which is held now. A tool acts on it along its free axes alone; what it does
/// along the others the pin takes.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT (also where `axes` has other bits, a tool holds the node, or it has no mass and is
/// pinned for good), SINEW_STATUS_STALE_ID, SINEW_STATUS_OUT_OF_MEMORY.
///
/// # Safety
/// `world` is NULL or a world nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_pin_axes(
    world: *mut sinew_world,
    body: sinew_body_id,
    node: u32,
    axes: u32,
) -> sinew_status {
    const AXES: [u32; 3] = [SINEW_AXIS_X, SINEW_AXIS_Y, SINEW_AXIS_Z];
    // SAFETY: the same contract.
    unsafe {
        with_body_mut(world, body, |body| {
            if axes & !AXES.iter().sum::<u32>() != 0 {
                return Err(Error::invalid(format!(
                    "axes is {axes}: must be a sum of SINEW_AXIS_X, _Y and _Z"
                )));
            }
            body.pin_axes(node, AXES.map(|axis| axes & axis != 0))
        })
    }
}

/// Lets go of a node along all axes: it goes on as it was led in the last step; nothing where it is not held.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT (also where a tool holds the node, or it has no mass and is pinned for good),
/// SINEW_STATUS_STALE_ID.
///
/// # Safety
/// `world` is NULL or a world nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_unpin(world: *mut sinew_world, body: sinew_body_id, node: u32) -> sinew_status {
    // SAFETY: the same contract.
    unsafe { with_body_mut(world, body, |body| body.unpin(node)) }
}

/// Leads a pinned node on a straight line to `position`, 3 floats, m: there at the end of the next step; one that is held
/// along some axes alone along those.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT (also where the node is not pinned, or a tool holds it), SINEW_STATUS_STALE_ID.
///
/// # Safety
/// `world` is NULL or a world nobody else uses; `position` is NULL or 3 floats.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_move_pin(
    world: *mut sinew_world,
    body: sinew_body_id,
    node: u32,
    position: *const f32,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_body_mut(world, body, |body| {
            body.move_pin(node, memory::vector("position", position)?)
        })
    }
}

/// Writes what holds a pinned node against its springs and its weight, 3 floats, N, mean over the last step; 0 along axes
/// along which it is not held.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT (also where the node is not pinned, or a tool holds it), SINEW_STATUS_STALE_ID.
///
/// # Safety
/// `world` is NULL or a world nobody changes; `force` is NULL or writable for 3 floats.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_pin_force(
    world: *const sinew_world,
    body: sinew_body_id,
    node: u32,
    force: *mut f32,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_body(world, body, |body| {
            *memory::output("force", force.cast::<[f32; 3]>())? = body.pin_force(node)?.to_array();
            Ok(())
        })
    }
}

/// Joins two nodes by a spring without damping: `stiffness` in N/m, `rest_length` in m, below 0: the current distance.
/// One spring per pair.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT (also where the pair has a spring), SINEW_STATUS_STALE_ID,
/// SINEW_STATUS_CAPACITY (FAST_LINK: a node has no free place), SINEW_STATUS_OUT_OF_MEMORY.
///
/// # Safety
/// `world` is NULL or a world nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_add_spring(
    world: *mut sinew_world,
    body: sinew_body_id,
    a: u32,
    b: u32,
    stiffness: f32,
    rest_length: f32,
) -> sinew_status {
    // Only a number can mean the current distance: NaN and -infinity are refused as lengths.
    let current = rest_length < 0.0 && rest_length.is_finite();
    let rest_length = (!current).then_some(rest_length);
    // SAFETY: the same contract.
    unsafe { with_body_mut(world, body, |body| body.add_spring(a, b, stiffness, rest_length)) }
}

/// Makes the pressure of a body's cavities this, Pa, where they have their volumes at rest, from the next step on: see `pressure` of
/// sinew_body_def. A cavity that was cut open stays without. A body that is to be inflated later is created with a pressure or an
/// enclosed_stiffness.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT (also where the body was created with neither), SINEW_STATUS_STALE_ID.
///
/// # Safety
/// `world` is NULL or a world nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_set_pressure(
    world: *mut sinew_world,
    body: sinew_body_id,
    pressure: f32,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe { with_body_mut(world, body, |body| body.set_pressure(pressure)) }
}

/// Removes the spring between two nodes.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT (also where there is none), SINEW_STATUS_STALE_ID.
///
/// # Safety
/// `world` is NULL or a world nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_remove_spring(
    world: *mut sinew_world,
    body: sinew_body_id,
    a: u32,
    b: u32,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe { with_body_mut(world, body, |body| body.remove_spring(a, b)) }
}
