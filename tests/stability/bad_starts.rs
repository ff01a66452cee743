//! Bodies with invalid starting shapes. Springs alone do not unfold them: they stay finite, and damping removes their
//! energy.

use glam::{DVec3, Vec3};

use super::setup::{Outcome, Setup, Tier, at_most, fault};
use super::watched::{Watched, momentum};
use crate::support::bodies::{Parts, Random};

fn block(cells: usize) -> Parts {
    Parts::block([cells; 3], 0.05, 0.01, 100.0)
}

fn scatter(parts: &Parts) -> Vec<Vec3> {
    let mut random = Random::new(11);
    let size = parts.size() as f32;
    parts.positions.iter().map(|_| size * random.vector()).collect()
}

fn flatten(parts: &Parts) -> Vec<Vec3> {
    parts.positions.iter().map(|p| p.with_z(0.05)).collect()
}

fn collapse(parts: &Parts) -> Vec<Vec3> {
    let mut random = Random::new(12);
    parts.positions.iter().map(|_| 1e-6 * random.vector()).collect()
}

/// Runs undamped, so that all energy stays, then damped until nothing moves.
fn start_from(setup: &Setup, place: fn(&Parts) -> Vec<Vec3>) -> Outcome {
    let mut parts = block(3);
    let positions = place(&parts);
    let start = |parts: &Parts| {
        let mut watched = Watched::new(setup, parts, Vec3::ZERO)?;
        watched.change(|body| body.set_positions(&positions));
        Ok(watched)
    };
    let mut free = start(&parts)?;
    free.run(setup.step, setup.steps(3.0, 5, setup.pick(300, 3000)))?;

    for (damping, mass) in parts.node_dampings.iter_mut().zip(&parts.masses) {
        *damping = 100.0 * mass;
    }
    let mut damped = start(&parts)?;
    let first = damped.state().energy();
    let rests = damped.settle(setup.step, 2.0)?;
    let last = damped.state();
    if rests {
        at_most("elastic energy left over that at first", last.elastic / first, 0.999)?;
        at_most("kinetic energy left over that at first", last.kinetic / first, 1e-6)?;
    }
    Ok(free.figures())
}

pub fn scattered(setup: &Setup) -> Outcome {
    start_from(setup, scatter)
}

pub fn flattened(setup: &Setup) -> Outcome {
    start_from(setup, flatten)
}

pub fn collapsed(setup: &Setup) -> Outcome {
    start_from(setup, collapse)
}

/// Large enough for two threads to share its nodes.
pub fn scattered_large(setup: &Setup) -> Outcome {
    let parts = block(20);
    let positions = scatter(&parts);
    let mut watched = Watched::new(setup, &parts, Vec3::ZERO)?;
    if setup.tier == Tier::Quick && setup.step > 0.05 {
        // Hundreds of substeps of 150 000 springs in `f64`.
        watched = watched.without_ledger();
    }
    watched.change(|body| body.set_positions(&positions));
    watched.run(setup.step, setup.steps(0.05, 1, setup.pick(2, 40)))?;
    Ok(watched.figures())
}

/// Springs of zero length between coincident nodes: they separate along one direction, and momentum is conserved.
pub fn coincident(setup: &Setup) -> Outcome {
    let place = Vec3::new(0.3, 0.2, 0.1);
    let mut parts = Parts::nodes(vec![place; 4], 0.1);
    parts.springs = vec![[0, 1], [1, 2], [3, 2]];
    parts.stiffnesses = vec![50.0; 3];
    parts.rest_lengths = vec![0.0, 0.04, 0.0];
    let mut pair = Watched::new(setup, &parts, Vec3::ZERO)?;
    // sqrt(2 k / m) is 32 /s: the nodes have separated after a quarter of a period.
    for _ in 0..setup.steps(0.05, 5, 5000) {
        pair.step(setup.step)?;
        let state = pair.state();
        for (position, velocity) in state.positions.iter().zip(&state.velocities) {
            let across = [
                position.y as f32,
                position.z as f32,
                velocity.y as f32,
                velocity.z as f32,
            ];
            if across != [0.2, 0.1, 0.0, 0.0] {
                return fault(format!("a node left the line: {position}, {velocity}"));
            }
        }
        let (sum, size) = momentum(&state, &parts.masses);
        at_most("momentum over that of its parts", sum.length(), 1e-5 * size)?;
    }
    let apart = |watched: &Watched, a: usize, b: usize| {
        let positions = watched.state().positions;
        positions[a].distance(positions[b])
    };
    if setup.step < 0.05 && apart(&pair, 1, 2) < 1e-4 {
        return fault("the nodes have not separated");
    }

    // All nodes of a block at one point.
    let parts = block(2);
    let mut heap = Watched::new(setup, &parts, Vec3::ZERO)?;
    heap.change(|body| body.set_positions(&[Vec3::ZERO; 27]));
    heap.run(setup.step, setup.steps(1.0, 5, setup.pick(200, 2000)))?;
    if heap.state().positions.iter().any(|p| p.y != 0.0 || p.z != 0.0) {
        return fault("a node left the line");
    }

    // A spring of zero length is an isotropic oscillator, which stays on its ellipse.
    let mut bobs = Parts::nodes(vec![Vec3::X, Vec3::NEG_X], 1.0);
    bobs.springs = vec![[0, 1]];
    bobs.stiffnesses = vec![50.0];
    bobs.rest_lengths = vec![0.0];
    let mut bobs = Watched::new(setup, &bobs, Vec3::ZERO)?;
    bobs.change(|body| body.set_velocities(&[Vec3::Y, Vec3::NEG_Y]));
    bobs.run(setup.step, setup.steps(2.0, 5, setup.pick(500, 5000)))?;
    let centre: DVec3 = bobs.state().positions.iter().sum();
    at_most("way of the centre, m", centre.length(), 1e-5)?;
    Ok(heap.figures())
}
