//! Where the vertices of a fine surface are, and their normals.

use glam::{Vec3, Vec3A};

use super::bind::{Binding, InTetrahedron, OverTriangle};

impl Binding {
    /// Writes where each vertex is with the nodes at `positions`; there are as many as at the binding.
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
                    // Of unit length whatever the triangle's size.
                    let normal = ab.normalize_or_zero().cross(ac.normalize_or_zero()).normalize_or_zero();
                    *vertex = (a + ab * weights[0] + ac * weights[1] + normal * *offset).into();
                }
            }
        }
    }
}

/// Writes the normal of each vertex: that of its triangles, each as much as it has area. With `scale` edges are some 1 long.
pub(super) fn normals(vertices: &[Vec3], triangles: &[[u32; 3]], scale: f32, normals: &mut [Vec3]) {
    normals.fill(Vec3::ZERO);
    for triangle in triangles {
        let [a, b, c] = triangle.map(|vertex| Vec3A::from(vertices[vertex as usize]));
        let area = Vec3::from(((b - a) * scale).cross((c - a) * scale));
        for &vertex in triangle {
            normals[vertex as usize] += area;
        }
    }
    for normal in normals {
        *normal = normal.normalize_or_zero();
    }
}
