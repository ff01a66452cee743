//! VERLET: the paper's explicit integration (Halic et al., section 3) as leapfrog with kept velocities.
//!
//! A step of n substeps is half a kick, n drifts with full kicks between them, and half a kick: symmetric, of order 2,
//! with the same positions as Verlet's own `2 x - x' + h² a`. Each substep visits the springs once: the force found at
//! the end of a step is the one the next begins with. Damping along springs needs velocities at the time of the
//! positions: a first visit predicts them, a second uses them (order 2 too; Heun's method).

use glam::{DVec3, Vec3};

use super::Stability;
use super::kick::Kick;
use super::stability::{longest_stable_substep, substep_stable_anywhere};
use crate::body::{Body, Bounds};
use crate::contact::{Meeting, ToolPath};

/// The part of the longest stable substep that is used.
const RESERVE: f32 = 0.8;

/// How often a step is begun again with shorter substeps, because its own motion made them necessary.
const ATTEMPTS: u32 = 4;

/// Substeps taken, at most, so that a fast tool moves less than its radius in each.
const SUBSTEPS_FOR_TOOLS: u32 = 64;

/// What is asked of a step.
pub(crate) struct StepRequest<'a> {
    /// Seconds, above 0.
    pub dt: f32,
    pub gravity: Vec3,
    /// 0: as many as stability needs.
    pub substeps: u32,
    pub max_substeps: u32,
    /// Metres; 0: off.
    pub tolerance: f32,
    pub tools: &'a [ToolPath],
}

/// How an attempted step ended. Nothing is current before [`Body::commit`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Outcome {
    /// The step is ready to be committed.
    Done {
        substeps: u32,
        stability: Stability,
        error: f32,
    },
    /// The step would have ended in infinity or NaN.
    NotFinite,
    /// More substeps would be needed than are allowed.
    Unstable { stable_substep: f32 },
}

/// Takes a step of `body` without making it current.
pub(crate) fn attempt(body: &mut Body, request: &StepRequest) -> Outcome {
    body.refresh_forces();
    let stability = match body.stability.limit {
        Some(_) => body.stability,
        None => estimate(body),
    };
    if request.substeps > 0 {
        return match run(body, request, request.substeps, stability) {
            Run::Done(stability) => finish(body, request.substeps, stability, 0.0),
            Run::TooLong(stable_substep) => Outcome::Unstable { stable_substep },
        };
    }
    let least = body.contacts.as_ref().map_or(1, |_| substeps_for_tools(body, request));
    let (substeps, stability) = match run_stably(body, request, least, stability) {
        Ok(done) => done,
        Err(stable_substep) => return Outcome::Unstable { stable_substep },
    };
    if request.tolerance == 0.0 {
        return finish(body, substeps, stability, 0.0);
    }
    run_to_tolerance(body, request, substeps, stability)
}

/// Takes the step with as many substeps as stability needs, at least `least`: how many, and what was learnt on the way.
fn run_stably(
    body: &mut Body,
    request: &StepRequest,
    least: u32,
    stability: Stability,
) -> Result<(u32, Stability), f32> {
    let mut limit = stability.limit.unwrap_or(f32::INFINITY);
    for attempt in 0..=ATTEMPTS {
        if attempt == ATTEMPTS {
            limit = substep_stable_anywhere(&body.springs, &body.inverse_masses);
        }
        let needed = (f64::from(request.dt) / f64::from(RESERVE * limit))
            .ceil()
            .max(f64::from(least));
        if needed > f64::from(request.max_substeps) {
            return Err(limit);
        }
        let substeps = needed as u32;
        match run(body, request, substeps, stability) {
            Run::Done(stability) => return Ok((substeps, stability)),
            Run::TooLong(found) => limit = limit.min(found),
        }
    }
    Err(limit)
}

/// Doubles the substeps until that changes no position by more than the tolerance; the finer result stands.
///
/// The difference bounds the error of the finer step whatever the order at which the step converges, from 1 on: contact
/// is of order 1, and modes that the step does not resolve are of no order at all.
fn run_to_tolerance(body: &mut Body, request: &StepRequest, substeps: u32, stability: Stability) -> Outcome {
    let mut substeps = substeps;
    let mut newest = stability;
    loop {
        body.keep_coarse_positions();
        substeps = substeps.saturating_mul(2);
        if substeps > request.max_substeps {
            let stable_substep = newest.limit.unwrap_or(f32::INFINITY);
            return Outcome::Unstable { stable_substep };
        }
        match run(body, request, substeps, stability) {
            Run::Done(stability) => newest = stability,
            Run::TooLong(stable_substep) => return Outcome::Unstable { stable_substep },
        }
        let error = body.difference_from_coarse();
        if error <= request.tolerance || error.is_infinite() {
            return finish(body, substeps, newest, error);
        }
    }
}

fn finish(body: &Body, substeps: u32, stability: Stability, error: f32) -> Outcome {
    let (positions, velocities) = body.state.newest();
    let finite = |vectors: &crate::body::Vectors| vectors.largest_length_squared().is_finite();
    if finite(positions) && finite(velocities) {
        Outcome::Done {
            substeps,
            stability,
            error,
        }
    } else {
        Outcome::NotFinite
    }
}

/// So many substeps that no tool near the body moves further than its radius in one.
fn substeps_for_tools(body: &Body, request: &StepRequest) -> u32 {
    let bounds = body.bounds();
    let mut substeps = 1.0_f32;
    for tool in request.tools {
        if let Some(sweep) = tool.sweep(body.origin)
            && sweep.bounds.overlaps(&bounds)
        {
            substeps = substeps.max((sweep.travel / sweep.radius).ceil());
        }
    }
    (substeps as u32).clamp(1, SUBSTEPS_FOR_TOOLS.min(request.max_substeps))
}

fn estimate(body: &Body) -> Stability {
    let limit = longest_stable_substep(&body.springs, &body.inverse_masses, body.state.positions());
    Stability {
        limit: Some(limit),
        travel: 0.0,
    }
}

enum Run {
    Done(Stability),
    /// The motion itself made the substep longer than what is stable: so long may it be.
    TooLong(f32),
}

/// Takes the step with exactly `substeps` substeps.
fn run(body: &mut Body, request: &StepRequest, substeps: u32, stability: Stability) -> Run {
    let mut stability = stability;
    let substep = (f64::from(request.dt) / f64::from(substeps)) as f32;
    let too_long = |stability: Stability| stability.limit.filter(|&limit| substep > limit);
    if let Some(limit) = too_long(stability) {
        return Run::TooLong(limit);
    }
    begin(body, request, substep);
    for index in 0..=substeps {
        let part = Part {
            begins: index == 0,
            ends: index == substeps,
            start: f64::from(index) / f64::from(substeps),
            end: f64::from(index + 1) / f64::from(substeps),
        };
        let mut velocities = kick_and_drift(body, request, substep, &part);
        hold_pins(body, request, &part);
        velocities = meet_tools(body, request, substep, &part, velocities);
        if part.ends {
            break;
        }
        body.state.advance();
        stability.travel += substep * (velocities.max - velocities.min).length();
        if !stability.holds(body.mean_rest_length) {
            let positions = body.state.newest().0;
            let limit = longest_stable_substep(&body.springs, &body.inverse_masses, positions);
            stability = Stability {
                limit: Some(limit),
                travel: 0.0,
            };
            if let Some(limit) = too_long(stability) {
                return Run::TooLong(limit);
            }
        }
    }
    Run::Done(stability)
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
}

/// Changes the velocities by the forces at the latest positions and moves the nodes by them: the box of all velocities.
fn kick_and_drift(body: &mut Body, request: &StepRequest, substep: f32, part: &Part) -> Bounds {
    let kick = Kick {
        substep,
        gravity: request.gravity,
        inverse_masses: &body.inverse_masses,
        applied: body.applied.as_ref(),
        damping: body.damping.as_ref(),
    };
    let state = body.state.substep();
    let springs = &body.springs;
    let nodes = 0..kick.inverse_masses.len();
    let mut velocities = Bounds::EMPTY;
    if part.begins {
        for node in nodes {
            let force = state.first_forces.get(node);
            let velocity = kick.half(node, state.first_velocities.get(node), force);
            state.velocities.set(node, velocity);
            state
                .next_positions
                .set(node, state.positions.get(node) + velocity * substep);
            velocities = velocities.with(velocity);
        }
        return velocities;
    }
    if let Some(predicted) = &mut body.predicted_velocities {
        for node in nodes.clone() {
            let force = springs.damped_force(node, state.positions, state.velocities);
            predicted.set(node, kick.half(node, state.velocities.get(node), force));
        }
        for pin in body.pins.iter() {
            predicted.set(pin.node as usize, state.velocities.get(pin.node as usize));
        }
    }
    let force_on = |node: usize| match &body.predicted_velocities {
        None => springs.force(node, state.positions),
        Some(predicted) => springs.damped_force(node, state.positions, predicted),
    };
    if part.ends {
        for node in nodes {
            let force = force_on(node);
            let velocity = kick.half(node, state.velocities.get(node), force);
            state.forces.set(node, force);
            state.velocities.set(node, velocity);
            velocities = velocities.with(velocity);
        }
    } else {
        for node in nodes {
            let velocity = kick.full(node, state.velocities.get(node), force_on(node));
            state.velocities.set(node, velocity);
            state
                .next_positions
                .set(node, state.positions.get(node) + velocity * substep);
            velocities = velocities.with(velocity);
        }
    }
    velocities
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
            let force = match &body.predicted_velocities {
                None => body.springs.force(node, state.positions),
                Some(predicted) => body.springs.damped_force(node, state.positions, predicted),
            };
            (force, 1.0)
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
fn meet_tools(body: &mut Body, request: &StepRequest, substep: f32, part: &Part, velocities: Bounds) -> Bounds {
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
        substep,
        drifts: !part.ends,
        fastest,
        inverse_masses: &body.inverse_masses,
        positions: state.positions,
        velocities: state.velocities,
        next_positions: state.next_positions,
    });
    contacts.velocities(velocities)
}
