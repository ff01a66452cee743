//! Sutures.

use super::attachment::sinew_attachment_id;
use super::body::sinew_body_id;
use super::guard::{guard, sinew_world, with_world, with_world_mut};
use super::memory::{self, Versioned};
use super::status::sinew_status;
use crate::base::Result;
use crate::world::{Anchor, SurfacePoint, SutureDefinition};

/// What a suture is like. Filled by sinew_suture_def_init.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_suture_def {
    /// Set by sinew_suture_def_init.
    pub struct_size: usize,
    /// How long the thread is between its points while nothing pulls, m, at least 0; -1, the default: as long as they are apart.
    pub length: f32,
    /// By what force it is longer, N/m, above 0; infinity, the default: it does not stretch.
    pub stiffness: f32,
    /// The force at which it is pulled through the tissue, N, at least 0; 0, the default, or infinity: it holds whatever comes.
    pub force_limit: f32,
    /// 0.
    pub reserved0: u32,
}

/// How a suture is now.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_suture_report {
    /// Set by the caller.
    pub struct_size: usize,
    /// How long its thread is while nothing pulls, m.
    pub length: f32,
    /// How far apart its points are, m: further than that where it pulls.
    pub distance: f32,
    /// What the thread stores, J; 0 where it does not stretch. That of bodies is without it.
    pub energy: f64,
}

// SAFETY: repr(C), begins with struct_size, numbers alone.
unsafe impl Versioned for sinew_suture_def {
    const SIZES: &'static [usize] = &[size_of::<Self>()];
    const NAME: &'static str = "sinew_suture_def";
}

// SAFETY: repr(C), begins with struct_size, numbers alone.
unsafe impl Versioned for sinew_suture_report {
    const SIZES: &'static [usize] = &[size_of::<Self>()];
    const NAME: &'static str = "sinew_suture_report";
}

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

/// Fills `def` with the defaults. `struct_size` is sizeof(sinew_suture_def).
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT.
///
/// # Safety
/// `def` is NULL or writable for `struct_size` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_suture_def_init(def: *mut sinew_suture_def, struct_size: usize) -> sinew_status {
    // SAFETY: the same contract.
    guard(|| unsafe { memory::initialise(def, struct_size, sinew_suture_def::defaults()) })
}

/// Sutures a point of the surface of a body to one of another, or of the same: a thread between them, which pulls them together where
/// they are further apart than it is long, and never pushes. Each may turn about its point as it likes. What the thread joins still
/// touches. A point is a triangle's number, as to sinew_body_attach_points, and 3 parts of its corners, at least 0 and 1 in sum.
///
/// It is one of the attachments, with the id written to `out`: sinew_attachment_release cuts it, sinew_attachment_get_force has
/// the force on `body`, and one that is pulled through the tissue is among those of sinew_world_get_slipped: with the step in which
/// its mean force was larger than the definition's force_limit. It ends with either body. The bodies take their substeps together,
/// as with sinew_body_attach_points_to_points; no stiffness makes them shorter.
///
/// A thread that is to be shorter than its points are apart is drawn in as with sinew_suture_set_length. No momentum is made; nor is
/// any angular momentum, unless points of a thread of next to no length pass each other. Nor is energy, but by drawing it in; what takes up
/// a thread that becomes taut within a substep is lost, as is some of what sways along a stiff one. `def` is nullable: the defaults.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT (also where the two are one point), SINEW_STATUS_STALE_ID, SINEW_STATUS_OUT_OF_MEMORY;
/// then nothing is sutured.
///
/// # Safety
/// `world` is NULL or a world nobody else uses; `weights` and `other_weights` are NULL or 3 floats; `def` is NULL or a definition of the
/// size that it states; `out` is NULL or writable.
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

/// Tightens a suture, or gives it slack: its thread becomes so long, m, at least 0, evenly over the next step; where it is to become
/// shorter no faster than by 0.25 m/s, over as many steps as that takes.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT (also where the attachment is no suture), SINEW_STATUS_STALE_ID.
///
/// # Safety
/// `world` is NULL or a world nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_suture_set_length(
    world: *mut sinew_world,
    suture: sinew_attachment_id,
    length: f32,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe { with_world_mut(world, |world| world.set_suture_length(suture.id(), length)) }
}

/// Writes how a suture is now; `report->struct_size` is set by the caller.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT (also where the attachment is no suture), SINEW_STATUS_STALE_ID.
///
/// # Safety
/// `world` is NULL or a world nobody changes; `report` is NULL or writable for the size that it states.
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
