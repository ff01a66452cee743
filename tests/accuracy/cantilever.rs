//! A beam clamped at one end, with a shear force at the other.

use glam::{DVec3, Vec3};
use sinew::mesh::Mesh;
use sinew::{BodyDefinition, Material, Model, RestStateDefinition, World};

use super::solid::Solid;
use crate::support::bodies::FREE;

const YOUNG_MODULUS: f32 = 5000.0;
/// m
const SIDE: f64 = 0.02;
const LENGTH: f64 = 0.16;

/// A beam of cubes cut into five tetrahedra each, `thick` cubes thick and eight times as long along z.
pub struct Cantilever {
    mesh: Mesh,
    nu: f32,
    is_held: Vec<bool>,
    /// The fraction of the load on each node of the end.
    end: Vec<(usize, f64)>,
    /// N
    load: f64,
    /// Deflection by beam theory (m).
    expected: f64,
}

impl Cantilever {
    /// Its end deflects by 0.1 % of its length, so that small-strain theory holds.
    pub fn new(thick: u32, nu: f32) -> Self {
        let size = [SIDE, SIDE, LENGTH].map(|length| length as f32);
        let mesh = Mesh::block(size, [thick, thick, 8 * thick]).expect("a block");
        let half = mesh.positions[0].abs();
        let at = |position: f32, rim: f32| if position.abs() == rim { 0.5 } else { 1.0 };
        let share = |p: Vec3| at(p.x, half.x) * at(p.y, half.y) / f64::from(thick * thick);
        let end = (0..).zip(&mesh.positions).filter(|(_, p)| p.z == half.z);
        let (modulus, ratio) = (f64::from(YOUNG_MODULUS), f64::from(nu));
        let inertia = SIDE.powi(4) / 12.0;
        let shear_modulus = modulus / (2.0 * (1.0 + ratio));
        let compliance =
            LENGTH.powi(3) / (3.0 * modulus * inertia) + LENGTH / (5.0 / 6.0 * shear_modulus * SIDE * SIDE);
        let expected = 0.001 * LENGTH;
        Self {
            nu,
            is_held: mesh.positions.iter().map(|p| p.z == -half.z).collect(),
            end: end.map(|(node, &p)| (node, share(p))).collect(),
            load: expected / compliance,
            expected,
            mesh,
        }
    }

    /// Returns the deflection of its end relative to beam theory.
    fn deflection(&self, at: &[DVec3]) -> f64 {
        let down = |&(node, share): &(usize, f64)| share * (f64::from(self.mesh.positions[node].y) - at[node].y);
        self.end.iter().map(down).sum::<f64>() / self.expected
    }

    /// Returns the deflection computed by the library.
    pub fn found(&self) -> f64 {
        let mut world = World::new(FREE).expect("a world");
        let id = world.create_body(&BodyDefinition {
            material: Some(Material {
                model: Model::Tetrahedra,
                young_modulus: YOUNG_MODULUS,
                poisson_ratio: self.nu,
                density: 1000.0,
                ..Material::default()
            }),
            ..BodyDefinition::of(&self.mesh)
        });
        let id = id.expect("a body");
        let body = world.body_mut(id).expect("the body");
        for node in (0..self.is_held.len()).filter(|&node| self.is_held[node]) {
            body.pin(node as u32).expect("a node");
        }
        for &(node, share) in &self.end {
            let force = Vec3::NEG_Y * (self.load * share) as f32;
            body.apply_force(node as u32, force).expect("a force");
        }
        let definition = RestStateDefinition {
            tolerance: 1e-9,
            ..RestStateDefinition::default()
        };
        world.rest_state(id, &definition).expect("a state of rest");
        let positions = world.body(id).expect("the body").positions();
        self.deflection(&positions.iter().map(|p| p.as_dvec3()).collect::<Vec<_>>())
    }

    /// Returns the deflection of the same mesh in `f64`.
    pub fn exact(&self) -> f64 {
        let solid = Solid::new(&self.mesh, YOUNG_MODULUS, self.nu);
        let mut at = solid.rest.clone();
        solid.settle(&mut at, &self.is_held, &|at, forces, _| {
            let mut energy = 0.0;
            for &(node, share) in &self.end {
                forces[node].y -= self.load * share;
                energy += self.load * share * at[node].y;
            }
            energy
        });
        self.deflection(&at)
    }
}

/// Returns the limit of three meshes, each twice as fine as the last, and the order of convergence (Richardson
/// extrapolation).
pub fn refined([coarse, middle, fine]: [f64; 3]) -> (f64, f64) {
    let order = ((middle - coarse) / (fine - middle)).log2();
    (fine + (fine - middle) / (order.exp2() - 1.0), order)
}
