//! Bodies with known static equilibria: chains, the discrete catenary, and patches of lattice and triangles under
//! uniform stress (Cauchy-Born).

use glam::{DMat3, DVec3, Vec3};

use super::bodies::{Parts, Scene, largest_difference};

/// m/s²
pub const G: f32 = 9.81;

/// Damps all nodes by `rate` times their mass (1/s).
pub fn damp(parts: &mut Parts, rate: f32) {
    for (damping, mass) in parts.node_dampings.iter_mut().zip(&parts.masses) {
        *damping = rate * mass;
    }
}

/// Returns a chain of `links` springs that hangs from its first node, and its total extension. Each spring carries the
/// weight below it.
pub fn hanging_chain(links: usize, spacing: f32, mass: f32, stiffness: f32) -> (Parts, f64) {
    let mut parts = Parts::chain(links + 1, Vec3::NEG_Y * spacing, mass, stiffness);
    parts.masses[0] = 0.0;
    parts.rest_lengths.fill(spacing);
    let extension = f64::from(mass) * f64::from(G) * (links * (links + 1)) as f64 / (2.0 * f64::from(stiffness));
    (parts, extension)
}

/// A chain between two pins, the expected positions of its nodes and the force on its first pin.
pub struct Catenary {
    pub parts: Parts,
    pub expected: Vec<DVec3>,
    pub force: DVec3,
    pub length: f64,
}

impl Catenary {
    pub fn new() -> Self {
        let (links, mass, stiffness, spacing) = (20, 0.01_f32, 400.0_f32, 0.05_f32);
        let span = DVec3::new(0.7, 0.1, 0.0).as_vec3().as_dvec3();
        let weight = f64::from(mass) * f64::from(G);
        let shape = |h: f64, v: f64| catenary(h, v, links, weight, f64::from(spacing), f64::from(stiffness));
        let end = |h: f64, v: f64| shape(h, v)[links] - span;
        // Newton's method for the force at the first end.
        let (mut horizontal, mut vertical) = (weight * 5.0, weight * 9.0);
        for _ in 0..60 {
            let (e, d) = (end(horizontal, vertical), 1e-6);
            let (dh, dv) = (
                (end(horizontal + d, vertical) - e) / d,
                (end(horizontal, vertical + d) - e) / d,
            );
            let determinant = dh.x * dv.y - dv.x * dh.y;
            horizontal -= (e.x * dv.y - dv.x * e.y) / determinant;
            vertical -= (dh.x * e.y - e.x * dh.y) / determinant;
        }
        assert!(end(horizontal, vertical).length() < 1e-12, "no catenary found");

        let mut parts = Parts::chain(links + 1, Vec3::X, mass, stiffness);
        for (i, position) in parts.positions.iter_mut().enumerate() {
            let along = i as f64 / links as f64;
            *position = (span * along - DVec3::Y * 1.4 * along * (1.0 - along)).as_vec3();
        }
        parts.rest_lengths.fill(spacing);
        parts.masses[0] = 0.0;
        parts.masses[links] = 0.0;
        Self {
            parts,
            expected: shape(horizontal, vertical),
            force: DVec3::new(-horizontal, vertical, 0.0),
            length: f64::from(spacing) * links as f64,
        }
    }

    /// Returns the largest error of a body at rest, divided by the length of the chain. Checks the force on the first
    /// pin.
    pub fn error_of(&self, scene: &Scene) -> f64 {
        let pin_force = scene.body().pin_force(0).expect("a pin").as_dvec3();
        let force = self.force;
        assert!(
            pin_force.distance(force) < 1e-4 * force.length(),
            "{pin_force} for {force}"
        );
        largest_difference(&scene.positions(), &self.expected) / self.length
    }
}

/// Returns the node positions of a hanging chain that starts at the origin and is pulled there by (-horizontal,
/// vertical). With stiffness k, link i carries the tension (H, V - i m g) and has the length L + T/k.
fn catenary(horizontal: f64, vertical: f64, links: usize, weight: f64, rest: f64, stiffness: f64) -> Vec<DVec3> {
    let mut positions = vec![DVec3::ZERO];
    for link in 0..links {
        let tension = DVec3::new(horizontal, link as f64 * weight - vertical, 0.0);
        let length = rest + tension.length() / stiffness;
        positions.push(positions[link] + tension.normalize() * length);
    }
    positions
}

/// Returns the first Piola-Kirchhoff stress of a lattice under the deformation `f`, from the springs that a cell of
/// volume `volume` owns: `sum k (|F d| - |d|) / |F d| (F d) d^T / volume`.
pub fn stress(f: DMat3, springs: &[(DVec3, f64)], volume: f64) -> DMat3 {
    springs.iter().fold(DMat3::ZERO, |sum, &(d, stiffness)| {
        let stretched = f * d;
        let force = stretched * (stiffness * (1.0 - d.length() / stretched.length()));
        sum + DMat3::from_cols(force * d.x, force * d.y, force * d.z) * (1.0 / volume)
    })
}

/// Returns the diagonal deformation with the stretch `stretch` along `axis` and no stress along the axes `free`.
pub fn uniaxial(axis: usize, stretch: f64, free: &[usize], springs: &[(DVec3, f64)], volume: f64) -> DMat3 {
    let deformation = |across: f64| {
        let mut diagonal = DVec3::ONE;
        for &other in free {
            diagonal[other] = across;
        }
        diagonal[axis] = stretch;
        DMat3::from_diagonal(diagonal)
    };
    let (mut low, mut high) = (0.5, 1.5);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if stress(deformation(middle), springs, volume).col(free[0])[free[0]] > 0.0 {
            high = middle;
        } else {
            low = middle;
        }
    }
    deformation(0.5 * (low + high))
}

/// Returns the springs that a cell of the cubic lattice owns.
pub fn cubic_cell(spacing: f64, stiffness: f64) -> Vec<(DVec3, f64)> {
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    [x, y, z, x + y, x - y, y + z, y - z, z + x, z - x]
        .map(|d| (d * spacing, stiffness))
        .to_vec()
}

/// A free body, the loads on its nodes, and the resulting deformation.
pub struct Patch {
    pub parts: Parts,
    pub loads: Vec<Vec3>,
    pub deformation: DMat3,
}

impl Patch {
    /// Creates a block of the cubic lattice under uniaxial tension along x. Compression by loads of fixed direction
    /// would turn a free body over.
    pub fn lattice(stretch: f64) -> Self {
        let (spacing, stiffness, cells) = (0.05_f32, 100.0_f32, 4);
        let a = f64::from(spacing);
        let springs = cubic_cell(a, f64::from(stiffness));
        let deformation = uniaxial(0, stretch, &[1, 2], &springs, a * a * a);
        let traction = stress(deformation, &springs, a * a * a).col(0).x;
        let parts = Parts::block([cells; 3], spacing, 0.01, stiffness);
        let length = spacing * cells as f32;
        let edge_weight = |x: f32| if x == 0.0 || x == length { 0.5 } else { 1.0 };
        let load = |p: &Vec3| {
            let outward = if p.x == 0.0 {
                -1.0
            } else {
                f64::from(u8::from(p.x == length))
            };
            (DVec3::X * (outward * traction * a * a * edge_weight(p.y) * edge_weight(p.z))).as_vec3()
        };
        Self {
            loads: parts.positions.iter().map(load).collect(),
            parts,
            deformation,
        }
    }

    /// Creates equilateral triangles, pulled along one axis and free across it.
    pub fn triangles(axis: usize, across: usize, stretch: f64) -> Self {
        let (cells, side, stiffness) = (6, 0.05, 100.0_f32);
        let (parts, triangles) = triangle_patch(cells, side, stiffness);
        let (directions, area) = triangle_cell(side, f64::from(stiffness));
        let deformation = uniaxial(axis, stretch, &[across], &directions, area);
        let stress = stress(deformation, &directions, area);
        // A uniform stress P loads each corner by P times half the normal of the opposite side.
        let mut loads = vec![DVec3::ZERO; parts.positions.len()];
        for triangle in &triangles {
            for corner in 0..3 {
                let [from, to] = [1, 2].map(|next| parts.positions[triangle[(corner + next) % 3]].as_dvec3());
                let side = to - from;
                loads[triangle[corner]] += stress * DVec3::new(-side.y, side.x, 0.0) * 0.5;
            }
        }
        Self {
            parts,
            loads: loads.iter().map(|load| load.as_vec3()).collect(),
            deformation,
        }
    }

    /// Applies the loads for the next step.
    pub fn load(&self, scene: &mut Scene) {
        let nodes: Vec<u32> = (0..self.parts.positions.len() as u32).collect();
        scene.body_mut().apply_forces(&nodes, &self.loads).expect("forces");
    }

    /// Returns the largest deviation of a body from the deformation, without its translation, divided by its size.
    pub fn error_of(&self, scene: &Scene) -> f64 {
        let rest = self.parts.positions.iter();
        let expected: Vec<DVec3> = rest.map(|p| self.deformation * p.as_dvec3()).collect();
        let mut positions = scene.positions();
        let shift = (expected.iter().sum::<DVec3>() - positions.iter().sum::<DVec3>()) / expected.len() as f64;
        for position in &mut positions {
            *position += shift;
        }
        largest_difference(&positions, &expected) / self.parts.size()
    }
}

/// Returns a patch of equilateral triangles. Each triangle owns half of its springs.
fn triangle_patch(cells: usize, side: f64, stiffness: f32) -> (Parts, Vec<[usize; 3]>) {
    let corner = |x: usize, y: usize| y * (cells + 1) + x;
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    for y in 0..=cells {
        for x in 0..=cells {
            let coordinates = DVec3::new(x as f64 + 0.5 * y as f64, 0.75_f64.sqrt() * y as f64, 0.0);
            positions.push((coordinates * side).as_vec3());
            if x < cells && y < cells {
                triangles.push([corner(x, y), corner(x + 1, y), corner(x, y + 1)]);
                triangles.push([corner(x + 1, y), corner(x + 1, y + 1), corner(x, y + 1)]);
            }
        }
    }
    let mut parts = Parts::nodes(positions, 0.01);
    let mut shares = std::collections::BTreeMap::new();
    for [a, b, c] in &triangles {
        for (a, b) in [(a, b), (b, c), (c, a)] {
            *shares.entry([*a.min(b), *a.max(b)]).or_insert(0.0) += 0.5;
        }
    }
    for ([a, b], share) in shares {
        parts.join(a, b, share * stiffness);
    }
    (parts, triangles)
}

/// Returns the three springs that a node of equilateral triangles owns, and the area of two triangles.
pub fn triangle_cell(side: f64, stiffness: f64) -> ([(DVec3, f64); 3], f64) {
    let directions = [0.0_f64, 60.0, 120.0].map(|degrees| {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        (DVec3::new(cosine, sine, 0.0) * side, stiffness)
    });
    (directions, 0.75_f64.sqrt() * side * side)
}
