//! Springs along the edges of elements, with stiffnesses from Young's modulus. See
//! [`Model::Springs`](crate::def::Model::Springs).

use glam::DVec3;

use super::elements::{MaterialElements, corners, triangle_area};
use crate::base::{Error, Result, ensure, memory};
use crate::def::BodyDefinition;
use crate::mesh::{
    CELL_DIAGONALS, CELL_EDGES, TETRAHEDRON_EDGES, TRIANGLE_EDGES, element_edges, pack, tetrahedron_volume, unpack,
};

/// The contribution of one cell to a spring's stiffness, over E a. In an infinite lattice of cubes of edge a, each
/// spring has 0.4 E a; four cells share an edge and two share a diagonal.
const CELL_EDGE: f64 = 0.4 / 4.0;
const CELL_DIAGONAL: f64 = 0.4 / 2.0;

/// The largest relative difference of stiffnesses that are merged, for any rounding of positions.
const LARGEST_MERGER: f64 = 1e-3;

/// An edge as a packed pair, and the stiffness that one element adds to it, N/m.
type EdgeStiffness = (u64, f64);

/// The unique springs of a material, in ascending order, and their stiffnesses, N/m.
pub(super) fn edge_springs(
    elements: &MaterialElements,
    young_modulus: f32,
    definition: &BodyDefinition,
) -> Result<(Vec<[u32; 2]>, Vec<f32>)> {
    let mut contributions = contributions(elements, f64::from(young_modulus), definition)?;
    // Contributions to an edge are sorted by size, so that the result does not depend on the order of elements.
    contributions.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let count = contributions.chunk_by(|a, b| a.0 == b.0).count();
    let mut springs = memory::reserved(count)?;
    let mut sums = memory::reserved(count)?;
    for contributions in contributions.chunk_by(|a, b| a.0 == b.0) {
        springs.push(unpack(contributions[0].0));
        sums.push(contributions.iter().map(|contribution| contribution.1).sum::<f64>());
    }
    if !matches!(elements, MaterialElements::Triangles(..)) {
        check_surface(&springs, elements, definition)?;
    }
    let stiffnesses = merged(&springs, &sums, definition)?;
    match stiffnesses.iter().position(|stiffness| !stiffness.is_finite()) {
        None => Ok((springs, stiffnesses)),
        Some(spring) => Err(Error::invalid(format!(
            "young_modulus is {young_modulus} Pa: the spring between nodes {:?} would have {} N/m",
            springs[spring], stiffnesses[spring]
        ))),
    }
}

fn contributions(
    elements: &MaterialElements,
    young_modulus: f64,
    definition: &BodyDefinition,
) -> Result<Vec<EdgeStiffness>> {
    let rest = definition.rest_positions.unwrap_or(definition.positions);
    let stiffness =
        |corners: &[DVec3], [a, b]: [usize; 2], energy: f64| energy / corners[a].distance_squared(corners[b]);
    let mut contributions;
    match elements {
        MaterialElements::Tetrahedra(tetrahedra) => {
            contributions = memory::reserved(6 * tetrahedra.len())?;
            for tetrahedron in *tetrahedra {
                let corners = corners(tetrahedron, rest);
                let energy = young_modulus * tetrahedron_volume(corners).abs();
                contributions
                    .extend(TETRAHEDRON_EDGES.map(|ends| (pack(tetrahedron, ends), stiffness(&corners, ends, energy))));
            }
        }
        MaterialElements::Triangles(triangles, thickness) => {
            contributions = memory::reserved(3 * triangles.len())?;
            for triangle in *triangles {
                let corners = corners(triangle, rest);
                let energy = young_modulus * thickness * triangle_area(corners);
                contributions
                    .extend(TRIANGLE_EDGES.map(|ends| (pack(triangle, ends), stiffness(&corners, ends, energy))));
            }
        }
        MaterialElements::Cells(cells, edge) => {
            contributions = memory::reserved(24 * cells.len())?;
            for cell in *cells {
                contributions.extend(CELL_EDGES.map(|ends| (pack(cell, ends), CELL_EDGE * young_modulus * edge)));
                contributions
                    .extend(CELL_DIAGONALS.map(|ends| (pack(cell, ends), CELL_DIAGONAL * young_modulus * edge)));
            }
        }
    }
    Ok(contributions)
}

/// Returns an error if an edge of a surface triangle has no spring: nothing would hold the surface there.
fn check_surface(springs: &[[u32; 2]], elements: &MaterialElements, definition: &BodyDefinition) -> Result<()> {
    for edge in element_edges(definition.triangles, &[], &[])? {
        ensure!(
            springs.binary_search(&edge).is_ok(),
            "triangles join nodes {} and {}, which no element of the material does: beside {} they are its surface",
            edge[0],
            edge[1],
            elements.name()
        );
    }
    Ok(())
}

/// Merges stiffnesses that differ only by the rounding of positions. Bodies with few kinds of springs are faster.
fn merged(springs: &[[u32; 2]], exact: &[f64], definition: &BodyDefinition) -> Result<Vec<f32>> {
    let rest = definition.rest_positions.unwrap_or(definition.positions);
    let reach = f64::from(definition.rounding().reach);
    let mut order: Vec<u32> = memory::collected(0..springs.len() as u32)?;
    order.sort_unstable_by(|&a, &b| exact[a as usize].total_cmp(&exact[b as usize]).then(a.cmp(&b)));
    let mut stiffnesses = memory::filled(0.0, springs.len())?;
    let mut remaining = &*order;
    while let Some(&first) = remaining.first() {
        let [a, b] = springs[first as usize].map(|node| rest[node as usize].as_dvec3());
        let width = (8.0 * f64::from(f32::EPSILON) * reach / a.distance(b)).min(LARGEST_MERGER);
        let softest = exact[first as usize];
        let count = remaining.partition_point(|&spring| exact[spring as usize] - softest <= width * softest);
        let (merged_springs, others) = remaining.split_at(count);
        let stiffest = exact[merged_springs[count - 1] as usize];
        for &spring in merged_springs {
            stiffnesses[spring as usize] = (0.5 * (softest + stiffest)) as f32;
        }
        remaining = others;
    }
    Ok(stiffnesses)
}
