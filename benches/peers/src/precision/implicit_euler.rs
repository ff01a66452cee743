//! Converged implicit Euler steps in double precision: the reference for engines whose time is only known for that
//! method.

use glam::DVec3;

use crate::precision::law::Law;
use crate::precision::model::Model;
use crate::precision::motion::Motion;
use crate::precision::reference::System;

/// Newton's method ends at this ratio of the residual to the initial forces.
const RESIDUAL: f64 = 1e-6;

/// Takes `count` steps of `step` seconds from rest.
pub fn steps(model: &Model, law: Law, step: f64, count: usize) -> Motion {
    let system = System::new(model, law);
    let start: Vec<DVec3> = model.positions.iter().copied().map(DVec3::from).collect();
    let mut positions = start.clone();
    let mut velocities = vec![DVec3::ZERO; start.len()];
    let mut frames = Vec::new();
    for _ in 0..count {
        let next = solved(&system, &positions, &velocities, step);
        for node in 0..next.len() {
            velocities[node] = (next[node] - positions[node]) / step;
        }
        positions = next;
        frames.push(positions.iter().map(DVec3::to_array).collect());
    }
    Motion::new(model.positions.clone(), frames)
}

/// Solves `M (x - y) / t² = f(x)` with y = positions + t velocities for the positions x. Uses Newton's method with
/// conjugate gradients; products with the matrix are finite differences of forces.
fn solved(system: &System, before: &[DVec3], velocities: &[DVec3], step: f64) -> Vec<DVec3> {
    let count = before.len();
    let inertia: Vec<f64> = system.masses().iter().map(|mass| mass / (step * step)).collect();
    let goal: Vec<DVec3> = before.iter().zip(velocities).map(|(x, v)| *x + *v * step).collect();
    let mut positions = before.to_vec();
    let mut forces = vec![DVec3::ZERO; count];
    let residual = |positions: &[DVec3], forces: &mut Vec<DVec3>| {
        system.forces(positions, forces);
        for node in 0..count {
            forces[node] += (goal[node] - positions[node]) * inertia[node];
            if !system.is_free(node) {
                forces[node] = DVec3::ZERO;
            }
        }
        dot(forces, forces).sqrt()
    };
    let weight: f64 = (system.weight() / count as f64) * (count as f64).sqrt();
    for _ in 0..30 {
        if residual(&positions, &mut forces) < RESIDUAL * weight {
            break;
        }
        let change = corrected(system, &positions, &forces, &inertia);
        for node in 0..count {
            positions[node] += change[node];
        }
    }
    positions
}

/// Conjugate gradients, preconditioned by the masses.
fn corrected(system: &System, positions: &[DVec3], residual: &[DVec3], inertia: &[f64]) -> Vec<DVec3> {
    let count = positions.len();
    let mut solution = vec![DVec3::ZERO; count];
    let mut remaining = residual.to_vec();
    let scaled = |remaining: &[DVec3]| {
        remaining
            .iter()
            .zip(inertia)
            .map(|(force, inertia)| *force / *inertia)
            .collect::<Vec<_>>()
    };
    let mut preconditioned = scaled(&remaining);
    let mut direction = preconditioned.clone();
    let mut size = dot(&remaining, &preconditioned);
    let first = size;
    let (mut ahead, mut behind) = (vec![DVec3::ZERO; count], vec![DVec3::ZERO; count]);
    for _ in 0..3000 {
        // A difference that is small compared with the elements and large compared with rounding.
        let reach = direction
            .iter()
            .map(|component| component.abs().max_element())
            .fold(0.0, f64::max);
        let small = 1e-6 / reach;
        let moved = |sign: f64| {
            positions
                .iter()
                .zip(&direction)
                .map(|(x, d)| *x + *d * (sign * small))
                .collect::<Vec<_>>()
        };
        system.forces(&moved(1.0), &mut ahead);
        system.forces(&moved(-1.0), &mut behind);
        let mut product = ahead.clone();
        for node in 0..count {
            product[node] = (behind[node] - ahead[node]) / (2.0 * small) + direction[node] * inertia[node];
            if !system.is_free(node) {
                product[node] = DVec3::ZERO;
            }
        }
        let curvature = dot(&direction, &product);
        if curvature <= 0.0 {
            break;
        }
        let along = size / curvature;
        for node in 0..count {
            solution[node] += direction[node] * along;
            remaining[node] -= product[node] * along;
        }
        preconditioned = scaled(&remaining);
        let next = dot(&remaining, &preconditioned);
        if next < 1e-8 * first {
            break;
        }
        let beta = next / size;
        size = next;
        for node in 0..count {
            direction[node] = preconditioned[node] + direction[node] * beta;
        }
    }
    solution
}

fn dot(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
}
