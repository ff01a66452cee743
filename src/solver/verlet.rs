//! VERLET: the paper's explicit integration (Halic et al., section 3) as leapfrog with kept velocities.
//!
//! A step of n substeps is half a kick, n drifts with full kicks between them, and half a kick: symmetric, of order 2,
//! with the same positions as Verlet's own `2 x - x' + h² a`. Each substep visits the springs once: the force found at
//! the end of a step is the one the next begins with. Damping along springs needs velocities at the time of the
//! positions: a first visit predicts them, a second uses them (order 2 too; Heun's method).

use glam::{DVec3, Vec3, Vec3A};

use super::attempt::{Carry, StepRequest};
use super::kick::Kick;
use super::stability::Stability;
use crate::body::{Body, Bounds, Mobility};
use crate::contact::Meeting;

/// The substep asked for is longer than what is stable, or the motion made it so on the way.
#[derive(Clone, Copy, Debug)]
pub(super) struct TooLong {
    /// So long may it be, s.
    pub stable_substep: f32,
}

/// Takes the step with exactly `substeps` substeps: what it carries on to the next. After `middle` of them a world with a
/// tolerance looks at it.
pub(super) fn run(
    body: &mut Body,
    request: &StepRequest,
    substeps: u32,
    middle: u32,
    start: Carry,
) -> Result<Carry, TooLong> {
    let mut carry = start;
    let substep = (f64::from(request.dt) / f64::from(substeps)) as f32;
    let check = |stability: &Stability| match stability.limit {
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
        let velocities = kick_and_drift(body, request, &part, fall);
        hold_pins(body, request, &part);
        carry.gravity.velocities = meet_tools(body, request, &part, velocities);
        if part.ends {
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
            let positions = body.state.newest().0;
            carry.stability = Stability::estimate(&body.springs, &body.inverse_masses, positions);
            check(&carry.stability)?;
        }
    }
    Ok(carry)
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

/// Which part of a step a substep is.
struct Part {
    /// The first kick: half of one, with the forces that the last step ended with.
    begins: bool,
    /// The last kick: half of one, without a drift.
    ends: bool,
    /// Fractions of the step at which the substep starts and ends.
    start: f64,
    end: f64,
    /// s
    substep: f32,
}

impl Part {
    /// Whether its kick is half of one.
    fn is_half(&self) -> bool {
        self.begins || self.ends
    }
}

/// Changes the velocities by the forces at the latest positions and moves the nodes by them: the box of all velocities.
fn kick_and_drift(body: &mut Body, request: &StepRequest, part: &Part, fall: Vec3) -> Bounds {
    let substep = part.substep;
    let kick = Kick {
        substep,
        gravity: request.gravity.into(),
        fall: fall.into(),
        inverse_masses: &body.inverse_masses,
        applied: body.applied.as_ref(),
        damping: body.damping.as_ref(),
    };
    let state = body.state.substep();
    let springs = &body.springs;
    let nodes = 0..kick.inverse_masses.len();
    let (mut slowest, mut fastest) = (Vec3A::INFINITY, Vec3A::NEG_INFINITY);
    if part.begins {
        for node in nodes {
            let force = state.first_forces.lanes(node);
            let velocity = kick.half(node, state.first_velocities.lanes(node), force);
            state.velocities.set(node, velocity);
            state
                .next_positions
                .set(node, state.positions.lanes(node) + velocity * substep);
            slowest = slowest.min(velocity);
            fastest = fastest.max(velocity);
        }
        return bounds(slowest, fastest);
    }
    if let Some(predicted) = &mut body.predicted_velocities {
        for node in nodes.clone() {
            let force = springs.damped_force(node, state.positions, state.velocities);
            predicted.set(node, kick.half(node, state.velocities.lanes(node), force));
        }
        for pin in body.pins.iter() {
            predicted.set(pin.node as usize, state.velocities.lanes(pin.node as usize));
        }
    }
    let predicted = body.predicted_velocities.as_ref();
    let force_on = |node: usize| springs.force_at(node, state.positions, predicted);
    if part.ends {
        for node in nodes {
            let force = force_on(node);
            let velocity = kick.half(node, state.velocities.lanes(node), force);
            state.forces.set(node, force);
            state.velocities.set(node, velocity);
            slowest = slowest.min(velocity);
            fastest = fastest.max(velocity);
        }
    } else {
        for node in nodes {
            let velocity = kick.full(node, state.velocities.lanes(node), force_on(node));
            state.velocities.set(node, velocity);
            state
                .next_positions
                .set(node, state.positions.lanes(node) + velocity * substep);
            slowest = slowest.min(velocity);
            fastest = fastest.max(velocity);
        }
    }
    bounds(slowest, fastest)
}

fn bounds(min: Vec3A, max: Vec3A) -> Bounds {
    Bounds {
        min: min.into(),
        max: max.into(),
    }
}

/// Puts the pinned nodes where they are led, and adds up what holds them.
fn hold_pins(body: &mut Body, request: &StepRequest, part: &Part) {
    let state = body.state.substep();
    for pin in body.pins.iter_mut() {
        let node = pin.node as usize;
        let (force, weight) = if part.begins {
            (state.first_forces.get(node), 0.5)
        } else if part.ends {
            (state.forces.get(node), 0.5)
        } else {
            let predicted = body.predicted_velocities.as_ref();
            (body.springs.force_at(node, state.positions, predicted).into(), 1.0)
        };
        let weight_of_node = request.gravity * body.masses[node];
        pin.force_sum -= (force + weight_of_node).as_dvec3() * weight;
        let velocity = pin.travel / request.dt;
        state.velocities.set(node, velocity);
        if !part.ends {
            // From the start of the step, so that roundings do not add up.
            let position = pin.goal - pin.travel * (1.0 - part.end) as f32;
            state.next_positions.set(node, position);
        }
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
