//! Checks the world's tolerance: frames are compared with the same frames in fine `f64` steps from the same state. It
//! also measures the error of the whole motion.

use glam::DVec3;
use sinew::Solver;

use crate::clock;
use crate::contender::{Contender, Method, Setup, State};
use crate::exact::Exact;
use crate::reference::{Reference, leapfrog};
use crate::report::{Report, Table, digits};
use crate::scene::{DURATION, SAMPLES, Scene};
use crate::tables::percent;
use crate::tissue::Tissue;

/// Tolerances [mm].
const TOLERANCES: [f64; 3] = [1.0, 0.1, 0.01];
/// Steps of the motion, a frame of 1/64 s each.
const FRAMES: usize = 2 * SAMPLES;
/// Every `COMPARED`th frame is compared.
const COMPARED: usize = 5;
/// Fine steps are shorter than stability requires by this factor.
const FINER: f64 = 8.0;

pub fn run(report: &mut Report, scene: &Scene, reference: &Reference, threads: u32, patience: f64) {
    report.write(&format!(
        "\n### {}: tolerance\n\nFrames of 1/64 s under the world's `tolerance`. Error of a step: the largest distance of a node, after a \
         frame, from its position by leapfrog in `f64` from the same state; the largest of every {COMPARED}th frame.\n",
        scene.name
    ));
    let mut table = Table::new(&[
        "solver",
        "tolerance, mm",
        "error of a step, mm",
        "part of the tolerance",
        "largest estimate, mm",
        "error of the motion",
        "s/s",
        "status",
    ]);
    for (name, solver) in [("VERLET", Solver::Verlet), ("IMPLICIT", Solver::Implicit)] {
        for tolerance in TOLERANCES {
            let mut row = vec![name.to_owned(), tolerance.to_string()];
            match measure(scene, reference, solver, threads, (1e-3 * tolerance) as f32, patience) {
                Ok(result) => row.extend([
                    format!("{:.1e}", 1e3 * result.step_error),
                    digits(1e3 * result.step_error / tolerance),
                    format!("{:.1e}", 1e3 * result.estimate),
                    percent(result.error),
                    digits(result.seconds),
                    if 1e3 * result.step_error < tolerance {
                        "kept"
                    } else {
                        "NOT KEPT"
                    }
                    .to_owned(),
                ]),
                Err(reason) => {
                    row.extend(vec!["-".to_owned(); 5]);
                    row.push(reason);
                }
            }
            report.progress(&format!("{}: tolerance: {}", scene.name, row.join(", ")));
            table.row(row);
        }
    }
    report.table(&table);
}

struct ToleranceRun {
    /// The largest error of a step [m].
    step_error: f64,
    /// The largest estimate [m].
    estimate: f32,
    /// Error of the motion, in the measure of all errors.
    error: f64,
    /// Seconds per simulated second.
    seconds: f64,
}

fn measure(
    scene: &Scene,
    reference: &Reference,
    solver: Solver,
    threads: u32,
    tolerance: f32,
    patience: f64,
) -> Result<ToleranceRun, String> {
    let exact = Exact::new(scene);
    let setup = Setup::new(Method::Sinew(solver), 1, DURATION / FRAMES as f64, threads);
    let mut tissue = Tissue::with_tolerance(scene, solver, setup, tolerance)?;
    let mut result = ToleranceRun {
        step_error: 0.0,
        estimate: 0.0,
        error: 0.0,
        seconds: 0.0,
    };
    let mut motion = Vec::new();
    let mut spent = 0.0;
    for frame in 0..FRAMES {
        if spent > patience {
            let seconds = spent / (frame as f64 * setup.span);
            return Err(format!("too slow: about {} s/s", digits(seconds)));
        }
        let before = frame.is_multiple_of(COMPARED).then(|| tissue.read());
        let mut advanced = Ok(());
        let elapsed = clock::time(|| advanced = tissue.advance());
        advanced?;
        spent += setup.counted(elapsed);
        result.estimate = result.estimate.max(tissue.estimate());
        let positions = tissue.read().positions;
        if let Some(before) = before {
            let fine = fine_positions(&exact, reference, before, setup.span);
            result.step_error = result.step_error.max(furthest(&positions, &fine));
        }
        if (frame + 1).is_multiple_of(FRAMES / SAMPLES) {
            motion.push(positions);
        }
    }
    result.error = reference.error(&motion, scene);
    result.seconds = spent / DURATION;
    Ok(result)
}

/// Final positions of leapfrog after `duration` [s].
fn fine_positions(exact: &Exact, reference: &Reference, from: State, duration: f64) -> Vec<DVec3> {
    let steps = (FINER * duration / reference.stable_step).ceil() as usize;
    let State {
        mut positions,
        mut velocities,
    } = from;
    leapfrog(exact, &mut positions, &mut velocities, duration / steps as f64, steps);
    positions
}

/// The largest distance of a node [m].
fn furthest(positions: &[DVec3], others: &[DVec3]) -> f64 {
    let distances = positions.iter().zip(others).map(|(a, b)| a.distance(*b));
    distances.fold(0.0, f64::max)
}
