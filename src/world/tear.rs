//! Tearing of overstretched tissue at the end of a step.

use super::World;
use crate::base::{BodyId, Result};
use crate::body::{Body, TearOutcome};
use crate::def::TearRefusal;

impl World {
    /// Tears bodies, one after the other, at the springs whose limits the step has exceeded. A tear without room is
    /// skipped.
    pub(super) fn tear(&mut self) {
        for slot in 0..self.bodies.slot_count() {
            while let Some(spring) = self.bodies.at_mut(slot).and_then(Body::next_tear) {
                let why = match self.tear_body(slot, spring) {
                    Ok(TearOutcome::Made) => continue,
                    Ok(TearOutcome::Refused(why)) => why,
                    Err(_) => TearRefusal::NoRoom,
                };
                if let Some(body) = self.bodies.at_mut(slot) {
                    body.refuse_tear(spring, why);
                }
            }
            if let Some(body) = self.bodies.at_mut(slot) {
                body.publish_topology();
            }
        }
    }

    fn tear_body(&mut self, slot: usize, spring: [u32; 2]) -> Result<TearOutcome> {
        let mut ids = self.bodies.iter_ids().map(|(id, _)| id);
        let id = ids.find(|id| id.index() == slot);
        drop(ids);
        match id {
            Some(id) => self.change_topology(BodyId(id), |body, skin| body.tear(spring, skin)),
            None => Ok(TearOutcome::Refused(TearRefusal::NoPath)),
        }
    }
}
