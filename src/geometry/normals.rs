//! Vertex normals of a surface.

use glam::{Vec3, Vec3A};

/// Writes the unit normal of each vertex: the mean of its triangles' normals, weighted by area. 0 if all areas are 0.
///
/// `scale` is about the inverse edge length, so that areas neither underflow nor overflow.
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
