//! Settings of a body that can change between steps: contact, damping and sleep.

use super::Body;
use crate::base::{Result, memory, not_negative};
use crate::def::{BodyContact, BodySettings, Sleep};
use crate::nodes::NodeDamping;
use crate::soa::{PerNode, tile_count, tile_nodes};
use crate::solver::{Changed, flush_half_kick};

impl Body {
    /// The settings, as they were at creation or set later.
    pub fn settings(&self) -> BodySettings {
        let sleep_state = self.system.sleep_state.as_ref();
        let contact = &self.system.contact;
        BodySettings {
            thickness: contact.thickness,
            friction: contact.friction,
            with_bodies: contact.with_bodies,
            with_itself: contact.with_itself,
            sleep: sleep_state.map_or(Sleep::default(), |sleep_state| sleep_state.sleep()),
        }
    }

    /// Sets the contact parameters, which have been checked, for tools and other tissue.
    pub(crate) fn set_contact(&mut self, contact: BodyContact) {
        self.system.contact = contact;
        self.system.wake();
        if let Some(contacts) = &mut self.system.contacts {
            contacts.set_thickness(contact.thickness);
        }
    }

    /// The damping of a node against the world, N s/m.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`](crate::Error::InvalidArgument): there is no such node.
    pub fn node_damping(&self, node: u32) -> Result<f32> {
        self.check_node(&"node", node)?;
        let own = self.system.order.own(node) as usize;
        let Some(damping) = &self.system.damping else {
            return Ok(0.0);
        };
        // The rate includes added mass.
        let mass = match self.system.inverse_masses[own] {
            0.0 => self.system.masses[own],
            inverse_mass => 1.0 / inverse_mass,
        };
        Ok(damping.rates()[own] * mass)
    }

    /// Sets the damping of every node against the world from the next step on, N s/m. 0 means none. Velocities stay.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`](crate::Error::InvalidArgument): the damping is out of its range.
    /// [`Error::OutOfMemory`](crate::Error::OutOfMemory). An error changes nothing.
    pub fn set_node_damping(&mut self, damping: f32) -> Result<()> {
        not_negative("node_damping", damping)?;
        let mut rates = memory::reserved(self.node_count())?;
        let rate = |&mass: &f32| if mass > 0.0 { damping / mass } else { 0.0 };
        rates.extend(self.system.masses.iter().map(rate));
        let is_damped = damping > 0.0;
        if let Some(scaling) = &mut self.system.scaling {
            scaling.set_rates(&rates);
        }
        let mut node_damping = NodeDamping::new(rates)?;
        node_damping.reserve_nodes(self.system.node_capacity)?;
        // The previous velocities need the previous damping.
        flush_half_kick(&mut self.system);
        self.system.damping = is_damped.then_some(node_damping);
        let step = self.system.scaling.as_ref().map_or(0.0, |scaling| scaling.step());
        self.system.scale_masses(step);
        self.system.changed(Changed::Damping);
        Ok(())
    }

    /// Sets the sleep parameters from the next step on. Tissue falls asleep after `sleep.time` below `sleep.speed`. A
    /// speed of 0 disables sleep. The whole body wakes.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`](crate::Error::InvalidArgument): a number is out of its range.
    /// [`Error::OutOfMemory`](crate::Error::OutOfMemory). An error changes nothing.
    pub(crate) fn set_sleep(&mut self, sleep: Sleep) -> Result<()> {
        sleep.check()?;
        if sleep.speed == 0.0 {
            self.system.wake();
            self.system.sleep_state = None;
        } else if let Some(sleep_state) = &mut self.system.sleep_state {
            sleep_state.set_sleep(sleep);
            self.system.wake();
        } else {
            return self.system.enable_sleep(sleep);
        }
        Ok(())
    }

    /// The fraction of nodes that are awake, 0 to 1. It is 1 for bodies that never sleep.
    pub fn awake_share(&self) -> f32 {
        let Some(sleep_state) = &self.system.sleep_state else {
            return 1.0;
        };
        let count = self.node_count();
        let asleep = (0..tile_count(count)).filter(|&tile| sleep_state.is_asleep(tile));
        let asleep: usize = asleep.map(|tile| tile_nodes(tile, count).len()).sum();
        1.0 - asleep as f32 / count as f32
    }

    /// Wakes the whole body. It can fall asleep again after the usual time at rest.
    pub fn wake(&mut self) {
        self.system.wake();
    }
}
