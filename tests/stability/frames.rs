//! Varying frames, and very many of them: the same rest shape.

use glam::Vec3;

use super::ratios::{damp, hold_side};
use super::setup::{Outcome, Setup, at_most};
use super::statics::rest_shape;
use super::watched::Watched;
use crate::support::bodies::{Parts, Random, largest_difference};

const DOWN: Vec3 = Vec3::new(0.0, -9.81, 0.0);

fn hanging_block() -> Parts {
    let mut parts = Parts::block([2, 2, 2], 0.05, 0.01, 100.0);
    hold_side(&mut parts);
    damp(&mut parts, 40.0);
    parts
}

/// The possible error of a rest shape in `f32`, relative to the size of the body: sixteen roundings of its positions.
const SAME_SHAPE: f64 = 1e-6;

/// From a sixteenth of the step to twice the step: at 60 Hz between 1 and 32 ms.
pub fn changing(setup: &Setup) -> Outcome {
    let parts = hanging_block();
    let mut watched = Watched::new(setup, &parts, DOWN)?;
    let mut random = Random::new(51);
    let needed = setup.steps(2.0, 20, usize::MAX);
    let count = needed.min(setup.pick(3000, usize::MAX));
    for _ in 0..count {
        watched.step(setup.step * (1.03 + 0.97 * random.signed()))?;
    }
    if count < needed {
        return Ok(watched.figures());
    }
    let expected = rest_shape(&parts.reference(DOWN));
    let error = largest_difference(&watched.state().positions, &expected) / parts.size();
    at_most("error of the rest shape over the size", error, SAME_SHAPE)?;
    Ok(format!("error {error:.1e}; {}", watched.figures()))
}

/// A million steps, or a million substeps where a step takes more than four.
pub fn a_million(setup: &Setup) -> Outcome {
    let parts = hanging_block();
    let expected = rest_shape(&parts.reference(DOWN));
    let mut watched = Watched::new(setup, &parts, DOWN)?;
    let substeps = watched.step(setup.step)?.substeps as usize;
    let all = setup.pick(15_000, 1_000_000);
    let count = if substeps > 4 { all / substeps } else { all };
    let mut errors = [0.0; 2];
    for error in &mut errors {
        watched.settle(setup.step, 0.5 * count as f64 * f64::from(setup.step))?;
        *error = largest_difference(&watched.state().positions, &expected) / parts.size();
    }
    // In the quick tier it may be too short to come to rest.
    if count as f64 * f64::from(setup.step) < 4.0 {
        return Ok(format!("not at rest after {count} steps; {}", watched.figures()));
    }
    at_most("error of the rest shape over the size", errors[1], SAME_SHAPE)?;
    at_most("growth of that error", errors[1] - errors[0], SAME_SHAPE / 2.0)?;
    Ok(format!("error {:.1e}, then {:.1e}", errors[0], errors[1]))
}
