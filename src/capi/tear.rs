//! Tears: what springs bear, and what tore.

use super::body::{sinew_body_id, with_body, with_body_mut};
use super::guard::sinew_world;
use super::memory::{self, told, versioned};
use super::status::sinew_status;
use crate::def::{TearReport, Values};

/// Report of the tears in the last step; all 0 for a body that does not tear.
///
/// Springs of small_pieces and no_room are retried after a topology change.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_tear_report {
    /// Set to sizeof(sinew_tear_report) before the call.
    pub struct_size: usize,
    /// Number of tears made.
    pub tears: u32,
    /// Increase of the number of connected surface components.
    pub pieces_parted: u32,
    /// Overloaded springs that wait: beyond most_tears, or not pulled apart.
    pub waiting: u32,
    /// Overloaded springs whose fragment would be below smallest_piece.
    pub small_pieces: u32,
    /// Overloaded springs without spare nodes, FAST_LINK slots or memory.
    pub no_room: u32,
}

versioned! { sinew_tear_report }

told! { TearReport => sinew_tear_report { tears, pieces_parted, waiting, small_pieces, no_room } }

/// Writes which tears the last step of a body made or refused.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_tear_report(
    world: *const sinew_world,
    body: sinew_body_id,
    out: *mut sinew_tear_report,
) -> sinew_status {
    with_body(world, body, |body| {
        memory::write_report("out", out, body.tear_report().into())
    })
}

/// Writes the tear limits of springs or element edges between pairs of nodes.
///
/// `pairs` holds 2 * count indices. `out_strains` and `out_forces` [N] receive `count` floats each, 0: no limit, and
/// are nullable. Errors are those of sinew_body_set_tear_limits.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_tear_limits(
    world: *const sinew_world,
    body: sinew_body_id,
    pairs: *const u32,
    count: usize,
    out_strains: *mut f32,
    out_forces: *mut f32,
) -> sinew_status {
    with_body(world, body, |body| {
        let pairs = memory::array("pairs", pairs.cast::<[u32; 2]>(), count)?;
        let strains = memory::optional_output_array("out_strains", out_strains, count)?;
        let forces = memory::optional_output_array("out_forces", out_forces, count)?;
        let limits = body.tear_limits(pairs)?;
        for (out, of) in [(strains, 0), (forces, 1)] {
            for (out, limits) in out.unwrap_or_default().iter_mut().zip(&limits) {
                *out = limits[of];
            }
        }
        Ok(())
    })
}

/// Sets tear limits of single springs or element edges, in place of the body's.
///
/// `pairs` holds 2 * count indices; `strains` and `forces` [N] `count` floats each, 0: no limit; both are nullable:
/// unchanged. If a pair repeats, its last entry counts. Later springs have none.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT for a pair without spring and edge; SINEW_STATUS_UNSUPPORTED if most_tears is
/// 0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_set_tear_limits(
    world: *mut sinew_world,
    body: sinew_body_id,
    pairs: *const u32,
    strains: *const f32,
    forces: *const f32,
    count: usize,
) -> sinew_status {
    with_body_mut(world, body, |body| {
        let pairs = memory::array("pairs", pairs.cast::<[u32; 2]>(), count)?;
        let strains = memory::optional_array("strains", strains, count)?;
        let forces = memory::optional_array("forces", forces, count)?;
        body.set_tear_limits(pairs, strains.map(Values::Each), forces.map(Values::Each))
    })
}
