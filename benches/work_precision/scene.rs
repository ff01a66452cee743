//! A simulated scene: nodes and springs as plain numbers, so that every solver gets the same input.

use glam::{DVec3, Vec3};
use sinew::mesh::Mesh;

/// Duration of a motion [s].
pub const DURATION: f64 = 0.25;
/// Number of evenly spaced times, up to the end, at which positions are compared.
pub const SAMPLES: usize = 8;
/// Time between two samples [s]: two frames of 1/64 s.
pub const SPAN: f64 = DURATION / SAMPLES as f64;

/// Nodes joined by undamped springs, at rest at the start.
#[derive(Clone)]
pub struct Scene {
    pub name: &'static str,
    /// A description of one or two sentences.
    pub description: String,
    /// Initial positions [m].
    pub positions: Vec<Vec3>,
    /// Masses [kg]; 0 is pinned.
    pub masses: Vec<f32>,
    pub springs: Vec<[u32; 2]>,
    /// The tetrahedra whose volume is compared; may be empty.
    pub tetrahedra: Vec<[u32; 4]>,
    /// Stiffnesses [N/m].
    pub stiffnesses: Vec<f32>,
    /// Rest lengths [m].
    pub rest_lengths: Vec<f32>,
    /// Gravity [m/s²].
    pub gravity: Vec3,
    /// Gravity of the measurement at rest [m/s²]; it differs from `gravity` if that has no unique rest shape.
    pub gravity_at_rest: Vec3,
    /// Damping rate of velocities against the world [1/s].
    pub damping_rate: f32,
}

impl Scene {
    /// Creates springs along the edges of tetrahedra, with stiffnesses by Van Gelder (1998) for Young's modulus `young`
    /// [Pa]. The mass of the tetrahedra, with `density` [kg/m³], is distributed to their corners. The upper
    /// `pinned_fraction` of the extent along `up` is pinned; gravity acts in the opposite direction.
    pub fn of_tetrahedra(
        name: &'static str,
        description: String,
        mesh: &Mesh,
        [young, density]: [f64; 2],
        up: DVec3,
        pinned_fraction: f64,
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
            // A node without tetrahedra has no mass, and therefore no motion to compare.
            if height > top - pinned_fraction * (top - bottom) {
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
                .map(|&tetrahedron| oriented(tetrahedron, &at))
                .collect(),
            masses: masses.into_iter().map(|mass| mass as f32).collect(),
            springs,
            stiffnesses: stiffnesses.into_iter().map(|stiffness| stiffness as f32).collect(),
            gravity: (-9.81 * up).as_vec3(),
            gravity_at_rest: (-9.81 * up).as_vec3(),
            damping_rate: 0.0,
        }
    }

    /// A copy with damping against the world [1/s] and this gravity.
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

    /// The signed volume of the tetrahedra, inverted ones negative [m³].
    pub fn volume(&self, positions: &[DVec3]) -> f64 {
        let at = |node: u32| positions[node as usize];
        let volume = |&[a, b, c, d]: &[u32; 4]| (at(b) - at(a)).dot((at(c) - at(a)).cross(at(d) - at(a))) / 6.0;
        self.tetrahedra.iter().map(volume).sum()
    }

    pub fn is_pinned(&self, node: usize) -> bool {
        self.masses[node] == 0.0
    }

    /// Initial positions [m].
    pub fn start(&self) -> Vec<DVec3> {
        self.positions.iter().map(|position| position.as_dvec3()).collect()
    }
}

/// The tetrahedron with its corners in an order of non-negative volume.
fn oriented([a, b, c, d]: [u32; 4], at: &impl Fn(u32) -> DVec3) -> [u32; 4] {
    let volume = (at(b) - at(a)).dot((at(c) - at(a)).cross(at(d) - at(a)));
    if volume < 0.0 { [a, b, d, c] } else { [a, b, c, d] }
}
