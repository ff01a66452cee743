//! Velocities from before the last half kick of a step: nothing stops that kick in what a body pressed.

use super::System;
use crate::base::Result;
use crate::codec::saved;
use crate::soa::{Vectors, per_node};

/// Velocities from before the last half kick of a step.
#[derive(Debug)]
pub(crate) struct Early {
    pub velocities: Vectors,
    /// Whether callers see these.
    pub is_seen: bool,
}

saved! { Early { velocities, is_seen } }

per_node! { Early { velocities } }

impl System {
    /// Makes room for velocities from before the last half kick of a step.
    pub fn reserve_early(&mut self) -> Result<()> {
        if self.early.is_none() {
            let early = [self.zeros()?, self.zeros()?];
            self.early = Some(early.map(|velocities| Early {
                velocities,
                is_seen: false,
            }));
        }
        Ok(())
    }

    /// Has callers see the velocities that it has now, before the last half kick of the step that is tried, once that is taken.
    pub fn show_early(&mut self) {
        if let Some([_, early]) = &mut self.early
            && !early.is_seen
        {
            early.velocities.copy_from(self.state.newest().1);
            early.is_seen = true;
        }
    }

    /// Has callers see the velocities at the end of the step that is to be tried.
    pub fn show_late(&mut self) {
        if let Some([_, early]) = &mut self.early {
            early.is_seen = false;
        }
    }

    /// The early velocities, where callers see those.
    pub fn early_seen(&self) -> Option<&Vectors> {
        let [early, _] = self.early.as_ref()?;
        early.is_seen.then_some(&early.velocities)
    }

    /// To be called when velocities change.
    pub fn forget_early(&mut self) {
        if let Some([early, _]) = &mut self.early {
            early.is_seen = false;
        }
    }
}
