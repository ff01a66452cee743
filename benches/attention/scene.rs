//! A block of springs that stands on its lower side, and a ball that presses into the upper and slides there.

use glam::{DVec3, Vec3};
use sinew::mesh::Mesh;

/// Its longest side, m.
const LENGTH: f32 = 0.2;

/// Young's modulus of tissue, about, Pa.
const STIFFNESS: f64 = 5000.0;

/// kg/m³
const DENSITY: f64 = 1000.0;

pub struct Scene {
    pub mesh: Mesh,
    pub edges: Vec<[u32; 2]>,
    /// Of a spring, N/m.
    pub stiffness: f64,
    /// Of a node, kg.
    pub mass: f64,
    /// What velocities lose, 1/s.
    pub damping: f64,
    /// Of the ball, m.
    pub radius: f64,
    /// How fast it comes, m/s, and how deep it goes, m.
    pub speed: f64,
    pub depth: f64,
    /// s
    pub step: f32,
    pub steps: u32,
    /// The nodes near the ball, by how far from it they are at first.
    pub watched: Vec<usize>,
    top: f64,
}

impl Scene {
    /// So many cells long and wide, and half as many high.
    pub fn new(cells: u32, speed: f64) -> Self {
        let cell = f64::from(LENGTH) / f64::from(cells);
        let mesh = Mesh::block([LENGTH, 0.5 * LENGTH, LENGTH], [cells, cells / 2, cells]).expect("a block");
        let edges = mesh.edges().expect("edges");
        let mut scene = Self {
            edges,
            mesh,
            stiffness: 0.4 * STIFFNESS * cell,
            mass: DENSITY * cell.powi(3),
            damping: 5.0,
            radius: 0.02,
            speed,
            depth: 0.01,
            step: 1e-3,
            steps: 40,
            watched: Vec::new(),
            top: 0.25 * f64::from(LENGTH),
        };
        let is_near = |node: &usize| scene.is_within(*node, 1.6);
        scene.watched = (0..scene.mesh.positions.len()).filter(is_near).collect();
        scene
    }

    pub fn springs(&self) -> Vec<([usize; 2], f64)> {
        let ends = |edge: &[u32; 2]| edge.map(|node| node as usize);
        self.edges.iter().map(|edge| (ends(edge), self.stiffness)).collect()
    }

    pub fn is_pinned(&self, node: usize) -> bool {
        self.mesh.positions[node].y < 1e-6 - 0.25 * LENGTH
    }

    /// Whether a node is within so many radii of where the ball first touches.
    pub fn is_within(&self, node: usize, radii: f64) -> bool {
        let place = self.mesh.positions[node].as_dvec3();
        place.distance(DVec3::Y * self.top) < radii * self.radius
    }

    /// Where the ball is after so many seconds, if it does not keep away.
    pub fn tool_at(&self, time: f64) -> DVec3 {
        let pressed = self.depth / self.speed;
        let slid = 0.1 * (time - pressed).max(0.0);
        DVec3::new(slid, self.top + self.radius - (self.speed * time).min(self.depth), 0.0)
    }

    pub fn tool_in_world(&self, time: f64) -> Vec3 {
        self.tool_at(time).as_vec3()
    }
}

/// How far nodes that were watched are from where they should be, a root of the mean of squares, m.
pub fn error(found: &[DVec3], right: &[DVec3]) -> f64 {
    let squares: f64 = found
        .iter()
        .zip(right)
        .map(|(found, right)| found.distance_squared(*right))
        .sum();
    (squares / right.len() as f64).sqrt()
}
