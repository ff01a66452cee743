//! Tools.

use glam::{Quat, Vec3};

use super::guard::{guard, sinew_world, with_world, with_world_mut};
use super::memory::{self, Versioned};
use super::status::sinew_status;
use crate::contact::{Detection, Pose, Shape, ToolDefinition};
use crate::error::{Error, Result};
use crate::slots::SlotId;
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
    /// m, above 0: sphere, capsule; no default.
    pub radius: f32,
    /// m: capsule, between the centre and a cap's centre.
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
    /// Where it is at first, m; default 0 0 0.
    pub position: [f32; 3],
    /// x y z w; default 0 0 0 1; normalised, zero is refused.
    pub orientation: [f32; 4],
    /// 0.
    pub reserved: u32,
}

// SAFETY: repr(C), begins with struct_size; numbers and pointers, which any bits are.
unsafe impl Versioned for sinew_tool_def {
    const SIZES: &'static [usize] = &[size_of::<Self>()];
    const NAME: &'static str = "sinew_tool_def";
}

impl sinew_tool_id {
    pub(super) fn id(self) -> ToolId {
        ToolId(SlotId {
            index1: self.index1,
            generation: self.generation,
        })
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
        }
    }

    fn definition(&self) -> Result<ToolDefinition> {
        memory::reserved("reserved0", self.reserved0)?;
        memory::reserved("reserved", self.reserved)?;
        let detection = match self.detection {
            SINEW_DETECTION_EXACT => Detection::Exact,
            SINEW_DETECTION_IMAGE_SPACE => Detection::ImageSpace,
            SINEW_DETECTION_DISTANCE_FIELD => Detection::DistanceField,
            unknown => {
                return Err(Error::invalid(format!(
                    "detection is {unknown}: no SINEW_DETECTION_..."
                )));
            }
        };
        let shape = match self.shape {
            SINEW_SHAPE_SPHERE => Shape::Sphere { radius: self.radius },
            SINEW_SHAPE_CAPSULE => Shape::Capsule {
                radius: self.radius,
                half_length: self.half_length,
            },
            SINEW_SHAPE_PLANE => Shape::Plane,
            SINEW_SHAPE_MESH => {
                return Err(Error::Unsupported(
                    "shape is SINEW_SHAPE_MESH: this version offers spheres, capsules and planes".into(),
                ));
            }
            unknown => return Err(Error::invalid(format!("shape is {unknown}: no SINEW_SHAPE_..."))),
        };
        Ok(ToolDefinition {
            shape,
            detection,
            friction: self.friction,
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
/// Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_UNSUPPORTED (SINEW_SHAPE_MESH, detection other than EXACT),
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
            let ToolId(id) = world.create_tool(&def.definition()?)?;
            *out = sinew_tool_id {
                index1: id.index1,
                generation: id.generation,
            };
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
/// NULL: as it is. It goes straight and turns the shorter way, both evenly; tissue gives way.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT (also where the orientation is zero), SINEW_STATUS_STALE_ID.
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
