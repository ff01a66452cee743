//! The bits of a body that its next step depends on.

use super::Body;
use crate::base::StateHasher;

impl Body {
    pub(crate) fn hash_state(&self, hasher: &mut StateHasher) {
        hasher.write_u64(self.node_count() as u64);
        for value in self.origin.to_array() {
            hasher.write_u64(value.to_bits());
        }
        let mut vectors = vec![self.state.positions(), self.state.velocities()];
        vectors.extend(self.state.remainders());
        // Without damping the forces follow from the positions.
        if self.springs.damped() && self.forces_current {
            vectors.push(self.state.forces());
        }
        hasher.write_u64(u64::from(self.forces_applied));
        if self.forces_applied {
            vectors.extend(&self.applied);
        }
        for vectors in vectors {
            for vector in vectors.iter() {
                hasher.write_floats(&vector.to_array());
            }
        }
        hasher.write_floats(&[self.gravity_scale]);
        hasher.write_floats(&self.masses);
        hasher.write_floats(&self.inverse_masses);
        if let Some(damping) = &self.damping {
            hasher.write_floats(damping.rates());
        }
        hasher.write_u64(self.surface.len() as u64);
        for &[a, b, c] in &self.surface {
            hasher.write_u64(u64::from(a) << 32 | u64::from(b));
            hasher.write_u64(u64::from(c));
        }
        for node in 0..self.node_count() {
            self.springs.visit(node, &mut |link| {
                hasher.write_u64(u64::from(link.neighbour));
                hasher.write_floats(&[link.stiffness, link.rest_length, link.damping]);
            });
        }
        if let Some(elements) = &self.elements {
            elements.hash(hasher);
        }
        if let Some(terms) = &self.terms {
            terms.hash(hasher);
        }
        if let Some(enclosed) = &self.enclosed {
            enclosed.hash(hasher);
        }
        for pin in self.pins.iter() {
            let led = u64::from(pin.target.is_some());
            hasher.write_u64(u64::from(pin.node) << 4 | u64::from(pin.axes.bitmask()) << 1 | led);
            if let Some(target) = pin.target {
                hasher.write_floats(&target.to_array());
            }
        }
        if let Some(cuttable) = &self.cuttable {
            hasher.write_floats(&[cuttable.toughness]);
            cuttable.stroke.hash(hasher);
            cuttable.material.hash(hasher);
        }
        if let Some(bindings) = &self.bindings {
            bindings.hash(hasher);
        }
        if let Some(tears) = &self.tears {
            tears.bearing.hash(hasher);
        }
        if let Some(grasps) = &self.grasps {
            grasps.hash(hasher);
        }
        hasher.write_floats(&self.carry.stability.floats());
        if self.carry.stability.limit().is_some() {
            self.watched.floats().for_each(|limit| hasher.write_floats(&[limit]));
        }
        if let Some(closing) = &self.carry.closing {
            hasher.write_floats(&[closing.substep]);
            hasher.write_floats(&closing.gravity.to_array());
        }
        hasher.write_floats(&[self.carry.masses_for]);
        self.carry.energy.hash(hasher);
        self.carry.pace.hash(hasher);
        for sliver in self.scaling.iter().flat_map(|scaling| scaling.slivers()) {
            hasher.write_u64(u64::from(sliver.node));
        }
        if let Some(implicit) = &self.implicit {
            implicit.hash(hasher);
        }
        if let Some(sleeper) = &self.sleeper {
            sleeper.hash(hasher);
        }
        self.contact.hash(hasher);
        if let Some(contacts) = &self.contacts {
            contacts.holds.hash(hasher);
        }
        for bits in self.carry.gravity.bits() {
            hasher.write_u64(bits);
        }
    }
}
