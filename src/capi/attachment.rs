//! Attachments: what tools hold of bodies and bodies of each other, and the force on several tools together.

use super::body::sinew_body_id;
use super::guard::{sinew_world, with_world, with_world_mut};
use super::id::converts;
use super::memory;
use super::status::sinew_status;
use super::tool::{sinew_tool_id, write_wrench};
use crate::base::{AttachmentId, Result};
use crate::def::{Anchor, SurfacePoint};

/// Id of an attachment or a suture; all zero means none.
#[repr(C)]
#[derive(Clone, Copy, Default)]
pub struct sinew_attachment_id {
    /// Slot of the attachment, counted from 1.
    pub index1: u32,
    /// Number of the use of that slot.
    pub generation: u32,
}

converts!(sinew_attachment_id, AttachmentId);

/// Attaches one node of a body to a tool, like sinew_body_attach_nodes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_attach_node(
    world: *mut sinew_world,
    body: sinew_body_id,
    node: u32,
    tool: sinew_tool_id,
    force_limit: f32,
    out: *mut sinew_attachment_id,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_world_mut(world, |world| {
            let out = memory::output("out", out)?;
            *out = world.attach_node(body.id(), node, tool.id(), force_limit)?.into();
            Ok(())
        })
    }
}

/// Attaches nodes of a body rigidly to a tool, each by its own attachment.
///
/// The nodes move with the tool until sinew_attachment_release; the tool does not collide with them. The holding
/// force is part of the tool's wrench. `out` receives `count` ids. `force_limit` [N]: the attachment breaks after a
/// step with a larger mean force; 0 or infinity: unlimited. Attachments end with the body or tool. On failure
/// nothing is attached.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT if a node is pinned, massless or held by another tool.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_attach_nodes(
    world: *mut sinew_world,
    body: sinew_body_id,
    nodes: *const u32,
    count: usize,
    tool: sinew_tool_id,
    force_limit: f32,
    out: *mut sinew_attachment_id,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_world_mut(world, |world| {
            let nodes = memory::array("nodes", nodes, count)?;
            let out = memory::output_array("out", out, count)?;
            write(out, world.attach_nodes(body.id(), nodes, tool.id(), force_limit)?);
            Ok(())
        })
    }
}

/// Attaches surface points of a body rigidly to a tool, each by its own attachment.
///
/// `triangles` holds `count` indices into the body's surface, `weights` 3 * count corner weights, at least 0 with
/// sum 1. Every corner with a weight is attached, so that the patch cannot rotate; its forces add up. Corners
/// shared by points split their force by weight. Otherwise like sinew_body_attach_nodes.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT if a corner is pinned, massless or held by another tool.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_attach_points(
    world: *mut sinew_world,
    body: sinew_body_id,
    triangles: *const u32,
    weights: *const f32,
    count: usize,
    tool: sinew_tool_id,
    force_limit: f32,
    out: *mut sinew_attachment_id,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_world_mut(world, |world| {
            let given = surface_points(["triangles", "weights"], triangles, weights, count)?;
            let mut points = crate::base::memory::reserved(count)?;
            points.extend(given);
            let out = memory::output_array("out", out, count)?;
            write(out, world.attach_points(body.id(), &points, tool.id(), force_limit)?);
            Ok(())
        })
    }
}

/// Attaches nodes of a body to nodes of another or the same body, pair by pair.
///
/// Each pair becomes one point, about which both may rotate; a gap closes at no more than 0.25 m/s. Momentum is
/// conserved. Paired nodes and their features do not collide. `out` receives `count` ids. `force_limit` [N]: breaks
/// after a step with a larger mean force; 0 or infinity: unlimited. Attachments end with either body. On failure
/// nothing is attached.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT if both nodes of a pair are the same.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_attach_nodes_to_nodes(
    world: *mut sinew_world,
    body: sinew_body_id,
    nodes: *const u32,
    count: usize,
    other: sinew_body_id,
    other_nodes: *const u32,
    force_limit: f32,
    out: *mut sinew_attachment_id,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_world_mut(world, |world| {
            let nodes = anchors_of_nodes("nodes", nodes, count)?;
            let other_nodes = anchors_of_nodes("other_nodes", other_nodes, count)?;
            let out = memory::output_array("out", out, count)?;
            let ids = world.attach_to_body(body.id(), &nodes, other.id(), &other_nodes, force_limit)?;
            write(out, ids);
            Ok(())
        })
    }
}

/// Attaches nodes of a body to surface points of another or the same body, pair by pair.
///
/// `other_triangles` and `other_weights` are as in sinew_body_attach_points, but the surface may rotate about each
/// point. Otherwise like sinew_body_attach_nodes_to_nodes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_attach_nodes_to_points(
    world: *mut sinew_world,
    body: sinew_body_id,
    nodes: *const u32,
    count: usize,
    other: sinew_body_id,
    other_triangles: *const u32,
    other_weights: *const f32,
    force_limit: f32,
    out: *mut sinew_attachment_id,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_world_mut(world, |world| {
            let nodes = anchors_of_nodes("nodes", nodes, count)?;
            let names = ["other_triangles", "other_weights"];
            let points = anchors_of_points(names, other_triangles, other_weights, count)?;
            let out = memory::output_array("out", out, count)?;
            write(
                out,
                world.attach_to_body(body.id(), &nodes, other.id(), &points, force_limit)?,
            );
            Ok(())
        })
    }
}

/// Attaches surface points of a body to surface points of another or the same body, pair by pair.
///
/// Points are as in sinew_body_attach_nodes_to_points, the rest as in sinew_body_attach_nodes_to_nodes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_attach_points_to_points(
    world: *mut sinew_world,
    body: sinew_body_id,
    triangles: *const u32,
    weights: *const f32,
    count: usize,
    other: sinew_body_id,
    other_triangles: *const u32,
    other_weights: *const f32,
    force_limit: f32,
    out: *mut sinew_attachment_id,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_world_mut(world, |world| {
            let points = anchors_of_points(["triangles", "weights"], triangles, weights, count)?;
            let names = ["other_triangles", "other_weights"];
            let others = anchors_of_points(names, other_triangles, other_weights, count)?;
            let out = memory::output_array("out", out, count)?;
            write(
                out,
                world.attach_to_body(body.id(), &points, other.id(), &others, force_limit)?,
            );
            Ok(())
        })
    }
}

/// # Safety
/// `nodes` is NULL or as long as stated.
unsafe fn anchors_of_nodes(name: &str, nodes: *const u32, count: usize) -> Result<Vec<Anchor>> {
    // SAFETY: the same contract.
    let nodes = unsafe { memory::array(name, nodes, count)? };
    let mut anchors = crate::base::memory::reserved(count)?;
    anchors.extend(nodes.iter().map(|&node| Anchor::Node(node)));
    Ok(anchors)
}

/// # Safety
/// As for [`surface_points`].
unsafe fn anchors_of_points(
    names: [&str; 2],
    triangles: *const u32,
    weights: *const f32,
    count: usize,
) -> Result<Vec<Anchor>> {
    // SAFETY: the same contract.
    let points = unsafe { surface_points(names, triangles, weights, count)? };
    let mut anchors = crate::base::memory::reserved(count)?;
    anchors.extend(points.map(Anchor::Point));
    Ok(anchors)
}

/// Points of a surface by the arrays of these names.
///
/// # Safety
/// The arrays are NULL or as long as stated, and nobody changes them while the points are taken.
unsafe fn surface_points<'a>(
    [of_triangles, of_weights]: [&str; 2],
    triangles: *const u32,
    weights: *const f32,
    count: usize,
) -> Result<impl Iterator<Item = SurfacePoint> + 'a> {
    // SAFETY: the same contract.
    let (triangles, weights): (&'a [u32], &'a [[f32; 3]]) = unsafe {
        let triangles = memory::array(of_triangles, triangles, count)?;
        (triangles, memory::array(of_weights, weights.cast(), count)?)
    };
    let pairs = triangles.iter().zip(weights);
    Ok(pairs.map(|(&triangle, &weights)| SurfacePoint { triangle, weights }))
}

fn write(out: &mut [sinew_attachment_id], ids: Vec<AttachmentId>) {
    for (out, id) in out.iter_mut().zip(ids) {
        *out = id.into();
    }
}

/// Releases an attachment or cuts a suture; its nodes keep their velocities.
///
/// Errors: SINEW_STATUS_STALE_ID also if it broke, or if a body or the tool was destroyed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_attachment_release(
    world: *mut sinew_world,
    attachment: sinew_attachment_id,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe { with_world_mut(world, |world| world.release(attachment.id())) }
}

/// Writes the force of an attachment on its body, averaged over the last step.
///
/// `force` [N] receives 3 floats in world axes, 0 before the first step. After sinew_body_rest_state it is the
/// force of the tool in equilibrium.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_attachment_get_force(
    world: *const sinew_world,
    attachment: sinew_attachment_id,
    force: *mut f32,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_world(world, |world| {
            let held = world.attachment_force(attachment.id())?;
            memory::write("force", force.cast::<[f32; 3]>(), held.to_array())
        })
    }
}

/// Writes the attachments that broke in the last step because of their force_limit.
///
/// `out` receives at most `capacity` ids, `count` the number that broke. The ids are stale: compare them with those
/// you stored.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_get_slipped(
    world: *const sinew_world,
    out: *mut sinew_attachment_id,
    capacity: usize,
    count: *mut usize,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_world(world, |world| {
            let out = memory::output_array("out", out, capacity)?;
            let count = memory::output("count", count)?;
            let slipped = world.slipped();
            for (out, &id) in out.iter_mut().zip(slipped) {
                *out = id.into();
            }
            *count = slipped.len();
            Ok(())
        })
    }
}

/// Writes the total force and torque on several tools, averaged over the last step, in world axes.
///
/// `tools` holds `count` different ids. `point` [m] is 3 floats. `force` [N] and `torque` [N m], about `point`,
/// receive 3 floats each; both are nullable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_tools_get_wrench(
    world: *const sinew_world,
    tools: *const sinew_tool_id,
    count: usize,
    point: *const f32,
    force: *mut f32,
    torque: *mut f32,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_world(world, |world| {
            let given = memory::array("tools", tools, count)?;
            let point = memory::vector("point", point)?;
            let mut tools = crate::base::memory::reserved(count)?;
            tools.extend(given.iter().map(|tool| tool.id()));
            write_wrench(world.wrench_about(&tools, point)?, force, torque)
        })
    }
}
