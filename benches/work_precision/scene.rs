//! What is simulated: nodes and springs as plain numbers, so that every solver is given the same.

use glam::{DVec3, Vec3};
use sinew::mesh::Mesh;

/// How long a motion lasts, s.
pub const DURATION: f64 = 0.25;
/// At how many times, evenly spread up to the end, positions are compared.
pub const SAMPLES: usize = 8;
/// From one of these times to the next, s: two frames of 1/64 s.
pub const SPAN: f64 = DURATION / SAMPLES as f64;

/// Nodes joined by undamped springs, at rest when they start.
#[derive(Clone)]
pub struct Scene {
    pub name: &'static str,
    /// In a sentence or two.
    pub description: String,
    /// Where nodes start, m.
    pub positions: Vec<Vec3>,
    /// kg; 0: pinned.
    pub masses: Vec<f32>,
    pub springs: Vec<[u32; 2]>,
    /// Whose volume is compared; empty where there are none.
    pub tetrahedra: Vec<[u32; 4]>,
    /// N/m
    pub stiffnesses: Vec<f32>,
    /// m
    pub rest_lengths: Vec<f32>,
    /// m/s²
    pub gravity: Vec3,
    /// As it comes to rest, m/s²: another where that has no single rest shape.
    pub gravity_at_rest: Vec3,
    /// What damping against the world takes off velocities, 1/s.
    pub damping_rate: f32,
}

impl Scene {
    /// The edges of tetrahedra as springs, with the stiffness that Van Gelder (1998) gives for the modulus `young`, Pa, and
    /// the mass of the tetrahedra, in kg/m³ `density`, shared out among their corners. What lies within the first
    /// `held` of the extent along `up` is pinned; gravity points the other way.
    pub fn of_tetrahedra(
        name: &'static str,
        description: String,
        mesh: &Mesh,
        [young, density]: [f64; 2],
        up: DVec3,
        held: f64,
    ) -> Self {
        let at = |node: u32| mesh.positions[node as usize].as_dvec3();
        let springs = mesh.edges().expect("memory for the edges");
        let mut stiffnesses = vec![0.0; springs.len()];
        let mut masses = vec![0.0; mesh.positions.len()];
        for &[a, b, c, d] in &mesh.tetrahedra {
            let volume = (at(b) - at(a)).dot((at(c) - at(a)).cross(at(d) - at(a))).abs() / 6.0;
            for node in [a, b, c, d] {
                masses[node as usize] += density * volume / 4.0;
            }
            for [a, b] in [[a, b], [a, c], [a, d], [b, c], [b, d], [c, d]] {
                let spring = springs
                    .binary_search(&[a.min(b), a.max(b)])
                    .expect("an edge of the mesh");
                stiffnesses[spring] += young * volume / at(a).distance_squared(at(b));
            }
        }
        let heights = || mesh.positions.iter().map(|position| position.as_dvec3().dot(up));
        let top = heights().fold(f64::NEG_INFINITY, f64::max);
        let bottom = heights().fold(f64::INFINITY, f64::min);
        for (mass, height) in masses.iter_mut().zip(heights()) {
            // A node of no tetrahedron has no mass, and so no motion to be compared.
            if height > top - held * (top - bottom) {
                *mass = 0.0;
            }
        }
        Self {
            name,
            description,
            rest_lengths: springs.iter().map(|&[a, b]| at(a).distance(at(b)) as f32).collect(),
            positions: mesh.positions.clone(),
            tetrahedra: mesh
                .tetrahedra
                .iter()
                .map(|&tetrahedron| turned_out(tetrahedron, &at))
                .collect(),
            masses: masses.into_iter().map(|mass| mass as f32).collect(),
            springs,
            stiffnesses: stiffnesses.into_iter().map(|stiffness| stiffness as f32).collect(),
            gravity: (-9.81 * up).as_vec3(),
            gravity_at_rest: (-9.81 * up).as_vec3(),
            damping_rate: 0.0,
        }
    }

    /// The same with damping against the world, 1/s, and this gravity.
    pub fn settling(&self, rate: f32, gravity: Vec3) -> Self {
        Self {
            damping_rate: rate,
            gravity,
            ..self.clone()
        }
    }

    pub fn node_count(&self) -> usize {
        self.positions.len()
    }

    /// What the tetrahedra enclose, those turned inside out subtracted, m³.
    pub fn volume(&self, positions: &[DVec3]) -> f64 {
        let at = |node: u32| positions[node as usize];
        let volume = |&[a, b, c, d]: &[u32; 4]| (at(b) - at(a)).dot((at(c) - at(a)).cross(at(d) - at(a))) / 6.0;
        self.tetrahedra.iter().map(volume).sum()
    }

    pub fn is_pinned(&self, node: usize) -> bool {
        self.masses[node] == 0.0
    }

    /// Where nodes start, m.
    pub fn start(&self) -> Vec<DVec3> {
        self.positions.iter().map(|position| position.as_dvec3()).collect()
    }
}

/// The tetrahedron, its corners in an order in which its volume is not negative.
fn turned_out([a, b, c, d]: [u32; 4], at: &impl Fn(u32) -> DVec3) -> [u32; 4] {
    let volume = (at(b) - at(a)).dot((at(c) - at(a)).cross(at(d) - at(a)));
    if volume < 0.0 { [a, b, d, c] } else { [a, b, c, d] }
}
