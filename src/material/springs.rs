//! Springs along the edges of elements, as stiff as Young's modulus asks for: see [`Model::Springs`](crate::def::Model::Springs).

use glam::DVec3;

use super::filled::{Filled, corners, triangle_area};
use crate::base::{Error, Result, ensure, memory};
use crate::def::BodyDefinition;
use crate::mesh::{
    CELL_DIAGONALS, CELL_EDGES, TETRAHEDRON_EDGES, TRIANGLE_EDGES, element_edges, pack, tetrahedron_volume, unpack,
};

/// Of the stiffness 0.4 E a of a spring in an endless lattice of cubes of edge a, what each of the four cells at an edge and of
/// the two at a diagonal has, over E a.
const CELL_EDGE: f64 = 0.4 / 4.0;
const CELL_DIAGONAL: f64 = 0.4 / 2.0;

/// Stiffnesses are merged where they differ by no more than this part of themselves, however coarse the positions.
const LARGEST_MERGER: f64 = 1e-3;

/// What one element adds to the stiffness of an edge, packed, N/m.
type EdgeShare = (u64, f64);

/// The springs of a material, each once, in ascending order, and their stiffnesses in N/m.
pub(super) fn of(
    elements: &Filled,
    young_modulus: f32,
    definition: &BodyDefinition,
) -> Result<(Vec<[u32; 2]>, Vec<f32>)> {
    let mut shares = shares(elements, f64::from(young_modulus), definition)?;
    // Among those of an edge by size, so that the order of the elements does not matter.
    shares.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let count = shares.chunk_by(|a, b| a.0 == b.0).count();
    let mut springs = memory::reserved(count)?;
    let mut sums = memory::reserved(count)?;
    for shares in shares.chunk_by(|a, b| a.0 == b.0) {
        springs.push(unpack(shares[0].0));
        sums.push(shares.iter().map(|share| share.1).sum::<f64>());
    }
    if !matches!(elements, Filled::Triangles(..)) {
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

fn shares(elements: &Filled, young_modulus: f64, definition: &BodyDefinition) -> Result<Vec<EdgeShare>> {
    let rest = definition.rest_positions.unwrap_or(definition.positions);
    let along = |corners: &[DVec3], [a, b]: [usize; 2], energy: f64| energy / corners[a].distance_squared(corners[b]);
    let mut shares;
    match elements {
        Filled::Tetrahedra(tetrahedra) => {
            shares = memory::reserved(6 * tetrahedra.len())?;
            for tetrahedron in *tetrahedra {
                let corners = corners(tetrahedron, rest);
                let energy = young_modulus * tetrahedron_volume(corners).abs();
                shares.extend(TETRAHEDRON_EDGES.map(|ends| (pack(tetrahedron, ends), along(&corners, ends, energy))));
            }
        }
        Filled::Triangles(triangles, thickness) => {
            shares = memory::reserved(3 * triangles.len())?;
            for triangle in *triangles {
                let corners = corners(triangle, rest);
                let energy = young_modulus * thickness * triangle_area(corners);
                shares.extend(TRIANGLE_EDGES.map(|ends| (pack(triangle, ends), along(&corners, ends, energy))));
            }
        }
        Filled::Cells(cells, edge) => {
            shares = memory::reserved(24 * cells.len())?;
            for cell in *cells {
                shares.extend(CELL_EDGES.map(|ends| (pack(cell, ends), CELL_EDGE * young_modulus * edge)));
                shares.extend(CELL_DIAGONALS.map(|ends| (pack(cell, ends), CELL_DIAGONAL * young_modulus * edge)));
            }
        }
    }
    Ok(shares)
}

/// Refuses triangles with an edge that no spring joins: beside other elements they are surface, and nothing would hold it.
fn check_surface(springs: &[[u32; 2]], elements: &Filled, definition: &BodyDefinition) -> Result<()> {
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

/// The stiffnesses, of which those that differ by what rounded positions make of them are one: bodies of few kinds of spring
/// are faster.
fn merged(springs: &[[u32; 2]], exact: &[f64], definition: &BodyDefinition) -> Result<Vec<f32>> {
    let rest = definition.rest_positions.unwrap_or(definition.positions);
    let reach = f64::from(definition.rounding().reach);
    let mut order: Vec<u32> = memory::collected(0..springs.len() as u32)?;
    order.sort_unstable_by(|&a, &b| exact[a as usize].total_cmp(&exact[b as usize]).then(a.cmp(&b)));
    let mut stiffnesses = memory::filled(0.0, springs.len())?;
    let mut left = &*order;
    while let Some(&first) = left.first() {
        let [a, b] = springs[first as usize].map(|node| rest[node as usize].as_dvec3());
        let width = (8.0 * f64::from(f32::EPSILON) * reach / a.distance(b)).min(LARGEST_MERGER);
        let softest = exact[first as usize];
        let count = left.partition_point(|&spring| exact[spring as usize] - softest <= width * softest);
        let (same, others) = left.split_at(count);
        let stiffest = exact[same[count - 1] as usize];
        for &spring in same {
            stiffnesses[spring as usize] = (0.5 * (softest + stiffest)) as f32;
        }
        left = others;
    }
    Ok(stiffnesses)
}
