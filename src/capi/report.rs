//! What a body tells of itself: energy, memory, its solver.

use super::body::{sinew_body_id, with_body};
use super::definition::{SINEW_SOLVER_IMPLICIT, SINEW_SOLVER_NEWTON, SINEW_SOLVER_VERLET};
use super::guard::{sinew_world, with_world};
use super::memory::{self, told, versioned};
use super::status::sinew_status;
use crate::def::{EnclosedReport, Energy, Solver, StorageReport};

/// Energy of a body [J] at the time of the positions.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_energy {
    /// Set to sizeof(sinew_energy) before the call.
    pub struct_size: usize,
    /// [J] Kinetic energy of the free nodes, without the mass of mass_scaling.
    pub kinetic: f64,
    /// [J] Energy of all internal terms, minus the work of a constant pressure.
    pub elastic: f64,
    /// [J] Gravitational energy, 0 at the origin.
    pub gravitational: f64,
}

/// Memory use of the springs of a body.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_storage_report {
    /// Set to sizeof(sinew_storage_report) before the call.
    pub struct_size: usize,
    /// Number of nodes, with those added by cuts.
    pub node_count: usize,
    /// Number of springs, each counted once.
    pub spring_count: usize,
    /// [bytes] Memory used by existing springs.
    pub bytes_used: usize,
    /// [bytes] Memory allocated, including spare room.
    pub bytes_reserved: usize,
}

/// Report of the solver of a body for its last successful step.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_solver_report {
    /// Set to sizeof(sinew_solver_report) before the call.
    pub struct_size: usize,
    /// IMPLICIT, NEWTON: matrix-vector products of the step.
    pub iterations: u32,
    /// [m] Remaining error of the solved equations, without that of time steps; 0 for VERLET.
    ///
    /// IMPLICIT: mass-weighted root mean square. NEWTON: last correction; about 1/100 of it remains.
    pub error: f32,
    /// [kg] VERLET: total mass that mass_scaling adds.
    pub added_mass: f64,
    /// IMPLICIT, NEWTON: number of linear systems solved.
    pub solves: u32,
    /// IMPLICIT, NEWTON: 1 if each solve reached its tolerance or rounding.
    pub has_converged: u32,
    /// Solver in use, a sinew_solver value; never AUTO.
    pub solver: u32,
    /// AUTO: substeps of VERLET on creation; IMPLICIT above 150; else 0.
    pub auto_substeps: u32,
    /// [s] AUTO: step length of the choice, the mean so far or 1/60 s; else 0.
    pub auto_step: f32,
}

/// Sums over the closed cavities of a body; all 0 without enclosed_stiffness and pressure.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_enclosed_report {
    /// Set to sizeof(sinew_enclosed_report) before the call.
    pub struct_size: usize,
    /// Number of cavities that are not cut open.
    pub cavity_count: usize,
    /// [m^3] Volume at the time of the positions; negative if inverted.
    pub volume: f64,
    /// [m^3] Volume in the rest shape.
    pub rest_volume: f64,
    /// [Pa] Mean overpressure, weighted by rest volume.
    pub pressure: f64,
}

versioned! { sinew_energy, sinew_storage_report, sinew_enclosed_report, sinew_solver_report { added_mass, solver } }

told! { EnclosedReport => sinew_enclosed_report { cavity_count, volume, rest_volume, pressure } }

told! { StorageReport => sinew_storage_report { node_count, spring_count, bytes_used, bytes_reserved } }

told! { Energy => sinew_energy { kinetic, elastic, gravitational } }

/// Writes the energy of a body.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_energy(
    world: *const sinew_world,
    body: sinew_body_id,
    out: *mut sinew_energy,
) -> sinew_status {
    with_world(world, |world| {
        let energy = world.body(body.id())?.energy(world.gravity());
        memory::write_report("out", out, energy.into())
    })
}

/// Writes the memory use of the springs of a body.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_storage_report(
    world: *const sinew_world,
    body: sinew_body_id,
    out: *mut sinew_storage_report,
) -> sinew_status {
    with_body(world, body, |body| {
        memory::write_report("out", out, body.storage_report().into())
    })
}

/// Writes how the solver of a body took the last step.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_solver_report(
    world: *const sinew_world,
    body: sinew_body_id,
    out: *mut sinew_solver_report,
) -> sinew_status {
    with_body(world, body, |body| {
        let (report, choice) = (body.solver_report(), body.solver_choice());
        let filled = sinew_solver_report {
            struct_size: size_of::<sinew_solver_report>(),
            iterations: report.iterations,
            error: report.error,
            added_mass: report.added_mass,
            solves: report.solves,
            has_converged: u32::from(report.has_converged),
            solver: match choice.solver {
                Solver::Verlet | Solver::Auto => SINEW_SOLVER_VERLET,
                Solver::Implicit => SINEW_SOLVER_IMPLICIT,
                Solver::Newton => SINEW_SOLVER_NEWTON,
            },
            auto_substeps: choice.substeps,
            auto_step: choice.step,
        };
        memory::write_report("out", out, filled)
    })
}

/// Writes the volume and the pressure of the cavities of a body.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_enclosed_report(
    world: *const sinew_world,
    body: sinew_body_id,
    out: *mut sinew_enclosed_report,
) -> sinew_status {
    with_body(world, body, |body| {
        memory::write_report("out", out, body.enclosed().into())
    })
}
