//! Triangulated surface of a box. Its faces, edges and corners are found like those of any mesh.

use glam::Vec3;

/// Faces of a box, two outward triangles each. The bits of a corner's index select the upper side: 1 for x, 2 for y,
/// 4 for z.
const TRIANGLES: [[u32; 3]; 12] = [
    [0, 4, 6],
    [0, 6, 2],
    [1, 3, 7],
    [1, 7, 5],
    [0, 1, 5],
    [0, 5, 4],
    [2, 6, 7],
    [2, 7, 3],
    [0, 2, 3],
    [0, 3, 1],
    [4, 5, 7],
    [4, 7, 6],
];

/// Returns the surface of the box of all points within `half_extents` of the origin along each axis.
pub(super) fn surface(half_extents: Vec3) -> ([Vec3; 8], [[u32; 3]; 12]) {
    let sign = |corner: usize, axis: usize| if corner >> axis & 1 == 1 { 1.0 } else { -1.0 };
    let corner = |corner| half_extents * Vec3::from_array([0, 1, 2].map(|axis| sign(corner, axis)));
    (std::array::from_fn(corner), TRIANGLES)
}
