//! Tools.

use glam::{Quat, Vec3};

use super::guard::{guard, sinew_world, with_world, with_world_mut};
use super::id::converts;
use super::memory::{self, Versioned, versioned};
use super::status::sinew_status;
use crate::base::{Error, Result, ToolId};
use crate::contact::{Pose, Shape, ToolDefinition};
use crate::def::{CollisionFilter, Detection};

/// Id of a tool; all zero means none.
#[repr(C)]
#[derive(Clone, Copy, Default)]
pub struct sinew_tool_id {
    /// Slot of the tool, counted from 1.
    pub index1: u32,
    /// Number of the use of that slot; upper 12 bits: tag of the world.
    pub generation: u32,
}

converts!(sinew_tool_id, ToolId);

/// Sphere about the origin.
pub const SINEW_SHAPE_SPHERE: u32 = 0;
/// Cylinder along y about the origin, with round caps.
pub const SINEW_SHAPE_CAPSULE: u32 = 1;
/// Plane y = 0 with free space above.
pub const SINEW_SHAPE_PLANE: u32 = 2;
/// Closed triangle mesh.
pub const SINEW_SHAPE_MESH: u32 = 3;

/// Box along the axes about the origin, with sharp edges.
pub const SINEW_SHAPE_BOX: u32 = 4;

/// Exact distances, swept over the step.
pub const SINEW_DETECTION_EXACT: u32 = 0;
/// Rays cast through depth images.
pub const SINEW_DETECTION_IMAGE_SPACE: u32 = 1;
/// Sampled signed distance; only for mesh and box tools.
pub const SINEW_DETECTION_DISTANCE_FIELD: u32 = 2;

/// Shape and settings of a rigid tool.
///
/// Filled by sinew_tool_def_init; read only during sinew_tool_create.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_tool_def {
    /// Size of this struct; sinew_tool_def_init sets it.
    pub struct_size: usize,
    /// Shape of the tool, a sinew_shape value.
    pub shape: u32,
    /// [m] Sphere, capsule: above 0, at most 1e9 with half_length; no default.
    pub radius: f32,
    /// [m] Capsule: distance from the center to the center of a cap.
    ///
    /// IMAGE_SPACE allows at most 10,000 times the radius. Contact points are accurate to 1e-7 of it.
    pub half_length: f32,
    /// Reserved; must be 0.
    pub reserved0: u32,
    /// [m] Mesh: 3 * node_count floats; nullable for other shapes.
    pub positions: *const f32,
    /// Number of nodes of the mesh.
    pub node_count: usize,
    /// 3 * triangle_count node indices of a closed surface, outward; nullable for other shapes.
    pub triangles: *const u32,
    /// Number of triangles of the mesh.
    pub triangle_count: usize,
    /// Contact detection, a sinew_detection value; default EXACT.
    pub detection: u32,
    /// Coulomb coefficient, at least 0; default 0.
    pub friction: f32,
    /// [m] Initial position; default 0 0 0.
    pub position: [f32; 3],
    /// Initial orientation; default 0 0 0 1.
    pub orientation: [f32; 4],
    /// Reserved; must be 0.
    pub reserved: u32,
    /// [m] Mesh, box: size of a pixel (images) or cell (distance field); 0 (default): automatic.
    ///
    /// Automatic is 1/256 (image) or 1/96 (field) of the longest extent, at most 1/4 of the shortest. Refused
    /// above 2^24 of them, or with none inside. Memory: 24 bytes a pixel, 4 a sample.
    pub resolution: f32,
    /// [N] Largest force that moves the tool; infinity (default) or 0: unlimited.
    ///
    /// Beyond it the tool stops short of its pose; see sinew_tool_get_pose.
    pub force_limit: f32,
    /// Collision categories of this tool; default 1. See base.h.
    pub collision_category: u32,
    /// Categories that it collides with; default 0xffffffff.
    pub collision_mask: u32,
    /// [m] Box: distance from the center to each side, above 0, at most 1e9.
    pub half_extents: [f32; 3],
}

versioned! { sinew_tool_def { resolution, half_extents } }

/// The way of detection of this number.
pub(super) fn detection(name: &str, number: u32) -> Result<Detection> {
    match number {
        SINEW_DETECTION_EXACT => Ok(Detection::Exact),
        SINEW_DETECTION_IMAGE_SPACE => Ok(Detection::ImageSpace),
        SINEW_DETECTION_DISTANCE_FIELD => Ok(Detection::DistanceField),
        unknown => Err(Error::invalid(format!("{name} is {unknown}: no SINEW_DETECTION_..."))),
    }
}

impl sinew_tool_def {
    fn defaults() -> Self {
        Self {
            shape: SINEW_SHAPE_SPHERE,
            detection: SINEW_DETECTION_EXACT,
            orientation: [0.0, 0.0, 0.0, 1.0],
            force_limit: f32::INFINITY,
            collision_category: CollisionFilter::default().category,
            collision_mask: CollisionFilter::default().mask,
            ..Self::empty()
        }
    }

    /// The definition with its arrays found.
    ///
    /// # Safety
    /// Every array is NULL or has as many entries as the definition states.
    unsafe fn definition<'a>(&self) -> Result<ToolDefinition<'a>> {
        memory::reserved("reserved0", self.reserved0)?;
        memory::reserved("reserved", self.reserved)?;
        let detection = detection("detection", self.detection)?;
        let shape = match self.shape {
            SINEW_SHAPE_SPHERE => Shape::Sphere { radius: self.radius },
            SINEW_SHAPE_CAPSULE => Shape::Capsule {
                radius: self.radius,
                half_length: self.half_length,
            },
            SINEW_SHAPE_PLANE => Shape::Plane,
            SINEW_SHAPE_BOX => Shape::Box {
                half_extents: Vec3::from_array(self.half_extents),
            },
            SINEW_SHAPE_MESH => Shape::Mesh {
                positions: memory::array("positions", self.positions.cast(), self.node_count)?,
                triangles: memory::array("triangles", self.triangles.cast(), self.triangle_count)?,
            },
            unknown => return Err(Error::invalid(format!("shape is {unknown}: no SINEW_SHAPE_..."))),
        };
        Ok(ToolDefinition {
            shape,
            detection,
            resolution: self.resolution,
            friction: self.friction,
            force_limit: self.force_limit,
            filter: CollisionFilter {
                category: self.collision_category,
                mask: self.collision_mask,
            },
            pose: Pose {
                position: Vec3::from_array(self.position),
                orientation: Quat::from_array(self.orientation),
            },
        })
    }
}

/// Fills a tool definition with its defaults; `struct_size` is sizeof(sinew_tool_def).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_tool_def_init(def: *mut sinew_tool_def, struct_size: usize) -> sinew_status {
    guard(|| memory::initialise(def, struct_size, sinew_tool_def::defaults()))
}

/// Creates a tool in a world, and copies everything that `def` points to.
///
/// Errors: SINEW_STATUS_UNSUPPORTED for DISTANCE_FIELD of a round shape, or either of a plane.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_tool_create(
    world: *mut sinew_world,
    def: *const sinew_tool_def,
    out: *mut sinew_tool_id,
) -> sinew_status {
    with_world_mut(world, |world| {
        let out = memory::output("out", out)?;
        let def = memory::definition("def", def, sinew_tool_def::defaults())?;
        *out = world.create_tool(&def.definition()?)?.into();
        Ok(())
    })
}

/// Destroys a tool and releases everything attached to it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_tool_destroy(world: *mut sinew_world, tool: sinew_tool_id) -> sinew_status {
    with_world_mut(world, |world| world.destroy_tool(tool.id()))
}

/// Moves a tool to a new pose during the next step, along a line and the shorter arc.
///
/// `position` [m] is 3 floats; `orientation` is nullable: unchanged. If force_limit stops the tool early, the rest is
/// discarded: call again for every step.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT if a haptic handle drives the tool.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_tool_set_pose(
    world: *mut sinew_world,
    tool: sinew_tool_id,
    position: *const f32,
    orientation: *const f32,
) -> sinew_status {
    with_world_mut(world, |world| {
        let position = memory::vector("position", position)?;
        let orientation = memory::optional_orientation("orientation", orientation)?;
        world.set_pose(tool.id(), position, orientation)
    })
}

/// Sets the friction coefficient of a tool, at least 0, from the next step on.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_tool_set_friction(
    world: *mut sinew_world,
    tool: sinew_tool_id,
    friction: f32,
) -> sinew_status {
    with_world_mut(world, |world| world.set_friction(tool.id(), friction))
}

/// Sets the largest force [N] that moves a tool, from the next step on; 0 or infinity: unlimited.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_tool_set_force_limit(
    world: *mut sinew_world,
    tool: sinew_tool_id,
    force_limit: f32,
) -> sinew_status {
    with_world_mut(world, |world| world.set_force_limit(tool.id(), force_limit))
}

/// Sets the collision category and mask of a tool from the next step on.
///
/// With mask 0 it collides with nothing. Tissue inside is pushed out once it collides.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_tool_set_collision(
    world: *mut sinew_world,
    tool: sinew_tool_id,
    category: u32,
    mask: u32,
) -> sinew_status {
    with_world_mut(world, |world| {
        world.set_collision_filter(tool.id(), CollisionFilter { category, mask })
    })
}

/// Writes the current pose of a tool, which a force_limit can keep short of the commanded one.
///
/// `out_position` [m] receives 3 floats and `out_orientation` 4 floats; both are nullable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_tool_get_pose(
    world: *const sinew_world,
    tool: sinew_tool_id,
    out_position: *mut f32,
    out_orientation: *mut f32,
) -> sinew_status {
    with_world(world, |world| {
        write_pose(world.pose(tool.id())?, out_position, out_orientation)
    })
}

/// Writes the pose that the last step moved a tool to, before the force_limit.
///
/// Both outputs are nullable. Replaying these poses reproduces the steps, also of a haptic handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_tool_get_target(
    world: *const sinew_world,
    tool: sinew_tool_id,
    out_position: *mut f32,
    out_orientation: *mut f32,
) -> sinew_status {
    with_world(world, |world| {
        write_pose(world.tool_target(tool.id())?, out_position, out_orientation)
    })
}

/// Writes a pose where it is wanted.
///
/// # Safety
/// Each place is NULL or writable: for 3 floats, and for 4.
pub(super) unsafe fn write_pose(pose: Pose, position: *mut f32, orientation: *mut f32) -> Result<()> {
    let position = ("out_position", position.cast(), pose.position.to_array());
    let orientation = ("out_orientation", orientation.cast(), pose.orientation.to_array());
    memory::write_wanted(position, orientation)
}

/// Writes a force and a torque where they are wanted.
///
/// # Safety
/// Each place is NULL or writable for 3 floats.
pub(super) unsafe fn write_wrench(wrench: (Vec3, Vec3), force: *mut f32, torque: *mut f32) -> Result<()> {
    let force = ("force", force.cast(), wrench.0.to_array());
    let torque = ("torque", torque.cast(), wrench.1.to_array());
    memory::write_wanted(force, torque)
}

/// Writes the force and torque on a tool, averaged over the last step, in world axes.
///
/// `force` [N] and `torque` [N m], about the position, receive 3 floats each; both are nullable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_tool_get_wrench(
    world: *const sinew_world,
    tool: sinew_tool_id,
    force: *mut f32,
    torque: *mut f32,
) -> sinew_status {
    with_world(world, |world| write_wrench(world.wrench(tool.id())?, force, torque))
}
