//! Where a spring points, and how long it is.

use glam::{Vec2, Vec3};

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

/// Half the energy of a spring of `node`, J: the other half is met at its other end.
#[inline(always)]
pub(crate) fn half_energy(node: usize, link: &Link, way: Vec3) -> f32 {
    let stretch = separation(node, link.neighbour as usize, way).0 - link.rest_length;
    0.25 * link.stiffness * stretch * stretch
}

/// How forces change as nodes move, as far as springs do not say it themselves.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tangent {
    /// The least stiffness across a spring, N/m: 0, and no spring pushes its ends sideways however it is pressed, so that
    /// the sum of all is positive semidefinite; -infinity: as it is.
    pub floor: f32,
    /// What a way counts as a velocity along damped springs, 1/s.
    pub rate: f32,
}

impl Tangent {
    pub const NONE: Self = Self { floor: 0.0, rate: 0.0 };

    /// The direction of a spring of `node`, and its matrix `x n n^T + y I` as x and y, with x without what y has, N/m.
    #[inline(always)]
    pub fn of(&self, node: usize, link: &Link, way: Vec3) -> (Vec3, Vec2) {
        let (length, direction) = separation(node, link.neighbour as usize, way);
        let slack = if link.rest_length == 0.0 {
            1.0
        } else {
            1.0 - link.rest_length / length
        };
        // Where the ends coincide there is no side to be pushed to.
        let floor = if length > 0.0 { self.floor } else { 0.0 };
        let across = (link.stiffness * slack).max(floor);
        (
            direction,
            Vec2::new(link.stiffness - across + link.damping * self.rate, across),
        )
    }

    /// How the force of a spring on `node` changes where its other end goes `difference` further than the node, N.
    #[inline(always)]
    pub fn change(&self, node: usize, link: &Link, way: Vec3, difference: Vec3) -> Vec3 {
        let (direction, matrix) = self.of(node, link, way);
        direction * (matrix.x * direction.dot(difference)) + difference * matrix.y
    }
}
