//! A sphere pressed into a layer that is bonded below (Hertz), with the thickness correction of Dimitriadis et al.
//! 2002.

use std::cell::RefCell;

use glam::{DVec3, Vec3};
use sinew::mesh::Mesh;
use sinew::{BodyDefinition, Material, Model, Pose, Shape, Solver, ToolDefinition, Values, World};

use super::envelope::Envelope;
use super::solid::Solid;
use crate::support::bodies::FREE;

const YOUNG_MODULUS: f32 = 5000.0;
const DENSITY: f64 = 1000.0;
/// m
pub const RADIUS: f64 = 0.05;
/// The maximum depth of the sphere, relative to its radius.
pub const DEEPEST: f64 = 0.01;
/// Damping rate of nodes (1/s), about the frequency of the layer.
const DAMPING: f64 = 200.0;

/// A layer four radii of the largest contact thick and twelve wide, fine under the sphere and coarse away from it.
pub struct Layer {
    pub mesh: Mesh,
    pub solid: Solid,
    nu: f32,
    thickness: f64,
}

/// From 0 to `end` in steps of `cell` up to `even`, then each step `growth` times as long as the last.
fn graded(cell: f64, even: f64, end: f64, growth: f64) -> Vec<f64> {
    let mut coordinates = vec![0.0];
    let (mut place, mut step) = (0.0, cell);
    while place < end - 0.5 * step {
        if place > even - 0.5 * cell {
            step *= growth;
        }
        place += step;
        coordinates.push(place);
    }
    // The last one is placed exactly.
    let last = coordinates[coordinates.len() - 1];
    for place in &mut coordinates {
        if *place > even {
            *place = even + (*place - even) * (end - even) / (last - even);
        }
    }
    coordinates
}

impl Layer {
    /// Creates a layer with this many cells in the radius of the largest contact.
    pub fn new(cells: u32, nu: f32) -> Self {
        let radius = RADIUS * DEEPEST.sqrt();
        let cell = radius / f64::from(cells);
        let growth = if cells > 4 { 1.35 } else { 1.5 };
        let aside = graded(cell, 1.25 * radius, 6.0 * radius, growth);
        let down = graded(cell, cell, 4.0 * radius, growth);
        let across: Vec<f64> = aside
            .iter()
            .rev()
            .map(|x| -x)
            .chain(aside[1..].iter().copied())
            .collect();
        // The vertical index varies first, so that the matrix in `f64` is narrow.
        let counts = [down.len(), across.len(), across.len()].map(|count| count as u32 - 1);
        let mut mesh = Mesh::block([1.0; 3], counts).expect("a block");
        for position in &mut mesh.positions {
            let place = |axis: usize| ((position[axis] + 0.5) * counts[axis] as f32).round() as usize;
            let [x, y, z] = [across[place(1)], -down[place(0)], across[place(2)]];
            *position = DVec3::new(x, y, z).as_vec3();
        }
        Self {
            solid: Solid::new(&mesh, YOUNG_MODULUS, nu),
            mesh,
            nu,
            thickness: 4.0 * radius,
        }
    }

    /// Returns the theoretical force at a depth (N), and the part of it that is Hertz's.
    pub fn theory(&self, depth: f64) -> (f64, f64) {
        let (e, nu) = (f64::from(YOUNG_MODULUS), f64::from(self.nu));
        let hertz = 4.0 / 3.0 * e / (1.0 - nu * nu) * RADIUS.sqrt() * depth.powf(1.5);
        // Equations 10 to 12 there, for a bonded layer.
        let pi = std::f64::consts::PI;
        let chi = (RADIUS * depth).sqrt() / self.thickness;
        let a = -(1.2876 - 1.4678 * nu + 1.3442 * nu * nu) / (1.0 - nu);
        let b = (0.6387 - 1.0277 * nu + 1.5164 * nu * nu) / (1.0 - nu);
        let correction = 1.0 - 2.0 * a / pi * chi + 4.0 * a * a / (pi * pi) * chi.powi(2)
            - 8.0 / pi.powi(3) * (a.powi(3) + 4.0 * pi * pi / 15.0 * b) * chi.powi(3)
            + 16.0 * a / pi.powi(4) * (a.powi(3) + 3.0 * pi * pi / 5.0 * b) * chi.powi(4);
        (hertz * correction, correction)
    }

    fn is_held(&self) -> Vec<bool> {
        let bottom = -self.thickness as f32;
        self.mesh.positions.iter().map(|p| p.y == bottom).collect()
    }

    /// Returns the forces on the sphere at consecutive depths (N).
    pub fn found(&self, solver: Solver, depths: &[f64]) -> Vec<f64> {
        let dampings: Vec<f32> = (self.solid.node_volumes().iter())
            .map(|volume| (DAMPING * DENSITY * volume) as f32)
            .collect();
        let mut world = World::new(FREE).expect("a world");
        let id = world.create_body(&BodyDefinition {
            node_dampings: Values::Each(&dampings),
            material: Some(Material {
                model: Model::Tetrahedra,
                young_modulus: YOUNG_MODULUS,
                poisson_ratio: self.nu,
                density: DENSITY as f32,
                ..Material::default()
            }),
            solver,
            ..BodyDefinition::of(&self.mesh)
        });
        let body = world.body_mut(id.expect("a body")).expect("the body");
        for (node, _) in (0..).zip(self.is_held()).filter(|(_, is_held)| *is_held) {
            body.pin(node).expect("a node");
        }
        let at = |depth: f64| Vec3::Y * (RADIUS - depth) as f32;
        let sphere = ToolDefinition {
            pose: Pose {
                position: at(0.0),
                ..Pose::IDENTITY
            },
            ..ToolDefinition::new(Shape::Sphere { radius: RADIUS as f32 })
        };
        let sphere = world.create_tool(&sphere).expect("a tool");
        let (dt, going, resting) = (2e-3, 20, 50);
        let mut before = 0.0;
        let mut forces = Vec::new();
        for &depth in depths {
            for step in 1..=going + resting {
                let part = (f64::from(step) / f64::from(going)).min(1.0);
                let place = at(before + (depth - before) * part);
                world.set_pose(sphere, place, None).expect("a pose");
                let report = world.step(dt).expect("a step");
                assert_eq!(report.bodies_restored, 0);
            }
            before = depth;
            forces.push(f64::from(world.wrench(sphere).expect("the sphere").0.y));
        }
        forces
    }

    /// Returns the force at a depth for the same mesh in `f64`: no triangle of the surface enters the sphere (augmented
    /// Lagrangian).
    pub fn exact(&self, depth: f64) -> f64 {
        let centre = DVec3::Y * (RADIUS - depth);
        let near = |triangle: &&[u32; 3]| {
            let is_near = |node: &u32| {
                let p = self.solid.rest[*node as usize];
                p.y == 0.0 && p.x.hypot(p.z) < 1.5 * (RADIUS * depth).sqrt() + 1e-3
            };
            triangle.iter().all(is_near)
        };
        let faces: Vec<[usize; 3]> = self
            .mesh
            .triangles
            .iter()
            .filter(near)
            .map(|face| face.map(|node| node as usize))
            .collect();
        let cell = self.solid.rest[1].y.abs();
        let stiffness = 300.0 * f64::from(YOUNG_MODULUS) * cell;
        let pushes = RefCell::new(vec![0.0; faces.len()]);
        // The contact force of each face, its direction, and the weights of its corners.
        let touch = |at: &[DVec3], face: usize| {
            let (shares, place) = nearest(centre, faces[face].map(|node| at[node]));
            let offset = place - centre;
            let push = pushes.borrow()[face] - stiffness * (offset.length() - RADIUS);
            (push.max(0.0), offset.normalize(), shares)
        };
        let load = |at: &[DVec3], forces: &mut [DVec3], mut matrix: Option<&mut Envelope>| {
            let mut energy = 0.0;
            for (face, corners) in faces.iter().enumerate() {
                let (push, normal, shares) = touch(at, face);
                energy += 0.5 * push * push / stiffness;
                if push == 0.0 {
                    continue;
                }
                for (&row, of_row) in corners.iter().zip(shares) {
                    forces[row] += normal * (push * of_row);
                    let Some(matrix) = &mut matrix else { continue };
                    for (&column, of_column) in corners.iter().zip(shares) {
                        for axis in 0..3 {
                            for other in 0..3 {
                                let value = stiffness * of_row * of_column * normal[axis] * normal[other];
                                matrix.add(3 * row + axis, 3 * column + other, value);
                            }
                        }
                    }
                }
            }
            energy
        };
        let mut at = self.solid.rest.clone();
        let is_held = self.is_held();
        let mut force = 0.0;
        for _ in 0..8 {
            self.solid.settle_to(1e-7, &mut at, &is_held, &load);
            let touches: Vec<_> = (0..faces.len()).map(|face| touch(&at, face)).collect();
            let before = force;
            force = touches.iter().map(|(push, normal, _)| -push * normal.y).sum();
            *pushes.borrow_mut() = touches.iter().map(|(push, ..)| *push).collect();
            if f64::abs(force - before) < 1e-4 * force {
                return force;
            }
        }
        panic!("contact was not found");
    }
}

/// Returns the barycentric weights and position of the nearest point of a triangle (Ericson 2005, section 5.1.5).
fn nearest(point: DVec3, [a, b, c]: [DVec3; 3]) -> ([f64; 3], DVec3) {
    let nearest_on_edge =
        |from: DVec3, to: DVec3| ((point - from).dot(to - from) / (to - from).length_squared()).clamp(0.0, 1.0);
    let normal = (b - a).cross(c - a);
    let size = normal.length_squared();
    let inside = [
        (c - b).cross(point - b).dot(normal) / size,
        (a - c).cross(point - c).dot(normal) / size,
        (b - a).cross(point - a).dot(normal) / size,
    ];
    let place = |shares: [f64; 3]| a * shares[0] + b * shares[1] + c * shares[2];
    if inside.iter().all(|&share| share >= 0.0) {
        return (inside, place(inside));
    }
    let [ab, bc, ca] = [nearest_on_edge(a, b), nearest_on_edge(b, c), nearest_on_edge(c, a)];
    [[1.0 - ab, ab, 0.0], [0.0, 1.0 - bc, bc], [ca, 0.0, 1.0 - ca]]
        .map(|shares| (shares, place(shares)))
        .into_iter()
        .min_by(|(_, p), (_, q)| p.distance_squared(point).total_cmp(&q.distance_squared(point)))
        .expect("three edges")
}
