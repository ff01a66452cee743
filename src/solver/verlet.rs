//! VERLET: the paper's explicit integration (Halic et al., section 3) as leapfrog with kept velocities.
//!
//! A step of n substeps is half a kick, n drifts with full kicks between them, and half a kick: symmetric, of order 2,
//! with the same positions as Verlet's own `2 x - x' + h² a`. Each substep visits the springs once: the force found at
//! the end of a step is the one the next begins with. Damping along springs needs velocities at the time of the
//! positions: a first visit predicts them, a second uses them (order 2 too; Heun's method).

use glam::DVec3;

use super::attempt::{Carry, StepRequest};
use super::stability::Stability;
use super::substep::{Part, kick_and_drift};
use crate::body::{Body, Bounds, Mobility};
use crate::contact::Meeting;
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
    begin(body, request, substep);
    for index in 0..=substeps {
        let part = Part {
            begins: index == 0,
            ends: index == substeps,
            start: f64::from(index) / f64::from(substeps),
            end: f64::from(index + 1) / f64::from(substeps),
            substep,
        };
        let kicked = if part.is_half() { 0.5 * substep } else { substep };
        let fall = carry.gravity.next(request.gravity, kicked);
        let survey = kick_and_drift(body, request, &part, fall, team);
        carry.gravity.velocities = meet_tools(body, request, &part, survey.velocities);
        if part.ends {
            // What tools have done was not looked at.
            finite = if body.contacts.is_some() {
                body.state.newest_is_finite()
            } else {
                survey.finite
            };
            break;
        }
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
    Ok(Taken { carry, finite })
}

/// Starts the step over, from what is current.
fn begin(body: &mut Body, request: &StepRequest, substep: f32) {
    body.state.begin();
    if let Some(damping) = &mut body.damping {
        damping.prepare(substep);
    }
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
        drifts: !part.ends,
        fastest,
        mobility: Mobility {
            inverse_masses: &body.inverse_masses,
            damping: body.damping.as_ref(),
            substep: part.substep,
            half: part.is_half(),
        },
        positions: state.positions,
        velocities: state.velocities,
        next_positions: state.next_positions,
        pins: &mut body.pins,
    });
    contacts.velocities(velocities)
}
