//! Velocities before the last half kick of a step. No contact impulse of tissue that the body presses counteracts that
//! kick.

use super::System;
use crate::base::Result;
use crate::codec::saved;
use crate::soa::{Vectors, per_node};

/// Velocities before the last half kick of a step.
#[derive(Debug)]
pub(crate) struct PreKickVelocities {
    pub velocities: Vectors,
    /// True if the caller reads these velocities.
    pub is_visible: bool,
}

saved! { PreKickVelocities { velocities, is_visible } }

per_node! { PreKickVelocities { velocities } }

impl System {
    /// Reserves the buffers.
    pub fn reserve_pre_kick_velocities(&mut self) -> Result<()> {
        if self.pre_kick_velocities.is_none() {
            let buffer = [self.zeros()?, self.zeros()?];
            self.pre_kick_velocities = Some(buffer.map(|velocities| PreKickVelocities {
                velocities,
                is_visible: false,
            }));
        }
        Ok(())
    }

    /// Lets the caller read the present velocities, before the last half kick of the attempted step, once the step is
    /// committed.
    pub fn publish_pre_kick_velocities(&mut self) {
        if let Some([_, buffer]) = &mut self.pre_kick_velocities
            && !buffer.is_visible
        {
            buffer.velocities.copy_from(self.state.newest().1);
            buffer.is_visible = true;
        }
    }

    /// Lets the caller read the velocities at the end of the step that is about to be attempted.
    pub fn retract_pre_kick_velocities(&mut self) {
        if let Some([_, buffer]) = &mut self.pre_kick_velocities {
            buffer.is_visible = false;
        }
    }

    /// The velocities before the last half kick, if the caller reads those.
    pub fn visible_pre_kick_velocities(&self) -> Option<&Vectors> {
        let [buffer, _] = self.pre_kick_velocities.as_ref()?;
        buffer.is_visible.then_some(&buffer.velocities)
    }

    /// Call this when velocities change.
    pub fn hide_pre_kick_velocities(&mut self) {
        if let Some([buffer, _]) = &mut self.pre_kick_velocities {
            buffer.is_visible = false;
        }
    }
}
