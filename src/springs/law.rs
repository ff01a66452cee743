//! Where a spring points, and how long it is.

use glam::Vec3;

use super::Link;

/// The length of the spring from `node` to `neighbour`, which lies `offset` away, and its direction.
///
/// Where both are at the same place, or so near that the square of the way is 0, the spring points along x, from the node
/// with the lower number to the other: each end sees the opposite of what the other sees, so that momentum is kept there too.
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

/// The force of a spring on `node`, N: along it, by its stretch and, where the velocity of the neighbour against the node
/// is given, by the rate at which it lengthens (Halic et al., section 3).
#[inline(always)]
pub(crate) fn pull(node: usize, link: &Link, offset: Vec3, velocity: Option<Vec3>) -> Vec3 {
    let square = offset.length_squared();
    if square > 0.0 {
        let length = square.sqrt();
        let mut pull = link.stiffness * (length - link.rest_length);
        if let Some(velocity) = velocity {
            pull += link.damping * (velocity.dot(offset) / length);
        }
        return offset * (pull / length);
    }
    let (length, direction) = separation(node, link.neighbour as usize, offset);
    let rate = velocity.map_or(0.0, |velocity| velocity.dot(direction));
    direction * (link.stiffness * (length - link.rest_length) + link.damping * rate)
}
