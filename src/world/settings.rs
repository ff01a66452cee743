//! Settings of a world and of its bodies that change between steps.

use super::World;
use crate::base::{BodyId, Error, Result, ensure, memory};
use crate::def::{BodyContact, BodySettings};
use crate::soa::PerNode;
use crate::solver::CoarseStep;

impl World {
    /// The number of substeps per step, 0 for as many as stability needs, and the largest number then allowed.
    pub fn substeps(&self) -> [u32; 2] {
        [self.definition.substeps, self.definition.max_substeps]
    }

    /// Sets the number of substeps per step, from the next step on. With 0 a step takes as many as stability needs, up
    /// to `max_substeps`.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: `max_substeps` is 0. [`Error::OutOfMemory`]. After an error nothing has changed.
    pub fn set_substeps(&mut self, substeps: u32, max_substeps: u32) -> Result<()> {
        ensure!(max_substeps != 0, "max_substeps is 0: must be at least 1");
        if self.definition.tolerance > 0.0 && substeps == 0 {
            // A tolerance compares with a coarse step, which needs its own state.
            let bodies = || self.bodies.iter().filter(|(_, body)| body.system().coarse.is_none());
            let mut made = memory::reserved(bodies().count())?;
            for (slot, body) in bodies() {
                let mut coarse = CoarseStep::new(body.node_count())?;
                coarse.reserve_nodes(body.node_count() + body.system().spare_nodes())?;
                made.push((slot, coarse));
            }
            for (slot, coarse) in made {
                if let Some(body) = self.bodies.at_mut(slot) {
                    body.system_mut().coarse = Some(coarse);
                }
            }
        }
        (self.definition.substeps, self.definition.max_substeps) = (substeps, max_substeps);
        Ok(())
    }

    /// Changes the settings of a body, from the next step on, and wakes it. Surfaces closer than a new thickness are
    /// pushed apart. Parts that interpenetrate bodies with which the body now collides count as crossings, and are
    /// pushed out of closed bodies.
    ///
    /// # Errors
    /// [`Error::StaleId`]. [`Error::InvalidArgument`]: a number is out of range. [`Error::Unsupported`]: the body was
    /// cut, and its collision flags change without both becoming 0. [`Error::OutOfMemory`]. After an error nothing has
    /// changed.
    pub fn set_body_settings(&mut self, body: BodyId, settings: BodySettings) -> Result<()> {
        let content = self.bodies.get(body.0)?;
        let before = content.system().contact;
        let contact = BodyContact {
            thickness: settings.thickness,
            friction: settings.friction,
            ..before
        };
        contact.check()?;
        settings.sleep.check()?;
        let sleep_before = content.settings().sleep;
        self.set_collisions(body, settings.with_bodies, settings.with_itself)?;
        if sleep_before != settings.sleep
            && let Err(error) = self.bodies.get_mut(body.0)?.set_sleep(settings.sleep)
        {
            self.set_collisions(body, before.with_bodies, before.with_itself)?;
            return Err(error);
        }
        let content = self.bodies.get_mut(body.0)?;
        if (contact.thickness, contact.friction) != (before.thickness, before.friction) {
            content.set_contact(BodyContact {
                thickness: contact.thickness,
                friction: contact.friction,
                ..content.system().contact
            });
        }
        Ok(())
    }

    /// Sets whether a body collides with other bodies, and with itself.
    fn set_collisions(&mut self, body: BodyId, with_bodies: bool, with_itself: bool) -> Result<()> {
        let slot = self.bodies.slot(body.0)?;
        let content = self.bodies.get_mut(body.0)?;
        let before = content.system().contact;
        if (before.with_bodies, before.with_itself) == (with_bodies, with_itself) {
            return Ok(());
        }
        // A new collision surface would not know which sides a cut has separated.
        ensure!(
            !(with_bodies || with_itself) || content.topology_version() == 0,
            Error::Unsupported(
                "meets_bodies and meets_itself of a body that was cut or torn can only both become 0".into(),
            )
        );
        content.system_mut().contact = BodyContact {
            with_bodies,
            with_itself,
            ..before
        };
        content.wake();
        if let Some(deformable_contact) = self
            .deformable_contact
            .as_mut()
            .filter(|_| !content.system().collides_with_tissue())
        {
            deformable_contact.remove_surface(slot);
        }
        let joined = self.join_tissue(body.0);
        if joined.is_err() {
            self.bodies.get_mut(body.0)?.system_mut().contact = before;
        }
        joined
    }
}
