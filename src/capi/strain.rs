//! Strain of a body, to read and to draw.

use glam::Vec3;

use super::body::{sinew_body_id, with_body};
use super::guard::{guard, sinew_world};
use super::memory;
use super::status::sinew_status;
use crate::base::{Error, Result};
use crate::strain::{self, Strain};

/// Strain of a triangle or tetrahedron; 0 for a rigid motion, or if it has no size at rest.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_strain {
    /// Largest principal stretch minus 1.
    pub largest: f32,
    /// Smallest principal stretch minus 1, at least -1.
    pub smallest: f32,
    /// Volumetric (or areal) strain J - 1; below -1 if inverted.
    pub growth: f32,
}

/// The caller's place for strains, as ours.
///
/// # Safety
/// As [`memory::output_array`].
unsafe fn strains_of<'a>(strains: *mut sinew_strain, count: usize) -> Result<&'a mut [Strain]> {
    const { assert!(size_of::<sinew_strain>() == size_of::<Strain>()) };
    // Both are repr(C) with the same fields.
    memory::output_array("out_strains", strains.cast::<Strain>(), count)
}

/// Writes the strain L / L0 - 1 between pairs of nodes; 0 where L0 is 0.
///
/// `pairs` holds 2 * count indices, `rest_lengths` [m] `count` floats; nullable: those of the springs, which takes
/// longer. `out_strains` receives `count` floats.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT if a pair has no spring and `rest_lengths` is NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_spring_strains(
    world: *const sinew_world,
    body: sinew_body_id,
    pairs: *const u32,
    rest_lengths: *const f32,
    count: usize,
    out_strains: *mut f32,
) -> sinew_status {
    with_body(world, body, |body| {
        let pairs = memory::array("pairs", pairs.cast::<[u32; 2]>(), count)?;
        let out_strains = memory::output_array("out_strains", out_strains, count)?;
        if let Some(lengths) = memory::optional_array("rest_lengths", rest_lengths, count)? {
            return strain::of_springs(body.positions(), pairs, lengths, out_strains);
        }
        let lengths = crate::base::memory::collected(body.springs(pairs)?.iter().map(|spring| spring.rest_length))?;
        strain::of_springs(body.positions(), pairs, &lengths, out_strains)
    })
}

/// Writes the strains of any triangles between nodes of a body, one per triangle.
///
/// `rest_positions` [m] holds 3 * node_count floats; `triangles` holds 3 * triangle_count indices.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_triangle_strains(
    world: *const sinew_world,
    body: sinew_body_id,
    rest_positions: *const f32,
    node_count: usize,
    triangles: *const u32,
    triangle_count: usize,
    out_strains: *mut sinew_strain,
) -> sinew_status {
    with_body(world, body, |body| {
        let rest = memory::array("rest_positions", rest_positions.cast::<Vec3>(), node_count)?;
        let triangles = memory::array("triangles", triangles.cast::<[u32; 3]>(), triangle_count)?;
        let out_strains = strains_of(out_strains, triangle_count)?;
        strain::of_triangles(rest, body.positions(), triangles, out_strains)
    })
}

/// Writes the strains of any tetrahedra between nodes of a body, one per tetrahedron.
///
/// `rest_positions` [m] holds 3 * node_count floats; `tetrahedra` 4 * tetrahedron_count indices.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_tetrahedron_strains(
    world: *const sinew_world,
    body: sinew_body_id,
    rest_positions: *const f32,
    node_count: usize,
    tetrahedra: *const u32,
    tetrahedron_count: usize,
    out_strains: *mut sinew_strain,
) -> sinew_status {
    with_body(world, body, |body| {
        let rest = memory::array("rest_positions", rest_positions.cast::<Vec3>(), node_count)?;
        let tetrahedra = memory::array("tetrahedra", tetrahedra.cast::<[u32; 4]>(), tetrahedron_count)?;
        let out_strains = strains_of(out_strains, tetrahedron_count)?;
        strain::of_tetrahedra(rest, body.positions(), tetrahedra, out_strains)
    })
}

/// Averages values of elements at their nodes; 0 at a node without elements.
///
/// `elements` holds corners * element_count node indices, `corners` is 2, 3 or 4, `values` holds element_count finite
/// floats, and `out_means` receives node_count floats.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_util_average_to_nodes(
    elements: *const u32,
    corners: u32,
    values: *const f32,
    element_count: usize,
    out_means: *mut f32,
    node_count: usize,
) -> sinew_status {
    guard(|| {
        let values = memory::array("values", values, element_count)?;
        let out_means = memory::output_array("out_means", out_means, node_count)?;
        let name = "elements";
        match corners {
            2 => strain::mean_at_nodes::<2>(memory::array(name, elements.cast(), element_count)?, values, out_means),
            3 => strain::mean_at_nodes::<3>(memory::array(name, elements.cast(), element_count)?, values, out_means),
            4 => strain::mean_at_nodes::<4>(memory::array(name, elements.cast(), element_count)?, values, out_means),
            _ => Err(Error::invalid(format!("corners is {corners}: must be 2, 3 or 4"))),
        }
    })
}
