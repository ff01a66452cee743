//! The linear spring law: length, direction, force, energy and tangent of a spring.

use glam::{Vec2, Vec3};

use super::Link;

/// The length and direction of the spring from `node` to `neighbor`, where `offset` is the vector between them.
///
/// If both nodes coincide, or the squared distance underflows to 0, the spring points along x from the lower node index
/// to the higher. Both ends then see opposite directions, which conserves momentum.
#[inline(always)]
pub(crate) fn separation(node: usize, neighbor: usize, offset: Vec3) -> (f32, Vec3) {
    let length_squared = offset.length_squared();
    if length_squared > 0.0 {
        let length = length_squared.sqrt();
        (length, offset * (1.0 / length))
    } else if node < neighbor {
        (0.0, Vec3::X)
    } else {
        (0.0, Vec3::NEG_X)
    }
}

/// The force of a spring on `node`, N. It acts along the spring and is proportional to the elongation. With the
/// neighbor's relative velocity, it includes damping proportional to the elongation rate (Halic et al., section 3).
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
    let (length, direction) = separation(node, link.neighbor as usize, offset);
    let rate = velocity.map_or(0.0, |velocity| velocity.dot(direction));
    direction * (link.stiffness * (length - link.rest_length) + link.damping * rate)
}

/// Half the energy of a spring of `node`, J. The other half counts at its other end.
#[inline(always)]
pub(crate) fn half_energy(node: usize, link: &Link, offset: Vec3) -> f32 {
    let stretch = separation(node, link.neighbor as usize, offset).0 - link.rest_length;
    0.25 * link.stiffness * stretch * stretch
}

/// Parameters of the tangent that do not depend on a spring.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tangent {
    /// The lower bound of the transverse stiffness of a spring, N/m. With 0 no compressed spring pushes its ends
    /// sideways, so the assembled matrix is positive semidefinite. With -infinity the tangent is exact.
    pub floor: f32,
    /// The velocity per displacement along damped springs, 1/s.
    pub rate: f32,
}

impl Tangent {
    pub const NONE: Self = Self { floor: 0.0, rate: 0.0 };

    /// The direction n of a spring of `node`, and the coefficients x and y of its matrix `x n n^T + y I`, N/m.
    #[inline(always)]
    pub fn direction_and_matrix(&self, node: usize, link: &Link, offset: Vec3) -> (Vec3, Vec2) {
        let (length, direction) = separation(node, link.neighbor as usize, offset);
        let slack = if link.rest_length == 0.0 {
            1.0
        } else {
            1.0 - link.rest_length / length
        };
        // Coincident ends have no transverse direction.
        let floor = if length > 0.0 { self.floor } else { 0.0 };
        let across = (link.stiffness * slack).max(floor);
        (
            direction,
            Vec2::new(link.stiffness - across + link.damping * self.rate, across),
        )
    }

    /// The change of a spring's force on `node` if its other end moves by `difference` relative to the node, N.
    #[inline(always)]
    pub fn force_change(&self, node: usize, link: &Link, offset: Vec3, difference: Vec3) -> Vec3 {
        let (direction, matrix) = self.direction_and_matrix(node, link, offset);
        direction * (matrix.x * direction.dot(difference)) + difference * matrix.y
    }
}
