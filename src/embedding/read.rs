//! Positions of the vertices of a fine surface.

use glam::{Vec3, Vec3A};

use super::bind::{Binding, InTetrahedron, OverTriangle};

impl Binding {
    /// Writes the positions of the vertices for these node positions, as many as at the binding.
    pub fn read(&self, positions: &[Vec3], vertices: &mut [Vec3]) {
        let at = |node: u32| Vec3A::from(positions[node as usize]);
        match self {
            Self::Tetrahedra(bound) => {
                for (vertex, InTetrahedron { nodes, weights }) in vertices.iter_mut().zip(bound) {
                    let [a, b, c, d] = nodes.map(at);
                    *vertex = (a + (b - a) * weights[0] + (c - a) * weights[1] + (d - a) * weights[2]).into();
                }
            }
            Self::Triangles(bound) => {
                for (vertex, over) in vertices.iter_mut().zip(bound) {
                    let OverTriangle { nodes, weights, offset } = over;
                    let [a, b, c] = nodes.map(at);
                    let (ab, ac) = (b - a, c - a);
                    // Normalized edges keep the product in range for triangles of any size.
                    let normal = ab.normalize_or_zero().cross(ac.normalize_or_zero()).normalize_or_zero();
                    *vertex = (a + ab * weights[0] + ac * weights[1] + normal * *offset).into();
                }
            }
        }
    }
}
