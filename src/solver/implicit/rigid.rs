//! A body without pins moves as a whole as outer forces have it, however well its equation was solved: what is left of the
//! residual is given no sum and no torque. Of one that is held along some axes alone this is so along the others, and about an axis
//! that is at right angles to both of those that are left.

use glam::{BVec3, DMat3, DVec3};

use super::Implicit;
use crate::body::Vectors;

impl Implicit {
    /// Adds to the pushes the shift and the turn that take the sum and the torque off the residual of nodes at `positions`, as far as
    /// nothing holds the body along these axes.
    pub(super) fn balance(&mut self, positions: &Vectors, held: BVec3) {
        let (mut mass, mut centre, mut sum) = (0.0, DVec3::ZERO, DVec3::ZERO);
        let nodes = || self.inertia.iter().zip(positions.iter()).zip(self.residuals.iter());
        for ((&inertia, position), residual) in nodes() {
            let inertia = f64::from(inertia);
            mass += inertia;
            centre += position.as_dvec3() * inertia;
            sum += residual.as_dvec3();
        }
        centre /= mass;
        let (mut moments, mut torque) = (DMat3::ZERO, DVec3::ZERO);
        for ((&inertia, position), residual) in nodes() {
            let arm = position.as_dvec3() - centre;
            let outer = DMat3::from_cols(arm * arm.x, arm * arm.y, arm * arm.z);
            let square = DMat3::from_diagonal(DVec3::splat(arm.length_squared()));
            moments += (square - outer) * f64::from(inertia);
            torque += arm.cross(residual.as_dvec3());
        }
        let shift = DVec3::select(held, DVec3::ZERO, sum / mass);
        // A body without extent across its axis does not turn about it.
        let largest = moments.x_axis.x.max(moments.y_axis.y).max(moments.z_axis.z);
        let largest = DMat3::from_diagonal(DVec3::splat(1e-9 * largest));
        let turn = if held.any() {
            // A turn about one axis moves nodes along both others.
            let about = BVec3::new(held.y | held.z, held.z | held.x, held.x | held.y);
            let moments = DVec3::new(moments.x_axis.x, moments.y_axis.y, moments.z_axis.z);
            DVec3::select(about, DVec3::ZERO, torque / moments)
        } else {
            (moments + largest).inverse() * torque
        };
        for node in 0..positions.len() {
            let arm = positions.get(node).as_dvec3() - centre;
            let way = if turn.is_finite() {
                shift + turn.cross(arm)
            } else {
                shift
            };
            if way.is_finite() {
                self.pushes.set(node, self.pushes.get(node) + way.as_vec3());
            }
        }
    }
}
