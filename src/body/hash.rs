//! The bits of a body that its next step depends on.

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
            let led = u64::from(pin.target.is_some());
            hasher.write_u64(u64::from(pin.node) << 4 | u64::from(pin.axes.bitmask()) << 1 | led);
            if let Some(target) = pin.target {
                hasher.write_floats(&target.to_array());
            }
        }
        if let Some(cuttable) = &self.cuttable {
            hasher.write_floats(self.toughness().as_slice());
            cuttable.stroke.hash(hasher);
            cuttable.material.hash(hasher);
        }
        if let Some(bindings) = &system.bindings {
            bindings.hash(hasher);
        }
        if let Some(tears) = &self.tears {
            tears.bearing.hash(hasher);
        }
        if let Some(grasps) = &system.grasps {
            grasps.hash(hasher);
        }
        hasher.write_floats(&system.carry.stability.floats());
        if system.carry.stability.limit().is_some() {
            self.system
                .watched
                .floats()
                .for_each(|limit| hasher.write_floats(&[limit]));
        }
        if let Some(closing) = &system.carry.closing {
            hasher.write_floats(&[closing.substep]);
            hasher.write_floats(&closing.gravity.to_array());
        }
        hasher.write_floats(&[system.carry.masses_for]);
        system.carry.energy.hash(hasher);
        system.carry.pace.hash(hasher);
        for sliver in system.scaling.iter().flat_map(|scaling| scaling.slivers()) {
            hasher.write_u64(u64::from(sliver.node));
        }
        system.integrator.hash(hasher);
        if let Some(sleeper) = &system.sleeper {
            sleeper.hash(hasher);
        }
        system.contact.hash(hasher);
        if let Some(contacts) = &system.contacts {
            contacts.holds.hash(hasher);
        }
        for bits in system.carry.gravity.bits() {
            hasher.write_u64(bits);
        }
    }
}
