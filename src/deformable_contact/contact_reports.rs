//! Contacts between bodies, or within one, that callers can query.

use glam::Vec3;

use super::pair_contact::{ContactSide, PairContact};
use super::warm_start::CONTACTS_PER_PRESSING;
use crate::base::{Result, memory};
use crate::codec::saved;

/// A contact of the last step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ContactReport {
    pub sides: [ContactSide; 2],
    /// Unit vector from the second side to the first.
    pub normal: Vec3,
    /// Force on the first side, N.
    pub force: Vec3,
}

saved! { ContactReport { sides, normal, force } }

/// Contacts at the end of the last step, and of the step in progress.
#[derive(Debug, Default)]
pub(crate) struct ContactReports {
    committed: Vec<ContactReport>,
    pending: Vec<ContactReport>,
}

saved! { ContactReports { committed, pending } }

impl ContactReports {
    /// Reserves memory for this number of contacts, of which few press at once.
    pub(super) fn reserve(&mut self, contacts: usize) -> Result<()> {
        let mut buffers = [&mut self.committed, &mut self.pending].into_iter();
        buffers.try_for_each(|reports| memory::reserve_in_steps(reports, contacts / CONTACTS_PER_PRESSING))
    }

    /// Begins or restarts a step.
    pub fn begin(&mut self) {
        self.pending.clear();
    }

    /// Begins or restarts the step of an island.
    pub(super) fn begin_island(&mut self, members: &[u32]) {
        self.pending
            .retain(|report| !members.contains(&(report.sides[0].body as u32)));
    }

    /// Adds contacts that press, with forces averaged over `duration` seconds, if `is_selected` accepts their bodies.
    /// Contacts beyond the capacity are dropped.
    pub(super) fn record(
        &mut self,
        pair_contacts: &[PairContact],
        duration: f32,
        is_selected: impl Fn([usize; 2]) -> bool,
    ) {
        let free_slots = self.pending.capacity() - self.pending.len();
        let pressing = pair_contacts
            .iter()
            .filter(|contact| contact.is_pressing() && is_selected(contact.sides.map(|side| side.body)));
        self.pending
            .extend(pressing.take(free_slots).map(|contact| ContactReport {
                sides: contact.sides,
                normal: contact.normal,
                force: contact.total_impulse() / duration,
            }));
    }

    /// Commits the step.
    pub fn commit(&mut self) {
        std::mem::swap(&mut self.committed, &mut self.pending);
    }

    /// Removes a body that was destroyed.
    pub(super) fn remove_body(&mut self, body_index: usize) {
        self.committed
            .retain(|report| report.sides.iter().all(|side| side.body != body_index));
    }

    pub fn iter(&self) -> impl Iterator<Item = &ContactReport> {
        self.committed.iter()
    }
}
