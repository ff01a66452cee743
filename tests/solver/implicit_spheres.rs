//! A sphere that touches many nodes, edges and faces of a block: IMPLICIT agrees with VERLET on the same mesh, comes to
//! rest, and takes few products.

use glam::{DVec3, Vec3};
use sinew::{BodyId, Pose, Shape, Solver, ToolDefinition, ToolId, World};

use crate::support::held_block::{CELL, TOP, held_block};

const FRAME: f32 = 1.0 / 60.0;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Tissue {
    Springs,
    Tetrahedra,
}

/// A block that is held below, and a sphere above it.
struct Scene {
    world: World,
    body: BodyId,
    tool: ToolId,
    radius: f32,
    surface: Vec<[u32; 3]>,
}

impl Scene {
    fn new(tissue: Tissue, solver: Solver, radius: f32) -> Self {
        let (mut world, body, mesh) = held_block(tissue == Tissue::Tetrahedra, solver);
        let tool = world.create_tool(&ToolDefinition {
            pose: Pose {
                position: Self::at(radius, 0.0),
                ..Pose::IDENTITY
            },
            ..ToolDefinition::new(Shape::Sphere { radius })
        });
        Self {
            tool: tool.expect("a tool"),
            world,
            body,
            radius,
            surface: mesh.triangles,
        }
    }

    /// Returns the position of the sphere at a depth, off the symmetry axis of the mesh.
    fn at(radius: f32, depth: f32) -> Vec3 {
        Vec3::new(0.3 * CELL, TOP + radius - depth, 0.1 * CELL)
    }

    /// Takes one frame to this depth and returns the force on the sphere.
    fn step(&mut self, depth: f32) -> Vec3 {
        let place = Self::at(self.radius, depth);
        self.world.set_pose(self.tool, place, None).expect("a pose");
        let report = self.world.step(FRAME).expect("a step");
        assert_eq!(report.bodies_restored, 0);
        self.world.wrench(self.tool).expect("a tool").0
    }

    /// Returns the penetration of the surface into the sphere (m).
    fn depth(&self) -> f64 {
        let centre = self.world.pose(self.tool).expect("a tool").position.as_dvec3();
        let positions = self.world.body(self.body).expect("the body").positions();
        let nearest = |face: &[u32; 3]| distance(centre, face.map(|node| positions[node as usize].as_dvec3()));
        let nearest = self.surface.iter().map(nearest).fold(f64::INFINITY, f64::min);
        f64::from(self.radius) - nearest
    }

    fn energy(&self) -> f64 {
        let energy = self.world.body(self.body).expect("the body").energy(Vec3::ZERO);
        energy.kinetic + energy.elastic
    }
}

/// Returns the distance of a point from a triangle (Ericson 2005, section 5.1.5).
fn distance(point: DVec3, [a, b, c]: [DVec3; 3]) -> f64 {
    let nearest_on_edge = |from: DVec3, to: DVec3| {
        let along = ((point - from).dot(to - from) / (to - from).length_squared()).clamp(0.0, 1.0);
        from.lerp(to, along).distance(point)
    };
    let normal = (b - a).cross(c - a);
    let is_inside = [(a, b), (b, c), (c, a)]
        .into_iter()
        .all(|(from, to)| (to - from).cross(point - from).dot(normal) >= 0.0);
    if is_inside {
        return (point - a).dot(normal.normalize()).abs();
    }
    nearest_on_edge(a, b)
        .min(nearest_on_edge(b, c))
        .min(nearest_on_edge(c, a))
}

/// The measured values of a sphere that is pressed in and then stays for as many frames.
struct Course {
    /// After each frame (N).
    forces: Vec<f64>,
    /// Products of each frame.
    products: Vec<u32>,
    /// J
    energies: Vec<f64>,
    /// The maximum penetration of the surface into the sphere after any frame (m).
    max_penetration: f64,
    /// True if the last frame converged.
    converged: bool,
}

/// The contact radius at the end, in cells.
const CONTACT: f32 = 3.0;

fn course(tissue: Tissue, solver: Solver, radius: f32, frames: usize) -> Course {
    let depth = (CONTACT * CELL).powi(2) / radius;
    let mut scene = Scene::new(tissue, solver, radius);
    let mut course = Course {
        forces: Vec::new(),
        products: Vec::new(),
        energies: Vec::new(),
        max_penetration: 0.0,
        converged: true,
    };
    for frame in 1..=2 * frames {
        let force = scene.step(depth * (frame as f32 / frames as f32).min(1.0));
        let report = scene.world.body(scene.body).expect("the body").solver_report();
        course.forces.push(f64::from(force.y));
        course.products.push(report.iterations);
        course.energies.push(scene.energy());
        course.max_penetration = course.max_penetration.max(scene.depth());
        course.converged = report.has_converged;
    }
    course
}

/// Frames to press in, and frames to stay.
const FRAMES: usize = 20;

#[test]
fn many_contacts_give_the_force_of_short_steps() {
    many_contacts_give_the_force_of_short_steps_of(Tissue::Tetrahedra, 16.0 * CELL);
}

#[test]
#[ignore = "long"]
fn many_contacts_give_the_force_of_short_steps_with_springs() {
    many_contacts_give_the_force_of_short_steps_of(Tissue::Springs, 8.0 * CELL);
}

fn many_contacts_give_the_force_of_short_steps_of(tissue: Tissue, radius: f32) {
    let case = format!("{tissue:?}, {radius} m");
    let expected = course(tissue, Solver::Verlet, radius, FRAMES);
    let found = course(tissue, Solver::Implicit, radius, FRAMES);
    for (frame, (force, expected)) in found.forces.iter().zip(&expected.forces).enumerate().skip(4) {
        let error = force / expected - 1.0;
        assert!(
            error.abs() < 0.02,
            "{case}, frame {frame}: {force} N, {expected} N is right"
        );
    }
    // At rest nothing changes any more.
    let resting = &found.forces[2 * FRAMES - 6..];
    let right = expected.forces[2 * FRAMES - 1];
    for force in resting {
        assert!(
            (force / right - 1.0).abs() < 5e-4,
            "{case}: {resting:?} N, {right} N is right"
        );
    }
    let energies = &found.energies[2 * FRAMES - 6..];
    assert!(energies[5] <= energies[0] * (1.0 + 1e-5), "{case}: {energies:?} J");
    assert!(
        found.max_penetration < 1e-4 * f64::from(radius),
        "{case}: {} m deep",
        found.max_penetration
    );
    // For seventeen substeps each. Solving contacts with outdated geometry would take thousands.
    let (pressing, resting) = found.products.split_at(FRAMES);
    assert!(pressing.iter().all(|&products| products < 700), "{case}: {pressing:?}");
    assert!(
        resting[FRAMES - 6..].iter().all(|&products| products < 200),
        "{case}: {resting:?}"
    );
    assert!(found.converged, "{case}");
}
