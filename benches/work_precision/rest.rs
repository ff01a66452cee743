//! The distance of each solver from the exact rest shape in damped frames of 1/60 s, and the time of a frame.

use glam::DVec3;
use sinew::{RestStateReport, Solver};

use crate::clock;
use crate::contender::{Contender, Method, Setup};
use crate::report::{Report, Table, milliseconds};
use crate::scene::Scene;
use crate::tables::{iterations, percent};
use crate::tissue::Tissue;

/// Damping rate against the world [1/s], near-critical for the slowest modes of the scenes.
const DAMPING: f32 = 20.0;
const FRAME: f64 = 1.0 / 60.0;
/// The distance is checked after every `LOOK` frames, for at most `MOST_FRAMES`.
const CHECK_INTERVAL: usize = 15;
const MOST_FRAMES: usize = 240;
/// No scene is at rest earlier.
const FEWEST_FRAMES: usize = 90;

pub fn run(report: &mut Report, scene: &Scene, threads: u32, patience: f64) {
    let scene = scene.settling(DAMPING, scene.gravity_at_rest);
    let shape = match rest_shape(&scene) {
        Ok(shape) => shape,
        Err(reason) => {
            report.not_offered(&format!("{} at rest", scene.name), &reason);
            return;
        }
    };
    let rest = shape.positions;
    let size = distance(&rest, &scene.start());
    report.write(&format!(
        "\n### {}: at rest, {:.2} m/s²\n\nFrames of 1/60 s, damping of {DAMPING} /s, until the distance to the rest shape \
         no longer decreases. `rest_state` found it in {:.2} s and {} solutions; it is {:.1} mm from the start (RMS), and the \
         largest force left in it is {:.0e} N, {:.0e} of the body's weight. Distances are RMS, in those of the rest shape from \
         the start.\n",
        scene.name,
        scene.gravity.length(),
        shape.seconds,
        shape.report.iterations,
        1e3 * size,
        shape.report.residual,
        shape.report.residual / weight(&scene),
    ));
    let mut table = Table::new(&[
        "solver",
        "h, ms",
        "iterations",
        "distance",
        "ms per frame",
        "in the end",
        "frames",
        "status",
    ]);
    for (name, setup) in setups(threads) {
        let frames = settle(&scene, setup, &rest, size, patience);
        let mut row = vec![name.to_owned()];
        match frames {
            Ok(settled) => row.extend([
                milliseconds(settled.step),
                iterations(&setup, settled.iterations),
                percent(settled.distance),
                milliseconds(settled.per_frame),
                milliseconds(settled.last_frames),
                settled.frames.to_string(),
                settled.status,
            ]),
            Err(reason) => {
                row.extend(vec!["-".to_owned(); 6]);
                row.push(reason);
            }
        }
        report.progress(&format!("{}: at rest: {}", scene.name, row.join(", ")));
        table.row(row);
    }
    report.table(&table);
}

/// Maximum matrix-vector products of IMPLICIT per frame; 0: automatic.
const BUDGETS: [u32; 5] = [0, 3, 4, 6, 8];

fn setups(threads: u32) -> Vec<(&'static str, Setup)> {
    let setup = |method, steps, iterations| Setup {
        iterations,
        ..Setup::new(method, steps, FRAME, threads)
    };
    let verlet = setup(Method::Sinew(Solver::Verlet), 1, 0);
    let scaled = Setup {
        mass_scaling: 1e-3,
        ..verlet
    };
    let mut setups = vec![
        ("VERLET, no mass added", verlet),
        ("VERLET, mass scaling", scaled),
        ("NEWTON", setup(Method::Sinew(Solver::Newton), 1, 0)),
    ];
    setups.extend(BUDGETS.map(|budget| ("IMPLICIT", setup(Method::Sinew(Solver::Implicit), 1, budget))));
    let coarse = setup(Method::Sinew(Solver::Implicit), 1, 0);
    setups.push((
        "IMPLICIT, accuracy 0.3",
        Setup {
            accuracy: 0.3,
            ..coarse
        },
    ));
    setups.extend([16, 32, 64, 128].map(|substeps| ("XPBD, substeps", setup(Method::Xpbd, substeps, 0))));
    setups.extend([1, 3, 10, 30].map(|iterations| ("Projective", setup(Method::Projective, 1, iterations))));
    setups
}

/// The result of `rest_state` for a scene.
struct RestShape {
    positions: Vec<DVec3>,
    report: RestStateReport,
    seconds: f64,
}

fn rest_shape(scene: &Scene) -> Result<RestShape, String> {
    let mut tissue = Tissue::new(
        scene,
        Solver::Newton,
        Setup::new(Method::Sinew(Solver::Newton), 1, FRAME, 1),
    )?;
    let mut report = Err(String::new());
    let seconds = clock::time(|| report = tissue.rest()).processor;
    Ok(RestShape {
        report: report?,
        positions: tissue.read().positions,
        seconds,
    })
}

/// Weight of the whole scene [N].
fn weight(scene: &Scene) -> f64 {
    let mass: f64 = scene.masses.iter().map(|&mass| f64::from(mass)).sum();
    mass * f64::from(scene.gravity.length())
}

struct Settled {
    distance: f64,
    /// Mean time of all frames, and of the frames since the last check [s].
    per_frame: f64,
    last_frames: f64,
    /// Duration of a step [s].
    step: f64,
    frames: usize,
    /// Iterations of the last frame, if the solver chose them.
    iterations: Option<f64>,
    status: String,
}

/// Runs until the distance no longer decreases or the time limit ends, or returns the reason that the setup is not
/// supported.
fn settle(scene: &Scene, setup: Setup, rest: &[DVec3], size: f64, patience: f64) -> Result<Settled, String> {
    let mut contender = setup.start(scene).map_err(|_| "not offered".to_owned())?;
    contender.restart();
    let (mut seconds, mut seconds_before) = (0.0, 0.0);
    let mut settled = Settled {
        distance: 1.0,
        per_frame: 0.0,
        last_frames: 0.0,
        step: setup.step(),
        frames: 0,
        iterations: None,
        status: String::new(),
    };
    while settled.status.is_empty() {
        let mut advanced = Ok(());
        let elapsed = clock::time(|| advanced = contender.advance());
        seconds += setup.counted(elapsed);
        settled.frames += 1;
        settled.per_frame = seconds / settled.frames as f64;
        if let Some(substeps) = contender.substeps() {
            settled.step = setup.span / f64::from(substeps.max(1));
        }
        settled.iterations = contender.iterations().map(f64::from);
        let out_of_time = seconds > patience || settled.frames >= MOST_FRAMES;
        if let Err(reason) = advanced {
            settled.status = format!("failed: {reason}");
        } else if settled.frames.is_multiple_of(CHECK_INTERVAL) || out_of_time {
            let before = settled.distance;
            let frames_since_check = (settled.frames - 1) % CHECK_INTERVAL + 1;
            settled.last_frames = (seconds - seconds_before) / frames_since_check as f64;
            seconds_before = seconds;
            settled.distance = distance(&contender.read().positions, rest) / size;
            if !settled.distance.is_finite() {
                settled.status = "failed: not finite".into();
            } else if settled.frames >= FEWEST_FRAMES && settled.distance > 0.95 * before {
                settled.status = "at rest".into();
            } else if out_of_time {
                settled.status = "not yet at rest".into();
            }
        }
    }
    Ok(settled)
}

/// RMS distance [m].
fn distance(positions: &[DVec3], others: &[DVec3]) -> f64 {
    let squares: f64 = positions.iter().zip(others).map(|(a, b)| a.distance_squared(*b)).sum();
    (squares / positions.len() as f64).sqrt()
}
