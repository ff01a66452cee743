//! What a step has stretched too far tears when it has ended.

use super::World;
use crate::base::{BodyId, Result};
use crate::body::{Body, Torn};
use crate::def::Withheld;

impl World {
    /// Tears bodies, one after the other, at the springs that the step has left beyond what they bear. A tear for which there is no room is
    /// not made.
    pub(super) fn tear(&mut self) {
        for place in 0..self.bodies.places() {
            while let Some(spring) = self.bodies.at_mut(place).and_then(Body::next_tear) {
                let why = match self.tear_body(place, spring) {
                    Ok(Torn::Made) => continue,
                    Ok(Torn::Not(why)) => why,
                    Err(_) => Withheld::NoRoom,
                };
                if let Some(body) = self.bodies.at_mut(place) {
                    body.withhold_tear(spring, why);
                }
            }
            if let Some(body) = self.bodies.at_mut(place) {
                body.show_topology();
            }
        }
    }

    fn tear_body(&mut self, place: usize, spring: [u32; 2]) -> Result<Torn> {
        let mut ids = self.bodies.iter_ids().map(|(id, _)| id);
        let id = ids.find(|id| id.index() == place);
        drop(ids);
        match id {
            Some(id) => self.change_topology(BodyId(id), |body, skin| body.tear(spring, skin)),
            None => Ok(Torn::Not(Withheld::NoWay)),
        }
    }
}
