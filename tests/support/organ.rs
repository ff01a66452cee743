//! A body as organs are: uneven tetrahedra, masses by volume, springs along the edges, a part of it held.

use glam::Vec3;
use sinew::mesh::Mesh;
use sinew::{BodyDefinition, Material, Model};

use super::bodies::Parts;

/// kg/m³
const DENSITY: f32 = 1060.0;

/// A liver-like body of this length and edge, m, held at its left side; its springs as stiff as tissue of Young's modulus
/// `young`, Pa, roughly makes them.
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
        // A spring stands for about so much of the tissue about it as its length is across.
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

/// The tetrahedra of a mesh as elements of this Young's modulus, Pa, Poisson's ratio and density, kg/m³.
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

/// A square of cloth, held at two corners.
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

/// How far the free nodes of two states are apart, RMS, m.
pub fn rms(a: &[glam::DVec3], b: &[glam::DVec3]) -> f64 {
    let squares: f64 = a.iter().zip(b).map(|(a, b)| a.distance_squared(*b)).sum();
    (squares / a.len() as f64).sqrt()
}

/// Earth's gravity, or a part of it.
pub fn gravity(part: f32) -> Vec3 {
    Vec3::new(0.0, -9.81 * part, 0.0)
}
