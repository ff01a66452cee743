//! Worlds.

use glam::Vec3;

use super::guard::{guard, with_world, with_world_mut};
use super::memory::{self, Versioned};
use super::status::sinew_status;
use crate::error::{Error, Result};
use crate::world::{StepReport, World, WorldDefinition};

pub use super::guard::sinew_world;

/// How a world steps. Filled by sinew_world_def_init.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_world_def {
    /// Set by sinew_world_def_init.
    pub struct_size: usize,
    /// m/s^2; default 0 -9.81 0.
    pub gravity: [f32; 3],
    /// 1, the default: the caller's thread alone; 0: one per core.
    pub thread_count: u32,
    /// 0, the default: as many as stability needs; n: exactly n per step.
    pub substeps: u32,
    /// Default 1000; at least 1; a step that needs more is SINEW_STATUS_UNSTABLE.
    pub max_substeps: u32,
    /// m; 0, the default: off; above 0, with substeps 0: a step's own position error stays below it.
    pub tolerance: f32,
    /// 0.
    pub reserved: u32,
}

/// What a step did; filled on SINEW_STATUS_OK and SINEW_STATUS_UNSTABLE.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_step_report {
    /// Set by the caller.
    pub struct_size: usize,
    /// The most that any body took.
    pub substeps: u32,
    /// s: the longest explicit substep that is stable now, over all bodies; infinity: no limit.
    pub stable_substep: f32,
    /// Bodies that would have become non-finite: put back as they were, the others stepped.
    pub bodies_restored: u32,
    /// m: how far a position of this step may be off; 0 where tolerance is off.
    pub error_estimate: f32,
}

// SAFETY: repr(C), begins with struct_size, numbers alone.
unsafe impl Versioned for sinew_world_def {
    const SIZES: &'static [usize] = &[size_of::<Self>()];
    const NAME: &'static str = "sinew_world_def";
}

// SAFETY: repr(C), begins with struct_size, numbers alone.
unsafe impl Versioned for sinew_step_report {
    const SIZES: &'static [usize] = &[size_of::<Self>()];
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
        }
    }

    fn definition(&self) -> Result<WorldDefinition> {
        memory::reserved("reserved", self.reserved)?;
        Ok(WorldDefinition {
            gravity: Vec3::from_array(self.gravity),
            thread_count: self.thread_count,
            substeps: self.substeps,
            max_substeps: self.max_substeps,
            tolerance: self.tolerance,
            ..WorldDefinition::default()
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
/// Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_UNSUPPORTED (a thread_count other than 1),
/// SINEW_STATUS_OUT_OF_MEMORY.
///
/// # Safety
/// `def` is NULL or a definition of the size that it states; `out` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_create(def: *const sinew_world_def, out: *mut *mut sinew_world) -> sinew_status {
    guard(|| {
        // SAFETY: the same contract.
        let out = unsafe { memory::output("out", out) }?;
        // SAFETY: the same contract.
        let def = unsafe { memory::definition("def", def, sinew_world_def::defaults()) }?;
        let world = World::new(def.definition()?)?;
        *out = Box::into_raw(Box::new(sinew_world::new(world)));
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
