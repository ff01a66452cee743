//! Worlds.

use glam::Vec3;
use std::ffi::c_void;

use super::body::sinew_body_id;
use super::guard::{destroy, guard, with_world, with_world_mut};
use super::limit::{SINEW_LIMIT_NONE, limit_of};
use super::log::{self, SINEW_LOG_WARNING};
use super::memory::{self, Versioned, versioned};
use super::status::sinew_status;
use crate::base::{Error, Result, StepReport};
use crate::simd::Kernel;
use crate::threads::RunTasks;
use crate::world::{World, WorldDefinition};

pub use super::guard::sinew_world;

/// Widest level that the processor supports.
pub const SINEW_KERNEL_BEST: u32 = 0;
/// Bitwise identical results on every processor.
pub const SINEW_KERNEL_PORTABLE: u32 = 1;
/// x86-64 with AVX2 and FMA.
pub const SINEW_KERNEL_AVX2: u32 = 2;
/// x86-64 with AVX-512 F, BW, DQ and VL.
pub const SINEW_KERNEL_AVX512: u32 = 3;
/// AArch64 with NEON.
pub const SINEW_KERNEL_NEON: u32 = 4;

/// One task of a step; call it with the task_data and the indices that sinew_run_tasks received.
pub type sinew_task = Option<unsafe extern "C" fn(task_data: *mut c_void, index: u32)>;

/// Callback that runs the tasks of a step on a job system.
///
/// Call task(task_data, index) once for every index from 0 to count - 1, on any threads, in any order, and return when
/// all have returned. Start no more tasks at once than there are free cores. The callback runs inside sinew_world_step
/// and must not use the world.
pub type sinew_run_tasks =
    Option<unsafe extern "C" fn(context: *mut c_void, task: sinew_task, task_data: *mut c_void, count: u32)>;

/// Settings of a world, filled by sinew_world_def_init.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_world_def {
    /// Size of this struct; sinew_world_def_init sets it.
    pub struct_size: usize,
    /// [m/s^2] Acceleration of all nodes; default 0 -9.81 0.
    pub gravity: [f32; 3],
    /// Threads of a step, at most 256: 1 (default) is the caller's, 0 is one per core.
    ///
    /// Results do not depend on it. The world's own threads sleep between steps.
    pub thread_count: u32,
    /// Substeps per step: 0 (default) takes as many as stability needs; n takes exactly n.
    ///
    /// IMPLICIT and NEWTON take at most 1 ms near a tool and at most 0.25 ms while attached to another body, and
    /// subdivide a substep that gains energy; at most 4096 substeps in total.
    pub substeps: u32,
    /// Largest number of substeps per step, at least 1; default 1000. Beyond it a step is SINEW_STATUS_UNSTABLE.
    ///
    /// The limit of 4096 of IMPLICIT and NEWTON makes a step of 4 s near a tool, or of 1 s while attached, unstable
    /// too.
    pub max_substeps: u32,
    /// [m] Bound on the position error of a step; 0: none. No effect with fixed substeps.
    pub tolerance: f32,
    /// Reserved; must be 0.
    pub reserved: u32,
    /// Job system that runs thread_count tasks per step; nullable (default): the world's own threads.
    ///
    /// It must stay valid while the world lives. A thread_count of 1 and small steps do not call it.
    pub run_tasks: sinew_run_tasks,
    /// First argument of run_tasks; nullable.
    pub tasks_context: *mut c_void,
    /// SIMD level, a sinew_kernel value; default SINEW_KERNEL_BEST.
    pub kernel: u32,
}

/// Report of a step; written on SINEW_STATUS_OK and on SINEW_STATUS_UNSTABLE.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_step_report {
    /// Set to sizeof(sinew_step_report) before the call.
    pub struct_size: usize,
    /// Largest number of substeps that a body took.
    pub substeps: u32,
    /// [s] Longest stable explicit substep over all bodies; infinity with IMPLICIT and NEWTON.
    pub stable_substep: f32,
    /// Number of bodies that became non-finite and were rolled back; the others were stepped.
    pub bodies_restored: u32,
    /// [m] Position error of this step; 0 without a tolerance, infinity if refused too early.
    pub error_estimate: f32,
    /// Number of interpenetrating surface edges that contact could not separate.
    ///
    /// Edges inside their own body count if that collides with itself. Later steps push others out of a
    /// closed body.
    pub crossings: u32,
    /// Cause of SINEW_STATUS_UNSTABLE, see diagnostics.h; else 0.
    pub limit: u32,
    /// UNSTABLE: body with the shortest substep.
    pub limit_body: sinew_body_id,
    /// Nodes of what limits it; the last is repeated.
    pub limit_nodes: [u32; 4],
    /// UNSTABLE: substeps that the step needs.
    pub limit_substeps: u32,
    /// Budget: units of work allowed.
    pub work: u32,
    /// Budget: units of work done.
    pub work_done: u32,
    /// [m] Budget: largest remaining error of an equation.
    pub residual: f32,
    /// [s] Budget: time not simulated yet.
    pub lag: f64,
    /// Body that took the most substeps.
    pub substeps_body: sinew_body_id,
    /// First body that was rolled back.
    pub restored_body: sinew_body_id,
    /// Body with the most of the crossings.
    pub crossing_body: sinew_body_id,
}

versioned! { sinew_world_def { run_tasks }, sinew_step_report { crossings, limit_body, substeps_body } }

impl sinew_world_def {
    fn defaults() -> Self {
        let defaults = WorldDefinition::default();
        Self {
            gravity: defaults.gravity.to_array(),
            thread_count: defaults.thread_count,
            substeps: defaults.substeps,
            max_substeps: defaults.max_substeps,
            tolerance: defaults.tolerance,
            kernel: SINEW_KERNEL_BEST,
            ..Self::empty()
        }
    }

    /// # Safety
    /// `def` is NULL or points to a definition of the size that it states, whose `run_tasks` is as [`Self::definition`]
    /// says.
    pub(super) unsafe fn read_or_default(def: *const Self) -> Result<WorldDefinition> {
        memory::optional_definition("def", def, Self::defaults())?.definition()
    }

    /// # Safety
    /// `run_tasks` is NULL or what [`sinew_run_tasks`] says, for as long as a world of this definition lives.
    unsafe fn definition(&self) -> Result<WorldDefinition> {
        memory::reserved("reserved", self.reserved)?;
        let run_tasks = |run| RunTasks::from_c(run, self.tasks_context);
        Ok(WorldDefinition {
            gravity: Vec3::from_array(self.gravity),
            thread_count: self.thread_count,
            tasks: self.run_tasks.map(run_tasks),
            substeps: self.substeps,
            max_substeps: self.max_substeps,
            tolerance: self.tolerance,
            kernel: match self.kernel {
                SINEW_KERNEL_BEST => Kernel::Best,
                SINEW_KERNEL_PORTABLE => Kernel::Portable,
                SINEW_KERNEL_AVX2 => Kernel::Avx2,
                SINEW_KERNEL_AVX512 => Kernel::Avx512,
                SINEW_KERNEL_NEON => Kernel::Neon,
                unknown => return Err(Error::invalid(format!("kernel is {unknown}: no SINEW_KERNEL_..."))),
            },
        })
    }
}

impl From<StepReport> for sinew_step_report {
    fn from(report: StepReport) -> Self {
        Self {
            substeps: report.substeps,
            stable_substep: report.stable_substep,
            bodies_restored: report.bodies_restored,
            error_estimate: report.error_estimate,
            crossings: report.crossings,
            limit: report.limit.map_or(SINEW_LIMIT_NONE, |limit| limit_of(limit.of.kind)),
            limit_body: report.limit.map(|limit| limit.body).unwrap_or_default().into(),
            limit_nodes: report.limit.map_or([0; 4], |limit| limit.of.nodes),
            limit_substeps: report.limit.map_or(0, |limit| limit.needed),
            substeps_body: report.substeps_body.unwrap_or_default().into(),
            restored_body: report.restored_body.unwrap_or_default().into(),
            crossing_body: report.crossing_body.unwrap_or_default().into(),
            ..Self::empty()
        }
    }
}

/// Fills a world definition with its defaults; `struct_size` is sizeof(sinew_world_def).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_def_init(def: *mut sinew_world_def, struct_size: usize) -> sinew_status {
    guard(|| memory::initialise(def, struct_size, sinew_world_def::defaults()))
}

/// Creates an empty world; destroy it with sinew_world_destroy.
///
/// Errors: SINEW_STATUS_UNSUPPORTED if a thread cannot start or the processor lacks the kernel.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_create(def: *const sinew_world_def, out: *mut *mut sinew_world) -> sinew_status {
    guard(|| {
        let out = memory::output("out", out)?;
        let def = memory::definition("def", def, sinew_world_def::defaults())?;
        let world = World::new(def.definition()?)?;
        *out = Box::into_raw(crate::base::memory::boxed(sinew_world::new(world))?);
        Ok(())
    })
}

/// Destroys a world with all its bodies, tools and blades; NULL has no effect.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_destroy(world: *mut sinew_world) {
    destroy(world);
}

/// Advances everything in the world by one time step.
///
/// `dt` [s] is above 0. `report` is nullable. The call ends the views of positions and velocities.
///
/// Errors: SINEW_STATUS_UNSTABLE if the step needs more than max_substeps or the fixed substeps.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_step(
    world: *mut sinew_world,
    dt: f32,
    report: *mut sinew_step_report,
) -> sinew_status {
    step_and_report(world, report, |world| world.step(dt))
}

/// Takes a step, and writes what came of it, also where it is refused as unstable.
///
/// # Safety
/// `world` is NULL or a world nobody else uses; `report` is NULL or writable for the size that it states.
pub(super) unsafe fn step_and_report<Report: Into<sinew_step_report>>(
    world: *mut sinew_world,
    report: *mut sinew_step_report,
    mut step: impl FnMut(&mut World) -> Result<Report>,
) -> sinew_status {
    with_world_mut(world, |world| {
        let report = memory::optional_report("report", report)?;
        let result = step(world).map(Into::into);
        let told = match &result {
            Ok(told) => Some(*told),
            Err(Error::Unstable { report, .. }) => Some((*report).into()),
            Err(_) => None,
        };
        let lag = world.lag();
        if let (Some(report), Some(told)) = (report, told) {
            report.fill(sinew_step_report { lag, ..told });
        }
        let count = result?.bodies_restored;
        if count > 0 {
            let time = world.time();
            log::log(
                SINEW_LOG_WARNING,
                format_args!("the step to {time} s restored {count} bodies"),
            );
        }
        Ok(())
    })
}

/// Sets the gravitational acceleration [m/s^2], 3 floats, from the next step on.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_set_gravity(world: *mut sinew_world, gravity: *const f32) -> sinew_status {
    with_world_mut(world, |world| world.set_gravity(memory::vector("gravity", gravity)?))
}

/// Computes a hash over all that the next step depends on; compare it within one version.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_get_state_hash(world: *const sinew_world, out: *mut u64) -> sinew_status {
    with_world(world, |world| memory::write("out", out, world.state_hash()))
}
