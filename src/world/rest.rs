//! Sleep of islands: bodies that are near each other sleep and wake together, because one can support another.

use crate::body::Body;
use crate::contact::ToolPath;
use crate::deformable_contact::DeformableContact;
use crate::slots::Slots;
use crate::solver::Outcome;

/// Wakes bodies near moving tools, and with each body those that fell asleep with it.
pub(super) fn wake_groups_near_tools(
    deformable_contact: &mut DeformableContact,
    bodies: &mut Slots<Body>,
    tools: &[ToolPath],
) {
    bodies
        .iter_mut()
        .for_each(|(_, body)| body.system_mut().wake_near_tools(tools));
    let mut woken = std::mem::take(&mut deformable_contact.sleep_groups);
    let is_asleep = |bodies: &Slots<Body>, slot: usize| bodies.at(slot).is_some_and(|body| body.system().is_asleep());
    woken.find_awake_groups(|slot| is_asleep(bodies, slot));
    for slot in woken.members_of_awake_groups() {
        if let Some(body) = bodies.at_mut(slot) {
            body.system_mut().wake_for_step();
        }
    }
    deformable_contact.sleep_groups = woken;
}

/// Wakes all bodies of each island that contains an awake body.
pub(super) fn wake_islands(
    deformable_contact: &DeformableContact,
    bodies: &mut Slots<Body>,
    outcomes: &mut [Option<Outcome>],
) {
    for island in 0..deformable_contact.islands.count() {
        if deformable_contact.is_asleep(island, bodies) {
            continue;
        }
        for &slot in deformable_contact.islands.members(island) {
            let slot = slot as usize;
            if let Some(body) = bodies.at_mut(slot).filter(|body| body.system().any_tile_asleep()) {
                body.system_mut().wake_for_step();
                // It has not attempted the step yet.
                outcomes[slot] = None;
            }
        }
    }
}

/// Puts each island to sleep whose bodies have all been at rest for long enough. `was_stepped` is true of a body that
/// was_stepped the step.
pub(super) fn put_islands_to_sleep(
    deformable_contact: &mut DeformableContact,
    bodies: &mut Slots<Body>,
    was_stepped: impl Fn(usize) -> bool,
) {
    for (slot, body) in bodies.iter() {
        if !body.system().is_asleep() {
            deformable_contact.sleep_groups.remove(slot);
        }
    }
    for island in 0..deformable_contact.islands.count() {
        let members = deformable_contact.islands.members(island);
        if members.iter().all(|&slot| was_stepped(slot as usize)) && deformable_contact.is_at_rest(island, bodies) {
            for &slot in members {
                if let Some(body) = bodies.at_mut(slot as usize) {
                    body.system_mut().fall_asleep();
                }
            }
            deformable_contact
                .sleep_groups
                .add_group(deformable_contact.islands.members(island));
        }
    }
}
