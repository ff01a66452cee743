//! Stiffness and mass ratios of a million in one body, and steps far above the stable limit.

use glam::Vec3;

use super::setup::{Outcome, Setup, Stop, at_most};
use super::statics::rest_shape;
use super::watched::Watched;
use crate::support::bodies::{Parts, Random, largest_difference};

const DOWN: Vec3 = Vec3::new(0.0, -9.81, 0.0);

/// Damps all nodes at this rate (1/s).
pub fn damp(parts: &mut Parts, rate: f32) {
    for (damping, mass) in parts.node_dampings.iter_mut().zip(&parts.masses) {
        *damping = rate * mass;
    }
}

/// Pins the nodes of the block at x = 0.
pub fn hold_side(parts: &mut Parts) {
    for (position, mass) in parts.positions.iter().zip(&mut parts.masses) {
        if position.x == 0.0 {
            *mass = 0.0;
        }
    }
}

/// Returns the largest error of a chain's stretch, relative to its largest stretch.
fn stretch_error(parts: &Parts, watched: &Watched) -> f64 {
    let positions = watched.state().positions;
    let (mut load, mut worst, mut largest) = (0.0, 0.0_f64, 0.0_f64);
    for link in (0..parts.springs.len()).rev() {
        load += f64::from(parts.masses[link + 1]) * f64::from(-DOWN.y);
        let expected = load / f64::from(parts.stiffnesses[link]);
        let stretch = positions[link].distance(positions[link + 1]) - f64::from(parts.rest_lengths[link]);
        worst = worst.max((stretch - expected).abs());
        largest = largest.max(expected);
    }
    worst / largest
}

pub fn stiffness_in_a_chain(setup: &Setup) -> Outcome {
    let mut parts = Parts::chain(7, Vec3::NEG_Y * 0.02, 0.1, 20.0);
    for stiffness in parts.stiffnesses.iter_mut().step_by(2) {
        *stiffness = 2e7;
    }
    parts.masses[0] = 0.0;
    damp(&mut parts, 8.0);
    let mut watched = Watched::new(setup, &parts, DOWN)?;
    if !watched.settle(setup.step, 6.0)? {
        return Ok(watched.figures());
    }
    let error = stretch_error(&parts, &watched);
    at_most("error of the stretch", error, 1e-4)?;
    Ok(format!("error {error:.1e}; {}", watched.figures()))
}

/// One spring in five of a block, compared with the rest shape in `f64`.
pub fn stiffness_in_a_block(setup: &Setup) -> Outcome {
    let mut parts = Parts::block([2, 2, 2], 0.05, 0.01, 40.0);
    parts.masses.fill(0.1);
    let mut random = Random::new(21);
    for stiffness in &mut parts.stiffnesses {
        *stiffness = if random.below(5) == 0 { 2e7 } else { 20.0 };
    }
    hold_side(&mut parts);
    damp(&mut parts, 15.0);
    let gravity = 0.1 * DOWN;
    let mut watched = Watched::new(setup, &parts, gravity)?;
    let expected = rest_shape(&parts.reference(gravity));
    let sag = largest_difference(&expected, &watched.state().positions);
    if !watched.settle(setup.step, 6.0)? {
        return Ok(watched.figures());
    }
    let error = largest_difference(&expected, &watched.state().positions) / sag;
    at_most("error of the sag", error, 1e-4)?;
    Ok(format!("error {error:.1e} of {sag:.1e} m; {}", watched.figures()))
}

pub fn masses(setup: &Setup) -> Outcome {
    let mut parts = Parts::chain(6, Vec3::NEG_Y * 0.02, 1e-6, 40.0);
    parts.masses[0] = 0.0;
    parts.masses[5] = 1.0;
    damp(&mut parts, 4.0);
    let mut watched = Watched::new(setup, &parts, DOWN)?;
    if !watched.settle(setup.step, 8.0)? {
        return Ok(watched.figures());
    }
    let error = stretch_error(&parts, &watched);
    at_most("error of the stretch", error, 1e-3)?;
    Ok(format!("error {error:.1e}; {}", watched.figures()))
}

/// From stable steps to steps that no number of substeps makes stable.
pub fn above_the_limit(setup: &Setup) -> Outcome {
    let mut refused = Vec::new();
    let mut figures = String::new();
    for stiffness in [1e2, 1e4, 1e6, 1e10, 1e30] {
        let mut parts = Parts::block([2, 2, 2], 0.05, 0.01, stiffness);
        hold_side(&mut parts);
        let mut watched = Watched::new(setup, &parts, DOWN)?;
        match watched.run(setup.step, setup.steps(0.5, 5, setup.pick(20, 200))) {
            Ok(()) => figures = format!("{stiffness:.0e} N/m: {}", watched.figures()),
            Err(Stop::Refused(_)) => refused.push(format!("{stiffness:.0e}")),
            Err(stop) => return Err(stop),
        }
    }
    Ok(format!("{figures}; refused: {}", refused.join(", ")))
}
