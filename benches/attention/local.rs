//! Local time steps in a small model of springs, in f64: those near a tool are kicked `rate` times as often as all others.
//!
//! Forces are split by springs, as in r-RESPA (Tuckerman, Berne, Martyna 1992): each spring pulls both of its ends at the same times, so that momentum is
//! kept and the scheme is symplectic. What it counts is visits of springs, the least that local steps can cost.

use glam::DVec3;

use crate::scene::Scene;

/// What came of a run.
pub struct Trace {
    /// Where the watched nodes were after each step, m.
    pub positions: Vec<DVec3>,
    /// How often springs were visited.
    pub visits: u64,
}

/// One spring: its ends, rest length, m, and stiffness, N/m.
type Spring = ([usize; 2], f64, f64);

/// Runs a scene with `substeps` in each step and `rate` times as many for springs with an end that `is_near`.
pub fn run(scene: &Scene, substeps: u32, rate: u32, is_near: &dyn Fn(usize) -> bool) -> Trace {
    let rest: Vec<DVec3> = scene.mesh.positions.iter().map(|place| place.as_dvec3()).collect();
    let (fast, slow): (Vec<Spring>, Vec<Spring>) = scene
        .springs()
        .into_iter()
        .map(|([a, b], stiffness)| ([a, b], rest[a].distance(rest[b]), stiffness))
        .partition(|(ends, ..)| ends.iter().any(|&end| is_near(end)));
    let mut drifts_often = vec![false; rest.len()];
    fast.iter()
        .flat_map(|(ends, ..)| ends)
        .for_each(|&end| drifts_often[end] = true);
    let moves = |node: &usize| !scene.is_pinned(*node);
    let (often, seldom): (Vec<usize>, Vec<usize>) = (0..rest.len()).filter(moves).partition(|&node| drifts_often[node]);
    let substep = f64::from(scene.step) / f64::from(substeps);
    let part = substep / f64::from(rate);
    let (mut positions, mut velocities) = (rest.clone(), vec![DVec3::ZERO; rest.len()]);
    let mut trace = Trace {
        positions: Vec::new(),
        visits: 0,
    };
    let mut is_first = true;
    for step in 0..scene.steps {
        for index in 0..substeps {
            let start = f64::from(step) * f64::from(scene.step) + f64::from(index) * substep;
            let half = |whole: f64| if is_first { 0.5 * whole } else { whole };
            kick(&slow, &positions, &mut velocities, half(substep) / scene.mass);
            for sub in 0..rate {
                let duration = if sub == 0 { half(part) } else { part };
                kick(&fast, &positions, &mut velocities, duration / scene.mass);
                let centre = scene.tool_at(start + f64::from(sub + 1) * part);
                for &node in &often {
                    let velocity = &mut velocities[node];
                    *velocity *= (-scene.damping * part).exp();
                    let out = positions[node] + *velocity * part - centre;
                    let depth = scene.radius - out.length();
                    if depth > 0.0 {
                        *velocity += out.normalize() * (depth / part);
                    }
                    positions[node] += *velocity * part;
                }
            }
            for &node in &seldom {
                velocities[node] *= (-scene.damping * substep).exp();
                positions[node] += velocities[node] * substep;
            }
            trace.visits += (slow.len() + rate as usize * fast.len()) as u64;
            is_first = false;
        }
        trace
            .positions
            .extend(scene.watched.iter().map(|&node| positions[node]));
    }
    trace
}

/// Lets springs pull for so long, s over the mass of a node; pinned nodes do not drift.
fn kick(springs: &[Spring], positions: &[DVec3], velocities: &mut [DVec3], duration_by_mass: f64) {
    for &([a, b], rest_length, stiffness) in springs {
        let way = positions[b] - positions[a];
        let length = way.length();
        let change = way * ((length - rest_length) * stiffness / length * duration_by_mass);
        velocities[a] += change;
        velocities[b] -= change;
    }
}
