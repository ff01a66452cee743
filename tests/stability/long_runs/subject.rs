//! The bodies of the long runs: a shape, and the law that its forces follow.

use glam::Vec3;
use sinew::mesh::Mesh;
use sinew::{BodyDefinition, Material, Model, Solver, Values};

use crate::support::solid::real;

/// Of soft tissue, Pa and kg/m³.
const YOUNG: f32 = 5400.0;
const DENSITY: f32 = 1060.0;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    Organ,
    Stomach,
    Cloth,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Law {
    /// Springs of this stiffness, N/m.
    Springs(f32),
    /// Springs from Young's modulus.
    Young,
    /// Finite elements of this Poisson's ratio.
    Elements(f32),
}

/// A shape at rest.
pub struct Subject {
    pub mesh: Mesh,
    /// The nodes at one end.
    pub end: Vec<u32>,
    law: Law,
}

impl Subject {
    /// `None` where the file of the shape is missing.
    pub fn new(shape: Shape, law: Law) -> Option<Self> {
        let mesh = match shape {
            Shape::Organ => Mesh::organ(0.15, 0.012).expect("an organ"),
            Shape::Stomach => real("stomach.msh", 1e-3)?,
            Shape::Cloth => Mesh::cloth([0.3; 2], [20; 2]).expect("a cloth"),
        };
        // The organ lies along x, and so does a side of the cloth; other organs hang from their tops.
        let along = match shape {
            Shape::Organ | Shape::Cloth => -Vec3::X,
            Shape::Stomach => Vec3::Y,
        };
        let heights = mesh.positions.iter().map(|p| p.dot(along));
        let low = heights.clone().fold(f32::INFINITY, f32::min);
        let high = heights.clone().fold(f32::NEG_INFINITY, f32::max);
        let edge = high - 0.1 * (high - low);
        let end = (0..)
            .zip(heights)
            .filter(|&(_, height)| height > edge)
            .map(|(node, _)| node);
        Some(Self {
            end: end.collect(),
            mesh,
            law,
        })
    }

    /// Damped at `rate`, 1/s.
    pub fn definition(&self, solver: Solver, rate: f32) -> BodyDefinition<'_> {
        let mesh = &self.mesh;
        let material = Material {
            young_modulus: YOUNG,
            density: DENSITY,
            thickness: if mesh.tetrahedra.is_empty() { 0.001 } else { 0.0 },
            ..Material::default()
        };
        let definition = BodyDefinition {
            positions: &mesh.positions,
            triangles: if mesh.tetrahedra.is_empty() {
                &mesh.triangles
            } else {
                &[]
            },
            tetrahedra: &mesh.tetrahedra,
            solver,
            ..BodyDefinition::default()
        };
        // A tenth of a kilogram.
        let node_mass = 0.1 / mesh.positions.len() as f32;
        let _ = rate;
        match self.law {
            Law::Springs(stiffness) => BodyDefinition {
                stiffnesses: Values::Uniform(stiffness),
                masses: Values::Uniform(node_mass),
                ..definition
            },
            Law::Young => BodyDefinition {
                material: Some(material),
                ..definition
            },
            Law::Elements(poisson_ratio) => BodyDefinition {
                material: Some(Material {
                    model: Model::Tetrahedra,
                    poisson_ratio,
                    ..material
                }),
                ..definition
            },
        }
    }
}
