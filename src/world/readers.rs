//! Readers of bodies.

use super::World;
use crate::base::{BodyId, Result};
use crate::readers::BodyReader;

impl World {
    /// Creates a reader of a body, for a thread that reads the body while the world steps. Each thread needs its own
    /// reader. A body has at most 126 readers.
    ///
    /// Readers see a body after each completed step, and immediately after a call that moves or cuts it. They never see
    /// a refused or incomplete step. A body without readers uses no time or memory for them. With readers a body keeps
    /// two more copies of its positions than it has readers. Each step writes one copy; the triangles are copied after
    /// cuts and tears.
    ///
    /// # Errors
    /// [`Error::StaleId`](crate::Error::StaleId). [`Error::Capacity`](crate::Error::Capacity): the body has 126
    /// readers. [`Error::OutOfMemory`](crate::Error::OutOfMemory).
    pub fn create_reader(&mut self, body: BodyId) -> Result<BodyReader> {
        let clock = self.clock;
        self.bodies.get_mut(body.0)?.create_reader(clock)
    }
}
