//! How many substeps a step takes, and what becomes of a step that cannot be taken.

use glam::Vec3;

use super::gravity::GravityKicks;
use super::stability::{Stability, substep_stable_anywhere};
use super::verlet::{self, TooLong};
use crate::body::{Body, Vectors};
use crate::contact::ToolPath;

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

/// What one step hands to the next beside the state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Carry {
    pub stability: Stability,
    pub gravity: GravityKicks,
}

/// How an attempted step ended. Nothing is current before [`Body::commit`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Outcome {
    /// The step is ready to be committed.
    Done { substeps: u32, carry: Carry, error: f32 },
    /// The step would have ended in infinity or NaN.
    NotFinite,
    /// More substeps would be needed than are allowed.
    Unstable { stable_substep: f32 },
}

/// Takes a step of `body` without making it current.
pub(crate) fn attempt(body: &mut Body, request: &StepRequest) -> Outcome {
    body.refresh_forces();
    let stability = match body.carry.stability.limit {
        Some(_) => body.carry.stability,
        None => Stability::estimate(&body.springs, &body.inverse_masses, body.state.positions()),
    };
    let start = Carry {
        stability,
        ..body.carry
    };
    if request.substeps > 0 {
        return match verlet::run(body, request, request.substeps, start) {
            Ok(carry) => finish(body, request.substeps, carry, 0.0),
            Err(TooLong { stable_substep }) => Outcome::Unstable { stable_substep },
        };
    }
    let least = body.contacts.as_ref().map_or(1, |_| substeps_for_tools(body, request));
    match run_stably(body, request, least, start) {
        Err(TooLong { stable_substep }) => Outcome::Unstable { stable_substep },
        Ok((substeps, carry)) if request.tolerance == 0.0 => finish(body, substeps, carry, 0.0),
        Ok((substeps, carry)) => run_to_tolerance(body, request, substeps, start, carry),
    }
}

/// Takes the step with as many substeps as stability needs, at least `least`: how many, and what they carry on.
fn run_stably(body: &mut Body, request: &StepRequest, least: u32, start: Carry) -> Result<(u32, Carry), TooLong> {
    let mut stable_substep = start.stability.limit.unwrap_or(f32::INFINITY);
    for attempt in 0..=ATTEMPTS {
        if attempt == ATTEMPTS {
            stable_substep = substep_stable_anywhere(&body.springs, &body.inverse_masses);
        }
        let needed = (f64::from(request.dt) / f64::from(RESERVE * stable_substep)).ceil();
        let needed = needed.max(f64::from(least));
        if needed > f64::from(request.max_substeps) {
            break;
        }
        let substeps = needed as u32;
        match verlet::run(body, request, substeps, start) {
            Ok(carry) => return Ok((substeps, carry)),
            Err(found) => stable_substep = stable_substep.min(found.stable_substep),
        }
    }
    Err(TooLong { stable_substep })
}

/// Doubles the substeps until that changes no position by more than the tolerance; the finer result stands.
///
/// The difference bounds the error of the finer step whatever the order at which the step converges, from 1 on: contact
/// is of order 1, and modes that the step does not resolve are of no order at all.
fn run_to_tolerance(body: &mut Body, request: &StepRequest, substeps: u32, start: Carry, coarse: Carry) -> Outcome {
    let mut substeps = substeps;
    let mut carry = coarse;
    loop {
        body.keep_coarse_positions();
        substeps = substeps.saturating_mul(2);
        if substeps > request.max_substeps {
            let stable_substep = carry.stability.limit.unwrap_or(f32::INFINITY);
            return Outcome::Unstable { stable_substep };
        }
        match verlet::run(body, request, substeps, start) {
            Ok(finer) => carry = finer,
            Err(TooLong { stable_substep }) => return Outcome::Unstable { stable_substep },
        }
        let error = body.difference_from_coarse();
        if error <= request.tolerance || error.is_infinite() {
            return finish(body, substeps, carry, error);
        }
    }
}

fn finish(body: &Body, substeps: u32, carry: Carry, error: f32) -> Outcome {
    let (positions, velocities) = body.state.newest();
    let finite = |vectors: &Vectors| vectors.largest_length_squared().is_finite();
    if finite(positions) && finite(velocities) {
        Outcome::Done { substeps, carry, error }
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
