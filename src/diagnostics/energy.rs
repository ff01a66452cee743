//! The energy of a body, added up in `f64`.

use glam::Vec3;

use crate::body::Body;

/// Energy in joules, at the time of the positions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Energy {
    /// Of the nodes that are free to move.
    pub kinetic: f64,
    /// Of the springs.
    pub elastic: f64,
    /// Of all nodes, zero at the origin.
    pub gravitational: f64,
}

impl Energy {
    pub(crate) fn of(body: &Body, gravity: Vec3) -> Self {
        let mut energy = Self::default();
        let (positions, velocities) = (body.state.positions(), body.velocities());
        let gravity = gravity.as_dvec3();
        for node in 0..body.node_count() {
            let mass = f64::from(body.masses[node]);
            let position = positions.get(node).as_dvec3();
            if body.inverse_masses[node] > 0.0 {
                energy.kinetic += 0.5 * mass * velocities[body.callers(node)].as_dvec3().length_squared();
            }
            energy.gravitational -= mass * gravity.dot(position + body.origin);
            body.springs.visit(node, &mut |link| {
                let neighbour = link.neighbour as usize;
                // Each spring is met at both of its nodes.
                if neighbour > node {
                    let length = position.distance(positions.get(neighbour).as_dvec3());
                    let stretch = length - f64::from(link.rest_length);
                    energy.elastic += 0.5 * f64::from(link.stiffness) * stretch * stretch;
                }
            });
        }
        energy
    }
}
