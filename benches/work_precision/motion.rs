//! Work and precision of a motion: runs and times every point of every line, and compares it with the reference.

use glam::DVec3;

use crate::clock;
use crate::contender::{Contender, Setup, State};
use crate::exact::Exact;
use crate::lines::Line;
use crate::reference::{Motion, Reference};
use crate::report::{Report, digits};
use crate::scene::{DURATION, SAMPLES, SPAN, Scene};

/// A larger error, relative to the RMS distance from the start, is a failure.
const FAILED: f64 = 10.0;

/// The measuring effort per point.
#[derive(Clone, Copy)]
pub struct Effort {
    pub quick: bool,
    /// Timed runs after the first, for points that take less than a second.
    pub runs: usize,
    /// A run that takes longer, or is expected to, is stopped [s].
    pub patience: f64,
    /// Time limit of a run to rest [s].
    pub patience_at_rest: f64,
}

impl Effort {
    pub const FULL: Self = Self {
        quick: false,
        runs: 1,
        patience: 6.0,
        patience_at_rest: 6.0,
    };
    pub const QUICK: Self = Self {
        quick: true,
        runs: 1,
        patience: 0.4,
        patience_at_rest: 0.5,
    };
}

/// A setting and its result.
pub struct Point {
    pub setup: Setup,
    /// The duration of a step or substep [s].
    pub step: f64,
    /// Time of the setup [s].
    pub preparation: f64,
    pub outcome: Result<Measured, Missing>,
}

/// The reason for a point without figures.
#[derive(Clone, Debug)]
pub enum Missing {
    Failed(String),
    /// Stopped or not started, as it takes this many seconds per simulated second.
    TooSlow(f64),
}

impl std::fmt::Display for Missing {
    fn fmt(&self, out: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Self::Failed(reason) => write!(out, "failed: {reason}"),
            Self::TooSlow(seconds) => write!(out, "too slow: about {} s/s", digits(*seconds)),
        }
    }
}

#[derive(Clone, Copy)]
pub struct Measured {
    /// RMS over nodes and samples, relative to the RMS distance from the start.
    pub error: f64,
    /// Error of the total force on the pins, RMS over samples, relative to the RMS of that force.
    pub force_error: f64,
    /// Error of the volume, RMS over samples, relative to the volume at the start; `None` without tetrahedra.
    pub volume_error: Option<f64>,
    /// Seconds per simulated second.
    pub seconds: f64,
    /// Iterations per step, if the solver chose them.
    pub iterations: Option<f64>,
    /// Time per spring and step [s].
    pub per_spring: f64,
    /// Energy at the end minus that at the start, relative to the largest kinetic energy.
    pub drift: f64,
}

/// A line and its points, or the reason that it is not supported.
pub struct Sweep {
    pub line: Line,
    pub points: Result<Vec<Point>, String>,
}

/// Measures a line from coarse to fine, within the time limit.
pub fn sweep(scene: &Scene, reference: &Reference, line: Line, effort: Effort, report: &Report) -> Sweep {
    let exact = Exact::new(scene);
    let mut points: Vec<Point> = Vec::new();
    let mut spent: Option<(f64, f64)> = None;
    for (index, &setup) in line.setups.iter().enumerate() {
        let work = setup.work();
        let expected = spent.map(|(seconds, steps)| seconds * work / steps);
        if effort.quick && index % 2 == 1 {
            continue;
        }
        if let Some(seconds) = expected.filter(|&seconds| seconds > effort.patience) {
            points.push(Point {
                setup,
                step: setup.step() / f64::from(setup.substeps.max(1)),
                preparation: f64::NAN,
                outcome: Err(Missing::TooSlow(seconds / DURATION)),
            });
            continue;
        }
        match measure(scene, &exact, reference, setup, effort) {
            Err(reason) => {
                return Sweep {
                    line,
                    points: Err(reason),
                };
            }
            Ok(point) => {
                match point.outcome {
                    Ok(measured) => spent = Some((measured.seconds * DURATION, work)),
                    Err(Missing::TooSlow(seconds)) => spent = Some((seconds * DURATION, work)),
                    Err(Missing::Failed(_)) => {}
                }
                report.progress(&format!("{}: {}: {}", scene.name, line.name, described(&point)));
                points.push(point);
            }
        }
    }
    Sweep {
        line,
        points: Ok(points),
    }
}

fn described(point: &Point) -> String {
    let step = 1e3 * point.step;
    match &point.outcome {
        Ok(measured) => format!(
            "h {step:.4} ms, error {:.2e}, {:.4} s/s",
            measured.error, measured.seconds
        ),
        Err(missing) => format!("h {step:.4} ms, {missing}"),
    }
}

/// Runs one setting: once to compare, and again for the best time. An error means that the setting is not supported.
pub fn measure(
    scene: &Scene,
    exact: &Exact,
    reference: &Reference,
    setup: Setup,
    effort: Effort,
) -> Result<Point, String> {
    let mut contender = Err(String::new());
    let preparation = clock::time(|| contender = setup.start(scene)).wall;
    let mut contender = contender?;
    let at_start = exact
        .energy(&scene.start(), &vec![DVec3::ZERO; scene.node_count()])
        .total();
    let mut step = setup.step() / f64::from(setup.substeps.max(1));
    let outcome = run(contender.as_mut(), setup, effort.patience).and_then(|first| {
        let error = reference.error(&first.motion, scene);
        // The negated comparison also rejects NaN.
        if !(error < FAILED) {
            return Err(Missing::Failed(match error.is_nan() {
                true => "not finite".into(),
                false => format!("error {error:.0e}"),
            }));
        }
        let runs = if first.seconds < 1.0 { effort.runs } else { 0 };
        let mut best = first.seconds;
        for _ in 0..runs {
            best = best.min(run(contender.as_mut(), setup, f64::INFINITY)?.seconds);
        }
        if let Some(substeps) = first.substeps {
            step = DURATION / f64::from(substeps);
        }
        let energy = exact.energy(&first.last.positions, &first.last.velocities).total();
        Ok(Measured {
            error,
            force_error: force_error(exact, &first.motion, reference),
            volume_error: volume_error(scene, &first.motion, reference),
            seconds: best / DURATION,
            iterations: (first.iterations).map(|all| f64::from(all) / (SAMPLES as f64 * f64::from(setup.steps))),
            per_spring: best / (scene.springs.len() as f64 * DURATION / step),
            drift: (energy - at_start) / reference.kinetic_energy,
        })
    });
    Ok(Point {
        setup,
        step,
        preparation,
        outcome,
    })
}

/// See [`Measured`].
fn force_error(exact: &Exact, motion: &Motion, reference: &Reference) -> f64 {
    let mut squared_error = 0.0;
    let mut size = 0.0;
    for (positions, reference) in motion.iter().zip(&reference.motion) {
        let force = exact.force_on_pins(reference);
        squared_error += exact.force_on_pins(positions).distance_squared(force);
        size += force.length_squared();
    }
    (squared_error / size).sqrt()
}

/// See [`Measured`].
fn volume_error(scene: &Scene, motion: &Motion, reference: &Reference) -> Option<f64> {
    let squared_error = |(positions, reference): (&Vec<DVec3>, &Vec<DVec3>)| {
        (scene.volume(positions) - scene.volume(reference)).powi(2)
    };
    let squares: f64 = motion.iter().zip(&reference.motion).map(squared_error).sum();
    (!scene.tetrahedra.is_empty()).then(|| (squares / SAMPLES as f64).sqrt() / scene.volume(&scene.start()))
}

/// The result of one run.
struct Run {
    seconds: f64,
    motion: Motion,
    /// The final state.
    last: State,
    /// Totals, if the solver chose them.
    substeps: Option<u32>,
    iterations: Option<u32>,
}

/// Runs a motion from its start, unless it takes longer than `patience` [s].
fn run(contender: &mut dyn Contender, setup: Setup, patience: f64) -> Result<Run, Missing> {
    contender.restart();
    let mut seconds = 0.0;
    let mut motion = Motion::new();
    let mut substeps = Some(0);
    let mut iterations = Some(0);
    let mut last = contender.read();
    for sample in 0..SAMPLES {
        // The total time is extrapolated from the fraction that was run.
        if seconds > patience {
            return Err(Missing::TooSlow(seconds / (sample as f64 * SPAN)));
        }
        let mut advanced = Ok(());
        let elapsed = clock::time(|| advanced = contender.advance());
        advanced.map_err(Missing::Failed)?;
        seconds += setup.counted(elapsed);
        substeps = contender.substeps().and_then(|count| Some(substeps? + count));
        iterations = contender.iterations().and_then(|count| Some(iterations? + count));
        last = contender.read();
        motion.push(last.positions.clone());
    }
    Ok(Run {
        seconds,
        motion,
        last,
        substeps,
        iterations,
    })
}
