//! Settings of worlds and bodies that change between steps.

use super::body::{sinew_body_id, with_body, with_body_mut};
use super::guard::{sinew_world, with_world, with_world_mut};
use super::memory::{self, versioned};
use super::status::sinew_status;
use crate::def::{BodySettings, Sleep};

/// Sets the substeps per step and their limit, from the next step on; see sinew_world_def.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_set_substeps(
    world: *mut sinew_world,
    substeps: u32,
    max_substeps: u32,
) -> sinew_status {
    with_world_mut(world, |world| world.set_substeps(substeps, max_substeps))
}

/// Writes the number of substeps per step and its limit; both outputs are nullable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_get_substeps(
    world: *const sinew_world,
    out_substeps: *mut u32,
    out_max_substeps: *mut u32,
) -> sinew_status {
    with_world(world, |world| {
        let [substeps, max_substeps] = world.substeps();
        memory::write_wanted(
            ("out_substeps", out_substeps, substeps),
            ("out_max_substeps", out_max_substeps, max_substeps),
        )
    })
}

/// Settings of a body that can change after creation; see sinew_body_def.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_body_settings {
    /// Set to sizeof(sinew_body_settings) before the call.
    pub struct_size: usize,
    /// [m] Distance kept from the surface.
    pub contact_thickness: f32,
    /// Friction coefficient for tissue contact.
    pub contact_friction: f32,
    /// 1: collides with other bodies that have 1.
    pub meets_bodies: u32,
    /// 1: collides with itself.
    pub meets_itself: u32,
    /// [m/s] Speed of sleep; 0: never.
    pub sleep_speed: f32,
    /// [s] Time at rest before sleep.
    pub sleep_time: f32,
}

versioned! { sinew_body_settings }

impl From<BodySettings> for sinew_body_settings {
    fn from(settings: BodySettings) -> Self {
        Self {
            struct_size: size_of::<Self>(),
            contact_thickness: settings.thickness,
            contact_friction: settings.friction,
            meets_bodies: settings.with_bodies.into(),
            meets_itself: settings.with_itself.into(),
            sleep_speed: settings.sleep.speed,
            sleep_time: settings.sleep.time,
        }
    }
}

/// Changes the settings of a body from the next step on; start from sinew_body_get_settings.
///
/// Surfaces closer than a new contact_thickness are pushed apart. New sleep settings wake the body.
///
/// Errors: SINEW_STATUS_UNSUPPORTED if meets_ flags of a cut body change, except both to 0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_set_settings(
    world: *mut sinew_world,
    body: sinew_body_id,
    settings: *const sinew_body_settings,
) -> sinew_status {
    with_world_mut(world, |world| {
        let defaults = world.body(body.id())?.settings().into();
        let given = memory::definition("settings", settings, defaults)?;
        world.set_body_settings(
            body.id(),
            BodySettings {
                thickness: given.contact_thickness,
                friction: given.contact_friction,
                with_bodies: memory::flag("meets_bodies", given.meets_bodies)?,
                with_itself: memory::flag("meets_itself", given.meets_itself)?,
                sleep: Sleep {
                    speed: given.sleep_speed,
                    time: given.sleep_time,
                },
            },
        )
    })
}

/// Writes the settings of a body that can change.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_settings(
    world: *const sinew_world,
    body: sinew_body_id,
    out: *mut sinew_body_settings,
) -> sinew_status {
    with_body(world, body, |body| {
        memory::write_report("out", out, body.settings().into())
    })
}

/// Sets the drag [N s/m] on each node of a body, at least 0, from the next step on.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_set_node_damping(
    world: *mut sinew_world,
    body: sinew_body_id,
    node_damping: f32,
) -> sinew_status {
    with_body_mut(world, body, |body| body.set_node_damping(node_damping))
}

/// Writes the drag [N s/m] on a node.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_node_damping(
    world: *const sinew_world,
    body: sinew_body_id,
    node: u32,
    out: *mut f32,
) -> sinew_status {
    with_body(world, body, |body| memory::write("out", out, body.node_damping(node)?))
}
