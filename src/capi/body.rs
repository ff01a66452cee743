//! Bodies: to create them, push on them, hold them, read them and change their springs.

use glam::Vec3;

use super::definition::sinew_body_def;
use super::guard::{sinew_world, with_world, with_world_mut};
use super::id::converts;
use super::memory;
use super::status::sinew_status;
use crate::base::{BodyId, Result, ensure};
use crate::body::Body;
use crate::def::CollisionFilter;

/// Bit of the x axis.
pub const SINEW_AXIS_X: u32 = 1;
/// Bit of the y axis.
pub const SINEW_AXIS_Y: u32 = 2;
/// Bit of the z axis.
pub const SINEW_AXIS_Z: u32 = 4;

/// Id of a body; all zero means none.
#[repr(C)]
#[derive(Clone, Copy, Default)]
pub struct sinew_body_id {
    /// Slot of the body, counted from 1.
    pub index1: u32,
    /// Number of the use of that slot; upper 12 bits: tag of the world.
    pub generation: u32,
}

converts!(sinew_body_id, BodyId);

/// Borrowed array of vectors of 3 floats; vector i starts at (const char *)data + i * stride.
///
/// Nodes are in the caller's order. The function that writes the view states its lifetime.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_vec3_view {
    /// First vector.
    pub data: *const f32,
    /// Number of vectors.
    pub count: usize,
    /// [bytes] Distance from one vector to the next.
    pub stride: usize,
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
    mut call: impl FnMut(&Body) -> Result<()>,
) -> sinew_status {
    with_world(world, |world| call(world.body(body.id())?))
}

/// Runs `call` with a body to change.
///
/// # Safety
/// `world` is NULL or a world that nobody else uses.
pub(super) unsafe fn with_body_mut(
    world: *mut sinew_world,
    body: sinew_body_id,
    mut call: impl FnMut(&mut Body) -> Result<()>,
) -> sinew_status {
    with_world_mut(world, |world| call(world.body_mut(body.id())?))
}

/// Creates a body in a world, and copies everything that `def` points to.
///
/// Errors: SINEW_STATUS_CAPACITY if a node has more than springs_per_node springs (FAST_LINK).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_create(
    world: *mut sinew_world,
    def: *const sinew_body_def,
    out: *mut sinew_body_id,
) -> sinew_status {
    with_world_mut(world, |world| {
        let out = memory::output("out", out)?;
        let def = memory::definition("def", def, sinew_body_def::defaults())?;
        let body = def.placed(|definition| world.create_body(definition))?;
        world.body_mut(body)?.set_gravity_scale(def.gravity_scale)?;
        *out = body.into();
        Ok(())
    })
}

/// Destroys a body and ends the views of it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_destroy(world: *mut sinew_world, body: sinew_body_id) -> sinew_status {
    with_world_mut(world, |world| world.destroy_body(body.id()))
}

/// Adds a force [N], 3 floats, to a node for the whole next step; cleared when that succeeds.
///
/// It has no effect on a pinned or attached node, nor along a pinned axis.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_apply_force(
    world: *mut sinew_world,
    body: sinew_body_id,
    node: u32,
    force: *const f32,
) -> sinew_status {
    with_body_mut(world, body, |body| {
        body.apply_force(node, memory::vector("force", force)?)
    })
}

/// Adds forces [N], 3 * count floats, to nodes for the whole next step; see sinew_body_apply_force.
///
/// `nodes` holds `count` indices, which may repeat.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_apply_forces(
    world: *mut sinew_world,
    body: sinew_body_id,
    nodes: *const u32,
    forces: *const f32,
    count: usize,
) -> sinew_status {
    with_body_mut(world, body, |body| {
        let nodes = memory::array("nodes", nodes, count)?;
        body.apply_forces(nodes, memory::array("forces", forces.cast(), count)?)
    })
}

/// Writes a view of the node positions [m] without copying.
///
/// Lifetime: until the next step, sinew_body_set_positions, sinew_body_set_velocities, sinew_body_solve_equilibrium or
/// topology change of the body, or its destruction.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_positions(
    world: *const sinew_world,
    body: sinew_body_id,
    out: *mut sinew_vec3_view,
) -> sinew_status {
    with_body(world, body, |body| {
        memory::write("out", out, sinew_vec3_view::of(body.positions()))
    })
}

/// Writes a view of the node velocities [m/s] at the time of the positions.
///
/// A pinned node has that of its pin in the last step. The first call after a step costs about one substep. Lifetime:
/// as for sinew_body_get_positions.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_velocities(
    world: *const sinew_world,
    body: sinew_body_id,
    out: *mut sinew_vec3_view,
) -> sinew_status {
    with_body(world, body, |body| {
        memory::write("out", out, sinew_vec3_view::of(body.velocities()))
    })
}

/// Writes 1 if the surface of a body is closed, else 0.
///
/// Only a closed body pushes out what is inside it. Removing a spring on its surface opens it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_is_closed(
    world: *const sinew_world,
    body: sinew_body_id,
    out: *mut u32,
) -> sinew_status {
    with_body(world, body, |body| {
        memory::write("out", out, u32::from(body.is_closed()))
    })
}

/// Sets the collision category and mask of a body from the next step on.
///
/// Tools and bodies inside it are pushed out once they collide with it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_set_collision(
    world: *mut sinew_world,
    body: sinew_body_id,
    category: u32,
    mask: u32,
) -> sinew_status {
    with_body_mut(world, body, |body| {
        body.set_collision_filter(CollisionFilter { category, mask });
        Ok(())
    })
}

/// Moves all nodes to new positions [m], 3 * node_count floats, without a sweep.
///
/// Velocities stay. Pinned nodes move too, and attached nodes stay attached.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_set_positions(
    world: *mut sinew_world,
    body: sinew_body_id,
    positions: *const f32,
    node_count: usize,
) -> sinew_status {
    with_body_mut(world, body, |body| {
        let own = body.positions().as_ptr_range();
        let positions = memory::array_apart("positions", positions.cast(), node_count, own)?;
        body.set_positions(&positions)
    })
}

/// Sets the velocities [m/s] of all nodes, 3 * node_count floats.
///
/// Pinned nodes and pinned axes keep theirs.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_set_velocities(
    world: *mut sinew_world,
    body: sinew_body_id,
    velocities: *const f32,
    node_count: usize,
) -> sinew_status {
    with_body_mut(world, body, |body| {
        let own = body.published_velocities();
        let velocities = memory::array_apart("velocities", velocities.cast(), node_count, own)?;
        body.set_velocities(&velocities)
    })
}

/// Pins a node at its current position; no effect on a pinned node.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT if a tool holds the node.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_pin(world: *mut sinew_world, body: sinew_body_id, node: u32) -> sinew_status {
    with_body_mut(world, body, |body| body.pin(node))
}

/// Pins a node along some axes and frees it along the others.
///
/// `axes` is a sum of SINEW_AXIS_ values; 0 unpins the node. A freed axis keeps the velocity of its pin. Changing the
/// axes cancels a pending sinew_body_move_pin.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT if a tool holds it, or a node of mass 0 would be free.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_pin_axes(
    world: *mut sinew_world,
    body: sinew_body_id,
    node: u32,
    axes: u32,
) -> sinew_status {
    const AXES: [u32; 3] = [SINEW_AXIS_X, SINEW_AXIS_Y, SINEW_AXIS_Z];
    with_body_mut(world, body, |body| {
        ensure!(
            axes & !AXES.iter().sum::<u32>() == 0,
            "axes is {axes}: must be a sum of SINEW_AXIS_X, _Y and _Z"
        );
        body.pin_axes(node, AXES.map(|axis| axes & axis != 0))
    })
}

/// Unpins a node along all axes; it keeps the velocity of its pin.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT if a tool holds the node, or its mass is 0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_unpin(world: *mut sinew_world, body: sinew_body_id, node: u32) -> sinew_status {
    with_body_mut(world, body, |body| body.unpin(node))
}

/// Moves the pinned axes of a node along a line to a position [m], 3 floats, in the next step.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT if the node is not pinned, or a tool holds it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_move_pin(
    world: *mut sinew_world,
    body: sinew_body_id,
    node: u32,
    position: *const f32,
) -> sinew_status {
    with_body_mut(world, body, |body| {
        body.move_pin(node, memory::vector("position", position)?)
    })
}

/// Writes the reaction force [N] on a pinned node, 3 floats: mean of the last step, 0 on free axes.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT if the node is not pinned, or a tool holds it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_pin_force(
    world: *const sinew_world,
    body: sinew_body_id,
    node: u32,
    force: *mut f32,
) -> sinew_status {
    with_body(world, body, |body| {
        memory::write("force", force.cast::<[f32; 3]>(), body.pin_force(node)?.to_array())
    })
}

/// Connects two nodes by a spring without damping.
///
/// `stiffness` is in [N/m], `rest_length` in [m]; negative: the current distance.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT if the pair has a spring; SINEW_STATUS_CAPACITY if a node has no free slot
/// (FAST_LINK).
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
    with_body_mut(world, body, |body| body.add_spring(a, b, stiffness, rest_length))
}

/// Sets the overpressure [Pa] of the cavities at rest volume from the next step on.
///
/// Open cavities stay without pressure.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT if created with neither pressure nor enclosed_stiffness.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_set_pressure(
    world: *mut sinew_world,
    body: sinew_body_id,
    pressure: f32,
) -> sinew_status {
    with_body_mut(world, body, |body| body.set_pressure(pressure))
}

/// Removes the spring between two nodes, and the tetrahedra and the bending that have this edge.
///
/// The tetrahedra are those of SINEW_MATERIAL_TETRAHEDRA. A cavity with the edge opens.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT if there is nothing between the nodes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_remove_spring(
    world: *mut sinew_world,
    body: sinew_body_id,
    a: u32,
    b: u32,
) -> sinew_status {
    with_body_mut(world, body, |body| body.remove_spring(a, b))
}
