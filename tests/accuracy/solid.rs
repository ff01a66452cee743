//! Tetrahedral finite elements in `f64`, by the energy that `Model::Tetrahedra` states: the reference for the library.

use glam::{DMat3, DVec3};
use sinew::mesh::Mesh;

use super::envelope::Envelope;

/// From this Poisson's ratio on, the tetrahedra around a node share one volume constraint (average nodal pressure).
const RINGS_FROM: f64 = 0.4;

/// The solution is converged if a correction is no longer than this fraction of the body.
const SOLVED: f64 = 1e-12;

pub struct Solid {
    pub rest: Vec<DVec3>,
    elements: Vec<Element>,
    lambda: f64,
    mu: f64,
    kappa: f64,
    /// A quarter of the volume of the tetrahedra around each node (m³); `None` if each tetrahedron keeps its own
    /// volume.
    rings: Option<Vec<f64>>,
    /// The lowest node that each node is coupled to in the matrix.
    firsts: Vec<usize>,
}

struct Element {
    corners: [usize; 4],
    /// Gradients of the shape functions of the corners (1/m).
    gradients: [DVec3; 4],
    inverse: DMat3,
    volume: f64,
}

/// A deformed tetrahedron: F, its cofactors and S.
struct Deformed {
    gradient: DMat3,
    cofactors: DMat3,
    strain: DMat3,
    stress: DMat3,
}

fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

fn trace(matrix: &DMat3) -> f64 {
    matrix.x_axis.x + matrix.y_axis.y + matrix.z_axis.z
}

fn cofactors(f: &DMat3) -> DMat3 {
    DMat3::from_cols(
        f.y_axis.cross(f.z_axis),
        f.z_axis.cross(f.x_axis),
        f.x_axis.cross(f.y_axis),
    )
}

/// A load on a solid beside its own stress: for given positions it adds its forces, and its stiffness if requested, and
/// returns its energy.
pub type Load<'a> = &'a dyn Fn(&[DVec3], &mut [DVec3], Option<&mut Envelope>) -> f64;

impl Solid {
    pub fn new(mesh: &Mesh, young_modulus: f32, poisson_ratio: f32) -> Self {
        let rest: Vec<DVec3> = mesh.positions.iter().map(|p| p.as_dvec3()).collect();
        let (e, nu) = (f64::from(young_modulus), f64::from(poisson_ratio));
        let lambda = e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu));
        let mu = e / (2.0 * (1.0 + nu));
        let kappa = lambda.max(0.25 * (lambda + 2.0 * mu));
        let element = |corners: &[u32; 4]| {
            let corners = corners.map(|corner| corner as usize);
            let [a, b, c, d] = corners.map(|corner| rest[corner]);
            let edges = DMat3::from_cols(b - a, c - a, d - a);
            let inverse = edges.inverse();
            let rows = inverse.transpose();
            let others = [rows.x_axis, rows.y_axis, rows.z_axis];
            Element {
                corners,
                gradients: [-(others[0] + others[1] + others[2]), others[0], others[1], others[2]],
                inverse,
                volume: edges.determinant().abs() / 6.0,
            }
        };
        let elements: Vec<Element> = mesh.tetrahedra.iter().map(element).collect();
        let mut firsts: Vec<usize> = (0..rest.len()).collect();
        for element in &elements {
            let lowest = *element.corners.iter().min().expect("four corners");
            for &corner in &element.corners {
                firsts[corner] = firsts[corner].min(lowest);
            }
        }
        let rings = (nu >= RINGS_FROM).then(|| {
            let mut volumes = vec![0.0; rest.len()];
            // Nodal pressures couple a node to the neighbors of its neighbors.
            let near = firsts.clone();
            for element in &elements {
                for &corner in &element.corners {
                    volumes[corner] += 0.25 * element.volume;
                    for &other in &element.corners {
                        firsts[corner] = firsts[corner].min(near[other]);
                    }
                }
            }
            volumes
        });
        Self {
            rest,
            elements,
            lambda: lambda - kappa,
            mu,
            kappa,
            rings,
            firsts,
        }
    }

    /// Returns the volume of each node at rest (m³).
    pub fn node_volumes(&self) -> Vec<f64> {
        let mut volumes = vec![0.0; self.rest.len()];
        for element in &self.elements {
            for &corner in &element.corners {
                volumes[corner] += 0.25 * element.volume;
            }
        }
        volumes
    }

    fn deformed(&self, element: &Element, at: &[DVec3]) -> Deformed {
        let [a, b, c, d] = element.corners.map(|corner| at[corner]);
        let gradient = DMat3::from_cols(b - a, c - a, d - a) * element.inverse;
        let strain = (gradient.transpose() * gradient - DMat3::IDENTITY) * 0.5;
        Deformed {
            cofactors: cofactors(&gradient),
            stress: strain * (2.0 * self.mu) + DMat3::from_diagonal(DVec3::splat(self.lambda * trace(&strain))),
            gradient,
            strain,
        }
    }

    /// Returns J of each tetrahedron.
    pub fn growths(&self, at: &[DVec3]) -> Vec<f64> {
        let growth = |element| self.deformed(element, at).gradient.determinant();
        self.elements.iter().map(growth).collect()
    }

    /// Returns the volume ratio of each node, and that of the whole body.
    pub fn volumes(&self, at: &[DVec3]) -> (Vec<f64>, f64) {
        let mut sums = vec![[0.0; 2]; self.rest.len()];
        let mut whole = [0.0; 2];
        for (element, growth) in self.elements.iter().zip(self.growths(at)) {
            let volumes = [element.volume, element.volume * growth];
            let add = |sum: &mut [f64; 2]| [0, 1].map(|which| sum[which] += volumes[which]);
            add(&mut whole);
            for &corner in &element.corners {
                add(&mut sums[corner]);
            }
        }
        let ratio = |[before, after]: &[f64; 2]| after / before;
        (sums.iter().map(ratio).collect(), ratio(&whole))
    }

    /// Returns the pressure of each tetrahedron, and the volumetric energy.
    fn pressures(&self, at: &[DVec3]) -> (Vec<f64>, f64) {
        let growths: Vec<f64> = self.growths(at).iter().map(|j| j - 1.0).collect();
        let Some(volumes) = &self.rings else {
            let energies = self
                .elements
                .iter()
                .zip(&growths)
                .map(|(e, g)| 0.5 * self.kappa * e.volume * g * g);
            return (growths.iter().map(|g| self.kappa * g).collect(), energies.sum());
        };
        let mut nodes = vec![0.0; self.rest.len()];
        for (element, growth) in self.elements.iter().zip(&growths) {
            for &corner in &element.corners {
                nodes[corner] += 0.25 * element.volume * growth;
            }
        }
        let mut energy = 0.0;
        for (node, volume) in nodes.iter_mut().zip(volumes) {
            energy += 0.5 * self.kappa * *node * *node / volume;
            *node *= self.kappa / volume;
        }
        let mean = |element: &Element| element.corners.iter().map(|&corner| 0.25 * nodes[corner]).sum();
        (self.elements.iter().map(mean).collect(), energy)
    }

    /// Adds the forces of the stress, and returns its energy.
    pub fn forces(&self, at: &[DVec3], forces: &mut [DVec3]) -> f64 {
        let (pressures, mut energy) = self.pressures(at);
        for (element, pressure) in self.elements.iter().zip(pressures) {
            let deformed = self.deformed(element, at);
            let squares = deformed.strain.transpose() * deformed.strain;
            let whole = trace(&deformed.strain);
            energy += element.volume * (0.5 * self.lambda * whole * whole + self.mu * trace(&squares));
            let stress = deformed.gradient * deformed.stress + deformed.cofactors * pressure;
            for (&corner, gradient) in element.corners.iter().zip(element.gradients) {
                forces[corner] -= stress * gradient * element.volume;
            }
        }
        energy
    }

    /// Returns the negative derivative of the forces by the positions.
    fn stiffness(&self, at: &[DVec3]) -> Envelope {
        let firsts = self.firsts.iter().flat_map(|first| [3 * first; 3]);
        let mut matrix = Envelope::new(firsts.collect());
        let (pressures, _) = self.pressures(at);
        let own = if self.rings.is_some() { 0.0 } else { self.kappa };
        for (element, pressure) in self.elements.iter().zip(pressures) {
            let Deformed {
                gradient: f,
                cofactors: area,
                stress,
                ..
            } = self.deformed(element, at);
            for (&column, of_column) in element.corners.iter().zip(element.gradients) {
                for (axis, unit) in DVec3::AXES.into_iter().enumerate() {
                    let df = outer(unit, of_column);
                    let half = f.transpose() * df;
                    let strain = (half + half.transpose()) * 0.5;
                    let second =
                        strain * (2.0 * self.mu) + DMat3::from_diagonal(DVec3::splat(self.lambda * trace(&strain)));
                    let turned = DMat3::from_cols(
                        df.y_axis.cross(f.z_axis) + f.y_axis.cross(df.z_axis),
                        df.z_axis.cross(f.x_axis) + f.z_axis.cross(df.x_axis),
                        df.x_axis.cross(f.y_axis) + f.x_axis.cross(df.y_axis),
                    );
                    let growth = (area * of_column).dot(unit);
                    let change = df * stress + f * second + turned * pressure + area * (own * growth);
                    for (&row, of_row) in element.corners.iter().zip(element.gradients) {
                        let force = change * of_row * element.volume;
                        for other in 0..3 {
                            matrix.add(3 * row + other, 3 * column + axis, force[other]);
                        }
                    }
                }
            }
        }
        self.add_rings(at, &mut matrix);
        matrix
    }

    /// Adds the change of the pressures: for each node the outer product of its volume gradient.
    fn add_rings(&self, at: &[DVec3], matrix: &mut Envelope) {
        let Some(volumes) = &self.rings else { return };
        let mut slopes = vec![std::collections::BTreeMap::new(); self.rest.len()];
        for element in &self.elements {
            let area = self.deformed(element, at).cofactors;
            for (&corner, gradient) in element.corners.iter().zip(element.gradients) {
                let slope = area * gradient * (0.25 * element.volume);
                for &ring in &element.corners {
                    *slopes[ring].entry(corner).or_insert(DVec3::ZERO) += slope;
                }
            }
        }
        for (slopes, volume) in slopes.iter().zip(volumes) {
            for (&row, a) in slopes {
                for (&column, b) in slopes {
                    let block = outer(*a, *b) * (self.kappa / volume);
                    for axis in 0..3 {
                        for other in 0..3 {
                            matrix.add(3 * row + axis, 3 * column + other, block.col(other)[axis]);
                        }
                    }
                }
            }
        }
    }

    /// Moves free nodes to equilibrium by Newton's method.
    pub fn settle(&self, at: &mut Vec<DVec3>, is_held: &[bool], load: Load) {
        self.settle_to(SOLVED, at, is_held, load);
    }

    /// Moves free nodes until a correction is no longer than this fraction of the body.
    pub fn settle_to(&self, tolerance: f64, at: &mut Vec<DVec3>, is_held: &[bool], load: Load) {
        let farthest = self.rest.iter().map(|p| p.length()).fold(0.0, f64::max);
        for _ in 0..60 {
            let mut forces = vec![DVec3::ZERO; at.len()];
            let energy = self.forces(at, &mut forces) + load(at, &mut forces, None);
            let mut matrix = self.stiffness(at);
            load(at, &mut vec![DVec3::ZERO; at.len()], Some(&mut matrix));
            let mut correction: Vec<f64> = forces.iter().flat_map(|force| force.to_array()).collect();
            for node in (0..at.len()).filter(|&node| is_held[node]) {
                (3 * node..3 * node + 3).for_each(|unknown| matrix.hold(unknown));
                correction[3 * node..3 * node + 3].fill(0.0);
            }
            // Where the energy is concave the diagonal is enlarged.
            let mut lift = 0.0;
            let factor = loop {
                match matrix.lifted(lift).factor() {
                    Some(factor) => break factor,
                    None => lift = f64::max(1e-3, 4.0 * lift),
                }
            };
            let down: Vec<f64> = correction.clone();
            factor.solve(&mut correction);
            let slope: f64 = correction.iter().zip(&down).map(|(a, b)| a * b).sum();
            let longest = correction.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
            // Step back where the energy does not decrease enough.
            let mut part = 1.0;
            loop {
                let then: Vec<DVec3> = at
                    .iter()
                    .zip(correction.chunks(3))
                    .map(|(position, correction)| *position + DVec3::from_slice(correction) * part)
                    .collect();
                let mut forces = vec![DVec3::ZERO; at.len()];
                let gained = energy - self.forces(&then, &mut forces) - load(&then, &mut forces, None);
                if gained > 1e-4 * part * slope - 1e-13 * energy.abs() || part < 1e-6 {
                    *at = then;
                    break;
                }
                part *= 0.5;
            }
            if longest < tolerance * farthest && lift == 0.0 {
                return;
            }
        }
        panic!("not at rest after sixty corrections");
    }
}
