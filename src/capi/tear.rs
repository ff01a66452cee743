//! Tears: what springs bear, and what tore.

use super::body::{sinew_body_id, with_body, with_body_mut};
use super::guard::sinew_world;
use super::memory::{self, Versioned};
use super::status::sinew_status;
use crate::def::Values;

/// What tore in the last step, and what did not; all 0 of a body that does not tear.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_tear_report {
    /// Set by the caller.
    pub struct_size: usize,
    /// Tears that were made.
    pub tears: u32,
    /// How many more pieces the surface has.
    pub pieces_parted: u32,
    /// Springs beyond their limits whose turn is to come: there were most_tears, one beside them, or nothing pulls their nodes apart.
    pub waiting: u32,
    /// Springs beyond their limits that would part a piece smaller than smallest_piece. They are tried again when the topology has changed.
    pub small_pieces: u32,
    /// Springs beyond their limits for whose tears there is no room: not as many spare nodes, FAST_LINK: no free place of a node, or no memory.
    /// They are tried again when the topology has changed.
    pub no_room: u32,
    /// 0.
    pub reserved: u32,
}

// SAFETY: repr(C), begins with struct_size, numbers alone.
unsafe impl Versioned for sinew_tear_report {
    const SIZES: &'static [usize] = &[size_of::<Self>()];
    const NAME: &'static str = "sinew_tear_report";
}

/// Writes what tore in the last step of a body, and what did not. `out->struct_size` is set by the caller.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
///
/// # Safety
/// `world` is NULL or a world nobody changes; `out` is NULL or writable for the size that it states.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_tear_report(
    world: *const sinew_world,
    body: sinew_body_id,
    out: *mut sinew_tear_report,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_body(world, body, |body| {
            let report = body.tear_report();
            memory::report("out", out)?.fill(sinew_tear_report {
                struct_size: size_of::<sinew_tear_report>(),
                tears: report.tears,
                pieces_parted: report.pieces_parted,
                waiting: report.waiting,
                small_pieces: report.small_pieces,
                no_room: report.no_room,
                reserved: 0,
            });
            Ok(())
        })
    }
}

/// Gives the springs of `count` pairs of nodes, or edges of elements, other limits than tear_strain and tear_force of the definition: `pairs` are 2 `count` indices,
/// `strains` and `forces`, N, `count` floats each, at least 0, 0: any; NULL: they stay. Springs that are added later have none until they are given
/// some. Of a pair that is named more than once the last counts.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT (also where a pair has neither), SINEW_STATUS_STALE_ID, SINEW_STATUS_UNSUPPORTED (most_tears was 0),
/// SINEW_STATUS_OUT_OF_MEMORY; then no limit is changed.
///
/// # Safety
/// `world` is NULL or a world nobody else uses; the arrays are NULL or as long as stated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_set_tear_limits(
    world: *mut sinew_world,
    body: sinew_body_id,
    pairs: *const u32,
    count: usize,
    strains: *const f32,
    forces: *const f32,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_body_mut(world, body, |body| {
            let pairs = memory::array("pairs", pairs.cast::<[u32; 2]>(), count)?;
            let strains = memory::optional_array("strains", strains, count)?;
            let forces = memory::optional_array("forces", forces, count)?;
            body.set_tear_limits(pairs, strains.map(Values::Each), forces.map(Values::Each))
        })
    }
}
