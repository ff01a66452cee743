//! Attachments: what tools hold of bodies and bodies of each other, and the force on several tools together.

use glam::Vec3;

use super::body::sinew_body_id;
use super::guard::{sinew_world, with_world, with_world_mut};
use super::memory;
use super::status::sinew_status;
use super::tool::sinew_tool_id;
use crate::base::Result;
use crate::ids::SlotId;
use crate::world::{Anchor, AttachmentId, SurfacePoint};

/// What a tool holds of a body, or a body of another: a plain value, all zero is "none".
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_attachment_id {
    /// Which place, from 1.
    pub index1: u32,
    /// Which of the attachments that lived there.
    pub generation: u32,
}

impl sinew_attachment_id {
    pub(super) fn id(self) -> AttachmentId {
        AttachmentId(SlotId {
            index1: self.index1,
            generation: self.generation,
        })
    }
}

impl From<AttachmentId> for sinew_attachment_id {
    fn from(AttachmentId(id): AttachmentId) -> Self {
        Self {
            index1: id.index1,
            generation: id.generation,
        }
    }
}

/// Attaches a node of a body to a tool, as sinew_body_attach_nodes does.
///
/// Errors: as there.
///
/// # Safety
/// `world` is NULL or a world nobody else uses; `out` is NULL or writable.
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

/// Attaches `count` nodes of a body to a tool, each by an attachment of its own, whose ids are written to `out`: where they lie
/// they become part of the tool, which carries them along and turns them, exactly and whatever the solver, until
/// sinew_attachment_release. Their velocities become the tool's in the next step.
///
/// What it takes to hold them, with their mass and what damps them, is part of the tool's wrench. The tool does not touch
/// them any more, nor edges and faces that have one of them. `force_limit`, N: an attachment ends with the step in which its
/// mean force was larger, and the node goes on as it was led (sinew_world_get_slipped); 0 or infinity: it holds whatever
/// comes.
///
/// An attached node cannot be pinned. Its position can be set: then it is attached where it was put. One tool may hold a node
/// more than once; then each attachment has its share of the force. An attachment ends with its body and with its tool.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT (also where a node is pinned, without mass or held by another tool),
/// SINEW_STATUS_STALE_ID, SINEW_STATUS_OUT_OF_MEMORY; then nothing is attached.
///
/// # Safety
/// `world` is NULL or a world nobody else uses; the arrays are NULL or as long as stated.
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

/// Attaches `count` points of a body's surface to a tool, each by an attachment of its own, whose ids are written to `out`.
/// `triangles` are their triangles' numbers: of those that the body was created with, or of the boundary of its tetrahedra or
/// cells; `weights` are 3 `count` parts of corners, at least 0 and 1 in sum.
///
/// It is sinew_body_attach_nodes for the corners of each point's triangle, but those whose weight is 0. So the patch about the
/// point is bonded to the tool, and does not turn against it; a point on an edge holds the edge, one in a corner the node. An
/// attachment's force is that on all its corners. Points whose triangles share corners share what holds those, by their
/// weights.
///
/// Errors: as there; SINEW_STATUS_INVALID_ARGUMENT also where there is no such triangle or weights are not as above.
///
/// # Safety
/// `world` is NULL or a world nobody else uses; the arrays are NULL or as long as stated.
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

/// Attaches `count` nodes of a body to as many nodes of another, or of the same, each pair by an attachment of its own, whose ids
/// are written to `out`. From the next step on the two are one point, whatever the solvers of the bodies; what is apart comes
/// together within some hundredths of a second, and no faster than at 0.25 m/s, however far that is. Each body may turn about the
/// point as it likes: what shall not turn takes three.
///
/// The bodies take their substeps together, those of IMPLICIT and NEWTON of 0.25 ms at most. No momentum is made; nor is any angular
/// momentum, once the points have come together. Where both points are held by pins or tools along an axis nothing is done
/// along it. Nodes, edges and faces that share such a pair of points do not touch each other.
///
/// `force_limit`, N: an attachment ends with the step in which its mean force was larger (sinew_world_get_slipped); 0 or infinity:
/// it holds whatever comes. sinew_attachment_get_force has the force on `body`; sinew_attachment_release lets go. An attachment
/// ends with either body.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT (also where the two are one node), SINEW_STATUS_STALE_ID, SINEW_STATUS_OUT_OF_MEMORY;
/// then nothing is attached.
///
/// # Safety
/// `world` is NULL or a world nobody else uses; the arrays are NULL or as long as stated.
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

/// Attaches `count` nodes of a body to as many points of the surface of another, or of the same, as sinew_body_attach_nodes_to_nodes
/// does. Points are given as to sinew_body_attach_points, and no patch is bonded: the surface may turn about the point.
///
/// Errors: as there; SINEW_STATUS_INVALID_ARGUMENT also where there is no such triangle or weights are not at least 0 and 1 in sum.
///
/// # Safety
/// `world` is NULL or a world nobody else uses; the arrays are NULL or as long as stated.
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

/// Attaches `count` points of the surface of a body to as many points of that of another, or of the same, as
/// sinew_body_attach_nodes_to_points does.
///
/// Errors: as there.
///
/// # Safety
/// `world` is NULL or a world nobody else uses; the arrays are NULL or as long as stated.
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

/// Lets go of what is attached: it goes on as it was led in the last step.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID (also where it slipped, or a body or the tool is gone).
///
/// # Safety
/// `world` is NULL or a world nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_attachment_release(
    world: *mut sinew_world,
    attachment: sinew_attachment_id,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe { with_world_mut(world, |world| world.release(attachment.id())) }
}

/// Writes the force by which what it is attached to, a tool or a body, holds a body, on the tissue, 3 floats, N: world axes, mean
/// over the last step; 0 before the first. After sinew_body_rest_state it is that by which a tool holds the body at rest.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
///
/// # Safety
/// `world` is NULL or a world nobody changes; `force` is NULL or writable for 3 floats.
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
            *memory::output("force", force.cast::<[f32; 3]>())? = held.to_array();
            Ok(())
        })
    }
}

/// Writes to `count` how many attachments ended with the last step because it took more to hold them than their limit, and to
/// `out`, which has room for `capacity` and may be NULL where that is 0, the first of their ids. They are stale: to be
/// compared with those that were kept.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT.
///
/// # Safety
/// `world` is NULL or a world nobody changes; `out` is NULL or as long as stated; `count` is NULL or writable.
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

/// Writes the force, 3 floats, N, on `count` tools together, and the torque about `point`, 3 floats, m, 3 floats, N m: world
/// axes, mean over the last step. Of the two jaws of a forceps, say.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT (also where a tool is named more than once), SINEW_STATUS_STALE_ID.
///
/// # Safety
/// `world` is NULL or a world nobody changes; `tools` is NULL or as long as stated, `point` NULL or 3 floats; `force` and
/// `torque` are NULL or writable for 3 floats.
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
            let (of_force, of_torque) = world.wrench_about(&tools, point)?;
            write_pair([("force", force, of_force), ("torque", torque, of_torque)])
        })
    }
}

/// Writes both vectors, or none.
///
/// # Safety
/// The pointers are NULL or writable for 3 floats.
unsafe fn write_pair(pair: [(&str, *mut f32, Vec3); 2]) -> Result<()> {
    // SAFETY: the same contract.
    unsafe {
        for (name, pointer, _) in pair {
            memory::output(name, pointer.cast::<[f32; 3]>())?;
        }
        for (name, pointer, vector) in pair {
            *memory::output(name, pointer.cast())? = vector.to_array();
        }
    }
    Ok(())
}
