//! Local time steps in a small spring model in `f64`: springs near a tool are kicked `rate` times as often as the
//! others.
//!
//! Forces are split by springs, as in r-RESPA (Tuckerman, Berne, Martyna 1992). Each spring pulls both of its ends at
//! the same times, so the scheme conserves momentum and is symplectic. It counts visits of springs, a lower bound of
//! the cost of local steps.

use glam::DVec3;

use crate::scene::Scene;

/// The result of a run.
pub struct Trace {
    /// Positions of the watched nodes after each step [m].
    pub positions: Vec<DVec3>,
    /// Number of spring visits.
    pub visits: u64,
}

/// One spring: its ends, rest length [m] and stiffness [N/m].
type Spring = ([usize; 2], f64, f64);

/// Runs a scene with `substeps` per step, and `rate` times as many for springs with an end that satisfies `is_near`.
pub fn run(scene: &Scene, substeps: u32, rate: u32, is_near: &dyn Fn(usize) -> bool) -> Trace {
    let rest: Vec<DVec3> = scene
        .mesh
        .positions
        .iter()
        .map(|position| position.as_dvec3())
        .collect();
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
    let short_substep = substep / f64::from(rate);
    let (mut positions, mut velocities) = (rest.clone(), vec![DVec3::ZERO; rest.len()]);
    let mut trace = Trace {
        positions: Vec::new(),
        visits: 0,
    };
    let mut is_first = true;
    for step in 0..scene.steps {
        for index in 0..substeps {
            let start = f64::from(step) * f64::from(scene.step) + f64::from(index) * substep;
            let half = |full: f64| if is_first { 0.5 * full } else { full };
            kick(&slow, &positions, &mut velocities, half(substep) / scene.mass);
            for sub in 0..rate {
                let duration = if sub == 0 { half(short_substep) } else { short_substep };
                kick(&fast, &positions, &mut velocities, duration / scene.mass);
                let center = scene.tool_at(start + f64::from(sub + 1) * short_substep);
                for &node in &often {
                    let velocity = &mut velocities[node];
                    *velocity *= (-scene.damping * short_substep).exp();
                    let from_center = positions[node] + *velocity * short_substep - center;
                    let depth = scene.radius - from_center.length();
                    if depth > 0.0 {
                        *velocity += from_center.normalize() * (depth / short_substep);
                    }
                    positions[node] += *velocity * short_substep;
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

/// Applies spring forces for a duration, given over the mass of a node [s/kg]. Pinned nodes do not drift.
fn kick(springs: &[Spring], positions: &[DVec3], velocities: &mut [DVec3], duration_by_mass: f64) {
    for &([a, b], rest_length, stiffness) in springs {
        let offset = positions[b] - positions[a];
        let length = offset.length();
        let change = offset * ((length - rest_length) * stiffness / length * duration_by_mass);
        velocities[a] += change;
        velocities[b] -= change;
    }
}
