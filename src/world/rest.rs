//! Bodies that are near each other, or that meet themselves, fall asleep together and wake together: what holds one up is another.

use crate::body::Body;
use crate::contact::ToolPath;
use crate::deformable_contact::DeformableContact;
use crate::slots::Slots;
use crate::solver::Outcome;

/// Wakes what tools come near to, and with each body those that fell asleep with it.
pub(super) fn rouse_groups(tissue: &mut DeformableContact, bodies: &mut Slots<Body>, tools: &[ToolPath]) {
    bodies.iter_mut().for_each(|(_, body)| body.system_mut().rouse(tools));
    let mut woken = std::mem::take(&mut tissue.groups);
    let is_asleep = |bodies: &Slots<Body>, place: usize| bodies.at(place).is_some_and(|body| body.system().is_asleep());
    woken.find_woken(|place| is_asleep(bodies, place));
    for place in woken.woken() {
        if let Some(body) = bodies.at_mut(place) {
            body.system_mut().wake_to_step();
        }
    }
    tissue.groups = woken;
}

/// Wakes all bodies of an island of which one is awake.
pub(super) fn wake_islands(tissue: &DeformableContact, bodies: &mut Slots<Body>, outcomes: &mut [Option<Outcome>]) {
    for island in 0..tissue.islands.count() {
        if tissue.is_asleep(island, bodies) {
            continue;
        }
        for &place in tissue.islands.members(island) {
            let place = place as usize;
            if let Some(body) = bodies.at_mut(place).filter(|body| body.system().sleeps()) {
                body.system_mut().wake_to_step();
                // It has tried nothing yet.
                outcomes[place] = None;
            }
        }
    }
}

/// After a step: an island of which all have been at rest for long enough falls asleep. `took` tells whether a body took the step.
pub(super) fn rest_islands(tissue: &mut DeformableContact, bodies: &mut Slots<Body>, took: impl Fn(usize) -> bool) {
    for (place, body) in bodies.iter() {
        if !body.system().is_asleep() {
            tissue.groups.leave(place);
        }
    }
    for island in 0..tissue.islands.count() {
        let members = tissue.islands.members(island);
        if members.iter().all(|&place| took(place as usize)) && tissue.is_at_rest(island, bodies) {
            for &place in members {
                if let Some(body) = bodies.at_mut(place as usize) {
                    body.system_mut().fall_asleep();
                }
            }
            tissue.groups.lie_down(tissue.islands.members(island));
        }
    }
}
