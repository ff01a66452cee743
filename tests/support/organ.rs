//! Organ-like bodies: uneven tetrahedra, masses by volume, springs along the edges, one side held.

use glam::Vec3;
use sinew::mesh::Mesh;
use sinew::{BodyDefinition, Material, Model};

use super::bodies::Parts;

/// kg/m³
const DENSITY: f32 = 1060.0;

/// Returns a liver-like body of this length and edge length (m), held at its left side. Its spring stiffnesses
/// approximate tissue of Young's modulus `young` (Pa).
pub fn organ(length: f32, spacing: f32, young: f32) -> Parts {
    let mesh = Mesh::organ(length, spacing).expect("an organ");
    let mut parts = Parts::nodes(mesh.positions.clone(), 0.0);
    for tetrahedron in &mesh.tetrahedra {
        let [a, b, c, d] = tetrahedron.map(|node| mesh.positions[node as usize].as_dvec3());
        let volume = (b - a).cross(c - a).dot(d - a) / 6.0;
        for &node in tetrahedron {
            parts.masses[node as usize] += DENSITY * volume as f32 / 4.0;
        }
    }
    for [a, b] in mesh.edges().expect("edges") {
        // A spring represents tissue of a cross-section of about its length squared.
        let length = parts.positions[a as usize].distance(parts.positions[b as usize]);
        parts.join(a as usize, b as usize, 0.4 * young * length);
    }
    let left = parts.positions.iter().map(|p| p.x).fold(f32::INFINITY, f32::min);
    for (position, mass) in parts.positions.iter().zip(&mut parts.masses) {
        if position.x < left + 0.15 * length {
            *mass = 0.0;
        }
    }
    parts
}

/// Defines the tetrahedra of a mesh as elements of this Young's modulus (Pa), Poisson's ratio and density (kg/m³).
pub fn of_elements(mesh: &Mesh, [young_modulus, poisson_ratio, density]: [f32; 3]) -> BodyDefinition<'_> {
    BodyDefinition {
        material: Some(Material {
            model: Model::Tetrahedra,
            young_modulus,
            poisson_ratio,
            density,
            ..Material::default()
        }),
        ..BodyDefinition::of(mesh)
    }
}

/// Returns a square cloth, held at two corners.
pub fn cloth(size: f32, cells: u32, mass: f32, stiffness: f32) -> Parts {
    let mesh = Mesh::cloth([size; 2], [cells; 2]).expect("a cloth");
    let count = mesh.positions.len();
    let mut parts = Parts::nodes(mesh.positions.clone(), mass / count as f32);
    for [a, b] in mesh.edges().expect("edges") {
        parts.join(a as usize, b as usize, stiffness);
    }
    parts.masses[0] = 0.0;
    parts.masses[cells as usize] = 0.0;
    parts
}

/// Returns the RMS distance between the nodes of two states (m).
pub fn rms(a: &[glam::DVec3], b: &[glam::DVec3]) -> f64 {
    let squares: f64 = a.iter().zip(b).map(|(a, b)| a.distance_squared(*b)).sum();
    (squares / a.len() as f64).sqrt()
}

/// Returns `part` times Earth's gravity.
pub fn gravity(part: f32) -> Vec3 {
    Vec3::new(0.0, -9.81 * part, 0.0)
}
