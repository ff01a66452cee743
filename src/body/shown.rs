//! What readers on other threads see.

use super::Body;
use crate::base::{Result, memory};
use crate::readers::{BodyReader, Clock, Shown, View};
use crate::threads::Team;

impl Body {
    pub(crate) fn create_reader(&mut self, clock: Clock) -> Result<BodyReader> {
        let room = self.system.node_room.max(self.node_count());
        let mut shown = match self.shown.take() {
            Some(shown) => shown,
            None => memory::boxed(Shown::new(room, &self.system.surface)?)?,
        };
        shown.clock = clock;
        let reader = shown.create_reader(room, self.view());
        self.shown = Some(shown);
        reader
    }

    /// How far the world has come, for what is shown from now on.
    pub(crate) fn set_clock(&mut self, clock: Clock) {
        if let Some(shown) = &mut self.shown {
            shown.clock = clock;
        }
    }

    /// Shows readers the published positions.
    pub(super) fn show(&mut self, team: &Team) {
        if let Some(mut shown) = self.shown.take() {
            shown.show(self.view(), team);
            self.shown = Some(shown);
        }
    }

    /// The same where its topology is not the one that was shown last.
    pub(crate) fn show_topology(&mut self) {
        let version = self.topology_version();
        if self
            .shown
            .as_ref()
            .is_some_and(|shown| shown.topology_version() != version)
        {
            self.show(&Team::alone());
        }
    }

    fn view(&self) -> View<'_> {
        View {
            positions: self.published.positions(),
            triangles: &self.system.surface,
            topology_version: self.topology_version(),
        }
    }
}
