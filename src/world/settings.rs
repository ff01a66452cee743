//! Settings of a world and of its bodies that change between steps.

use super::World;
use crate::base::{BodyId, Error, Result, ensure, memory};
use crate::def::{BodyContact, BodySettings};
use crate::soa::PerNode;
use crate::solver::CoarseStep;

impl World {
    /// The substeps of a step, 0: as many as stability needs, and how many are allowed then.
    pub fn substeps(&self) -> [u32; 2] {
        [self.definition.substeps, self.definition.max_substeps]
    }

    /// Takes steps in so many substeps from the next on, 0: as many as stability needs, up to `max_substeps`.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: `max_substeps` is 0. [`Error::OutOfMemory`]. Nothing has changed then.
    pub fn set_substeps(&mut self, substeps: u32, max_substeps: u32) -> Result<()> {
        ensure!(max_substeps != 0, "max_substeps is 0: must be at least 1");
        if self.definition.tolerance > 0.0 && substeps == 0 {
            // What a tolerance compares is kept from now on.
            let bodies = || self.bodies.iter().filter(|(_, body)| body.system().coarse.is_none());
            let mut made = memory::reserved(bodies().count())?;
            for (place, body) in bodies() {
                let mut coarse = CoarseStep::new(body.node_count())?;
                coarse.reserve_nodes(body.node_count() + body.system().spare_nodes())?;
                made.push((place, coarse));
            }
            for (place, coarse) in made {
                if let Some(body) = self.bodies.at_mut(place) {
                    body.system_mut().coarse = Some(coarse);
                }
            }
        }
        (self.definition.substeps, self.definition.max_substeps) = (substeps, max_substeps);
        Ok(())
    }

    /// Gives a body other settings from the next step on. What is nearer than a new thickness is pushed off; what passes through other
    /// tissue that it is to meet counts as crossings, and is led out where that is closed. What sleeps wakes.
    ///
    /// # Errors
    /// [`Error::StaleId`]. [`Error::InvalidArgument`]: a number is out of its range. [`Error::Unsupported`]: the body was cut, and what it is
    /// to meet changes, other than to nothing. [`Error::OutOfMemory`]. Nothing has changed then.
    pub fn set_body_settings(&mut self, body: BodyId, settings: BodySettings) -> Result<()> {
        let it = self.bodies.get(body.0)?;
        let before = it.system().contact;
        let contact = BodyContact {
            thickness: settings.thickness,
            friction: settings.friction,
            ..before
        };
        contact.check()?;
        settings.sleep.check()?;
        let sleeps = it.settings().sleep;
        self.set_meets(body, settings.with_bodies, settings.with_itself)?;
        if sleeps != settings.sleep
            && let Err(error) = self.bodies.get_mut(body.0)?.set_sleep(settings.sleep)
        {
            self.set_meets(body, before.with_bodies, before.with_itself)?;
            return Err(error);
        }
        let it = self.bodies.get_mut(body.0)?;
        if (contact.thickness, contact.friction) != (before.thickness, before.friction) {
            it.set_contact(BodyContact {
                thickness: contact.thickness,
                friction: contact.friction,
                ..it.system().contact
            });
        }
        Ok(())
    }

    /// Has a body meet other bodies that want it too, or itself, or no longer.
    fn set_meets(&mut self, body: BodyId, with_bodies: bool, with_itself: bool) -> Result<()> {
        let place = self.bodies.place(body.0)?;
        let it = self.bodies.get_mut(body.0)?;
        let before = it.system().contact;
        if (before.with_bodies, before.with_itself) == (with_bodies, with_itself) {
            return Ok(());
        }
        // A surface that is taken anew would not know which sides were parted.
        ensure!(
            !(with_bodies || with_itself) || it.topology_version() == 0,
            Error::Unsupported(
                "meets_bodies and meets_itself of a body that was cut or torn can only both become 0".into(),
            )
        );
        it.system_mut().contact = BodyContact {
            with_bodies,
            with_itself,
            ..before
        };
        it.wake();
        if let Some(tissue) = self.tissue.as_mut().filter(|_| !it.system().meets_tissue()) {
            tissue.shed(place);
        }
        let joined = self.join_tissue(body.0);
        if joined.is_err() {
            self.bodies.get_mut(body.0)?.system_mut().contact = before;
        }
        joined
    }
}
