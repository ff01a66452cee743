//! Settings of a body that change between steps: what keeps off its surface, how much it rubs, damping and sleep.

use super::Body;
use crate::base::{Result, memory, not_negative};
use crate::def::{BodyContact, BodySettings, Sleep};
use crate::nodes::NodeDamping;
use crate::soa::tile_count;
use crate::solver::close;

impl Body {
    /// What of it can be set, as it was made or set.
    pub fn settings(&self) -> BodySettings {
        let contact = &self.contact;
        BodySettings {
            thickness: contact.thickness,
            friction: contact.friction,
            with_bodies: contact.with_bodies,
            with_itself: contact.with_itself,
            sleep: self
                .sleeper
                .as_ref()
                .map_or(Sleep::default(), |sleeper| sleeper.sleep()),
        }
    }

    /// Has tools and other tissue keep to another contact, which has been checked.
    pub(crate) fn set_contact(&mut self, contact: BodyContact) {
        self.contact = contact;
        self.wake();
        if let Some(contacts) = &mut self.contacts {
            contacts.set_thickness(contact.thickness);
        }
    }

    /// The damping of a node against the world, N s/m.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`](crate::Error::InvalidArgument): there is no such node.
    pub fn node_damping(&self, node: u32) -> Result<f32> {
        self.check_node(&"node", node)?;
        let own = self.order.own(node) as usize;
        let Some(damping) = &self.damping else {
            return Ok(0.0);
        };
        // The rate is that of the mass with what is added to it.
        let mass = match self.inverse_masses[own] {
            0.0 => self.masses[own],
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
        rates.extend(self.masses.iter().map(rate));
        let is_damped = damping > 0.0;
        if let Some(scaling) = &mut self.scaling {
            scaling.set_rates(&rates);
        }
        let mut made = NodeDamping::new(rates)?;
        made.reserve(self.node_room)?;
        // The velocities so far are those of the damping so far.
        close(self);
        self.damping = is_damped.then_some(made);
        let step = self.scaling.as_ref().map_or(0.0, |scaling| scaling.step());
        self.scale_masses(step);
        self.forget_matrix();
        self.wake();
        Ok(())
    }

    /// Has it sleep from the next step on where it is slower than `sleep.speed` for `sleep.time`; a speed of 0: never. All of it wakes.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`](crate::Error::InvalidArgument): a number is out of its range. [`Error::OutOfMemory`](crate::Error::OutOfMemory). Nothing has changed then.
    pub(crate) fn set_sleep(&mut self, sleep: Sleep) -> Result<()> {
        sleep.check()?;
        if sleep.speed == 0.0 {
            self.wake();
            self.sleeper = None;
        } else if let Some(sleeper) = &mut self.sleeper {
            sleeper.set_sleep(sleep);
            self.wake();
        } else {
            let made = self.make_sleeper(sleep).and_then(|()| self.reserve_sleep());
            if made.is_err() {
                self.sleeper = None;
            }
            return made;
        }
        Ok(())
    }

    /// Makes room for the tiles that cuts may add.
    fn reserve_sleep(&mut self) -> Result<()> {
        let tiles = tile_count(self.node_count().max(self.node_room));
        self.sleeper.as_mut().map_or(Ok(()), |sleeper| sleeper.reserve(tiles))
    }
}
