//! Masses of nodes from a density: each element's mass in equal parts to its nodes.

use super::filled::{Filled, corners, triangle_area};
use crate::base::{Result, ensure, memory};
use crate::def::{BodyDefinition, SMALLEST_MASS};
use crate::mesh::tetrahedron_volume;

/// The mass of each node, kg; `density` in kg/m³, above 0.
pub(super) fn of(elements: &Filled, density: f32, definition: &BodyDefinition) -> Result<Vec<f32>> {
    let rest = definition.rest_positions.unwrap_or(definition.positions);
    let mut volumes = memory::filled(0.0_f64, rest.len())?;
    match elements {
        Filled::Tetrahedra(tetrahedra) => share_out(&mut volumes, tetrahedra, |tetrahedron| {
            tetrahedron_volume(corners(tetrahedron, rest)).abs()
        }),
        Filled::Cells(cells, edge) => share_out(&mut volumes, cells, |_| edge.powi(3)),
        Filled::Triangles(triangles, thickness) => share_out(&mut volumes, triangles, |triangle| {
            triangle_area(corners(triangle, rest)) * thickness
        }),
    }
    let masses = memory::collected(volumes.iter().map(|volume| (f64::from(density) * volume) as f32))?;
    for (node, &volume) in volumes.iter().enumerate() {
        ensure!(
            volume != 0.0,
            "density is {density} kg/m³: node {node} belongs to none of the {}, and would have no mass",
            elements.name()
        );
    }
    for (node, &mass) in masses.iter().enumerate() {
        ensure!(
            mass >= SMALLEST_MASS && mass.is_finite(),
            "density is {density} kg/m³: node {node} would have a mass of {mass} kg"
        );
    }
    Ok(masses)
}

/// Gives each node of each element an equal part of what it has.
fn share_out<const N: usize>(sums: &mut [f64], elements: &[[u32; N]], of: impl Fn(&[u32; N]) -> f64) {
    for element in elements {
        let share = of(element) / N as f64;
        for &node in element {
            sums[node as usize] += share;
        }
    }
}
