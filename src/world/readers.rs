//! Readers of bodies.

use super::World;
use crate::base::{BodyId, Result};
use crate::readers::BodyReader;

impl World {
    /// Makes a reader of a body, for a thread that reads it while the world steps: any number of threads, each with a reader of its own. No more
    /// than 126 of one body live at a time.
    ///
    /// Each step that moves the body shows it to its readers when it has been taken, and so does what moves or cuts it between steps, at once. A step that
    /// is refused is never seen, nor one that is not complete. A body that has no readers takes no time or memory for them; one that has keeps two
    /// copies of its positions more than it has readers, writes one of them each step, and copies its triangles when cuts or tears have changed them.
    ///
    /// # Errors
    /// [`Error::StaleId`](crate::Error::StaleId). [`Error::Capacity`](crate::Error::Capacity): the body has 126 readers.
    /// [`Error::OutOfMemory`](crate::Error::OutOfMemory).
    pub fn create_reader(&mut self, body: BodyId) -> Result<BodyReader> {
        let clock = self.clock;
        self.bodies.get_mut(body.0)?.create_reader(clock)
    }
}
