//! States of rest.

use super::body::sinew_body_id;
use super::guard::{guard, sinew_world, with_world_mut};
use super::memory::{self, Versioned, told, versioned};
use super::status::sinew_status;
use crate::solver::{RestStateDefinition, RestStateReport};

/// Settings of the search for static equilibrium, filled by sinew_equilibrium_def_init.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_equilibrium_def {
    /// Size of this struct; sinew_equilibrium_def_init sets it.
    pub struct_size: usize,
    /// [m] Estimated position error allowed; 0: 1e-6 of the body's extent.
    pub tolerance: f32,
    /// Largest number of matrix-vector products; 0 (default): 1,000,000.
    pub iterations: u32,
}

/// Report of the search for static equilibrium.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_equilibrium_report {
    /// Set to sizeof(sinew_equilibrium_report) before the call.
    pub struct_size: usize,
    /// Number of linear systems solved.
    pub iterations: u32,
    /// Number of matrix-vector products.
    pub products: u32,
    /// [N] Largest force left on a free node, before positions become floats.
    pub residual: f64,
    /// [m] Estimated position error, before positions become floats.
    pub error: f64,
    /// [J] Energy of springs, gravity and forces before the search.
    pub energy_before: f64,
    /// [J] Energy of springs, gravity and forces after the search.
    pub energy_after: f64,
}

versioned! { sinew_equilibrium_def, sinew_equilibrium_report }

told! { RestStateReport => sinew_equilibrium_report { iterations, products, residual, error, energy_before, energy_after } }

/// Fills a definition with its defaults; `struct_size` is sizeof(sinew_equilibrium_def).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_equilibrium_def_init(
    def: *mut sinew_equilibrium_def,
    struct_size: usize,
) -> sinew_status {
    guard(|| memory::initialise(def, struct_size, sinew_equilibrium_def::empty()))
}

/// Moves the free nodes of a body to static equilibrium under gravity, pins and pending forces.
///
/// It may take seconds, ignores tools and ends views. Velocities become 0, pending forces stay. `def` (defaults) and
/// `out_report` are nullable. Where unpinned parts end is unspecified.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT if a net force acts on an unpinned part; SINEW_STATUS_UNSTABLE if not found.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_solve_equilibrium(
    world: *mut sinew_world,
    body: sinew_body_id,
    def: *const sinew_equilibrium_def,
    out_report: *mut sinew_equilibrium_report,
) -> sinew_status {
    with_world_mut(world, |world| {
        let def = memory::optional_definition("def", def, sinew_equilibrium_def::empty())?;
        let out = memory::optional_report("out_report", out_report)?;
        let found = world.rest_state(
            body.id(),
            &RestStateDefinition {
                tolerance: def.tolerance,
                iterations: def.iterations,
            },
        )?;
        if let Some(out) = out {
            out.fill(found.into());
        }
        Ok(())
    })
}
