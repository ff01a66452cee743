//! Where a spring points, and how long it is.

use glam::Vec3;

/// The length of the spring from `node` to `neighbour`, which lies `offset` away, and its direction.
///
/// Where both are at the same place, or so near that the square of the way is 0, the spring points along x, from the node with the lower number to the other: each
/// end sees the opposite of what the other sees, so that momentum is kept there too.
#[inline(always)]
pub(crate) fn separation(node: usize, neighbour: usize, offset: Vec3) -> (f32, Vec3) {
    let length_squared = offset.length_squared();
    if length_squared > 0.0 {
        let length = length_squared.sqrt();
        (length, offset * (1.0 / length))
    } else if node < neighbour {
        (0.0, Vec3::X)
    } else {
        (0.0, Vec3::NEG_X)
    }
}
