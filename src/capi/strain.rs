//! Strain of a body, to read and to draw.

use glam::Vec3;

use super::body::{sinew_body_id, with_body};
use super::guard::{guard, sinew_world};
use super::memory;
use super::status::sinew_status;
use crate::base::{Error, Result};
use crate::strain::{self, Strain};

/// How a triangle or tetrahedron is strained, as a part of its lengths at rest: 0 wherever it is moved and turned, 0.1 where it is a
/// tenth longer. What has no area or volume at rest has no strain: 0.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_strain {
    /// Along the direction in which it is longest: the largest principal stretch, less 1.
    pub largest: f32,
    /// Along the direction in which it is shortest: the smallest principal stretch, less 1; from -1 on.
    pub smallest: f32,
    /// Of its area or volume: J - 1; below -1 for a tetrahedron that is inside out.
    pub growth: f32,
}

/// The caller's place for strains, as ours.
///
/// # Safety
/// As [`memory::output_array`].
unsafe fn strains_of<'a>(strains: *mut sinew_strain, count: usize) -> Result<&'a mut [Strain]> {
    const { assert!(size_of::<sinew_strain>() == size_of::<Strain>()) };
    // SAFETY: the same contract; both are repr(C) with the same fields.
    unsafe { memory::output_array("strains", strains.cast::<Strain>(), count) }
}

/// Writes the strain L/L0 - 1 of `count` pairs of nodes, 0 where L0 is 0: `pairs` are 2 `count` indices, `rest_lengths` `count` floats,
/// m, NULL: those of the springs that the pairs have (which takes longer), `strains` `count` floats.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT (also where a pair has no spring and `rest_lengths` is NULL), SINEW_STATUS_STALE_ID,
/// SINEW_STATUS_OUT_OF_MEMORY.
///
/// # Safety
/// `world` is NULL or a world nobody changes; the arrays are NULL or as long as stated, and do not overlap.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_spring_strains(
    world: *const sinew_world,
    body: sinew_body_id,
    pairs: *const u32,
    rest_lengths: *const f32,
    count: usize,
    strains: *mut f32,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_body(world, body, |body| {
            let pairs = memory::array("pairs", pairs.cast::<[u32; 2]>(), count)?;
            let strains = memory::output_array("strains", strains, count)?;
            if let Some(lengths) = memory::optional_array("rest_lengths", rest_lengths, count)? {
                return strain::of_springs(body.positions(), pairs, lengths, strains);
            }
            let mut lengths = crate::base::memory::reserved(count)?;
            lengths.extend(body.springs(pairs)?.iter().map(|spring| spring.rest_length));
            strain::of_springs(body.positions(), pairs, &lengths, strains)
        })
    }
}

/// Writes the strain of `triangle_count` triangles of a body's nodes, any, such as those of its surface: `rest_positions` are 3
/// `node_count` floats, m, where its nodes are at rest, or were when strain is to be counted from; `triangles` 3 `triangle_count`
/// indices.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT (also where `node_count` is not the body's), SINEW_STATUS_STALE_ID.
///
/// # Safety
/// `world` is NULL or a world nobody changes; the arrays are NULL or as long as stated, and do not overlap.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_triangle_strains(
    world: *const sinew_world,
    body: sinew_body_id,
    rest_positions: *const f32,
    node_count: usize,
    triangles: *const u32,
    triangle_count: usize,
    strains: *mut sinew_strain,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_body(world, body, |body| {
            let rest = memory::array("rest_positions", rest_positions.cast::<Vec3>(), node_count)?;
            let triangles = memory::array("triangles", triangles.cast::<[u32; 3]>(), triangle_count)?;
            let strains = strains_of(strains, triangle_count)?;
            strain::of_triangles(rest, body.positions(), triangles, strains)
        })
    }
}

/// Writes the strain of `tetrahedron_count` tetrahedra of a body's nodes, any: `rest_positions` as for sinew_body_get_triangle_strains,
/// `tetrahedra` 4 `tetrahedron_count` indices.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT (also where `node_count` is not the body's), SINEW_STATUS_STALE_ID.
///
/// # Safety
/// `world` is NULL or a world nobody changes; the arrays are NULL or as long as stated, and do not overlap.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_tetrahedron_strains(
    world: *const sinew_world,
    body: sinew_body_id,
    rest_positions: *const f32,
    node_count: usize,
    tetrahedra: *const u32,
    tetrahedron_count: usize,
    strains: *mut sinew_strain,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_body(world, body, |body| {
            let rest = memory::array("rest_positions", rest_positions.cast::<Vec3>(), node_count)?;
            let tetrahedra = memory::array("tetrahedra", tetrahedra.cast::<[u32; 4]>(), tetrahedron_count)?;
            let strains = strains_of(strains, tetrahedron_count)?;
            strain::of_tetrahedra(rest, body.positions(), tetrahedra, strains)
        })
    }
}

/// Writes for each of `node_count` nodes the mean of the values of its elements, 0 where it has none, as to draw strain with
/// sinew_world_save_picture_of_values: `elements` are `corners` `element_count` node indices, `corners` 2, 3 or 4, `values`
/// `element_count` floats, finite, `means` `node_count` floats.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_OUT_OF_MEMORY.
///
/// # Safety
/// The arrays are NULL or as long as stated, and do not overlap.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_mean_at_nodes(
    elements: *const u32,
    corners: u32,
    values: *const f32,
    element_count: usize,
    means: *mut f32,
    node_count: usize,
) -> sinew_status {
    // SAFETY: the same contract.
    guard(|| unsafe {
        let values = memory::array("values", values, element_count)?;
        let means = memory::output_array("means", means, node_count)?;
        let name = "elements";
        match corners {
            2 => strain::mean_at_nodes::<2>(memory::array(name, elements.cast(), element_count)?, values, means),
            3 => strain::mean_at_nodes::<3>(memory::array(name, elements.cast(), element_count)?, values, means),
            4 => strain::mean_at_nodes::<4>(memory::array(name, elements.cast(), element_count)?, values, means),
            _ => Err(Error::invalid(format!("corners is {corners}: must be 2, 3 or 4"))),
        }
    })
}
