//! Frames for readers on other threads.

use super::Body;
use crate::base::{Result, memory};
use crate::readers::{BodyReader, Clock, Shown, View};
use crate::threads::Team;

impl Body {
    pub(crate) fn create_reader(&mut self, clock: Clock) -> Result<BodyReader> {
        let room = self.system.node_capacity.max(self.node_count());
        let mut frames = match self.frames.take() {
            Some(frames) => frames,
            None => memory::boxed(Shown::new(room, &self.system.surface)?)?,
        };
        frames.clock = clock;
        let reader = frames.create_reader(room, self.frame_view());
        self.frames = Some(frames);
        reader
    }

    /// Sets the clock for the next frames.
    pub(crate) fn set_clock(&mut self, clock: Clock) {
        if let Some(frames) = &mut self.frames {
            frames.clock = clock;
        }
    }

    /// Publishes the current positions to readers.
    pub(super) fn publish_frame(&mut self, team: &Team) {
        if let Some(mut frames) = self.frames.take() {
            frames.show(self.frame_view(), team);
            self.frames = Some(frames);
        }
    }

    /// Publishes to readers if the topology has changed since the last frame.
    pub(crate) fn publish_topology(&mut self) {
        let version = self.topology_version();
        if self
            .frames
            .as_ref()
            .is_some_and(|frames| frames.topology_version() != version)
        {
            self.publish_frame(&Team::alone());
        }
    }

    fn frame_view(&self) -> View<'_> {
        View {
            positions: self.readback.positions(),
            triangles: &self.system.surface,
            topology_version: self.topology_version(),
        }
    }
}
