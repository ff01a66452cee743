//! The energy of a body, summed in `f64`.

use glam::Vec3;

use super::Body;
use crate::def::Energy;

impl Energy {
    pub(crate) fn of(body: &Body, gravity: Vec3) -> Self {
        let mut energy = Self::default();
        let (positions, velocities) = (body.system.state.positions(), body.velocities());
        let gravity = body.system.body_acceleration(gravity).as_dvec3();
        for node in 0..body.node_count() {
            let mass = f64::from(body.system.masses[node]);
            let position = positions.get(node).as_dvec3();
            if body.system.inverse_masses[node] > 0.0 {
                let held = body.system.pins.partial_axes_of(node as u32);
                let velocity = Vec3::select(held, Vec3::ZERO, velocities[body.system.caller_index(node)]);
                energy.kinetic += 0.5 * mass * velocity.as_dvec3().length_squared();
            }
            energy.gravitational -= mass * gravity.dot(position + body.system.origin);
        }
        let mut volume_strains = vec![0.0; body.system.forces.ring_count()];
        let position_of = |node: usize| positions.get(node).as_dvec3();
        let [stored, work] = body.system.forces.exact_energy(position_of, &mut volume_strains);
        energy.elastic = stored - work;
        energy
    }
}
