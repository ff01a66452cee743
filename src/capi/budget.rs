//! Steps of bounded work and time.

use super::guard::{sinew_world, with_world, with_world_mut};
use super::memory;
use super::status::sinew_status;
use super::tool::sinew_tool_id;
use super::world::{sinew_step_report, step_and_report};
use crate::world::BudgetReport;

impl From<BudgetReport> for sinew_step_report {
    fn from(report: BudgetReport) -> Self {
        Self {
            work: report.work,
            work_done: report.work_done,
            residual: report.error,
            ..report.step.into()
        }
    }
}

/// Advances the world by at most `work` units of work; `report` is nullable.
///
/// A unit is one substep of each VERLET body or one matrix-vector product of each other body. The step covers `dt` [s]
/// plus the lag; what it does not reach is the new lag. Equations stop after `work` products and continue in the next
/// step. Tools, pins and blades move in full.
///
/// Errors: SINEW_STATUS_UNSUPPORTED with fixed substeps or a tolerance.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_step_with_budget(
    world: *mut sinew_world,
    dt: f32,
    work: u32,
    report: *mut sinew_step_report,
) -> sinew_status {
    step_and_report(world, report, |world| world.step_with_budget(dt, work))
}

/// Advances the world by as much work as fits into `seconds`, judged by the speed of earlier calls.
///
/// The first calls measure; any can be late. `work` of the nullable `report` replays it bitwise.
///
/// Errors: those of sinew_world_step_with_budget; SINEW_STATUS_UNSUPPORTED on WebAssembly.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_step_within(
    world: *mut sinew_world,
    dt: f32,
    seconds: f64,
    report: *mut sinew_step_report,
) -> sinew_status {
    step_and_report(world, report, |world| world.step_within(dt, seconds))
}

/// Gives up the lag: the time that steps with a budget have not reached is not simulated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_drop_lag(world: *mut sinew_world) -> sinew_status {
    with_world_mut(world, |world| {
        world.drop_lag();
        Ok(())
    })
}

/// Writes how far the force on a tool is at most from what the equations of the last step ask for.
///
/// `out` [N]; 0 if only VERLET bodies press it. Mesh and time step have errors of their own.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_tool_get_force_error(
    world: *const sinew_world,
    tool: sinew_tool_id,
    out: *mut f32,
) -> sinew_status {
    with_world(world, |world| memory::write("out", out, world.force_error(tool.id())?))
}
