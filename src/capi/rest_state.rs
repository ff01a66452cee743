//! States of rest.

use super::body::sinew_body_id;
use super::guard::{guard, sinew_world, with_world_mut};
use super::memory::{self, Versioned};
use super::status::sinew_status;
use crate::solver::RestStateDefinition;

/// How a state of rest is looked for. Filled by sinew_rest_state_def_init.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_rest_state_def {
    /// Set by sinew_rest_state_def_init.
    pub struct_size: usize,
    /// How far a node may be from where it is at rest, as far as that can be told, m; 0, the default: a millionth of the body's
    /// extent.
    pub tolerance: f32,
    /// The most products with the matrix of second derivatives; 0, the default: a million.
    pub iterations: u32,
}

/// How a state of rest was found.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_rest_state_report {
    /// Set by the caller.
    pub struct_size: usize,
    /// Linearised equations that were solved.
    pub iterations: u32,
    /// Products with their matrices.
    pub products: u32,
    /// The largest force left on a node that is not pinned, before positions were rounded to float, N.
    pub residual: f64,
    /// How far a node may be from where it is at rest, before positions were rounded to float, m.
    pub error: f64,
    /// Of springs, gravity and forces, J, zero at the origin: before.
    pub energy_before: f64,
    /// After.
    pub energy_after: f64,
}

// SAFETY: repr(C), begins with struct_size, numbers alone.
unsafe impl Versioned for sinew_rest_state_def {
    const SIZES: &'static [usize] = &[size_of::<Self>()];
    const NAME: &'static str = "sinew_rest_state_def";
}

// SAFETY: repr(C), begins with struct_size, numbers alone.
unsafe impl Versioned for sinew_rest_state_report {
    const SIZES: &'static [usize] = &[size_of::<Self>()];
    const NAME: &'static str = "sinew_rest_state_report";
}

impl sinew_rest_state_def {
    fn defaults() -> Self {
        Self {
            struct_size: size_of::<Self>(),
            tolerance: 0.0,
            iterations: 0,
        }
    }
}

/// Fills `def` with the defaults. `struct_size` is sizeof(sinew_rest_state_def).
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT.
///
/// # Safety
/// `def` is NULL or writable for `struct_size` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_rest_state_def_init(def: *mut sinew_rest_state_def, struct_size: usize) -> sinew_status {
    // SAFETY: the same contract.
    guard(|| unsafe { memory::initialise(def, struct_size, sinew_rest_state_def::defaults()) })
}

/// Moves the free nodes of a body, whatever its solver, to the nearest place downhill where it is at rest under gravity, its
/// pins where they are, and the forces applied since the last step, which stay pending. Velocities become zero, and
/// sinew_body_get_pin_force tells what holds the pins there. Views of the body's positions and velocities end. It is no step: it takes memory and may take seconds. Tools are not
/// taken into account. How a part that no pin holds lies and is turned as a whole is as it happens to be. `def` is nullable: the
/// defaults; `report` is nullable; `report->struct_size` is set by the caller.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT (also where a part is pulled by a net force along an axis along which no pin holds it, and
/// so has no state of rest), SINEW_STATUS_STALE_ID, SINEW_STATUS_UNSTABLE (not found in the iterations allowed), SINEW_STATUS_OUT_OF_MEMORY; nothing
/// has changed then.
///
/// # Safety
/// `world` is NULL or a world nobody else uses; `def` is NULL or a definition of the size that it states; `report` is NULL or
/// writable for the size that it states.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_rest_state(
    world: *mut sinew_world,
    body: sinew_body_id,
    def: *const sinew_rest_state_def,
    report: *mut sinew_rest_state_report,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_world_mut(world, |world| {
            let defaults = sinew_rest_state_def::defaults();
            let def = if def.is_null() {
                defaults
            } else {
                memory::definition("def", def, defaults)?
            };
            let out = if report.is_null() {
                None
            } else {
                Some(memory::report("report", report)?)
            };
            let found = world.rest_state(
                body.id(),
                &RestStateDefinition {
                    tolerance: def.tolerance,
                    iterations: def.iterations,
                },
            )?;
            if let Some(out) = out {
                out.fill(sinew_rest_state_report {
                    struct_size: size_of::<sinew_rest_state_report>(),
                    iterations: found.iterations,
                    products: found.products,
                    residual: found.residual,
                    error: found.error,
                    energy_before: found.energy_before,
                    energy_after: found.energy_after,
                });
            }
            Ok(())
        })
    }
}
