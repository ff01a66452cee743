//! Springs and regions of a body, read and changed while it runs.

use super::body::{sinew_body_id, with_body, with_body_mut};
use super::guard::sinew_world;
use super::memory;
use super::status::sinew_status;
use crate::def::{Values, expect_count};

/// Writes the two nodes of each spring, each spring once, the lower node first: `pairs` are 2 `count` indices, `count` how many springs
/// the body has (`spring_count` of sinew_body_get_storage_report). The order is the same until springs are added or removed.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT (also where `count` is not the body's), SINEW_STATUS_STALE_ID, SINEW_STATUS_OUT_OF_MEMORY.
///
/// # Safety
/// `world` is NULL or a world nobody changes; `pairs` is NULL or as long as stated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_spring_pairs(
    world: *const sinew_world,
    body: sinew_body_id,
    pairs: *mut u32,
    count: usize,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_body(world, body, |body| {
            let out = memory::output_array("pairs", pairs.cast::<[u32; 2]>(), count)?;
            let pairs = body.spring_pairs()?;
            expect_count("pairs", count, pairs.len())?;
            out.copy_from_slice(&pairs);
            Ok(())
        })
    }
}

/// Writes what the springs of `count` pairs of nodes are like now: `pairs` are 2 `count` indices; `stiffnesses`, N/m, and
/// `rest_lengths`, m, are `count` floats each, nullable. PACKED keeps rest lengths that come from positions merged where these are
/// rounded to the same.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT (also where a pair has no spring), SINEW_STATUS_STALE_ID.
///
/// # Safety
/// `world` is NULL or a world nobody changes; the arrays are NULL or as long as stated, and do not overlap.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_springs(
    world: *const sinew_world,
    body: sinew_body_id,
    pairs: *const u32,
    count: usize,
    stiffnesses: *mut f32,
    rest_lengths: *mut f32,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_body(world, body, |body| {
            let pairs = memory::array("pairs", pairs.cast::<[u32; 2]>(), count)?;
            let mut stiffnesses = memory::optional_output_array("stiffnesses", stiffnesses, count)?;
            let mut rest_lengths = memory::optional_output_array("rest_lengths", rest_lengths, count)?;
            let springs = body.springs(pairs)?;
            for (index, spring) in springs.into_iter().enumerate() {
                if let Some(stiffnesses) = &mut stiffnesses {
                    stiffnesses[index] = spring.stiffness;
                }
                if let Some(rest_lengths) = &mut rest_lengths {
                    rest_lengths[index] = spring.rest_length;
                }
            }
            Ok(())
        })
    }
}

/// Gives the springs of `count` pairs of nodes other stiffnesses, N/m, or rest lengths, m, or both: `pairs` are 2 `count` indices,
/// `stiffnesses` and `rest_lengths` `count` floats each, NULL: they stay. Damping stays, and the law by which springs stiffen. Of a
/// pair that is named more than once the last counts. Positions and velocities stay, so the energy changes by what the springs then
/// hold. It takes as long as the springs are many, however large the body.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT (also where a pair has no spring), SINEW_STATUS_STALE_ID, SINEW_STATUS_OUT_OF_MEMORY; then no
/// spring is changed.
///
/// # Safety
/// `world` is NULL or a world nobody else uses; the arrays are NULL or as long as stated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_set_springs(
    world: *mut sinew_world,
    body: sinew_body_id,
    pairs: *const u32,
    count: usize,
    stiffnesses: *const f32,
    rest_lengths: *const f32,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_body_mut(world, body, |body| {
            let pairs = memory::array("pairs", pairs.cast::<[u32; 2]>(), count)?;
            let stiffnesses = memory::optional_array("stiffnesses", stiffnesses, count)?;
            let rest_lengths = memory::optional_array("rest_lengths", rest_lengths, count)?;
            body.set_springs(pairs, stiffnesses.map(Values::Each), rest_lengths.map(Values::Each))
        })
    }
}

/// Makes what lies between `node_count` nodes alone `stiffness_factor` times as stiff and `length_factor` times as long at rest, as
/// cautery stiffens and shrinks, and as tissue swells: springs of two of them, tetrahedra of SINEW_MATERIAL_TETRAHEDRA or with a
/// volume_stiffness with all corners among them, bending and fibres alike. Home springs become stiffer, and draw where they did. What
/// reaches beyond the region stays as it is, and so do masses, damping, positions and velocities: the body moves to its new shape by
/// itself.
///
/// `stiffness_factor` is at least 0, `length_factor` above 0. Factors multiply those of calls before; a stiffness of 0 is for good, and
/// takes tetrahedra away. `nodes` may name a node more than once. It takes as long as the region is large.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT (also where something would become so stiff, long or small that it is no number),
/// SINEW_STATUS_STALE_ID, SINEW_STATUS_OUT_OF_MEMORY; then nothing is changed.
///
/// # Safety
/// `world` is NULL or a world nobody else uses; `nodes` is NULL or as long as stated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_scale_region(
    world: *mut sinew_world,
    body: sinew_body_id,
    nodes: *const u32,
    node_count: usize,
    stiffness_factor: f32,
    length_factor: f32,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_body_mut(world, body, |body| {
            let nodes = memory::array("nodes", nodes, node_count)?;
            body.scale_region(nodes, stiffness_factor, length_factor)
        })
    }
}
