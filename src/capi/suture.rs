//! Sutures.

use super::attachment::sinew_attachment_id;
use super::guard::{guard, sinew_world, with_world, with_world_mut};
use super::memory::{self, Versioned, told, versioned};
use super::query::sinew_surface_point;
use super::status::sinew_status;
use crate::def::{Anchor, SurfacePoint};
use crate::world::{SutureDefinition, SutureReport};

/// Settings of a suture, filled by sinew_suture_def_init.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_suture_def {
    /// Size of this struct; sinew_suture_def_init sets it.
    pub struct_size: usize,
    /// [m] Unloaded length of the thread; -1 (default): the current distance.
    pub length: f32,
    /// [N/m] Stiffness of the thread, above 0; infinity (default): inextensible.
    pub stiffness: f32,
    /// [N] Mean force where it tears out; infinity (default) or 0: unlimited.
    pub force_limit: f32,
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
    /// [J] Energy of the thread, not of the bodies; 0 if inextensible.
    pub energy: f64,
}

versioned! { sinew_suture_def, sinew_suture_report }

told! { SutureReport => sinew_suture_report { length, distance, energy } }

impl sinew_suture_def {
    fn defaults() -> Self {
        Self {
            struct_size: size_of::<Self>(),
            length: -1.0,
            stiffness: f32::INFINITY,
            force_limit: f32::INFINITY,
        }
    }
}

/// Fills a suture definition with its defaults; `struct_size` is sizeof(sinew_suture_def).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_suture_def_init(def: *mut sinew_suture_def, struct_size: usize) -> sinew_status {
    guard(|| memory::initialise(def, struct_size, sinew_suture_def::defaults()))
}

/// Joins two surface points of bodies by a thread, which pulls and never pushes.
///
/// Body, triangle and weights of the points count. The bodies may be the same and still collide. `def` is nullable: the
/// defaults. It is drawn in at no more than 0.25 m/s. It is an attachment.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT if both points are the same.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_suture_create(
    world: *mut sinew_world,
    point: *const sinew_surface_point,
    other_point: *const sinew_surface_point,
    def: *const sinew_suture_def,
    out: *mut sinew_attachment_id,
) -> sinew_status {
    with_world_mut(world, |world| {
        let [point, other] = [("point", point), ("other_point", other_point)]
            .map(|(name, point)| memory::definition(name, point, sinew_surface_point::empty()));
        let (point, other) = (point?, other?);
        let def = memory::optional_definition("def", def, sinew_suture_def::defaults())?;
        let definition = SutureDefinition {
            length: (def.length != -1.0).then_some(def.length),
            stiffness: def.stiffness,
            force_limit: def.force_limit,
        };
        let out = memory::output("out", out)?;
        let anchor = |of: &sinew_surface_point| {
            let (triangle, weights) = (of.triangle, of.weights);
            Anchor::Point(SurfacePoint { triangle, weights })
        };
        let made = world.suture(
            point.body.id(),
            &anchor(&point),
            other.body.id(),
            &anchor(&other),
            &definition,
        )?;
        *out = made.into();
        Ok(())
    })
}

/// Changes the length [m] of a suture's thread over the next step, by at most 0.25 m/s.
///
/// A longer change goes on over the following steps.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT if the attachment is not a suture.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_suture_set_length(
    world: *mut sinew_world,
    suture: sinew_attachment_id,
    length: f32,
) -> sinew_status {
    with_world_mut(world, |world| world.set_suture_length(suture.id(), length))
}

/// Writes the current state of a suture.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT if the attachment is not a suture.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_suture_get_report(
    world: *const sinew_world,
    suture: sinew_attachment_id,
    out_report: *mut sinew_suture_report,
) -> sinew_status {
    with_world(world, |world| {
        let out = memory::report("out_report", out_report)?;
        out.fill(world.suture_report(suture.id())?.into());
        Ok(())
    })
}
