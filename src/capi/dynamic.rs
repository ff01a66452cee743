//! Tools that are rigid bodies, and what couples a tool to a rigid body of another engine.

use glam::Vec3;

use super::guard::{sinew_world, with_world, with_world_mut};
use super::memory::{self, Versioned, told, versioned};
use super::status::sinew_status;
use super::tool::sinew_tool_id;
use crate::contact::MassProperties;

/// Mass, center of mass and inertia of a rigid tool, in the tool's own axes.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_mass_properties {
    /// Set to sizeof(sinew_mass_properties) before the call.
    pub struct_size: usize,
    /// [kg] Mass, 1e-12 to 1e12.
    pub mass: f32,
    /// [m] Center of mass, from the tool's position; within 1e9.
    pub center_of_mass: [f32; 3],
    /// [kg m^2] Inertia tensor xx yy zz xy xz yz about the center of mass.
    ///
    /// It is positive definite; no principal moment exceeds the sum of the others.
    pub inertia: [f32; 6],
}

versioned! { sinew_mass_properties }

told! { MassProperties => sinew_mass_properties { mass, center_of_mass, inertia } }

/// Writes the mass properties of a tool of a density [kg/m^3], above 0; `out` sets struct_size.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT for a plane.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_tool_get_mass_of_density(
    world: *const sinew_world,
    tool: sinew_tool_id,
    density: f32,
    out: *mut sinew_mass_properties,
) -> sinew_status {
    with_world(world, |world| {
        let out = memory::report("out", out)?;
        out.fill(world.mass_of_density(tool.id(), density)?.into());
        Ok(())
    })
}

/// Makes a tool dynamic: a rigid body that forces, gravity and contact with tissue move.
///
/// `mass` is nullable: kinematic again. It starts at rest; a new mass leaves its velocity. Pinned
/// nodes are obstacles; other tools are not. Bodies near it do not sleep. force_limit is ignored.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT for a plane, or if an attachment or haptic handle uses it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_tool_set_mass(
    world: *mut sinew_world,
    tool: sinew_tool_id,
    mass: *const sinew_mass_properties,
) -> sinew_status {
    with_world_mut(world, |world| {
        if mass.is_null() {
            return world.set_dynamic(tool.id(), None);
        }
        let mass = memory::definition("mass", mass, sinew_mass_properties::empty())?;
        let properties = MassProperties {
            mass: mass.mass,
            center_of_mass: Vec3::from_array(mass.center_of_mass),
            inertia: mass.inertia,
        };
        world.set_dynamic(tool.id(), Some(&properties))
    })
}

/// Writes the mass properties of a dynamic tool; all zero if the tool is kinematic.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_tool_get_mass(
    world: *const sinew_world,
    tool: sinew_tool_id,
    out: *mut sinew_mass_properties,
) -> sinew_status {
    with_world(world, |world| {
        let out = memory::report("out", out)?;
        let properties = world.mass_properties(tool.id())?;
        out.fill(properties.map_or_else(sinew_mass_properties::empty, Into::into));
        Ok(())
    })
}

/// Sets the velocity of a dynamic tool, in world axes.
///
/// `velocity` [m/s] of the center of mass and `angular_velocity` [rad/s] are 3 floats each.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT if the tool is kinematic.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_tool_set_velocity(
    world: *mut sinew_world,
    tool: sinew_tool_id,
    velocity: *const f32,
    angular_velocity: *const f32,
) -> sinew_status {
    with_world_mut(world, |world| {
        let velocity = memory::vector("velocity", velocity)?;
        let spin = memory::vector("angular_velocity", angular_velocity)?;
        world.set_tool_velocity(tool.id(), velocity, spin)
    })
}

/// Writes the velocity of a dynamic tool, as sinew_tool_set_velocity takes it; both are nullable.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT if the tool is kinematic.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_tool_get_velocity(
    world: *const sinew_world,
    tool: sinew_tool_id,
    out_velocity: *mut f32,
    out_angular_velocity: *mut f32,
) -> sinew_status {
    with_world(world, |world| {
        let (linear, angular) = world.tool_velocity(tool.id())?;
        memory::write_wanted(
            ("out_velocity", out_velocity.cast(), linear.to_array()),
            ("out_angular_velocity", out_angular_velocity.cast(), angular.to_array()),
        )
    })
}

/// Adds a force and a torque on a dynamic tool throughout the next step, in world axes.
///
/// `force` [N] acts at the center of mass, `torque` [N m] about it; they are 3 floats each.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT if the tool is kinematic.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_tool_apply_wrench(
    world: *mut sinew_world,
    tool: sinew_tool_id,
    force: *const f32,
    torque: *const f32,
) -> sinew_status {
    with_world_mut(world, |world| {
        let force = memory::vector("force", force)?;
        let torque = memory::vector("torque", torque)?;
        world.apply_wrench(tool.id(), force, torque)
    })
}

/// Moves a tool to a new pose at once, without a sweep; a dynamic tool keeps its velocity.
///
/// `position` [m] is 3 floats; `orientation` is nullable: unchanged. Tissue inside is pushed out over the next steps. A
/// pending sinew_tool_set_pose is dropped.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT if attachments or a haptic handle use the tool.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_tool_teleport(
    world: *mut sinew_world,
    tool: sinew_tool_id,
    position: *const f32,
    orientation: *const f32,
) -> sinew_status {
    with_world_mut(world, |world| {
        let position = memory::vector("position", position)?;
        let orientation = memory::optional_orientation("orientation", orientation)?;
        world.teleport(tool.id(), position, orientation)
    })
}
