//! What a body tells of itself: energy, memory, its solver.

use std::mem::offset_of;

use super::body::{sinew_body_id, with_body};
use super::guard::{sinew_world, with_world};
use super::memory::{self, Versioned};
use super::status::sinew_status;

/// J, at the time of the positions.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_energy {
    /// Set by the caller.
    pub struct_size: usize,
    /// Of the nodes that are free to move, with what mass_scaling adds to them.
    pub kinetic: f64,
    /// Springs and every other inner term, less the work that a constant pressure has done.
    pub elastic: f64,
    /// Zero at the origin.
    pub gravitational: f64,
}

/// How much memory the springs of a body take.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_storage_report {
    /// Set by the caller.
    pub struct_size: usize,
    /// Nodes of the body.
    pub node_count: usize,
    /// Each counted once.
    pub spring_count: usize,
    /// By springs that exist.
    pub bytes_used: usize,
    /// From the allocator, with what is spare.
    pub bytes_reserved: usize,
}

/// How a body's solver took the last step: not one that was refused, or for which the body was put back.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_solver_report {
    /// Set by the caller.
    pub struct_size: usize,
    /// IMPLICIT, NEWTON: how often the equations of the step were multiplied out; 0 for VERLET.
    pub iterations: u32,
    /// How far nodes may be from where the step's equation has them, m. IMPLICIT: root mean square by mass; above what rounding
    /// allows only where `iterations` of the definition were not enough. NEWTON: the longest way of the last correction, of which
    /// about a hundredth is left. What a shorter step would change is not in it. 0 for VERLET.
    pub error: f32,
    /// VERLET: by how much mass_scaling makes nodes heavier in all, kg.
    pub added_mass: f64,
    /// IMPLICIT, NEWTON: linearised equations that were solved; 0 for VERLET.
    pub solves: u32,
    /// IMPLICIT, NEWTON: 1 where every equation was solved as far as the definition asks or rounding allows, else 0; 0 for VERLET.
    pub converged: u32,
}

/// What a body encloses: sums over the cavities that are closed; all 0 where its definition asks for neither enclosed_stiffness nor
/// pressure.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_enclosed_report {
    /// Set by the caller.
    pub struct_size: usize,
    /// Cavities that have not been cut open.
    pub cavity_count: usize,
    /// m3, at the time of the positions; negative where they are inside out.
    pub volume: f64,
    /// The same at rest.
    pub rest_volume: f64,
    /// Pa: by how much the pressure inside is above that outside; the mean by volume at rest.
    pub pressure: f64,
}

// SAFETY: repr(C), begins with struct_size, numbers alone.
unsafe impl Versioned for sinew_energy {
    const SIZES: &'static [usize] = &[size_of::<Self>()];
    const NAME: &'static str = "sinew_energy";
}

// SAFETY: repr(C), begins with struct_size, numbers alone.
unsafe impl Versioned for sinew_storage_report {
    const SIZES: &'static [usize] = &[size_of::<Self>()];
    const NAME: &'static str = "sinew_storage_report";
}

// SAFETY: repr(C), begins with struct_size, numbers alone.
unsafe impl Versioned for sinew_enclosed_report {
    const SIZES: &'static [usize] = &[size_of::<Self>()];
    const NAME: &'static str = "sinew_enclosed_report";
}

// SAFETY: repr(C), begins with struct_size, numbers alone.
unsafe impl Versioned for sinew_solver_report {
    const SIZES: &'static [usize] = &[offset_of!(Self, added_mass), size_of::<Self>()];
    const NAME: &'static str = "sinew_solver_report";
}

/// Writes the energy of a body. `out->struct_size` is set by the caller.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
///
/// # Safety
/// `world` is NULL or a world nobody changes; `out` is NULL or writable for the size that it states.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_energy(
    world: *const sinew_world,
    body: sinew_body_id,
    out: *mut sinew_energy,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_world(world, |world| {
            let energy = world.body(body.id())?.energy(world.gravity());
            memory::report("out", out)?.fill(sinew_energy {
                struct_size: size_of::<sinew_energy>(),
                kinetic: energy.kinetic,
                elastic: energy.elastic,
                gravitational: energy.gravitational,
            });
            Ok(())
        })
    }
}

/// Writes how much memory the springs of a body take. `out->struct_size` is set by the caller.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
///
/// # Safety
/// `world` is NULL or a world nobody changes; `out` is NULL or writable for the size that it states.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_storage_report(
    world: *const sinew_world,
    body: sinew_body_id,
    out: *mut sinew_storage_report,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_body(world, body, |body| {
            let report = body.storage_report();
            memory::report("out", out)?.fill(sinew_storage_report {
                struct_size: size_of::<sinew_storage_report>(),
                node_count: report.node_count,
                spring_count: report.spring_count,
                bytes_used: report.bytes_used,
                bytes_reserved: report.bytes_reserved,
            });
            Ok(())
        })
    }
}

/// Writes how a body's solver took the last step. `out->struct_size` is set by the caller.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
///
/// # Safety
/// `world` is NULL or a world nobody changes; `out` is NULL or writable for the size that it states.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_solver_report(
    world: *const sinew_world,
    body: sinew_body_id,
    out: *mut sinew_solver_report,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_body(world, body, |body| {
            let report = body.solver_report();
            memory::report("out", out)?.fill(sinew_solver_report {
                struct_size: size_of::<sinew_solver_report>(),
                iterations: report.iterations,
                error: report.error,
                added_mass: report.added_mass,
                solves: report.solves,
                converged: u32::from(report.converged),
            });
            Ok(())
        })
    }
}

/// Writes what a body encloses. `out->struct_size` is set by the caller.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
///
/// # Safety
/// `world` is NULL or a world nobody changes; `out` is NULL or writable for the size that it states.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_enclosed_report(
    world: *const sinew_world,
    body: sinew_body_id,
    out: *mut sinew_enclosed_report,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_body(world, body, |body| {
            let report = body.enclosed();
            memory::report("out", out)?.fill(sinew_enclosed_report {
                struct_size: size_of::<sinew_enclosed_report>(),
                cavity_count: report.cavity_count,
                volume: report.volume,
                rest_volume: report.rest_volume,
                pressure: report.pressure,
            });
            Ok(())
        })
    }
}
