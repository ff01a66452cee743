//! What the stages of a step took.

use super::guard::{sinew_world, with_world, with_world_mut};
use super::memory::{self, told, versioned};
use super::status::sinew_status;
use crate::base::Error;
use crate::world::StepProfile;

/// Times and counts of the last step, taken or refused.
///
/// Times of stages are summed over threads. Counts of contacts are summed over all substeps.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_profile {
    /// Set to sizeof(sinew_profile) before the call.
    pub struct_size: usize,
    /// [s] Whole step.
    pub step: f64,
    /// [s] Targets and paths of tools and blades.
    pub plan: f64,
    /// [s] VERLET: forces and integration.
    pub forces: f64,
    /// [s] IMPLICIT, NEWTON: equations with the forces, and their solution.
    pub solver: f64,
    /// [s] Search for what is near a tool or other tissue.
    pub broad_phase: f64,
    /// [s] Search for contacts among what is near.
    pub narrow_phase: f64,
    /// [s] Impulses of contacts, attachments and sutures.
    pub contact_solver: f64,
    /// [s] New state, sleep, readers and haptic handles.
    pub publish: f64,
    /// [s] Blades and tears.
    pub cutting: f64,
    /// Bodies that were stepped.
    pub bodies: u64,
    /// Bodies that slept.
    pub sleeping_bodies: u64,
    /// Attempts; above 1 if a force_limit or contact repeated the step.
    pub tries: u64,
    /// Substeps, summed over the bodies.
    pub substeps: u64,
    /// Matrix-vector products of IMPLICIT and NEWTON.
    pub iterations: u64,
    /// Nodes, edges and faces near tools.
    pub candidates: u64,
    /// Contacts with tools.
    pub tool_contacts: u64,
    /// Contacts between tissue and tissue.
    pub tissue_contacts: u64,
}

versioned! { sinew_profile }

told! { StepProfile => sinew_profile {
    step, plan, forces, solver, broad_phase, narrow_phase, contact_solver, publish, cutting, bodies, sleeping_bodies,
    tries, substeps, iterations, candidates, tool_contacts, tissue_contacts
} }

/// Turns the profile of each step on (1) or off (0, the default).
///
/// A step that is not profiled reads no clock. Profiling changes no result.
///
/// Errors: SINEW_STATUS_UNSUPPORTED on WebAssembly, which has no clock.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_set_profiling(world: *mut sinew_world, enabled: u32) -> sinew_status {
    with_world_mut(world, |world| world.set_profiling(memory::flag("enabled", enabled)?))
}

/// Writes 1 if steps are profiled, else 0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_get_profiling(world: *const sinew_world, out: *mut u32) -> sinew_status {
    with_world(world, |world| {
        memory::write("out", out, u32::from(world.profile().is_some()))
    })
}

/// Writes the profile of the last step; 0 before the first.
///
/// Errors: SINEW_STATUS_UNSUPPORTED while profiling is off.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_get_profile(world: *const sinew_world, out: *mut sinew_profile) -> sinew_status {
    with_world(world, |world| {
        let out = memory::report("out", out)?;
        let profile = world.profile().ok_or_else(|| {
            Error::Unsupported("the world is not profiled: call sinew_world_set_profiling first".into())
        })?;
        out.fill(profile.into());
        Ok(())
    })
}
