//! A body without pins moves as a whole as outer forces have it, however well its equation was solved: what is left of the
//! residual is given no sum and no torque. Of one that is held along some axes alone this is so along the others, and about an axis
//! that is at right angles to both of those that are left.

use glam::{BVec3, DMat3, DVec3};

use super::Implicit;
use super::step::Substep;
use crate::base::outer;
use crate::soa::Vectors;
use crate::solver::System;

/// What forces move the nodes in a step, as a part of the size of the body, beyond which it changes much.
const MOST_CHANGE: f64 = 0.1;

impl Implicit {
    /// Adds to the pushes the shift and the turn that take the sum and the torque off the residual of nodes at `positions`, as far as
    /// nothing holds the body along these axes.
    pub(super) fn balance(&mut self, positions: &Vectors, held: BVec3) {
        let of = |vectors: &Vectors, node: usize| vectors.get(node).as_dvec3();
        let (mut mass, mut sum, mut means, mut squares) = (0.0, DVec3::ZERO, [DVec3::ZERO; 2], [0.0; 2]);
        for (node, &inertia) in self.inertia.iter().enumerate() {
            let inertia = f64::from(inertia);
            mass += inertia;
            sum += of(&self.residuals, node);
            for (at, vectors) in [positions, &self.pushes].into_iter().enumerate() {
                means[at] += of(vectors, node) * inertia;
                squares[at] += of(vectors, node).length_squared() * inertia;
            }
        }
        let [centre, push] = means.map(|mean| mean / mass);
        let [size, change] = [0, 1].map(|at| squares[at] / mass - (means[at] / mass).length_squared());
        // The turn moves the nodes on which inertia acts, too. Where the body changes much in the step, that would be no good equation.
        let is_known = change < MOST_CHANGE * MOST_CHANGE * size;
        let (mut torque, mut moments) = (DVec3::ZERO, DMat3::ZERO);
        for (node, &inertia) in self.inertia.iter().enumerate() {
            let arm = of(positions, node) - centre;
            torque += arm.cross(of(&self.residuals, node));
            let aim = if is_known {
                arm - (of(&self.pushes, node) - push)
            } else {
                arm
            };
            moments += moment(aim, arm) * f64::from(inertia);
        }
        let shift = DVec3::select(held, DVec3::ZERO, sum / mass);
        let turn = turn(moments, torque, held);
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

/// A turn about a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Turn {
    centre: DVec3,
    /// rad/s
    rate: DVec3,
}

impl Turn {
    /// Adds it to the velocities of nodes at these positions, and to what they gained.
    pub fn add(&self, positions: [&[f32]; 3], velocities: &mut [&mut [f32]; 3], gains: &mut [&mut [f32]; 3]) {
        for node in 0..positions[0].len() {
            let position = DVec3::from_array(positions.map(|axis| f64::from(axis[node])));
            let more = self.rate.cross(position - self.centre).as_vec3();
            for (axis, more) in more.to_array().into_iter().enumerate() {
                velocities[axis][node] += more;
                gains[axis][node] += more;
            }
        }
    }
}

impl Substep<'_> {
    /// The turn that gives a body that nothing holds the angular momentum which the step's formula takes away.
    ///
    /// With L that about the centre of mass and T the torque from outside, a formula gives `sum x1 x m (v1 - w) = t T`, where it should
    /// give `L1 - L0 - c (L0 - L') = t T`. The first is less by `sum m (s x w + c (1 + c) (x - x') x (v - v'))`.
    pub(super) fn lost_turn(&self, body: &mut System, implicit: &Implicit) -> Option<Turn> {
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
        let (mut mass, mut sums, mut lost) = (0.0, [DVec3::ZERO; 5], DVec3::ZERO);
        for (node, of_node) in free() {
            let [position, push, velocity, way, gain] =
                [positions, &implicit.pushes, velocities, &history.ways, &history.gains]
                    .map(|of| of.get(node).as_dvec3());
            mass += of_node;
            for (sum, of) in sums.iter_mut().zip([position, push, velocity, way, gain]) {
                *sum += of * of_node;
            }
            lost += (push.cross(velocity) + way.cross(gain) * carried) * of_node;
        }
        let [centre, push, velocity, way, gain] = sums.map(|sum| sum / mass);
        lost -= (push.cross(velocity) + way.cross(gain) * carried) * mass;
        let moments = moments(free().map(|(node, mass)| (mass, positions.get(node).as_dvec3() - centre)));
        let rate = turn(moments, -lost, held);
        rate.is_finite().then_some(Turn { centre, rate })
    }
}

/// The moments of inertia of masses at the ends of these arms.
fn moments(nodes: impl Iterator<Item = (f64, DVec3)>) -> DMat3 {
    let mut moments = DMat3::ZERO;
    for (mass, arm) in nodes {
        moments += moment(arm, arm) * mass;
    }
    moments
}

/// The matrix that takes `w` to `a x (w x b)`.
fn moment(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_diagonal(DVec3::splat(a.dot(b))) - outer(b, a)
}

/// How a body with these moments turns by this torque or angular momentum, about what axes these that are held leave it.
fn turn(moments: DMat3, torque: DVec3, held: BVec3) -> DVec3 {
    // A body without extent across its axis does not turn about it.
    let largest = moments.x_axis.x.max(moments.y_axis.y).max(moments.z_axis.z);
    let largest = DMat3::from_diagonal(DVec3::splat(1e-9 * largest));
    if held.any() {
        // A turn about one axis moves nodes along both others.
        let about = BVec3::new(held.y | held.z, held.z | held.x, held.x | held.y);
        let moments = DVec3::new(moments.x_axis.x, moments.y_axis.y, moments.z_axis.z);
        DVec3::select(about, DVec3::ZERO, torque / moments)
    } else {
        (moments + largest).inverse() * torque
    }
}
