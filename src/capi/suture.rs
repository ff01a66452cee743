//! Sutures.

use super::attachment::sinew_attachment_id;
use super::body::sinew_body_id;
use super::guard::{guard, sinew_world, with_world, with_world_mut};
use super::memory::{self, Versioned};
use super::status::sinew_status;
use crate::base::Result;
use crate::def::{Anchor, SurfacePoint};
use crate::world::SutureDefinition;

/// Settings of a suture, filled by sinew_suture_def_init.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_suture_def {
    /// Size of this struct; sinew_suture_def_init sets it.
    pub struct_size: usize,
    /// [m] Unloaded length of the thread, at least 0; -1 (default): the current distance.
    pub length: f32,
    /// [N/m] Stiffness of the thread, above 0; infinity (default): inextensible.
    pub stiffness: f32,
    /// [N] Mean force above which it tears out, at least 0; 0 (default) or infinity: unlimited.
    pub force_limit: f32,
    /// Reserved; must be 0.
    pub reserved0: u32,
}

/// Current state of a suture.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_suture_report {
    /// Set to sizeof(sinew_suture_report) before the call.
    pub struct_size: usize,
    /// [m] Unloaded length of the thread.
    pub length: f32,
    /// [m] Distance of its points; larger than the length under load.
    pub distance: f32,
    /// [J] Energy stored in the thread, not part of the bodies' energy; 0 if inextensible.
    pub energy: f64,
}

// SAFETY: repr(C), begins with struct_size, numbers alone.
unsafe impl Versioned for sinew_suture_def {}

// SAFETY: repr(C), begins with struct_size, numbers alone.
unsafe impl Versioned for sinew_suture_report {}

impl sinew_suture_def {
    fn defaults() -> Self {
        Self {
            struct_size: size_of::<Self>(),
            length: -1.0,
            stiffness: f32::INFINITY,
            force_limit: 0.0,
            reserved0: 0,
        }
    }
}

/// Fills a suture definition with its defaults; `struct_size` is sizeof(sinew_suture_def).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_suture_def_init(def: *mut sinew_suture_def, struct_size: usize) -> sinew_status {
    // SAFETY: the same contract.
    guard(|| unsafe { memory::initialise(def, struct_size, sinew_suture_def::defaults()) })
}

/// Joins two surface points of bodies by a thread, which pulls and never pushes.
///
/// A point is a surface triangle with 3 corner weights, at least 0 with sum 1. The bodies may be the same and still
/// collide. `def` is nullable: the defaults. A thread shorter than the distance is drawn in at no more than 0.25
/// m/s. Release and force are those of an attachment; a torn suture is in sinew_world_get_slipped.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT if both points are the same.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_suture_points(
    world: *mut sinew_world,
    body: sinew_body_id,
    triangle: u32,
    weights: *const f32,
    other: sinew_body_id,
    other_triangle: u32,
    other_weights: *const f32,
    def: *const sinew_suture_def,
    out: *mut sinew_attachment_id,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_world_mut(world, |world| {
            let point = anchor("weights", triangle, weights)?;
            let other_point = anchor("other_weights", other_triangle, other_weights)?;
            let defaults = sinew_suture_def::defaults();
            let def = if def.is_null() {
                defaults
            } else {
                memory::definition("def", def, defaults)?
            };
            memory::reserved("reserved0", def.reserved0)?;
            let definition = SutureDefinition {
                length: (def.length != -1.0).then_some(def.length),
                stiffness: def.stiffness,
                force_limit: def.force_limit,
            };
            let out = memory::output("out", out)?;
            let made = world.suture(body.id(), &point, other.id(), &other_point, &definition)?;
            *out = made.into();
            Ok(())
        })
    }
}

/// # Safety
/// `weights` is NULL or 3 floats.
unsafe fn anchor(name: &str, triangle: u32, weights: *const f32) -> Result<Anchor> {
    // SAFETY: the same contract.
    let weights = unsafe { memory::vector(name, weights) }?.to_array();
    Ok(Anchor::Point(SurfacePoint { triangle, weights }))
}

/// Changes the length [m] of a suture's thread evenly over the next step.
///
/// The length is at least 0. It shortens by at most 0.25 m/s, over as many steps as that takes.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT if the attachment is not a suture.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_suture_set_length(
    world: *mut sinew_world,
    suture: sinew_attachment_id,
    length: f32,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe { with_world_mut(world, |world| world.set_suture_length(suture.id(), length)) }
}

/// Writes the current state of a suture.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT if the attachment is not a suture.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_suture_get_report(
    world: *const sinew_world,
    suture: sinew_attachment_id,
    report: *mut sinew_suture_report,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_world(world, |world| {
            let out = memory::report("report", report)?;
            let found = world.suture_report(suture.id())?;
            out.fill(sinew_suture_report {
                struct_size: size_of::<sinew_suture_report>(),
                length: found.length,
                distance: found.distance,
                energy: found.energy,
            });
            Ok(())
        })
    }
}
