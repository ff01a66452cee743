//! VERLET bodies that touch each other, or themselves, take their substeps together: what one does to the other is part of each.

use super::attempt::{Carry, Outcome, StepRequest, finish, needed, substeps_needed};
use super::substep::Part;
use super::verlet::{Step, Taken, TooLong, begin, check, check_beside_springs, pass};
use crate::body::Body;
use crate::contact::{Moment, Tissue};
use crate::slots::Slots;
use crate::threads::Team;

/// How often a step is begun again with shorter substeps, because its own motion made them necessary.
const ATTEMPTS: u32 = 6;

/// A body on its way through a step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Walk {
    start: Carry,
    masses_for: f32,
    carry: Carry,
    part: Part,
}

/// Takes the step of the bodies that are to go together, those that `walks` has a place for, without making it current.
pub(crate) fn attempt_together(
    bodies: &mut Slots<Body>,
    tissue: &mut Tissue,
    walks: &mut [Option<Walk>],
    outcomes: &mut [Option<Outcome>],
    request: &StepRequest,
    team: &Team,
) {
    let mut substeps = 1;
    for (place, walk) in walks.iter_mut().enumerate() {
        *walk = None;
        if let Some(body) = bodies.at_mut(place)
            && tissue.goes_together(place)
        {
            let need = needed(body, request, team);
            substeps = substeps.max(need.substeps);
            *walk = Some(Walk {
                start: need.start,
                masses_for: need.masses_for,
                carry: need.start,
                part: Part::opening(0.0),
            });
        }
    }
    let allowed = if request.substeps > 0 { 0 } else { ATTEMPTS };
    let mut stable_substep = f32::INFINITY;
    for attempt in 0..=allowed {
        if request.substeps == 0 && substeps > request.max_substeps {
            stable_substep = stable_substep.min(request.dt / substeps as f32);
            break;
        }
        match go(bodies, tissue, walks, request, substeps, team) {
            Ok(()) => {
                for (place, walk) in walks.iter().enumerate() {
                    if let (Some(walk), Some(body)) = (walk, bodies.at(place)) {
                        let finite = body.state.newest_is_finite();
                        let taken = Taken {
                            carry: walk.carry,
                            finite,
                        };
                        outcomes[place] = Some(finish(body, substeps, taken, 0.0));
                    }
                }
                return;
            }
            Err(found) => {
                stable_substep = stable_substep.min(found.stable_substep);
                let wanted = substeps_needed(request, stable_substep).min(f64::from(u32::MAX)) as u32;
                substeps = wanted.max(substeps.saturating_add(substeps / 4 + 1));
                if attempt + 1 == allowed {
                    substeps = substeps.saturating_mul(2);
                }
            }
        }
    }
    for (walk, outcome) in walks.iter().zip(outcomes) {
        if walk.is_some() {
            *outcome = Some(Outcome::Unstable {
                stable_substep,
                error: 0.0,
            });
        }
    }
}

/// Takes it in so many substeps.
fn go(
    bodies: &mut Slots<Body>,
    tissue: &mut Tissue,
    walks: &mut [Option<Walk>],
    request: &StepRequest,
    substeps: u32,
    team: &Team,
) -> Result<(), TooLong> {
    let step = |walk: &Walk| Step::of(request, substeps, walk.masses_for, team);
    let substep = (f64::from(request.dt) / f64::from(substeps)) as f32;
    let gravity = request.gravity.as_dvec3();
    each(bodies, walks, |_, body, walk| {
        if walk.masses_for == 0.0 {
            check(&walk.start.stability, substep)?;
        }
        walk.carry = walk.start;
        begin(body, request);
        walk.part = step(walk).opening(body, &mut walk.carry);
        if let Some(damping) = &mut body.damping {
            damping.prepare(substep);
        }
        Ok(())
    })?;
    let mut moment = Moment {
        duration: substep,
        drifts: true,
    };
    for index in 0..substeps {
        each(bodies, walks, |_, body, walk| {
            if index > 0 {
                walk.part.go_on(walk.carry.gravity.next(gravity * f64::from(substep)));
            }
            walk.part.start = f64::from(index) / f64::from(substeps);
            walk.part.end = f64::from(index + 1) / f64::from(substeps);
            pass(body, request, &walk.part, &mut walk.carry, team);
            Ok(())
        })?;
        tissue.meet_together(bodies, &moment);
        each(bodies, walks, |place, body, walk| {
            body.age(f64::from(substep), team);
            body.state.advance();
            let velocities = &mut walk.carry.gravity.velocities;
            *velocities = tissue.velocities(place, *velocities);
            let velocities = *velocities;
            if !step(walk).is_stable_after(&mut walk.carry.stability, &velocities) {
                let known = walk.carry.stability.for_short(substep);
                walk.carry.stability = known.unwrap_or_else(|| body.estimate(body.state.newest().0));
                check(&walk.carry.stability, substep)?;
            }
            check_beside_springs(body, substep)
        })?;
    }
    moment.drifts = false;
    each(bodies, walks, |_, body, walk| {
        let fall = gravity * f64::from(0.5 * substep);
        walk.part.close(walk.carry.gravity.next(fall));
        pass(body, request, &walk.part, &mut walk.carry, team);
        check_beside_springs(body, substep)
    })?;
    tissue.meet_together(bodies, &moment);
    Ok(())
}

/// Does something with each body that is on its way.
fn each(
    bodies: &mut Slots<Body>,
    walks: &mut [Option<Walk>],
    mut act: impl FnMut(usize, &mut Body, &mut Walk) -> Result<(), TooLong>,
) -> Result<(), TooLong> {
    for (place, walk) in walks.iter_mut().enumerate() {
        if let (Some(walk), Some(body)) = (walk, bodies.at_mut(place)) {
            act(place, body, walk)?;
        }
    }
    Ok(())
}
