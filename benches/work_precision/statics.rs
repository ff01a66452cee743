//! The shape in which a scene comes to rest, in `f64`: Newton's method with conjugate gradients, preconditioned by a factor
//! of the springs' Laplacian.
//!
//! A mass term that fades leads from the start to the rest shape without leaps.

use std::time::{Duration, Instant};

use glam::DVec3;

use crate::bisection;
use crate::cholesky::Factor;
use crate::contender::record;
use crate::exact::Exact;
use crate::kept::kept;
use crate::projective::system;
use crate::report::Report;
use crate::scene::Scene;
use crate::simd::Record;

/// The first of the pseudo time steps, s, and by how much they grow.
const FIRST_STEP: f64 = 1.0 / 30.0;
const GROWTH: f64 = 1.5;
/// The pseudo time step at which inertia no longer counts, s.
const LAST_STEP: f64 = 1e3;
/// A Newton step that is too long to lengthen the time step, m.
const FAR: f64 = 1e-2;
/// At rest once a Newton step moves no node further, m.
const AT_REST: f64 = 1e-8;
const MOST_ITERATIONS: usize = 400;
/// The search is given up after so long.
const PATIENCE: Duration = Duration::from_secs(90);

/// Where the nodes are at rest, m; and the largest force that is left, in the largest weight of a node. `None`: not found.
pub fn rest_shape(scene: &Scene, report: &Report) -> Option<(Vec<DVec3>, f64)> {
    let numbers = kept(scene, "rest", 1 + 3 * scene.node_count(), report, || {
        let (positions, left) = find(scene, report)?;
        let coordinates = positions.iter().flat_map(|position| position.to_array());
        Some([left].into_iter().chain(coordinates).collect())
    })?;
    let (left, coordinates) = numbers.split_first()?;
    Some((coordinates.chunks_exact(3).map(DVec3::from_slice).collect(), *left))
}

fn find(scene: &Scene, report: &Report) -> Option<(Vec<DVec3>, f64)> {
    let begin = Instant::now();
    let mut statics = Statics::new(scene);
    let mut step = FIRST_STEP;
    let mut moved = f64::INFINITY;
    while step < LAST_STEP || moved > AT_REST {
        if begin.elapsed() > PATIENCE {
            return None;
        }
        moved = statics.newton(step);
        // Where a step went far, the time step stays as it is.
        if moved < FAR {
            step *= GROWTH;
        }
    }
    report.progress(&format!(
        "{}: the rest shape took {:.1} s",
        scene.name,
        begin.elapsed().as_secs_f64()
    ));
    let weight =
        statics.exact.masses.iter().fold(0.0, |most: f64, &mass| most.max(mass)) * f64::from(scene.gravity.length());
    let mut forces = vec![DVec3::ZERO; scene.node_count()];
    statics.exact.forces(&statics.positions, &mut forces);
    let left = forces.iter().fold(0.0, |most: f64, force| most.max(force.length())) / weight;
    Some((statics.positions, left))
}

struct Statics {
    exact: Exact,
    places: Vec<u32>,
    factor: Factor,
    scratch: Vec<Record>,
    positions: Vec<DVec3>,
}

impl Statics {
    fn new(scene: &Scene) -> Self {
        let places = bisection::places(&bisection::order(scene));
        Self {
            exact: Exact::new(scene),
            factor: Factor::new(&system(scene, &places, 1.0)),
            scratch: vec![Record::default(); scene.node_count()],
            places,
            positions: scene.start(),
        }
    }

    /// One Newton step of the potential energy with nodes held where they are by `mass / step²`; how far the furthest
    /// went, m.
    fn newton(&mut self, step: f64) -> f64 {
        let mut forces = vec![DVec3::ZERO; self.positions.len()];
        self.exact.forces(&self.positions, &mut forces);
        let holding: Vec<f64> = self.exact.masses.iter().map(|mass| mass / (step * step)).collect();
        let mut direction = self.solve(&forces, &holding);
        let downhill: f64 = direction.iter().zip(&forces).map(|(d, f)| d.dot(*f)).sum();
        if downhill < 0.0 {
            direction.iter_mut().for_each(|d| *d = -*d);
        }
        let before = self.exact.potential(&self.positions);
        let mut length = 1.0;
        for _ in 0..30 {
            let next: Vec<DVec3> = self
                .positions
                .iter()
                .zip(&direction)
                .map(|(x, d)| *x + length * *d)
                .collect();
            // Rounding may raise the energy of a step that no longer matters.
            if self.exact.potential(&next) <= before + 1e-12 * before.abs() {
                self.positions = next;
                return length * direction.iter().fold(0.0, |most: f64, d| most.max(d.length()));
            }
            length *= 0.5;
        }
        0.0
    }

    /// Conjugate gradients, up to where the energy curves down (Steihaug 1983).
    fn solve(&mut self, forces: &[DVec3], holding: &[f64]) -> Vec<DVec3> {
        let dot = |a: &[DVec3], b: &[DVec3]| -> f64 { a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum() };
        let mut solution = vec![DVec3::ZERO; forces.len()];
        let mut residual = forces.to_vec();
        let mut preconditioned = self.precondition(&residual);
        let mut direction = preconditioned.clone();
        let mut curved = vec![DVec3::ZERO; forces.len()];
        let mut size = dot(&residual, &preconditioned);
        let enough = 1e-12 * size;
        for iteration in 0..MOST_ITERATIONS {
            if !(size > enough) {
                break;
            }
            self.curve(&direction, holding, &mut curved);
            let curvature = dot(&direction, &curved);
            if curvature <= 0.0 {
                return if iteration == 0 { direction } else { solution };
            }
            let length = size / curvature;
            for node in 0..forces.len() {
                solution[node] += length * direction[node];
                residual[node] -= length * curved[node];
            }
            preconditioned = self.precondition(&residual);
            let next = dot(&residual, &preconditioned);
            for (direction, preconditioned) in direction.iter_mut().zip(&preconditioned) {
                *direction = *preconditioned + *direction * (next / size);
            }
            size = next;
        }
        solution
    }

    /// The second derivative of the energy, along `direction`.
    fn curve(&self, direction: &[DVec3], holding: &[f64], curved: &mut [DVec3]) {
        for ((curved, direction), holding) in curved.iter_mut().zip(direction).zip(holding) {
            *curved = *direction * *holding;
        }
        for spring in &self.exact.springs {
            let apart = spring.between(&self.positions);
            let length = apart.length();
            let along = apart / length;
            let change = spring.between(direction);
            let across = 1.0 - spring.rest_length / length;
            let push = spring.stiffness * (across * change + (1.0 - across) * along.dot(change) * along);
            curved[spring.a as usize] += push;
            curved[spring.b as usize] -= push;
        }
        self.exact.hold(curved);
    }

    fn precondition(&mut self, residual: &[DVec3]) -> Vec<DVec3> {
        // What is small in f64 may be nothing in f32.
        let scale = residual
            .iter()
            .fold(0.0, |most: f64, r| most.max(r.abs().max_element()))
            .max(1e-300);
        for (&place, residual) in self.places.iter().zip(residual) {
            self.scratch[place as usize] = record((*residual / scale).as_vec3(), 0.0);
        }
        self.factor.solve(&mut self.scratch);
        let solved = |&place: &u32| crate::contender::vector(&self.scratch[place as usize]) * scale;
        let mut solution: Vec<DVec3> = self.places.iter().map(solved).collect();
        self.exact.hold(&mut solution);
        solution
    }
}
