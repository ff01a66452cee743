//! Work and precision of a motion: every point of every line is run, timed and compared with the reference.

use glam::DVec3;

use crate::clock;
use crate::contender::{Contender, Setup, State};
use crate::exact::Exact;
use crate::lines::Line;
use crate::reference::{Motion, Reference};
use crate::report::Report;
use crate::scene::{DURATION, SAMPLES, Scene};

/// A larger error, in RMS distances from the start, is a failure.
const FAILED: f64 = 10.0;

/// How long points are measured.
#[derive(Clone, Copy)]
pub struct Effort {
    pub quick: bool,
    /// Timed runs after the first, of points that take less than a second.
    pub runs: usize,
    /// A line goes no finer once a run would take longer, s.
    pub patience: f64,
    /// Nothing is followed to its rest for longer, s.
    pub patience_at_rest: f64,
}

impl Effort {
    pub const FULL: Self = Self {
        quick: false,
        runs: 3,
        patience: 3.0,
        patience_at_rest: 8.0,
    };
    pub const QUICK: Self = Self {
        quick: true,
        runs: 1,
        patience: 0.4,
        patience_at_rest: 0.5,
    };
}

/// A setting and what came of it.
pub struct Point {
    pub setup: Setup,
    /// s, of what the solver takes at once.
    pub step: f64,
    /// What setting up took, s.
    pub preparation: f64,
    /// Or why it failed.
    pub outcome: Result<Measured, String>,
}

#[derive(Clone, Copy)]
pub struct Measured {
    /// RMS over nodes and samples, in RMS distances from the start.
    pub error: f64,
    /// Per simulated second.
    pub seconds: f64,
    /// s, per spring and step.
    pub per_spring: f64,
    /// Energy at the end less that at the start, in the largest kinetic energies.
    pub drift: f64,
}

/// A line and its points; or why it is not offered.
pub struct Sweep {
    pub line: Line,
    pub points: Result<Vec<Point>, String>,
}

/// Measures a line from coarse to fine, as far as patience reaches.
pub fn sweep(scene: &Scene, reference: &Reference, line: Line, effort: Effort, report: &Report) -> Sweep {
    let exact = Exact::new(scene);
    let mut points: Vec<Point> = Vec::new();
    let mut spent: Option<(f64, f64)> = None;
    for (index, &setup) in line.setups.iter().enumerate() {
        let work = setup.work();
        let expected = spent.map(|(seconds, steps)| seconds * work / steps);
        if expected.is_some_and(|seconds| seconds > effort.patience) {
            break;
        }
        if effort.quick && index % 2 == 1 {
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
                if let Ok(measured) = point.outcome {
                    spent = Some((measured.seconds * DURATION, work));
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
        Err(reason) => format!("h {step:.4} ms, {reason}"),
    }
}

/// Runs one setting: once to compare, and again for the best time. An error is an answer: not offered.
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
    let outcome = run(contender.as_mut(), setup).and_then(|first| {
        let error = reference.error(&first.motion, scene);
        // A NaN is not below either.
        if !(error < FAILED) {
            return Err(match error.is_nan() {
                true => "not finite".into(),
                false => format!("error {error:.0e}"),
            });
        }
        let runs = if first.seconds < 1.0 { effort.runs } else { 0 };
        let mut best = first.seconds;
        for _ in 0..runs {
            best = best.min(run(contender.as_mut(), setup)?.seconds);
        }
        if let Some(substeps) = first.substeps {
            step = DURATION / f64::from(substeps);
        }
        let energy = exact.energy(&first.last.positions, &first.last.velocities).total();
        Ok(Measured {
            error,
            seconds: best / DURATION,
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

/// What one run showed.
struct Run {
    seconds: f64,
    motion: Motion,
    /// The end.
    last: State,
    /// Taken in all, where they were the solver's choice.
    substeps: Option<u32>,
}

/// Runs a motion from its start.
fn run(contender: &mut dyn Contender, setup: Setup) -> Result<Run, String> {
    contender.restart();
    let mut seconds = 0.0;
    let mut motion = Motion::new();
    let mut substeps = Some(0);
    let mut last = contender.read();
    for _ in 0..SAMPLES {
        let mut advanced = Ok(());
        let elapsed = clock::time(|| advanced = contender.advance());
        advanced?;
        seconds += setup.counted(elapsed);
        substeps = contender.substeps().and_then(|taken| Some(substeps? + taken));
        last = contender.read();
        motion.push(last.positions.clone());
    }
    Ok(Run {
        seconds,
        motion,
        last,
        substeps,
    })
}
