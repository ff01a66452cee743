//! A block of springs fixed at its lower side, and a ball that presses into the upper side and slides there.

use glam::{DVec3, Vec3};
use sinew::mesh::Mesh;

/// The longest side of the block [m].
const LENGTH: f32 = 0.2;

/// Approximate Young's modulus of tissue [Pa].
const STIFFNESS: f64 = 5000.0;

/// Density [kg/m³].
const DENSITY: f64 = 1000.0;

pub struct Scene {
    pub mesh: Mesh,
    pub edges: Vec<[u32; 2]>,
    /// Stiffness of a spring [N/m].
    pub stiffness: f64,
    /// Mass of a node [kg].
    pub mass: f64,
    /// Damping rate of velocities [1/s].
    pub damping: f64,
    /// Radius of the ball [m].
    pub radius: f64,
    /// Approach speed [m/s] and final depth [m] of the ball.
    pub speed: f64,
    pub depth: f64,
    /// Duration of a step [s].
    pub step: f32,
    pub steps: u32,
    /// The nodes within 1.6 radii of the first contact point.
    pub watched: Vec<usize>,
    top: f64,
}

impl Scene {
    /// Creates a block `cells` long and wide, and half as many high.
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

    /// True if a node is within `radii` ball radii of the first contact point.
    pub fn is_within(&self, node: usize, radii: f64) -> bool {
        let position = self.mesh.positions[node].as_dvec3();
        position.distance(DVec3::Y * self.top) < radii * self.radius
    }

    /// The commanded position of the ball at a time [s].
    pub fn tool_at(&self, time: f64) -> DVec3 {
        let press_time = self.depth / self.speed;
        let slide = 0.1 * (time - press_time).max(0.0);
        DVec3::new(slide, self.top + self.radius - (self.speed * time).min(self.depth), 0.0)
    }

    pub fn tool_in_world(&self, time: f64) -> Vec3 {
        self.tool_at(time).as_vec3()
    }
}

/// RMS distance of nodes from their reference positions [m].
pub fn error(positions: &[DVec3], reference: &[DVec3]) -> f64 {
    let squares: f64 = positions
        .iter()
        .zip(reference)
        .map(|(positions, reference)| positions.distance_squared(*reference))
        .sum();
    (squares / reference.len() as f64).sqrt()
}
