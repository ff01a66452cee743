//! Nodal masses from a density: each element distributes its mass equally to its nodes.

use super::elements::{MaterialElements, corners, triangle_area};
use crate::base::{Result, ensure, memory};
use crate::def::{BodyDefinition, MIN_MASS};
use crate::mesh::tetrahedron_volume;

/// The nodal masses, kg; `density` is in kg/m³ and above 0.
pub(super) fn nodal_masses(elements: &MaterialElements, density: f32, definition: &BodyDefinition) -> Result<Vec<f32>> {
    let rest = definition.rest_positions.unwrap_or(definition.positions);
    let mut volumes = memory::filled(0.0_f64, rest.len())?;
    match elements {
        MaterialElements::Tetrahedra(tetrahedra) => distribute(&mut volumes, tetrahedra, |tetrahedron| {
            tetrahedron_volume(corners(tetrahedron, rest)).abs()
        }),
        MaterialElements::Cells(cells, edge) => distribute(&mut volumes, cells, |_| edge.powi(3)),
        MaterialElements::Triangles(triangles, thickness) => distribute(&mut volumes, triangles, |triangle| {
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
            mass >= MIN_MASS && mass.is_finite(),
            "density is {density} kg/m³: node {node} would have a mass of {mass} kg"
        );
    }
    Ok(masses)
}

/// Adds an equal part of each element's value to each of its nodes.
fn distribute<const N: usize>(sums: &mut [f64], elements: &[[u32; N]], value: impl Fn(&[u32; N]) -> f64) {
    for element in elements {
        let share = value(element) / N as f64;
        for &node in element {
            sums[node as usize] += share;
        }
    }
}
