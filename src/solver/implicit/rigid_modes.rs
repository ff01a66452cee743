//! Corrects the rigid-body motion of unconstrained bodies.
//!
//! The motion of an unpinned body as a whole depends only on external forces, however accurately its equation was
//! solved. Therefore the remaining residual is given zero net force and torque. If nodes are held along some axes only,
//! this applies to the other axes, and to rotation about an axis that is perpendicular to the two free ones.

use glam::{BVec3, DMat3, DVec3};

use super::Implicit;
use super::step::Substep;
use crate::base::outer;
use crate::soa::Vectors;
use crate::solver::System;

/// Limit of a small deformation: displacement by forces in the step, as a fraction of the body's size.
const MAX_CHANGE: f64 = 0.1;

impl Implicit {
    /// Adds to the force displacements the translation and rotation that remove the net force and torque of the
    /// residual, along the free axes. The nodes are at `positions`.
    pub(super) fn balance_residual(&mut self, positions: &Vectors, held: BVec3) {
        let get = |vectors: &Vectors, node: usize| vectors.get(node).as_dvec3();
        let (mut mass, mut sum, mut means, mut squares) = (0.0, DVec3::ZERO, [DVec3::ZERO; 2], [0.0; 2]);
        for (node, &inertia) in self.inertia.iter().enumerate() {
            let inertia = f64::from(inertia);
            mass += inertia;
            sum += get(&self.residuals, node);
            for (index, vectors) in [positions, &self.force_displacements].into_iter().enumerate() {
                means[index] += get(vectors, node) * inertia;
                squares[index] += get(vectors, node).length_squared() * inertia;
            }
        }
        let [center, force_displacement] = means.map(|mean| mean / mass);
        let [size, change] = [0, 1].map(|index| squares[index] / mass - (means[index] / mass).length_squared());
        // The rotation moves the nodes that inertia acts on, too. If the body deforms strongly in the step, that
        // equation is ill-conditioned.
        let is_small_change = change < MAX_CHANGE * MAX_CHANGE * size;
        let (mut torque, mut moments) = (DVec3::ZERO, DMat3::ZERO);
        for (node, &inertia) in self.inertia.iter().enumerate() {
            let arm = get(positions, node) - center;
            torque += arm.cross(get(&self.residuals, node));
            let target = if is_small_change {
                arm - (get(&self.force_displacements, node) - force_displacement)
            } else {
                arm
            };
            moments += moment(target, arm) * f64::from(inertia);
        }
        let shift = DVec3::select(held, DVec3::ZERO, sum / mass);
        let rotation = rotation(moments, torque, held);
        for node in 0..positions.len() {
            let arm = positions.get(node).as_dvec3() - center;
            let displacement = if rotation.is_finite() {
                shift + rotation.cross(arm)
            } else {
                shift
            };
            if displacement.is_finite() {
                self.force_displacements
                    .set(node, self.force_displacements.get(node) + displacement.as_vec3());
            }
        }
    }
}

/// Rate of rotation about a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct RotationRate {
    center: DVec3,
    /// Angular velocity, rad/s.
    rate: DVec3,
}

impl RotationRate {
    /// Adds the rotation to the velocities of nodes at these positions, and to their velocity changes.
    pub fn add(
        &self,
        positions: [&[f32]; 3],
        velocities: &mut [&mut [f32]; 3],
        velocity_changes: &mut [&mut [f32]; 3],
    ) {
        for node in 0..positions[0].len() {
            let position = DVec3::from_array(positions.map(|axis| f64::from(axis[node])));
            let change = self.rate.cross(position - self.center).as_vec3();
            for (axis, change) in change.to_array().into_iter().enumerate() {
                velocities[axis][node] += change;
                velocity_changes[axis][node] += change;
            }
        }
    }
}

impl Substep<'_> {
    /// Returns the rotation that restores the angular momentum which the formula loses, for a body that nothing holds.
    ///
    /// L is the angular momentum about the center of mass and T the external torque. The formula yields
    /// `sum x1 x m (v1 - w) = t T`, but should yield `L1 - L0 - c (L0 - L') = t T`. The difference is
    /// `sum m (s x w + c (1 + c) (x - x') x (v - v'))`.
    pub(super) fn angular_momentum_correction(&self, body: &mut System, implicit: &Implicit) -> Option<RotationRate> {
        let held = body.held_axes();
        if held.all() {
            return None;
        }
        let history = implicit.solution.last(self.is_first);
        let carried = self.carried();
        let carried = carried * (1.0 + carried);
        let state = body.state.substep();
        let (positions, velocities) = (&*state.next_positions, &*state.velocities);
        let free = || {
            let nodes = 0..positions.len();
            nodes
                .filter(|&node| body.inverse_masses[node] > 0.0)
                .map(|node| (node, f64::from(body.masses[node])))
        };
        let (mut mass, mut sums, mut lost_momentum) = (0.0, [DVec3::ZERO; 5], DVec3::ZERO);
        for (node, node_mass) in free() {
            let [position, force_displacement, velocity, displacement, velocity_change] = [
                positions,
                &implicit.force_displacements,
                velocities,
                &history.displacements,
                &history.velocity_changes,
            ]
            .map(|vectors| vectors.get(node).as_dvec3());
            mass += node_mass;
            for (sum, vector) in
                sums.iter_mut()
                    .zip([position, force_displacement, velocity, displacement, velocity_change])
            {
                *sum += vector * node_mass;
            }
            lost_momentum +=
                (force_displacement.cross(velocity) + displacement.cross(velocity_change) * carried) * node_mass;
        }
        let [center, force_displacement, velocity, displacement, velocity_change] = sums.map(|sum| sum / mass);
        lost_momentum -= (force_displacement.cross(velocity) + displacement.cross(velocity_change) * carried) * mass;
        let moments = moments(free().map(|(node, mass)| (mass, positions.get(node).as_dvec3() - center)));
        let rate = rotation(moments, -lost_momentum, held);
        rate.is_finite().then_some(RotationRate { center, rate })
    }
}

/// Inertia tensor of point masses at these arms.
fn moments(nodes: impl Iterator<Item = (f64, DVec3)>) -> DMat3 {
    let mut moments = DMat3::ZERO;
    for (mass, arm) in nodes {
        moments += moment(arm, arm) * mass;
    }
    moments
}

/// Matrix that maps `w` to `a x (w x b)`.
fn moment(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_diagonal(DVec3::splat(a.dot(b))) - outer(b, a)
}

/// Returns the rotation of a body with this inertia tensor under this torque or angular momentum, about the axes that
/// are free.
fn rotation(moments: DMat3, torque: DVec3, held: BVec3) -> DVec3 {
    // A body without extent across an axis does not rotate about it.
    let largest = moments.x_axis.x.max(moments.y_axis.y).max(moments.z_axis.z);
    let largest = DMat3::from_diagonal(DVec3::splat(1e-9 * largest));
    if held.any() {
        // A rotation about one axis moves nodes along both others.
        let about = BVec3::new(held.y | held.z, held.z | held.x, held.x | held.y);
        let moments = DVec3::new(moments.x_axis.x, moments.y_axis.y, moments.z_axis.z);
        DVec3::select(about, DVec3::ZERO, torque / moments)
    } else {
        (moments + largest).inverse() * torque
    }
}
