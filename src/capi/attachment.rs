//! Attachments: what tools hold of bodies and bodies of each other, and the force on several tools together.

use super::body::sinew_body_id;
use super::guard::{guard, sinew_world, with_world, with_world_mut};
use super::id::converts;
use super::memory::{self, Versioned, versioned};
use super::status::sinew_status;
use super::tool::{sinew_tool_id, write_wrench};
use crate::base::memory::collected;
use crate::base::{AttachmentId, BodyId, Result, ToolId, ensure};
use crate::def::{Anchor, SurfacePoint};
use crate::world::World;

/// Id of an attachment or a suture; all zero means none.
#[repr(C)]
#[derive(Clone, Copy, Default)]
pub struct sinew_attachment_id {
    /// Slot of the attachment, counted from 1.
    pub index1: u32,
    /// Number of the use of that slot; upper 12 bits: tag of the world.
    pub generation: u32,
}

converts!(sinew_attachment_id, AttachmentId);

/// Nodes or surface points of a body that are attached to a tool or a body.
///
/// Filled by sinew_attachment_def_init; read only during sinew_attachment_create.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_attachment_def {
    /// Size of this struct; sinew_attachment_def_init sets it.
    pub struct_size: usize,
    /// Body whose nodes or points are attached; no default.
    pub body: sinew_body_id,
    /// Tool that they are attached to; all zero (default): those of `other`.
    pub tool: sinew_tool_id,
    /// Body that they are attached to; all zero (default): the tool.
    pub other: sinew_body_id,
    /// Number of attachments; default 0.
    pub count: usize,
    /// `count` node indices; nullable: points.
    pub nodes: *const u32,
    /// `count` surface triangle indices of points; nullable: nodes.
    pub triangles: *const u32,
    /// 3 * count corner weights of them, at least 0 with sum 1; nullable: nodes.
    pub weights: *const f32,
    /// `count` node indices of `other`; nullable: points or a tool.
    pub other_nodes: *const u32,
    /// `count` surface triangle indices of `other`; nullable: nodes or a tool.
    pub other_triangles: *const u32,
    /// 3 * count corner weights of these points; nullable: nodes or a tool.
    pub other_weights: *const f32,
    /// [N] Mean force above which it breaks; infinity (default) or 0: unlimited.
    pub force_limit: f32,
}

versioned! { sinew_attachment_def }

/// Nodes, or points of a surface; of one end of attachments.
enum AttachedEnds<'a> {
    Nodes(&'a [u32]),
    Points(Vec<SurfacePoint>),
}

impl sinew_attachment_def {
    fn defaults() -> Self {
        Self {
            force_limit: f32::INFINITY,
            ..Self::empty()
        }
    }

    /// # Safety
    /// The arrays are NULL or as long as stated, and nobody changes them meanwhile.
    unsafe fn create(&self, world: &mut World) -> Result<Vec<AttachmentId>> {
        let names = ["nodes", "triangles", "weights"];
        let other_names = ["other_nodes", "other_triangles", "other_weights"];
        let arrays = (self.nodes, self.triangles, self.weights);
        let other_arrays = (self.other_nodes, self.other_triangles, self.other_weights);
        let ends = ends(names, arrays, self.count)?;
        let (body, limit) = (self.body.id(), self.force_limit);
        let (nodes, triangles, weights) = other_arrays;
        let is_given = !(nodes.is_null() && triangles.is_null() && weights.is_null());
        if self.other.id() == BodyId::default() && !is_given {
            return match ends {
                AttachedEnds::Nodes(nodes) => world.attach_nodes(body, nodes, self.tool.id(), limit),
                AttachedEnds::Points(points) => world.attach_points(body, &points, self.tool.id(), limit),
            };
        }
        ensure!(
            self.tool.id() == ToolId::default(),
            "tool is given beside other or its nodes or points"
        );
        let others = self::ends(other_names, other_arrays, self.count)?.anchors()?;
        world.attach_to_body(body, &ends.anchors()?, self.other.id(), &others, limit)
    }
}

impl AttachedEnds<'_> {
    fn anchors(&self) -> Result<Vec<Anchor>> {
        match self {
            Self::Nodes(nodes) => collected(nodes.iter().copied().map(Anchor::Node)),
            Self::Points(points) => collected(points.iter().copied().map(Anchor::Point)),
        }
    }
}

/// The nodes of an array, or the points of two, by these names.
///
/// # Safety
/// The arrays are NULL or as long as stated, and nobody changes them while the ends are used.
unsafe fn ends<'a>(
    [of_nodes, of_triangles, of_weights]: [&str; 3],
    (nodes, triangles, weights): (*const u32, *const u32, *const f32),
    count: usize,
) -> Result<AttachedEnds<'a>> {
    if triangles.is_null() && weights.is_null() {
        ensure!(!nodes.is_null() || count == 0, "{of_nodes} and {of_triangles} are NULL");
        return memory::array(of_nodes, nodes, count).map(AttachedEnds::Nodes);
    }
    ensure!(nodes.is_null(), "{of_nodes} is given beside points");
    let triangles = memory::array(of_triangles, triangles, count)?;
    let weights = memory::array(of_weights, weights.cast::<[f32; 3]>(), count)?;
    let pairs = triangles.iter().zip(weights);
    let points = collected(pairs.map(|(&triangle, &weights)| SurfacePoint { triangle, weights }))?;
    Ok(AttachedEnds::Points(points))
}

/// Fills an attachment definition with its defaults; `struct_size` is sizeof(sinew_attachment_def).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_attachment_def_init(def: *mut sinew_attachment_def, struct_size: usize) -> sinew_status {
    guard(|| memory::initialise(def, struct_size, sinew_attachment_def::defaults()))
}

/// Attaches nodes or surface points of a body to a tool or to a body, each by its own attachment.
///
/// A tool holds them rigidly and does not collide with them. Two bodies join at one point that both rotate about; a gap
/// closes at no more than 0.25 m/s. `out_attachments` receives `count` ids.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT if a node for a tool is pinned, massless or held, or both ends are the same.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_attachment_create(
    world: *mut sinew_world,
    def: *const sinew_attachment_def,
    out_attachments: *mut sinew_attachment_id,
) -> sinew_status {
    with_world_mut(world, |world| {
        let def = memory::definition("def", def, sinew_attachment_def::defaults())?;
        let out = memory::output_array("out_attachments", out_attachments, def.count)?;
        for (out, id) in out.iter_mut().zip(def.create(world)?) {
            *out = id.into();
        }
        Ok(())
    })
}

/// Releases an attachment or cuts a suture; its nodes keep their velocities.
///
/// Errors: SINEW_STATUS_STALE_ID also if it broke, or if a body or the tool was destroyed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_attachment_release(
    world: *mut sinew_world,
    attachment: sinew_attachment_id,
) -> sinew_status {
    with_world_mut(world, |world| world.release(attachment.id()))
}

/// Writes the force [N] of an attachment on its body, averaged over the last step.
///
/// `out_force` receives 3 floats in world axes; after sinew_body_solve_equilibrium those at rest.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_attachment_get_force(
    world: *const sinew_world,
    attachment: sinew_attachment_id,
    out_force: *mut f32,
) -> sinew_status {
    with_world(world, |world| {
        let held = world.attachment_force(attachment.id())?;
        memory::write("out_force", out_force.cast::<[f32; 3]>(), held.to_array())
    })
}

/// Writes the attachments that broke in the last step because of their force_limit.
///
/// `out_attachments` receives at most `capacity` ids, which are stale, `out_count` their number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_get_broken_attachments(
    world: *const sinew_world,
    out_attachments: *mut sinew_attachment_id,
    capacity: usize,
    out_count: *mut usize,
) -> sinew_status {
    with_world(world, |world| {
        let found = world.slipped().iter().map(|&id| id.into());
        memory::write_found(found, ("out_attachments", out_attachments, capacity), out_count)
    })
}

/// Writes the total force and torque on several tools, averaged over the last step, in world axes.
///
/// `tools` holds `count` different ids. `point` [m] is 3 floats. `out_force` [N] and `out_torque` [N m], about `point`,
/// receive 3 floats each; both are nullable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_get_total_wrench(
    world: *const sinew_world,
    tools: *const sinew_tool_id,
    count: usize,
    point: *const f32,
    out_force: *mut f32,
    out_torque: *mut f32,
) -> sinew_status {
    with_world(world, |world| {
        let given = memory::array("tools", tools, count)?;
        let point = memory::vector("point", point)?;
        let tools = collected(given.iter().map(|tool| tool.id()))?;
        write_wrench(world.wrench_about(&tools, point)?, out_force, out_torque)
    })
}
