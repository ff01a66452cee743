//! The reference motion of a scene: leapfrog in `f64` with steps so short that halving their number makes no
//! difference. It is cached in `target/reference`, since it takes long.

use glam::DVec3;

use crate::cache::cached;
use crate::exact::Exact;
use crate::report::Report;
use crate::scene::{DURATION, SAMPLES, SPAN, Scene};

/// The minimum number of steps, relative to the number that stability requires.
const FINER: f64 = 8.0;
/// The minimum number of steps.
const FEWEST: f64 = 25_000.0;

/// Positions at the time of each sample [m].
pub type Motion = Vec<Vec<DVec3>>;

pub struct Reference {
    pub motion: Motion,
    /// The longest stable leapfrog step at the start [s].
    pub stable_step: f64,
    /// The difference from the motion in half as many steps, in the measure of all errors. If it is not tiny, elements
    /// snap through and the motion depends on rounding; errors below it are not reported.
    pub uncertainty: f64,
    /// The largest kinetic energy at the sample times [J].
    pub kinetic_energy: f64,
}

impl Reference {
    /// The cached reference, or a newly computed one.
    pub fn of(scene: &Scene, report: &Report) -> Self {
        let size = 3 * SAMPLES * scene.node_count();
        let numbers = cached(scene, "motion", 3 + size, report, || {
            Some(Self::compute(scene, report).numbers())
        });
        Self::from_numbers(&numbers.expect("a motion can always be computed"), scene)
    }

    /// Three figures, then the positions.
    fn numbers(&self) -> Vec<f64> {
        let figures = [self.stable_step, self.uncertainty, self.kinetic_energy];
        let coordinates = self.motion.iter().flatten().flat_map(|position| position.to_array());
        figures.into_iter().chain(coordinates).collect()
    }

    fn from_numbers(numbers: &[f64], scene: &Scene) -> Self {
        let (figures, coordinates) = numbers.split_at(3);
        let positions = |sample: &[f64]| sample.chunks_exact(3).map(DVec3::from_slice).collect();
        Self {
            motion: coordinates
                .chunks_exact(3 * scene.node_count())
                .map(positions)
                .collect(),
            stable_step: figures[0],
            uncertainty: figures[1],
            kinetic_energy: figures[2],
        }
    }

    fn compute(scene: &Scene, report: &Report) -> Self {
        let exact = Exact::new(scene);
        let stable_step = exact.stable_step(&scene.start());
        let needed = (FINER * DURATION / stable_step).max(FEWEST);
        let per_span = (needed / SAMPLES as f64 / 2.0).ceil() as usize;
        report.progress(&format!(
            "{}: the reference takes {} steps, its check half as many",
            scene.name,
            2 * per_span * SAMPLES
        ));
        let (coarse, _) = motion(scene, &exact, per_span);
        let (motion, kinetic_energy) = motion(scene, &exact, 2 * per_span);
        let start = scene.start();
        Self {
            uncertainty: relative_error(&coarse, &motion, &start),
            motion,
            stable_step,
            kinetic_energy,
        }
    }

    /// RMS distance from this motion over nodes and samples, relative to the RMS distance from the start.
    pub fn error(&self, motion: &Motion, scene: &Scene) -> f64 {
        relative_error(motion, &self.motion, &scene.start())
    }
}

fn relative_error(motion: &Motion, reference: &Motion, start: &[DVec3]) -> f64 {
    let mut squared_error = 0.0;
    let mut moved = 0.0;
    for (positions, reference) in motion.iter().zip(reference) {
        for ((position, reference), start) in positions.iter().zip(reference).zip(start) {
            squared_error += position.distance_squared(*reference);
            moved += reference.distance_squared(*start);
        }
    }
    (squared_error / moved).sqrt()
}

/// The motion with this number of steps between samples, and its largest kinetic energy.
fn motion(scene: &Scene, exact: &Exact, steps_per_span: usize) -> (Motion, f64) {
    let step = SPAN / steps_per_span as f64;
    let mut positions = scene.start();
    let mut velocities = vec![DVec3::ZERO; positions.len()];
    let mut motion = Vec::new();
    let mut kinetic: f64 = 0.0;
    for _ in 0..SAMPLES {
        leapfrog(exact, &mut positions, &mut velocities, step, steps_per_span);
        motion.push(positions.clone());
        kinetic = kinetic.max(exact.energy(&positions, &velocities).kinetic);
    }
    (motion, kinetic)
}

/// Takes `count` leapfrog steps.
pub fn leapfrog(exact: &Exact, positions: &mut [DVec3], velocities: &mut [DVec3], step: f64, count: usize) {
    let half_kicks: Vec<f64> = (exact.masses.iter())
        .map(|&mass| if mass > 0.0 { 0.5 * step / mass } else { 0.0 })
        .collect();
    let mut forces = vec![DVec3::ZERO; positions.len()];
    exact.forces(positions, &mut forces);
    for _ in 0..count {
        for node in 0..positions.len() {
            velocities[node] += half_kicks[node] * forces[node];
            positions[node] += step * velocities[node];
        }
        exact.forces(positions, &mut forces);
        for node in 0..positions.len() {
            velocities[node] += half_kicks[node] * forces[node];
        }
    }
}
