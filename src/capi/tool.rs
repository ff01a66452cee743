//! Tools.

use std::mem::offset_of;

use glam::{Quat, Vec3};

use super::guard::{guard, sinew_world, with_world, with_world_mut};
use super::memory::{self, Versioned};
use super::status::sinew_status;
use crate::base::{Error, Result};
use crate::contact::{Pose, Shape, ToolDefinition};
use crate::def::{CollisionFilter, Detection};
use crate::ids::SlotId;
use crate::world::ToolId;

/// A tool: a plain value, all zero is "none".
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_tool_id {
    /// Which place, from 1.
    pub index1: u32,
    /// Which of the tools that lived there.
    pub generation: u32,
}

/// A ball about the origin.
pub const SINEW_SHAPE_SPHERE: u32 = 0;
/// A cylinder along y about the origin, with round caps.
pub const SINEW_SHAPE_CAPSULE: u32 = 1;
/// The plane y = 0 with free space above.
pub const SINEW_SHAPE_PLANE: u32 = 2;
/// A closed mesh.
pub const SINEW_SHAPE_MESH: u32 = 3;

/// Exact distances, swept over the step.
pub const SINEW_DETECTION_EXACT: u32 = 0;
/// Virtual rays cast through a depth buffer.
pub const SINEW_DETECTION_IMAGE_SPACE: u32 = 1;
/// A sampled signed distance; for meshes alone.
pub const SINEW_DETECTION_DISTANCE_FIELD: u32 = 2;

/// What a tool is. Filled by sinew_tool_def_init; used only during sinew_tool_create.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_tool_def {
    /// Set by sinew_tool_def_init.
    pub struct_size: usize,
    /// SINEW_SHAPE_...: sphere about the origin, capsule along y, plane y = 0 with free space above.
    pub shape: u32,
    /// m, above 0, at most 1e9, as is the sum with `half_length`: sphere, capsule; no default.
    pub radius: f32,
    /// m, at least 0: capsule, between the centre and a cap's centre; with SINEW_DETECTION_IMAGE_SPACE at most 10 000 times `radius`.
    /// What is touched is known to a ten millionth of it.
    pub half_length: f32,
    /// 0.
    pub reserved0: u32,
    /// Mesh: 3 node_count floats, closed, triangles outward.
    pub positions: *const f32,
    /// Nodes of the mesh.
    pub node_count: usize,
    /// 3 triangle_count node indices.
    pub triangles: *const u32,
    /// Triangles of the mesh.
    pub triangle_count: usize,
    /// SINEW_DETECTION_...
    pub detection: u32,
    /// Coulomb coefficient; default 0.
    pub friction: f32,
    /// Where it is at first, m, each within 1e9 of 0; default 0 0 0.
    pub position: [f32; 3],
    /// x y z w; default 0 0 0 1; normalised, zero is refused.
    pub orientation: [f32; 4],
    /// 0.
    pub reserved: u32,
    /// How fine an image or a distance field is, m: the side of a pixel or a cell; 0, the default: a 256th or a 96th of the mesh's longest
    /// extent, or a fourth of the least where that is less. Refused where no ray or sample would lie within the mesh, by default where
    /// fewer than two would along its least extent; and where an image would have more than 2^24 pixels or a field as many samples.
    /// Memory: some 24 bytes for each pixel of 3 images, or 4 for each sample. Time: to draw the mesh 3 times, or as many exact distances
    /// as there are samples, which takes minutes for 2^24 of a large mesh.
    pub resolution: f32,
    /// N, at least 0: the largest force that moves it; default infinity: it goes wherever it is sent. Where tissue resists with more it stops
    /// short of its pose: see sinew_tool_get_pose.
    pub force_limit: f32,
    /// The categories that it belongs to, a bit for each; default 1. It meets bodies where each has a category that the other's
    /// mask has.
    pub collision_category: u32,
    /// The categories that it meets, a bit for each; default 0xffffffff.
    pub collision_mask: u32,
}

// SAFETY: repr(C), begins with struct_size; numbers and pointers, which any bits are.
unsafe impl Versioned for sinew_tool_def {
    const SIZES: &'static [usize] = &[offset_of!(Self, resolution), size_of::<Self>()];
    const NAME: &'static str = "sinew_tool_def";
}

impl From<ToolId> for sinew_tool_id {
    fn from(ToolId(id): ToolId) -> Self {
        Self {
            index1: id.index1,
            generation: id.generation,
        }
    }
}

impl sinew_tool_id {
    pub(super) fn id(self) -> ToolId {
        ToolId(SlotId {
            index1: self.index1,
            generation: self.generation,
        })
    }
}

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
            struct_size: size_of::<Self>(),
            shape: SINEW_SHAPE_SPHERE,
            radius: 0.0,
            half_length: 0.0,
            reserved0: 0,
            positions: std::ptr::null(),
            node_count: 0,
            triangles: std::ptr::null(),
            triangle_count: 0,
            detection: SINEW_DETECTION_EXACT,
            friction: 0.0,
            position: [0.0; 3],
            orientation: [0.0, 0.0, 0.0, 1.0],
            reserved: 0,
            resolution: 0.0,
            force_limit: f32::INFINITY,
            collision_category: CollisionFilter::default().category,
            collision_mask: CollisionFilter::default().mask,
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
            SINEW_SHAPE_MESH => Shape::Mesh {
                // SAFETY: the same contract.
                positions: unsafe { memory::array("positions", self.positions.cast(), self.node_count) }?,
                // SAFETY: the same contract.
                triangles: unsafe { memory::array("triangles", self.triangles.cast(), self.triangle_count) }?,
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

/// Fills `def` with the defaults. `struct_size` is sizeof(sinew_tool_def).
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT.
///
/// # Safety
/// `def` is NULL or writable for `struct_size` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_tool_def_init(def: *mut sinew_tool_def, struct_size: usize) -> sinew_status {
    // SAFETY: the same contract.
    guard(|| unsafe { memory::initialise(def, struct_size, sinew_tool_def::defaults()) })
}

/// Creates a tool; copies what `def` points to.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_UNSUPPORTED (DISTANCE_FIELD of a shape that is no mesh, IMAGE_SPACE of a plane),
/// SINEW_STATUS_OUT_OF_MEMORY.
///
/// # Safety
/// `world` is NULL or a world nobody else uses; `def` is NULL or a definition of the size that it states, with arrays of
/// the lengths that it states; `out` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_tool_create(
    world: *mut sinew_world,
    def: *const sinew_tool_def,
    out: *mut sinew_tool_id,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_world_mut(world, |world| {
            let out = memory::output("out", out)?;
            let def = memory::definition("def", def, sinew_tool_def::defaults())?;
            *out = world.create_tool(&def.definition()?)?.into();
            Ok(())
        })
    }
}

/// Destroys a tool. What is attached to it is let go.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
///
/// # Safety
/// `world` is NULL or a world nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_tool_destroy(world: *mut sinew_world, tool: sinew_tool_id) -> sinew_status {
    // SAFETY: the same contract.
    unsafe { with_world_mut(world, |world| world.destroy_tool(tool.id())) }
}

/// Moves a tool to `position`, 3 floats, m, over the next step, and turns it to `orientation`, x y z w, which may be
/// NULL: as it is. It goes straight and turns the shorter way, both evenly; tissue gives way. What of its way a tool of limited force has
/// not gone in that step is forgotten: it is sent again.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT (also where a coordinate is further than 1e9 m from 0, the orientation is zero, or a haptic handle leads the
/// tool), SINEW_STATUS_STALE_ID.
///
/// # Safety
/// `world` is NULL or a world nobody else uses; `position` is NULL or 3 floats, `orientation` NULL or 4.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_tool_set_pose(
    world: *mut sinew_world,
    tool: sinew_tool_id,
    position: *const f32,
    orientation: *const f32,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_world_mut(world, |world| {
            let position = memory::vector("position", position)?;
            let orientation = memory::optional_array("orientation", orientation.cast::<[f32; 4]>(), 1)?;
            let orientation = orientation.map(|orientation| Quat::from_array(orientation[0]));
            world.set_pose(tool.id(), position, orientation)
        })
    }
}

/// Gives a tool this Coulomb coefficient of friction, at least 0, from the next step on.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
///
/// # Safety
/// `world` is NULL or a world nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_tool_set_friction(
    world: *mut sinew_world,
    tool: sinew_tool_id,
    friction: f32,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe { with_world_mut(world, |world| world.set_friction(tool.id(), friction)) }
}

/// Has `force_limit`, N, at least 0 or infinity, be the largest force that moves a tool, from the next step on: see sinew_tool_def.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
///
/// # Safety
/// `world` is NULL or a world nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_tool_set_force_limit(
    world: *mut sinew_world,
    tool: sinew_tool_id,
    force_limit: f32,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe { with_world_mut(world, |world| world.set_force_limit(tool.id(), force_limit)) }
}

/// Has a tool be of these categories and meet those of `mask`, a bit for each, from the next step on: see sinew_tool_def. With mask 0 it
/// meets nothing; tissue that lies within it when it meets it again is pushed out.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
///
/// # Safety
/// `world` is NULL or a world nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_tool_set_collision(
    world: *mut sinew_world,
    tool: sinew_tool_id,
    category: u32,
    mask: u32,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_world_mut(world, |world| {
            world.set_collision_filter(tool.id(), CollisionFilter { category, mask })
        })
    }
}

/// Writes where a tool is: its position, 3 floats, m, and its orientation, 4 floats, x y z w; either may be NULL. Where its force is
/// limited it may have stopped short of where it was sent.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
///
/// # Safety
/// `world` is NULL or a world nobody changes; `position` is NULL or writable for 3 floats, `orientation` for 4.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_tool_get_pose(
    world: *const sinew_world,
    tool: sinew_tool_id,
    position: *mut f32,
    orientation: *mut f32,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_world(world, |world| {
            let pose = world.pose(tool.id())?;
            let position = memory::optional_output_array("position", position.cast(), 1)?;
            let orientation = memory::optional_output_array("orientation", orientation.cast(), 1)?;
            if let Some(place) = position {
                place[0] = pose.position.to_array();
            }
            if let Some(place) = orientation {
                place[0] = pose.orientation.to_array();
            }
            Ok(())
        })
    }
}

/// Writes where the last step led a tool: where it is, but for one of limited force. Either may be NULL, as for sinew_tool_get_pose. Sent there by
/// sinew_tool_set_pose step by step, it does the same in another world: so what a haptic handle did can be taken down and done again.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
///
/// # Safety
/// `world` is NULL or a world nobody changes; `position` is NULL or writable for 3 floats, `orientation` for 4.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_tool_get_target(
    world: *const sinew_world,
    tool: sinew_tool_id,
    position: *mut f32,
    orientation: *mut f32,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_world(world, |world| {
            let pose = world.tool_target(tool.id())?;
            let position = memory::optional_output_array("position", position.cast(), 1)?;
            let orientation = memory::optional_output_array("orientation", orientation.cast(), 1)?;
            if let Some(place) = position {
                place[0] = pose.position.to_array();
            }
            if let Some(place) = orientation {
                place[0] = pose.orientation.to_array();
            }
            Ok(())
        })
    }
}

/// Writes the force, 3 floats, N, and the torque about its position, 3 floats, N m, on a tool: world axes, mean over the
/// last step.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
///
/// # Safety
/// `world` is NULL or a world nobody changes; `force` and `torque` are NULL or writable for 3 floats.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_tool_get_wrench(
    world: *const sinew_world,
    tool: sinew_tool_id,
    force: *mut f32,
    torque: *mut f32,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_world(world, |world| {
            let (of_force, of_torque) = world.wrench(tool.id())?;
            // Both are looked at before either is written.
            memory::output("force", force.cast::<[f32; 3]>())?;
            memory::output("torque", torque.cast::<[f32; 3]>())?;
            *memory::output("force", force.cast())? = of_force.to_array();
            *memory::output("torque", torque.cast())? = of_torque.to_array();
            Ok(())
        })
    }
}
