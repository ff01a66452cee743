//! Warm start of contacts (Catto 2005). A substep begins with the impulses of the one before, and a step with those of
//! the last step, so a resting body needs few sweeps.
//!
//! Impulses that no longer fit could add energy. The dual energy is quadratic in the fraction of them that is applied,
//! so a substep uses the fraction that minimizes it. It uses none if any would raise it, and kinetic energy never
//! grows.

use glam::Vec3;

use super::collision_surface::CollisionSurface;
use super::pair_contact::{ContactKey, PairContact};
use crate::base::{Result, StateHasher, memory};
use crate::codec::saved;

/// Maximum fraction after the first substep of a step, which is half a kick with VERLET. In later substeps it is 1.
/// Otherwise opposing contacts would let impulses grow without limit.
const MAX_FRACTION_AFTER_HALF_KICK: f32 = 2.0;

/// Number of contacts per contact that presses, for the capacity. Impulses beyond the capacity are not kept.
pub(super) const CONTACTS_PER_PRESSING: usize = 3;

/// Minimum cosine between the normals of a contact and a neighboring one whose impulse it takes over.
const MIN_COSINE: f32 = 0.99;

/// Impulses of a contact in the last substep, N s.
#[derive(Clone, Copy, Debug)]
struct WarmStart {
    key: ContactKey,
    impulse: f32,
    friction: Vec3,
    /// Unit vector from the second side to the first.
    normal: Vec3,
    /// True if a contact of the substep in progress uses it.
    is_restored: bool,
}

saved! { WarmStart { key, impulse, friction, normal, is_restored } }

impl WarmStart {
    fn restore(&mut self, contact: &mut PairContact) {
        self.is_restored = true;
        contact.set_impulses(self.impulse, self.friction);
    }
}

/// Impulses of earlier substeps, sorted by the sides of contacts.
#[derive(Debug, Default)]
pub(crate) struct WarmStartCache {
    /// Impulses of the last substep of the current island.
    previous: Vec<WarmStart>,
    /// Impulses at the end of the last step.
    committed: Vec<WarmStart>,
    /// Impulses at the end of the step in progress, of islands that are done.
    pending: Vec<WarmStart>,
    /// Number of substeps that the current island has taken, and whether it continues with the impulses of the last
    /// step.
    substeps: u32,
    restores: bool,
}

saved! { WarmStartCache { previous, committed, pending, substeps, restores } }

impl WarmStartCache {
    /// Reserves memory for this number of contacts, of which few press at once.
    pub(super) fn reserve(&mut self, contacts: usize) -> Result<()> {
        let count = contacts / CONTACTS_PER_PRESSING;
        let mut buffers = [&mut self.previous, &mut self.committed, &mut self.pending].into_iter();
        buffers.try_for_each(|entries| memory::reserve_in_steps(entries, count))
    }

    /// Begins or restarts a step.
    pub fn begin(&mut self) {
        self.pending.clear();
    }

    /// Begins the step of an island, with the impulses of the last step if `restores`.
    pub(super) fn begin_island(&mut self, members: &[u32], restores: bool) {
        self.previous.clear();
        (self.substeps, self.restores) = (0, restores);
        if restores {
            let committed = committed(&self.committed, members);
            self.previous.extend(committed);
        }
        self.previous.iter_mut().for_each(|entry| entry.is_restored = false);
        self.previous.sort_unstable_by_key(|entry| entry.key);
    }

    /// Stores the impulses of a substep. Those beyond the capacity are dropped.
    pub(super) fn store(&mut self, pair_contacts: &[PairContact]) {
        self.substeps = self.substeps.saturating_add(1);
        self.previous.clear();
        let free_slots = self.previous.capacity();
        let pressing = pair_contacts
            .iter()
            .filter(|contact| contact.is_pressing())
            .take(free_slots);
        self.previous.extend(pressing.map(|contact| {
            let (impulse, friction) = contact.impulses();
            WarmStart {
                key: contact.key(),
                impulse,
                friction,
                normal: contact.normal,
                is_restored: false,
            }
        }));
        self.previous.sort_unstable_by_key(|entry| entry.key);
    }

    /// Ends the step of the current island.
    pub(super) fn end_island(&mut self) {
        let free_slots = self.pending.capacity() - self.pending.len();
        self.pending.extend(self.previous.iter().take(free_slots));
    }

    /// Commits the step.
    pub fn commit(&mut self) {
        std::mem::swap(&mut self.committed, &mut self.pending);
        self.committed.sort_unstable_by_key(|entry| entry.key);
        self.pending.clear();
    }

    /// Returns the maximum fraction of the previous impulses that this substep applies.
    pub(super) fn max_fraction(&self) -> f32 {
        if self.restores && self.substeps == 1 {
            MAX_FRACTION_AFTER_HALF_KICK
        } else {
            1.0
        }
    }

    /// Removes a body that was destroyed.
    pub(super) fn remove_body(&mut self, body_index: usize) {
        self.committed
            .retain(|entry| entry.key.iter().all(|side| side.0 != body_index));
    }

    /// Returns the sides of these bodies' contacts at the end of the last step, and their normal impulses, N s.
    pub(super) fn committed<'a>(&'a self, members: &'a [u32]) -> impl Iterator<Item = (ContactKey, f32)> + 'a {
        committed(&self.committed, members).map(|entry| (entry.key, entry.impulse))
    }

    /// Sets the impulses of a new contact to its previous ones.
    pub(super) fn restore(&mut self, contact: &mut PairContact) {
        let key = contact.key();
        if let Ok(slot) = self.previous.binary_search_by_key(&key, |entry| entry.key) {
            self.previous[slot].restore(contact);
        }
    }

    /// Sets the impulses of new corner contacts without previous ones to unused ones of a neighboring face. Which of
    /// several similar faces a corner touches may change.
    pub(super) fn restore_from_neighbors(&mut self, pair_contacts: &mut [PairContact]) {
        for contact in pair_contacts.iter_mut().filter(|contact| !contact.is_pressing()) {
            let [(body, nodes), (other, others)] = contact.key();
            if nodes[0] != nodes[2] {
                continue;
            }
            let first = self.previous.partition_point(|entry| entry.key[0] < (body, nodes));
            let entries_of_corner = self.previous[first..].iter_mut();
            let mut entries_of_corner = entries_of_corner.take_while(|entry| entry.key[0] == (body, nodes));
            let neighbor = entries_of_corner.find(|entry| {
                let (other_body, corners) = entry.key[1];
                let shares_corner = other_body == other && corners.iter().any(|node| others.contains(node));
                shares_corner && !entry.is_restored && entry.normal.dot(contact.normal) > MIN_COSINE
            });
            if let Some(entry) = neighbor {
                entry.restore(contact);
            }
        }
    }

    pub fn hash(&self, hasher: &mut StateHasher) {
        for entry in &self.committed {
            for (body, nodes) in entry.key {
                hasher.write_u64(body as u64);
                nodes.into_iter().for_each(|node| hasher.write_u64(u64::from(node)));
            }
            hasher.write_floats(&[entry.impulse]);
            hasher.write_vectors([entry.friction, entry.normal]);
        }
    }
}

/// Returns the impulses of contacts whose first side is on one of these bodies.
fn committed<'a>(all: &'a [WarmStart], members: &'a [u32]) -> impl Iterator<Item = &'a WarmStart> {
    members
        .iter()
        .map(|&body_index| body_index as usize)
        .flat_map(|body_index| {
            let first = all.partition_point(|entry| entry.key[0].0 < body_index);
            all[first..]
                .iter()
                .take_while(move |entry| entry.key[0].0 == body_index)
        })
}

/// Applies the warm start of new contacts to nodes, or the best fraction up to `max_fraction`. Returns the largest
/// change of velocity, m/s.
pub(super) fn apply_warm_start(
    pair_contacts: &mut [PairContact],
    max_fraction: f32,
    surfaces: &mut [Option<CollisionSurface>],
) -> f32 {
    let any_pressing = |pair_contacts: &[PairContact]| pair_contacts.iter().any(PairContact::is_pressing);
    if !any_pressing(pair_contacts) {
        return 0.0;
    }
    let total_works = |pair_contacts: &[PairContact], surfaces: &[Option<CollisionSurface>]| {
        let total_works = pair_contacts
            .iter()
            .filter(|contact| contact.is_pressing())
            .map(|contact| contact.work(surfaces));
        total_works.fold([0.0; 2], |[total_work, allowed_work], [work, gap_work]| {
            [total_work + work, allowed_work + gap_work]
        })
    };
    let [work_before, allowed_work] = total_works(pair_contacts, surfaces);
    pair_contacts
        .iter()
        .for_each(|contact| contact.apply_fraction(1.0, surfaces));
    let [work_after, _] = total_works(pair_contacts, surfaces);
    let (slope, curvature) = (work_before - allowed_work, work_after - work_before);
    let fraction = if curvature > 0.0 {
        (-slope / curvature).clamp(0.0, max_fraction)
    } else {
        0.0
    };
    let mut max_change = 0.0_f32;
    for contact in pair_contacts.iter_mut().filter(|contact| contact.is_pressing()) {
        contact.apply_fraction(fraction - 1.0, surfaces);
        contact.scale_warm_start(fraction);
        max_change = max_change.max(contact.velocity_change());
    }
    max_change
}
