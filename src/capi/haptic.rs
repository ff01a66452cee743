//! Haptic handles.

use glam::{Quat, Vec3};

use super::body::sinew_body_id;
use super::guard::{destroy, guard, sinew_world, with_world_mut};
use super::memory::{self, told, versioned};
use super::status::sinew_status;
use super::tool::sinew_tool_id;
use crate::base::ToolId;
use crate::contact::Pose;
use crate::haptics::{HapticContact, HapticDefinition, HapticHandle, HapticTick};

/// Haptic handle: couples a device to a tool, used by the device's thread.
///
/// One thread at a time may use it, while other threads step or use the world.
pub struct sinew_haptic {
    handle: HapticHandle,
    /// As the device was turned last.
    orientation: Quat,
}

/// Coupling of a haptic device to a tool.
///
/// Filled by sinew_haptic_def_init; read only during sinew_haptic_create.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_haptic_def {
    /// Size of this struct; sinew_haptic_def_init sets it.
    pub struct_size: usize,
    /// Tool that the device drives; no default.
    pub tool: sinew_tool_id,
    /// [N/m] Coupling stiffness between device and tool, above 0; default 1000.
    ///
    /// Stable up to about half of the device's damping [N s/m] divided by the tick time.
    pub stiffness: f32,
    /// [N m/rad] Angular coupling stiffness; 0 (default): stiffness at half of the tool's length.
    ///
    /// It is at least 1e-6 of that value.
    pub angular_stiffness: f32,
    /// Damping while tissue resists; 1 (default): critical for device_mass.
    pub damping_ratio: f32,
    /// [kg] Effective mass of the device, above 0; default 0.05.
    pub device_mass: f32,
    /// [N] Largest force on the device; infinity (default) or 0: unlimited.
    pub force_limit: f32,
    /// [N m] Largest torque on the device; infinity (default) or 0: unlimited.
    pub torque_limit: f32,
    /// [N/s] Largest rate of change of the force; infinity (default) or 0: unlimited.
    ///
    /// The coupling is passive only while this limit is not reached.
    pub force_rate_limit: f32,
    /// [N m/s] Largest rate of change of the torque; infinity (default) or 0: unlimited.
    pub torque_rate_limit: f32,
    /// [s] Age at which the model's force fades to 0, above 0; default 0.1.
    pub stale_after: f32,
    /// [s] Duration of that fade, and of the return, above 0; default 0.1.
    pub ramp: f32,
}

/// Result of a haptic tick.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_haptic_report {
    /// Set to sizeof(sinew_haptic_report) before the call.
    pub struct_size: usize,
    /// [N] Force on the device until the next tick, in world axes.
    pub force: [f32; 3],
    /// [N m] Torque on the device about its position, in world axes.
    pub torque: [f32; 3],
    /// [m] Position that the tool is driven to, behind the device.
    pub proxy_position: [f32; 3],
    /// Orientation that the tool is driven to, x y z w.
    pub proxy_orientation: [f32; 4],
    /// Number of contacts of the model; see sinew_haptic_get_contacts.
    pub contact_count: u32,
    /// [s] Age of the model by tick time; infinity before the first model.
    pub age: f32,
    /// Number of world steps published to this handle.
    pub version: u64,
    /// Fraction of the model's force that is applied; below 1 if stale.
    pub gain: f32,
    /// 1: the tool or its world was destroyed.
    pub is_over: u32,
    /// [J] Energy that the coupling dissipated, at least 0 as far as damping can.
    pub lost: f64,
}

/// Contact of the tool in the model of a haptic handle.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_haptic_contact {
    /// Body that the tool touches.
    pub body: sinew_body_id,
    /// [m] Contact point on the body.
    pub point: [f32; 3],
    /// Unit normal that points away from the tool.
    pub normal: [f32; 3],
    /// [m/s] Velocity of the tissue at the point.
    pub velocity: [f32; 3],
    /// [N] Force on the tool at the point.
    pub force: [f32; 3],
}

versioned! { sinew_haptic_def, sinew_haptic_report }

told! { HapticDefinition => sinew_haptic_def {
    tool, stiffness, angular_stiffness, damping_ratio, device_mass, force_limit, torque_limit, force_rate_limit,
    torque_rate_limit, stale_after, ramp
} }

impl sinew_haptic_def {
    fn definition(&self) -> HapticDefinition {
        HapticDefinition {
            tool: self.tool.id(),
            stiffness: self.stiffness,
            angular_stiffness: self.angular_stiffness,
            damping_ratio: self.damping_ratio,
            device_mass: self.device_mass,
            force_limit: self.force_limit,
            torque_limit: self.torque_limit,
            force_rate_limit: self.force_rate_limit,
            torque_rate_limit: self.torque_rate_limit,
            stale_after: self.stale_after,
            ramp: self.ramp,
        }
    }
}

impl sinew_haptic_report {
    fn of(tick: HapticTick, is_over: bool) -> Self {
        Self {
            struct_size: size_of::<Self>(),
            force: tick.force.to_array(),
            torque: tick.torque.to_array(),
            proxy_position: tick.proxy.position.to_array(),
            proxy_orientation: tick.proxy.orientation.to_array(),
            contact_count: tick.contact_count,
            age: tick.age,
            version: tick.version,
            gain: tick.gain,
            is_over: u32::from(is_over),
            lost: tick.lost,
        }
    }
}

impl From<&HapticContact> for sinew_haptic_contact {
    fn from(contact: &HapticContact) -> Self {
        Self {
            body: contact.body.into(),
            point: contact.point.to_array(),
            normal: contact.normal.to_array(),
            velocity: contact.velocity.to_array(),
            force: contact.force.to_array(),
        }
    }
}

/// Fills a haptic definition with its defaults; `struct_size` is sizeof(sinew_haptic_def).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_haptic_def_init(def: *mut sinew_haptic_def, struct_size: usize) -> sinew_status {
    guard(|| memory::initialise(def, struct_size, HapticDefinition::new(ToolId::default()).into()))
}

/// Creates a haptic handle that drives a tool; destroy it with sinew_haptic_destroy.
///
/// Until then sinew_tool_set_pose refuses the tool, and each step moves it to the latest proxy pose. The tool should
/// start at the device's pose.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT if another handle drives the tool.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_haptic_create(
    world: *mut sinew_world,
    def: *const sinew_haptic_def,
    out: *mut *mut sinew_haptic,
) -> sinew_status {
    with_world_mut(world, |world| {
        let out = memory::output("out", out)?;
        let def = memory::definition("def", def, HapticDefinition::new(ToolId::default()).into())?;
        let orientation = world.pose(def.tool.id())?.orientation;
        let handle = world.create_haptic(&def.definition())?;
        *out = Box::into_raw(crate::base::memory::boxed(sinew_haptic { handle, orientation })?);
        Ok(())
    })
}

/// Destroys a haptic handle, before or after its world; NULL has no effect.
///
/// The tool is then moved by sinew_tool_set_pose again.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_haptic_destroy(haptic: *mut sinew_haptic) {
    destroy(haptic);
}

/// Computes the force on the device from its current pose, without waiting, locking or allocating.
///
/// `position` [m] is 3 floats; `orientation` is nullable: unchanged. `velocity` [m/s] and `angular_velocity` [rad/s]
/// are 3 floats each in world axes, nullable: estimated. `dt` [s] is the time since the last tick, above 0, at most 1.
/// After an error apply no force.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_haptic_tick(
    haptic: *mut sinew_haptic,
    position: *const f32,
    orientation: *const f32,
    velocity: *const f32,
    angular_velocity: *const f32,
    dt: f32,
    out: *mut sinew_haptic_report,
) -> sinew_status {
    guard(|| {
        let haptic = memory::output("haptic", haptic)?;
        let out = memory::report("out", out)?;
        let position = memory::vector("position", position)?;
        let orientation = memory::optional_orientation("orientation", orientation)?.unwrap_or(haptic.orientation);
        let along = memory::optional_array("velocity", velocity.cast::<[f32; 3]>(), 1)?;
        let about = memory::optional_array("angular_velocity", angular_velocity.cast::<[f32; 3]>(), 1)?;
        let pose = Pose { position, orientation };
        let [along, about] = [along, about].map(|given| given.map(|given| Vec3::from_array(given[0])));
        let tick = haptic.handle.tick(pose, along, about, dt)?;
        haptic.orientation = orientation;
        out.fill(sinew_haptic_report::of(tick, haptic.handle.is_over()));
        Ok(())
    })
}

/// Writes the contacts of the model that the last tick used, without waiting.
///
/// `out_contacts`: up to `capacity` entries; `out_count`: how many exist, the 32 largest at most.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_haptic_get_contacts(
    haptic: *const sinew_haptic,
    out_contacts: *mut sinew_haptic_contact,
    capacity: usize,
    out_count: *mut usize,
) -> sinew_status {
    guard(|| {
        let haptic = memory::reference("haptic", haptic)?;
        let out_count = memory::output("out_count", out_count)?;
        let out_contacts = memory::output_array("out_contacts", out_contacts, capacity)?;
        let mut found = 0;
        haptic.handle.contacts(|contact| {
            if let Some(place) = out_contacts.get_mut(found) {
                *place = contact.into();
            }
            found += 1;
        });
        *out_count = found;
        Ok(())
    })
}
