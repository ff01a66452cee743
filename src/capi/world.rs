//! Worlds.

use std::mem::offset_of;

use glam::Vec3;
use libc::c_void;

use super::guard::{guard, with_world, with_world_mut};
use super::memory::{self, Versioned};
use super::status::sinew_status;
use crate::base::{Error, Result};
use crate::simd::Kernel;
use crate::threads::RunTasks;
use crate::world::{StepReport, World, WorldDefinition};

pub use super::guard::sinew_world;

/// uint32_t: the instructions that springs and nodes are worked on with. The widest that the processor offers.
pub const SINEW_KERNEL_BEST: u32 = 0;
/// The same bits on every processor.
pub const SINEW_KERNEL_PORTABLE: u32 = 1;
/// x86-64: AVX2 and FMA.
pub const SINEW_KERNEL_AVX2: u32 = 2;
/// x86-64: AVX-512 F, BW, DQ and VL.
pub const SINEW_KERNEL_AVX512: u32 = 3;
/// AArch64.
pub const SINEW_KERNEL_NEON: u32 = 4;

/// A part of a step, to be called once for every index that sinew_run_tasks was told, with the task_data it was given.
pub type sinew_task = Option<unsafe extern "C" fn(task_data: *mut c_void, index: u32)>;

/// Runs a step's tasks on the threads of a job system: calls task(task_data, index) once for every index from 0 to
/// count - 1, on any threads, in any order, even one after another, and returns when all of these calls have. Calling it
/// later than that is an error that is not found out.
///
/// Calls that overlap share the work; each lasts until the step is taken, so that no more tasks should run at once than
/// there are cores free for them. The first to begin takes the step, wherever it runs; with none, the step is taken by
/// the caller's thread. Runs within sinew_world_step, and must not use the world.
pub type sinew_run_tasks =
    Option<unsafe extern "C" fn(context: *mut c_void, task: sinew_task, task_data: *mut c_void, count: u32)>;

/// How a world steps. Filled by sinew_world_def_init.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_world_def {
    /// Set by sinew_world_def_init.
    pub struct_size: usize,
    /// m/s^2; default 0 -9.81 0.
    pub gravity: [f32; 3],
    /// 1, the default: the caller's thread alone; 0: one per core; at most 256. Results are the same for every number. A
    /// world's threads end with it, and sleep while it is not stepped or too small to share.
    pub thread_count: u32,
    /// 0, the default: as many as stability needs; n: exactly n per step, but for bodies of IMPLICIT and NEWTON near a tool,
    /// whose substeps are of 1 ms at most there, or attached to a body, of 0.25 ms, and where a substep of theirs gains energy: then
    /// they are cut again, to 4096 in all.
    pub substeps: u32,
    /// Default 1000; at least 1; a step that needs more is SINEW_STATUS_UNSTABLE. What IMPLICIT and NEWTON cut, as above, may be 4096
    /// parts whatever this is; one that would take more of them, 4 s near a tool or 1 s attached to a body, is
    /// SINEW_STATUS_UNSTABLE too.
    pub max_substeps: u32,
    /// m; 0, the default: off, as it is with fixed substeps; above 0, with substeps 0: a step's own position error stays below it.
    pub tolerance: f32,
    /// 0.
    pub reserved: u32,
    /// Nullable, the default: the world has threads of its own. Else these are used instead, thread_count tasks a step, 1:
    /// never called; it is called by steps that are worth sharing, as long as the world lives.
    pub run_tasks: sinew_run_tasks,
    /// What run_tasks is given; nullable.
    pub tasks_context: *mut c_void,
    /// SINEW_KERNEL_...; default SINEW_KERNEL_BEST.
    pub kernel: u32,
    /// 0.
    pub reserved2: u32,
}

/// What a step did; filled on SINEW_STATUS_OK and SINEW_STATUS_UNSTABLE.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_step_report {
    /// Set by the caller.
    pub struct_size: usize,
    /// The most that any body took.
    pub substeps: u32,
    /// s: the longest explicit substep that is stable now, over all bodies; infinity: no limit, as for bodies of IMPLICIT and
    /// NEWTON.
    pub stable_substep: f32,
    /// Bodies that would have become non-finite: put back as they were, the others stepped.
    pub bodies_restored: u32,
    /// m: how far a position of this step may be off; 0 where tolerance is off, infinity where the step is refused before there is
    /// anything to compare.
    pub error_estimate: f32,
    /// Edges of surfaces that pass through other tissue, or through their own body's where it meets itself: what contact could not keep
    /// apart. Those of another body in one that is closed come out again by themselves.
    pub crossings: u32,
    /// 0.
    pub reserved: u32,
}

// SAFETY: repr(C), begins with struct_size, numbers and pointers alone; what is no function is the caller's breach.
unsafe impl Versioned for sinew_world_def {
    const SIZES: &'static [usize] = &[offset_of!(Self, run_tasks), size_of::<Self>()];
    const NAME: &'static str = "sinew_world_def";
}

// SAFETY: repr(C), begins with struct_size, numbers alone.
unsafe impl Versioned for sinew_step_report {
    const SIZES: &'static [usize] = &[offset_of!(Self, crossings), size_of::<Self>()];
    const NAME: &'static str = "sinew_step_report";
}

impl sinew_world_def {
    fn defaults() -> Self {
        let defaults = WorldDefinition::default();
        Self {
            struct_size: size_of::<Self>(),
            gravity: defaults.gravity.to_array(),
            thread_count: defaults.thread_count,
            substeps: defaults.substeps,
            max_substeps: defaults.max_substeps,
            tolerance: defaults.tolerance,
            reserved: 0,
            run_tasks: None,
            tasks_context: std::ptr::null_mut(),
            kernel: SINEW_KERNEL_BEST,
            reserved2: 0,
        }
    }

    /// # Safety
    /// `run_tasks` is NULL or what [`sinew_run_tasks`] says, for as long as a world of this definition lives.
    unsafe fn definition(&self) -> Result<WorldDefinition> {
        memory::reserved("reserved", self.reserved)?;
        memory::reserved("reserved2", self.reserved2)?;
        // SAFETY: the same contract.
        let run_tasks = |run| unsafe { RunTasks::from_c(run, self.tasks_context) };
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
            struct_size: size_of::<Self>(),
            substeps: report.substeps,
            stable_substep: report.stable_substep,
            bodies_restored: report.bodies_restored,
            error_estimate: report.error_estimate,
            crossings: report.crossings,
            reserved: 0,
        }
    }
}

/// Fills `def` with the defaults. `struct_size` is sizeof(sinew_world_def).
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT.
///
/// # Safety
/// `def` is NULL or writable for `struct_size` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_def_init(def: *mut sinew_world_def, struct_size: usize) -> sinew_status {
    // SAFETY: the same contract.
    guard(|| unsafe { memory::initialise(def, struct_size, sinew_world_def::defaults()) })
}

/// Creates an empty world, which the caller destroys with sinew_world_destroy.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_UNSUPPORTED (a thread could not be started, or the
/// processor does not offer the kernel),
/// SINEW_STATUS_OUT_OF_MEMORY.
///
/// # Safety
/// `def` is NULL or a definition of the size that it states, with a `run_tasks` that keeps its word; `out` is NULL or
/// writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_create(def: *const sinew_world_def, out: *mut *mut sinew_world) -> sinew_status {
    guard(|| {
        // SAFETY: the same contract.
        let out = unsafe { memory::output("out", out) }?;
        // SAFETY: the same contract.
        let def = unsafe { memory::definition("def", def, sinew_world_def::defaults()) }?;
        // SAFETY: the same contract.
        let world = World::new(unsafe { def.definition() }?)?;
        *out = Box::into_raw(crate::base::memory::boxed(sinew_world::new(world))?);
        Ok(())
    })
}

/// Destroys a world with all that is in it. NULL: nothing.
///
/// # Safety
/// `world` is NULL or a world that is not destroyed and that nobody uses any more.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_destroy(world: *mut sinew_world) {
    if !world.is_null() {
        guard(|| {
            // SAFETY: made by Box::into_raw in sinew_world_create, and given back once.
            drop(unsafe { Box::from_raw(world) });
            Ok(())
        });
    }
}

/// Steps everything in the world by `dt` seconds, above 0. `report` may be NULL. Views of positions and velocities end.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT; SINEW_STATUS_UNSTABLE, where the step needs more substeps than max_substeps, or
/// than the world's fixed substeps: nothing has moved, pending forces and poses stay pending.
///
/// # Safety
/// `world` is NULL or a world nobody else uses; `report` is NULL or writable for the size that it states.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_step(
    world: *mut sinew_world,
    dt: f32,
    report: *mut sinew_step_report,
) -> sinew_status {
    let step = |world: &mut World| {
        let report = if report.is_null() {
            None
        } else {
            // SAFETY: the same contract.
            Some(unsafe { memory::report("report", report) }?)
        };
        let result = world.step(dt);
        if let (Some(report), Ok(value) | Err(Error::Unstable { report: value, .. })) = (report, &result) {
            // SAFETY: still there, by the same contract.
            unsafe { report.fill((*value).into()) };
        }
        result.map(drop)
    };
    // SAFETY: the same contract.
    unsafe { with_world_mut(world, step) }
}

/// Gives everything this acceleration, 3 floats, m/s^2, from the next step on.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT.
///
/// # Safety
/// `world` is NULL or a world nobody else uses; `gravity` is NULL or 3 floats.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_set_gravity(world: *mut sinew_world, gravity: *const f32) -> sinew_status {
    // SAFETY: the same contract.
    unsafe { with_world_mut(world, |world| world.set_gravity(memory::vector("gravity", gravity)?)) }
}

/// Writes a hash over everything that the next step depends on; to be compared within one version of the library.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT.
///
/// # Safety
/// `world` is NULL or a world nobody changes; `out` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_get_state_hash(world: *const sinew_world, out: *mut u64) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_world(world, |world| {
            *memory::output("out", out)? = world.state_hash();
            Ok(())
        })
    }
}
