//! What a step has stretched too far tears when it has ended.

use super::{BodyId, World};
use crate::body::{Body, Torn, Withheld};

impl World {
    /// Tears bodies, one after the other, at the springs that are beyond what they bear. A tear for which there is no room is not made.
    pub(super) fn tear(&mut self) {
        for place in 0..self.bodies.places() {
            if !self.bodies.at_mut(place).is_some_and(Body::begin_tears) {
                continue;
            }
            let id = self.bodies.iter_ids().map(|(id, _)| id).find(|id| id.index() == place);
            let Some(id) = id.map(BodyId) else {
                continue;
            };
            while let Some(spring) = self.bodies.at_mut(place).and_then(Body::next_tear) {
                let why = match self.change_topology(id, |body| body.tear(spring)) {
                    Ok(Torn::Made) => continue,
                    Ok(Torn::Not(why)) => why,
                    Err(_) => Withheld::NoRoom,
                };
                if let Some(body) = self.bodies.at_mut(place) {
                    body.withhold_tear(spring, why);
                }
            }
        }
    }
}
