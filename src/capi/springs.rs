//! Springs and regions of a body, read and changed while it runs.

use super::body::{sinew_body_id, with_body, with_body_mut};
use super::guard::sinew_world;
use super::memory;
use super::status::sinew_status;
use crate::def::{Values, expect_count};

/// Writes the two nodes of each spring, each spring once, the lower node first.
///
/// `out_pairs` receives 2 * count indices; `count` is spring_count of sinew_body_get_storage_report. The order stays
/// until springs are added or removed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_spring_pairs(
    world: *const sinew_world,
    body: sinew_body_id,
    out_pairs: *mut u32,
    count: usize,
) -> sinew_status {
    with_body(world, body, |body| {
        let out = memory::output_array("out_pairs", out_pairs.cast::<[u32; 2]>(), count)?;
        let pairs = body.spring_pairs()?;
        expect_count("out_pairs", count, pairs.len())?;
        out.copy_from_slice(&pairs);
        Ok(())
    })
}

/// Writes the stiffnesses and rest lengths of the springs between pairs of nodes.
///
/// `pairs` holds 2 * count indices. `out_stiffnesses` [N/m] and `out_rest_lengths` [m] receive `count` floats each and
/// are nullable.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT if a pair has no spring.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_springs(
    world: *const sinew_world,
    body: sinew_body_id,
    pairs: *const u32,
    count: usize,
    out_stiffnesses: *mut f32,
    out_rest_lengths: *mut f32,
) -> sinew_status {
    with_body(world, body, |body| {
        let pairs = memory::array("pairs", pairs.cast::<[u32; 2]>(), count)?;
        let out_stiffnesses = memory::optional_output_array("out_stiffnesses", out_stiffnesses, count)?;
        let out_rest_lengths = memory::optional_output_array("out_rest_lengths", out_rest_lengths, count)?;
        let springs = body.springs(pairs)?;
        for (out, spring) in out_stiffnesses.unwrap_or_default().iter_mut().zip(&springs) {
            *out = spring.stiffness;
        }
        for (out, spring) in out_rest_lengths.unwrap_or_default().iter_mut().zip(&springs) {
            *out = spring.rest_length;
        }
        Ok(())
    })
}

/// Sets stiffnesses, rest lengths or both of the springs between pairs of nodes.
///
/// `pairs` holds 2 * count indices, `stiffnesses` [N/m] and `rest_lengths` [m] `count` floats each, nullable:
/// unchanged. If a pair repeats, its last entry counts. Damping, law and motion stay.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT if a pair has no spring.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_set_springs(
    world: *mut sinew_world,
    body: sinew_body_id,
    pairs: *const u32,
    stiffnesses: *const f32,
    rest_lengths: *const f32,
    count: usize,
) -> sinew_status {
    with_body_mut(world, body, |body| {
        let pairs = memory::array("pairs", pairs.cast::<[u32; 2]>(), count)?;
        let stiffnesses = memory::optional_array("stiffnesses", stiffnesses, count)?;
        let rest_lengths = memory::optional_array("rest_lengths", rest_lengths, count)?;
        body.set_springs(pairs, stiffnesses.map(Values::Each), rest_lengths.map(Values::Each))
    })
}

/// Multiplies the stiffness and the rest length of the material between given nodes.
///
/// It changes springs, tetrahedra, bending and fibers whose nodes are all among `nodes`, which may repeat, and the
/// stiffness of anchor springs. `stiffness_factor` is at least 0, where 0 is permanent; `length_factor` is above 0.
/// Masses, damping and motion stay.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_scale_region(
    world: *mut sinew_world,
    body: sinew_body_id,
    nodes: *const u32,
    node_count: usize,
    stiffness_factor: f32,
    length_factor: f32,
) -> sinew_status {
    with_body_mut(world, body, |body| {
        let nodes = memory::array("nodes", nodes, node_count)?;
        body.scale_region(nodes, stiffness_factor, length_factor)
    })
}
