//! VERLET: the paper's explicit integration (Halic et al., section 3) as leapfrog with kept velocities.
//!
//! A step of n substeps is half a kick, n drifts with full kicks between them, and half a kick: symmetric, of order 2,
//! with the same positions as Verlet's own `2 x - x' + h² a`. Each substep visits the springs once: the half kick that
//! closes a step is left to the next, which begins with the same forces, or where it cannot be left, its forces are kept
//! for the next. Damping along springs needs velocities at the time of the positions: a first visit predicts them, a
//! second uses them (order 2 too; Heun's method).

use glam::DVec3;

use super::attempt::{Carry, StepRequest};
use super::closing::{ClosingKick, close_aside, may_stay_open};
use super::stability::Stability;
use super::substep::{Before, Part, kick_and_drift};
use crate::body::{Body, Bounds, Mobility};
use crate::contact::{Contacts, Meeting};
use crate::threads::Team;

/// The substep asked for is longer than what is stable, or the motion made it so on the way.
#[derive(Clone, Copy, Debug)]
pub(super) struct TooLong {
    /// So long may it be, s.
    pub stable_substep: f32,
}

/// A step that was taken, and is not current yet.
#[derive(Clone, Copy, Debug)]
pub(super) struct Taken {
    /// What it carries on to the next.
    pub carry: Carry,
    /// Whether its positions and velocities are finite.
    pub finite: bool,
}

/// Takes the step with exactly `substeps` substeps. After `middle` of them a world with a tolerance looks at it.
pub(super) fn run(
    body: &mut Body,
    request: &StepRequest,
    substeps: u32,
    middle: u32,
    start: Carry,
    team: &Team,
) -> Result<Taken, TooLong> {
    let mut carry = start;
    let mut finite = true;
    let substep = (f64::from(request.dt) / f64::from(substeps)) as f32;
    let check = |stability: &Stability| match stability.limit() {
        Some(stable_substep) if substep > stable_substep => Err(TooLong { stable_substep }),
        _ => Ok(()),
    };
    check(&carry.stability)?;
    begin(body, request);
    let may_stay_open = may_stay_open(body);
    let mut part = opening(body, request, substep, &mut carry, team);
    if let Some(damping) = &mut body.damping {
        damping.prepare(substep);
    }
    for index in 0..substeps {
        part.last = may_stay_open && index + 1 == substeps;
        part.start = f64::from(index) / f64::from(substeps);
        part.end = f64::from(index + 1) / f64::from(substeps);
        if index > 0 {
            part.go_on(carry.gravity.next(request.gravity.as_dvec3() * f64::from(substep)));
        }
        finite = pass(body, request, &part, &mut carry, team);
        body.state.advance();
        if index + 1 == middle
            && let Some(coarse) = &mut body.coarse
        {
            coarse.pass_middle(body.state.newest().0);
        }
        let Bounds { min, max } = carry.gravity.velocities;
        if !carry.stability.holds_after(substep * (max - min).length()) {
            carry.stability = carry.stability.for_short(substep).unwrap_or_else(|| {
                let positions = body.state.newest().0;
                Stability::estimate(&*body.springs, &body.inverse_masses, positions)
            });
            check(&carry.stability)?;
        }
    }
    // What a tool touches is closed with it.
    if may_stay_open && body.contacts.as_ref().is_none_or(Contacts::are_far) {
        carry.closing = Some(ClosingKick {
            substep,
            gravity: request.gravity,
        });
    } else {
        part.close(
            carry
                .gravity
                .next(request.gravity.as_dvec3() * f64::from(0.5 * substep)),
        );
        finite = pass(body, request, &part, &mut carry, team);
    }
    Ok(Taken { carry, finite })
}

/// Takes one part of the step; whether what it leads to is finite, where it was looked at.
fn pass(body: &mut Body, request: &StepRequest, part: &Part, carry: &mut Carry, team: &Team) -> bool {
    let survey = kick_and_drift(body, request, part, team);
    carry.gravity.velocities = meet_tools(body, request, part, survey.velocities);
    // What tools have done was not looked at.
    if part.last && body.contacts.as_ref().is_some_and(|contacts| !contacts.are_far()) {
        body.state.newest_is_finite()
    } else {
        survey.finite
    }
}

/// The first kick of a step: the half that opens it, together with the half that closes the last where that was left open.
fn opening(body: &mut Body, request: &StepRequest, substep: f32, carry: &mut Carry, team: &Team) -> Part {
    let mut part = Part::opening(substep);
    let mut change = request.gravity.as_dvec3() * f64::from(part.duration);
    match carry.closing.take() {
        None => {}
        Some(closing) if closing.joins(body, substep, request.gravity) => {
            part.join(&closing);
            change += closing.fall();
        }
        Some(closing) => {
            close_aside(body, &closing, &mut carry.gravity, team);
            part.before = Before::Closed;
        }
    }
    part.fall = carry.gravity.next(change);
    part
}

/// Starts the step over, from what is current.
fn begin(body: &mut Body, request: &StepRequest) {
    body.state.begin();
    for pin in body.pins.iter_mut() {
        let position = body.state.positions().get(pin.node as usize);
        pin.goal = match pin.target {
            Some(target) => (target.as_dvec3() - body.origin).as_vec3(),
            None => position,
        };
        pin.travel = pin.goal - position;
        pin.force_sum = DVec3::ZERO;
    }
    if let Some(contacts) = &mut body.contacts {
        contacts.begin(request.tools, body.origin);
    }
}

/// Lets tools stop the nodes that would enter them: the box of all velocities, given that of those before.
fn meet_tools(body: &mut Body, request: &StepRequest, part: &Part, velocities: Bounds) -> Bounds {
    let Some(contacts) = &mut body.contacts else {
        return velocities;
    };
    let fastest = velocities.min.abs().max(velocities.max.abs()).length();
    let state = body.state.substep();
    contacts.resolve(Meeting {
        tools: request.tools,
        origin: body.origin,
        dt: request.dt,
        start: part.start,
        end: part.end,
        substep: part.substep,
        drifts: part.drifts,
        fastest,
        mobility: Mobility {
            inverse_masses: &body.inverse_masses,
            damping: body.damping.as_ref(),
            substep: part.substep,
            half: part.half,
        },
        positions: state.positions,
        velocities: state.velocities,
        next_positions: state.next_positions,
        pins: &mut body.pins,
    });
    contacts.velocities(velocities)
}
