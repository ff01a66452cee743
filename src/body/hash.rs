//! The hash of all state of a body that its next step depends on.

use super::Body;
use crate::base::StateHasher;

impl Body {
    pub(crate) fn hash_state(&self, hasher: &mut StateHasher) {
        let system = &self.system;
        hasher.write_u64(self.node_count() as u64);
        hasher.write_doubles(&system.origin.to_array());
        let mut vectors = vec![system.state.positions(), system.state.velocities()];
        vectors.extend(system.state.remainders());
        // Without damping the forces follow from the positions.
        if system.forces.springs.damped() && system.forces_current {
            vectors.push(system.state.forces());
        }
        hasher.write_u64(u64::from(system.forces_applied));
        if system.forces_applied {
            vectors.extend(&system.applied);
        }
        for vectors in vectors {
            hasher.write_vectors(vectors.iter());
        }
        hasher.write_floats(&[system.gravity_scale]);
        hasher.write_floats(&system.acceleration.to_array());
        hasher.write_floats(&system.masses);
        hasher.write_floats(&system.inverse_masses);
        if let Some(damping) = &system.damping {
            hasher.write_floats(damping.rates());
        }
        hasher.write_u64(system.surface.len() as u64);
        for &[a, b, c] in &system.surface {
            hasher.write_u64(u64::from(a) << 32 | u64::from(b));
            hasher.write_u64(u64::from(c));
        }
        system.forces.hash(hasher);
        for pin in system.pins.iter() {
            let has_target = u64::from(pin.target.is_some());
            hasher.write_u64(u64::from(pin.node) << 4 | u64::from(pin.axes.bitmask()) << 1 | has_target);
            if let Some(target) = pin.target {
                hasher.write_floats(&target.to_array());
            }
        }
        if let Some(cut_state) = &self.cut_state {
            hasher.write_floats(self.toughness().as_slice());
            cut_state.stroke.hash(hasher);
            cut_state.material.hash(hasher);
        }
        if let Some(bindings) = &system.bindings {
            bindings.hash(hasher);
        }
        if let Some(tear_queue) = &self.tear_queue {
            tear_queue.strength.hash(hasher);
        }
        if let Some(tool_attachments) = &system.tool_attachments {
            tool_attachments.hash(hasher);
        }
        hasher.write_floats(&system.carry.stability.floats());
        if system.carry.stability.limit().is_some() {
            self.system
                .critical_nodes
                .floats()
                .for_each(|limit| hasher.write_floats(&[limit]));
        }
        if let Some(closing) = &system.carry.deferred_kick {
            hasher.write_floats(&[closing.substep]);
            hasher.write_floats(&closing.gravity.to_array());
        }
        hasher.write_floats(&[system.carry.scaling_substep]);
        system.carry.energy.hash(hasher);
        system.carry.substep_history.hash(hasher);
        for sliver in system.scaling.iter().flat_map(|scaling| scaling.candidates()) {
            hasher.write_u64(u64::from(sliver.node));
        }
        system.integrator.hash(hasher);
        if let Some(sleep_state) = &system.sleep_state {
            sleep_state.hash(hasher);
        }
        system.contact.hash(hasher);
        if let Some(contacts) = &system.contacts {
            contacts.multipliers.hash(hasher);
        }
        for bits in system.carry.gravity.bits() {
            hasher.write_u64(bits);
        }
    }
}
