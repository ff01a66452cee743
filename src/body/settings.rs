//! Settings of a body that change between steps: what keeps off its surface, how much it rubs, damping and sleep.

use super::Body;
use crate::base::{Result, memory, not_negative};
use crate::def::{BodyContact, BodySettings, Sleep};
use crate::nodes::NodeDamping;
use crate::soa::{PerNode, tile_count, tile_nodes};
use crate::solver::{Changed, close};

impl Body {
    /// What of it can be set, as it was made or set.
    pub fn settings(&self) -> BodySettings {
        let sleeper = self.system.sleeper.as_ref();
        let contact = &self.system.contact;
        BodySettings {
            thickness: contact.thickness,
            friction: contact.friction,
            with_bodies: contact.with_bodies,
            with_itself: contact.with_itself,
            sleep: sleeper.map_or(Sleep::default(), |sleeper| sleeper.sleep()),
        }
    }

    /// Has tools and other tissue keep to another contact, which has been checked.
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
        // The rate is that of the mass with what is added to it.
        let mass = match self.system.inverse_masses[own] {
            0.0 => self.system.masses[own],
            inverse_mass => 1.0 / inverse_mass,
        };
        Ok(damping.rates()[own] * mass)
    }

    /// Damps every node against the world by this much from the next step on, N s/m; 0: not at all. Velocities stay.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`](crate::Error::InvalidArgument): it is out of its range. [`Error::OutOfMemory`](crate::Error::OutOfMemory). Nothing has changed then.
    pub fn set_node_damping(&mut self, damping: f32) -> Result<()> {
        not_negative("node_damping", damping)?;
        let mut rates = memory::reserved(self.node_count())?;
        let rate = |&mass: &f32| if mass > 0.0 { damping / mass } else { 0.0 };
        rates.extend(self.system.masses.iter().map(rate));
        let is_damped = damping > 0.0;
        if let Some(scaling) = &mut self.system.scaling {
            scaling.set_rates(&rates);
        }
        let mut made = NodeDamping::new(rates)?;
        made.reserve_nodes(self.system.node_room)?;
        // The velocities so far are those of the damping so far.
        close(&mut self.system);
        self.system.damping = is_damped.then_some(made);
        let step = self.system.scaling.as_ref().map_or(0.0, |scaling| scaling.step());
        self.system.scale_masses(step);
        self.system.changed(Changed::Damping);
        Ok(())
    }

    /// Has it sleep from the next step on where it is slower than `sleep.speed` for `sleep.time`; a speed of 0: never. All of it wakes.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`](crate::Error::InvalidArgument): a number is out of its range. [`Error::OutOfMemory`](crate::Error::OutOfMemory). Nothing has changed then.
    pub(crate) fn set_sleep(&mut self, sleep: Sleep) -> Result<()> {
        sleep.check()?;
        if sleep.speed == 0.0 {
            self.system.wake();
            self.system.sleeper = None;
        } else if let Some(sleeper) = &mut self.system.sleeper {
            sleeper.set_sleep(sleep);
            self.system.wake();
        } else {
            return self.system.make_sleeper(sleep);
        }
        Ok(())
    }

    /// What part of its nodes is awake, 0 to 1: stepped. 1 for bodies that never sleep.
    pub fn awake_share(&self) -> f32 {
        let Some(sleeper) = &self.system.sleeper else {
            return 1.0;
        };
        let count = self.node_count();
        let asleep = (0..tile_count(count)).filter(|&tile| sleeper.is_asleep(tile));
        let asleep: usize = asleep.map(|tile| tile_nodes(tile, count).len()).sum();
        1.0 - asleep as f32 / count as f32
    }

    /// Has all of it be stepped again, until it has been at rest for as long as it takes.
    pub fn wake(&mut self) {
        self.system.wake();
    }
}
