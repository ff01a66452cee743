//! Vertex normals of a surface.

use glam::{Vec3, Vec3A};

/// Writes the unit normal of each vertex, the mean of its triangles' by area; 0 without area.
///
/// `scale` is about 1 over the length of an edge: areas neither vanish nor overflow.
pub(crate) fn vertex_normals(vertices: &[Vec3], triangles: &[[u32; 3]], scale: f32, normals: &mut [Vec3]) {
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
