//! A block compressed between two plates: bonded to them, or free to slide.

use glam::{DVec3, Quat, Vec3};
use sinew::mesh::Mesh;
use sinew::{
    BodyDefinition, BodyId, Material, Model, Pose, RestStateDefinition, Shape, Solver, ToolDefinition, Values, World,
};

use super::solid::Solid;
use crate::support::bodies::FREE;

pub const YOUNG_MODULUS: f32 = 5000.0;
/// m
pub const SIDE: f32 = 0.02;
/// Steps in which a block is compressed.
const PARTS: u32 = 10;

/// A cube, `thick` cells thick; each cell is cut into five tetrahedra.
pub struct Block {
    pub mesh: Mesh,
    pub solid: Solid,
    nu: f32,
    /// Relative to the height.
    by: f64,
}

/// The result of a compression.
pub struct Pressed {
    pub at: Vec<DVec3>,
    /// The force of the upper plate on the block, downward (N).
    pub force: f64,
}

impl Block {
    pub fn new(thick: u32, nu: f32, by: f64) -> Self {
        let mesh = Mesh::block([SIDE; 3], [thick; 3]).expect("a block");
        Self {
            solid: Solid::new(&mesh, YOUNG_MODULUS, nu),
            nu,
            mesh,
            by,
        }
    }

    fn body(&self, world: &mut World, solver: Solver) -> BodyId {
        let definition = BodyDefinition {
            node_dampings: Values::Uniform(0.01),
            material: Some(Material {
                model: Model::Tetrahedra,
                young_modulus: YOUNG_MODULUS,
                poisson_ratio: self.nu,
                density: 1000.0,
                ..Material::default()
            }),
            solver,
            ..BodyDefinition::of(&self.mesh)
        };
        world.create_body(&definition).expect("a body")
    }

    /// Returns which nodes are at the plates.
    fn held(&self) -> Vec<bool> {
        let rim = self.mesh.positions[0].y.abs();
        self.mesh.positions.iter().map(|p| p.y.abs() == rim).collect()
    }

    /// True if the node is at the upper plate.
    fn is_upper(&self, node: usize) -> bool {
        self.mesh.positions[node].y == self.mesh.positions[0].y.abs()
    }

    /// Returns the positions of the nodes after `part` of the compression, as if all deformed uniformly.
    fn prescribed_positions(&self, at: &[DVec3], part: u32) -> Vec<DVec3> {
        let factor = |part: u32| 1.0 - self.by * f64::from(part) / f64::from(PARTS);
        let ratio = factor(part) / factor(part - 1);
        at.iter().map(|p| DVec3::new(p.x, p.y * ratio, p.z)).collect()
    }

    /// Compresses the block bonded to its plates, with the library.
    pub fn bonded(&self) -> Pressed {
        let mut world = World::new(FREE).expect("a world");
        let id = self.body(&mut world, Solver::Verlet);
        let is_held = self.held();
        let held = || (0..is_held.len()).filter(|&node| is_held[node]);
        let mut at = self.solid.rest.clone();
        for part in 1..=PARTS {
            let led: Vec<Vec3> = self
                .prescribed_positions(&at, part)
                .iter()
                .map(|p| p.as_vec3())
                .collect();
            let body = world.body_mut(id).expect("the body");
            body.set_positions(&led).expect("positions");
            for node in held() {
                body.pin(node as u32).expect("a node");
            }
            let definition = RestStateDefinition {
                tolerance: if part == PARTS { 1e-8 } else { 1e-6 },
                ..RestStateDefinition::default()
            };
            world.rest_state(id, &definition).expect("a state of rest");
            let body = world.body(id).expect("the body");
            at = body.positions().iter().map(|p| p.as_dvec3()).collect();
        }
        let body = world.body(id).expect("the body");
        let upper = held().filter(|&node| self.is_upper(node));
        let down = |node| -f64::from(body.pin_force(node as u32).expect("a pin").y);
        let force = upper.map(down).sum();
        Pressed { at, force }
    }

    /// Compresses the block bonded to its plates, in `f64`.
    pub fn exact(&self) -> Pressed {
        let is_held = self.held();
        let mut at = self.solid.rest.clone();
        for part in 1..=PARTS {
            at = self.prescribed_positions(&at, part);
            self.solid.settle(&mut at, &is_held, &|_, _, _| 0.0);
        }
        let mut forces = vec![DVec3::ZERO; at.len()];
        self.solid.forces(&at, &mut forces);
        let upper = (0..at.len()).filter(|&node| is_held[node] && self.is_upper(node));
        let force = upper.map(|node| forces[node].y).sum();
        Pressed { at, force }
    }

    /// Compresses the block between plates that it slides on: two tools.
    pub fn sliding(&self) -> Pressed {
        let mut world = World::new(FREE).expect("a world");
        let id = self.body(&mut world, Solver::Implicit);
        let plates = [(-1.0, 0.0), (1.0, std::f32::consts::PI)].map(|(side, turn)| {
            let plate = ToolDefinition {
                pose: Pose {
                    position: Vec3::Y * side * 0.5 * SIDE,
                    orientation: Quat::from_rotation_x(turn),
                },
                ..ToolDefinition::new(Shape::Plane)
            };
            (side, world.create_tool(&plate).expect("a tool"))
        });
        let (press, rest) = (50, 50);
        for step in 1..=press + rest {
            let gap = SIDE * (1.0 - self.by as f32 * (step as f32 / press as f32).min(1.0));
            for (side, plate) in plates {
                world.set_pose(plate, Vec3::Y * side * 0.5 * gap, None).expect("a pose");
            }
            let report = world.step(0.01).expect("a step");
            assert_eq!(report.bodies_restored, 0);
        }
        let positions = world.body(id).expect("the body").positions();
        Pressed {
            at: positions.iter().map(|p| p.as_dvec3()).collect(),
            force: f64::from(world.wrench(plates[1].1).expect("a plate").0.y),
        }
    }

    /// Returns the elongation of the sides under uniform compression with free sides, and the force (N).
    pub fn even(&self) -> (f64, f64) {
        let (e, nu) = (f64::from(YOUNG_MODULUS), f64::from(self.nu));
        let whole = e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu));
        let mu = e / (2.0 * (1.0 + nu));
        let kappa = whole.max(0.25 * (whole + 2.0 * mu));
        let lambda = whole - kappa;
        let down = 1.0 - self.by;
        let strain = |stretch: f64| 0.5 * (stretch * stretch - 1.0);
        let stress = |along: f64, across: f64, other: f64| {
            let trace = strain(along) + strain(across) + strain(other);
            let volume = along * across * other;
            along * (lambda * trace + 2.0 * mu * strain(along)) + kappa * (volume - 1.0) * across * other
        };
        let (mut low, mut high) = (0.5, 2.0);
        for _ in 0..100 {
            let side = 0.5 * (low + high);
            if stress(side, side, down) > 0.0 {
                high = side;
            } else {
                low = side;
            }
        }
        let area = f64::from(SIDE) * f64::from(SIDE);
        (low, -stress(down, low, low) * area)
    }
}

impl Pressed {
    /// Returns the volume relative to rest, and the RMS deviation of the nodal volumes from `expected`.
    pub fn volume(&self, block: &Block, expected: f64) -> (f64, f64) {
        let (rings, whole) = block.solid.volumes(&self.at);
        let squares: f64 = rings.iter().map(|ring| (ring - expected).powi(2)).sum();
        (whole, (squares / rings.len() as f64).sqrt())
    }
}
