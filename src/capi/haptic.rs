//! Haptic handles.

use glam::{Quat, Vec3};

use super::body::sinew_body_id;
use super::guard::{guard, sinew_world, with_world_mut};
use super::memory::{self, Versioned};
use super::status::{fail, sinew_status};
use super::tool::sinew_tool_id;
use crate::base::Error;
use crate::contact::Pose;
use crate::haptics::{HapticContact, HapticDefinition, HapticHandle, HapticTick};
use crate::world::ToolId;

/// The device's side of a tool of a world, for one thread, the device's own: it may tick while another thread steps the world, or uses it otherwise.
pub struct sinew_haptic {
    handle: HapticHandle,
    /// As the device was turned last.
    orientation: Quat,
}

/// How a device is coupled to a tool. Filled by sinew_haptic_def_init; used only during sinew_haptic_create.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_haptic_def {
    /// Set by sinew_haptic_def_init.
    pub struct_size: usize,
    /// The tool that the device leads; no default.
    pub tool: sinew_tool_id,
    /// Of the spring between device and tool, N/m, above 0; default 1000. A device should stand it with its own sampling: about half of its damping,
    /// N s/m, by the time between ticks, or less.
    pub stiffness: f32,
    /// The same for turning, N m/rad, at least a millionth of the stiffness at the lever, which is half of the tool's length; default 0: that stiffness.
    pub angular_stiffness: f32,
    /// Of the damper beside that spring, which acts where tissue resists; default 1: it damps device_mass on the spring critically. 0: what the loop
    /// makes of energy is still damped away, but less surely.
    pub damping_ratio: f32,
    /// What the hand moves of the device, kg, above 0; default 0.05.
    pub device_mass: f32,
    /// The largest force, N, above 0; default infinity.
    pub force_limit: f32,
    /// The largest torque, N m, above 0; default infinity.
    pub torque_limit: f32,
    /// How fast the force may change, N/s, above 0; default infinity. A force that such a limit makes late gives a hand more than it took: the loop is
    /// kept passive where it is not reached.
    pub force_rate_limit: f32,
    /// How fast the torque may change, N m/s, above 0; default infinity.
    pub torque_rate_limit: f32,
    /// A model that is older, s, above 0, is stale: force and torque go to 0 until there is a newer one; default 0.1.
    pub stale_after: f32,
    /// The time in which they do, or come back, s, above 0; default 0.1.
    pub ramp: f32,
}

/// What a tick comes to.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_haptic_result {
    /// Set by the caller.
    pub struct_size: usize,
    /// On the device, world axes, N, until the next tick.
    pub force: [f32; 3],
    /// On the device, about its position, world axes, N m.
    pub torque: [f32; 3],
    /// Where the tool is to go, m: the device, but for what the spring between them is drawn out.
    pub proxy_position: [f32; 3],
    /// x y z w.
    pub proxy_orientation: [f32; 4],
    /// Contacts of the tool as the model was made: sinew_haptic_get_contacts.
    pub contact_count: u32,
    /// How long ago the device was where the model was made, s, by the ticks; infinity as long as there was none.
    pub age: f32,
    /// The steps of the world that were published for it.
    pub version: u64,
    /// What part of the model's forces is given: less than 1 where that was stale.
    pub gain: f32,
    /// 1: the tool, or its world, is gone.
    pub is_over: u32,
    /// What the coupling has lost of the energy that went through it, J: kept at 0 or above as far as damping can.
    pub lost: f64,
}

/// Where a tool pressed a body as the model of its handle was made.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_haptic_contact {
    /// The body.
    pub body: sinew_body_id,
    /// The point, m.
    pub point: [f32; 3],
    /// Away from the tool, of unit length.
    pub normal: [f32; 3],
    /// How fast the tissue moves there, m/s.
    pub velocity: [f32; 3],
    /// On the tool, N.
    pub force: [f32; 3],
}

// SAFETY: repr(C), begins with struct_size, numbers alone.
unsafe impl Versioned for sinew_haptic_def {
    const SIZES: &'static [usize] = &[size_of::<Self>()];
    const NAME: &'static str = "sinew_haptic_def";
}

// SAFETY: repr(C), begins with struct_size, numbers alone.
unsafe impl Versioned for sinew_haptic_result {
    const SIZES: &'static [usize] = &[size_of::<Self>()];
    const NAME: &'static str = "sinew_haptic_result";
}

impl sinew_haptic_def {
    fn defaults() -> Self {
        let defaults = HapticDefinition::new(ToolId::default());
        Self {
            struct_size: size_of::<Self>(),
            tool: sinew_tool_id {
                index1: 0,
                generation: 0,
            },
            stiffness: defaults.stiffness,
            angular_stiffness: defaults.angular_stiffness,
            damping_ratio: defaults.damping_ratio,
            device_mass: defaults.device_mass,
            force_limit: defaults.force_limit,
            torque_limit: defaults.torque_limit,
            force_rate_limit: defaults.force_rate_limit,
            torque_rate_limit: defaults.torque_rate_limit,
            stale_after: defaults.stale_after,
            ramp: defaults.ramp,
        }
    }

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

impl sinew_haptic_result {
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

/// Fills `def` with the defaults. `struct_size` is sizeof(sinew_haptic_def).
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT.
///
/// # Safety
/// `def` is NULL or writable for `struct_size` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_haptic_def_init(def: *mut sinew_haptic_def, struct_size: usize) -> sinew_status {
    // SAFETY: the same contract.
    guard(|| unsafe { memory::initialise(def, struct_size, sinew_haptic_def::defaults()) })
}

/// Lets a device lead a tool through a handle, which the caller destroys with sinew_haptic_destroy. The tool should be where the device is: the
/// first step leads it there. As long as there is the handle, sinew_tool_set_pose of the tool is refused: each step leads it to where the handle's
/// proxy was last, as sinew_tool_get_target tells. Each step costs the handle some microseconds.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT (also where another handle leads the tool), SINEW_STATUS_STALE_ID, SINEW_STATUS_OUT_OF_MEMORY.
///
/// # Safety
/// `world` is NULL or a world nobody else uses; `def` is NULL or a definition of the size that it states; `out` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_haptic_create(
    world: *mut sinew_world,
    def: *const sinew_haptic_def,
    out: *mut *mut sinew_haptic,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_world_mut(world, |world| {
            let out = memory::output("out", out)?;
            let def = memory::definition("def", def, sinew_haptic_def::defaults())?;
            let orientation = world.pose(def.tool.id())?.orientation;
            let handle = world.create_haptic(&def.definition())?;
            *out = Box::into_raw(crate::base::memory::boxed(sinew_haptic { handle, orientation })?);
            Ok(())
        })
    }
}

/// Destroys a handle, before its world or after. The tool is the world's again. NULL: nothing.
///
/// # Safety
/// `haptic` is NULL or a handle that is not destroyed and that nobody uses any more.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_haptic_destroy(haptic: *mut sinew_haptic) {
    if !haptic.is_null() {
        guard(|| {
            // SAFETY: made by Box::into_raw in sinew_haptic_create, and given back once.
            drop(unsafe { Box::from_raw(haptic) });
            Ok(())
        });
    }
}

/// Takes where the device is, 3 floats, m, and how it is turned, x y z w, `dt` seconds after the last tick, above 0 and at most 1, and writes what it
/// is to feel until the next. `orientation` may be NULL: as it was, at first as the tool. `velocity`, m/s, and `angular_velocity`, rad/s, 3 floats each,
/// world axes, may be NULL: as its way since the last tick says. `out->struct_size` is set by the caller.
///
/// It waits for nothing, takes no lock and allocates nothing, whatever other threads do with the world. It takes some microseconds.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT: `out` is as it was, and the device should be given no force.
///
/// # Safety
/// `haptic` is NULL or a handle nobody else uses; `position` is NULL or 3 floats, `orientation` NULL or 4, `velocity` and `angular_velocity` NULL or
/// 3; `out` is NULL or writable for the size that it states.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_haptic_tick(
    haptic: *mut sinew_haptic,
    position: *const f32,
    orientation: *const f32,
    velocity: *const f32,
    angular_velocity: *const f32,
    dt: f32,
    out: *mut sinew_haptic_result,
) -> sinew_status {
    // SAFETY: the caller vouches for the handle where the pointer is not NULL.
    let Some(haptic) = (unsafe { haptic.as_mut() }) else {
        return fail(Error::invalid("haptic is NULL"));
    };
    guard(|| {
        // SAFETY: the same contract, for this and what follows.
        let out = unsafe { memory::report("out", out) }?;
        // SAFETY: as above.
        let position = unsafe { memory::vector("position", position) }?;
        // SAFETY: as above.
        let given = unsafe { memory::optional_array("orientation", orientation.cast::<[f32; 4]>(), 1) }?;
        // SAFETY: as above.
        let along = unsafe { memory::optional_array("velocity", velocity.cast::<[f32; 3]>(), 1) }?;
        // SAFETY: as above.
        let about = unsafe { memory::optional_array("angular_velocity", angular_velocity.cast::<[f32; 3]>(), 1) }?;
        let orientation = given.map_or(haptic.orientation, |given| Quat::from_array(given[0]));
        let pose = Pose { position, orientation };
        let [along, about] = [along, about].map(|given| given.map(|given| Vec3::from_array(given[0])));
        let tick = haptic.handle.tick(pose, along, about, dt)?;
        haptic.orientation = orientation;
        // SAFETY: still there.
        unsafe { out.fill(sinew_haptic_result::of(tick, haptic.handle.is_over())) };
        Ok(())
    })
}

/// Writes the contacts of the tool as the model was made that the last tick used, up to `capacity`, and how many there are in all to `count`: at most
/// 32, of more the most pressed. `contacts` may be NULL with a capacity of 0. As sinew_haptic_tick it waits for nothing.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT.
///
/// # Safety
/// `haptic` is NULL or a handle nobody else uses; `contacts` is NULL or writable for `capacity` contacts; `count` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_haptic_get_contacts(
    haptic: *const sinew_haptic,
    contacts: *mut sinew_haptic_contact,
    capacity: usize,
    count: *mut usize,
) -> sinew_status {
    // SAFETY: the caller vouches for the handle where the pointer is not NULL.
    let Some(haptic) = (unsafe { haptic.as_ref() }) else {
        return fail(Error::invalid("haptic is NULL"));
    };
    guard(|| {
        // SAFETY: the same contract.
        let count = unsafe { memory::output("count", count) }?;
        // SAFETY: the same contract.
        let contacts = unsafe { memory::output_array("contacts", contacts, capacity) }?;
        let mut found = 0;
        haptic.handle.contacts(|contact| {
            if let Some(place) = contacts.get_mut(found) {
                *place = contact.into();
            }
            found += 1;
        });
        *count = found;
        Ok(())
    })
}
