//! Work and precision of a motion: every point of every line is run, timed and compared with the reference.

use glam::DVec3;

use crate::clock;
use crate::contender::{Contender, Setup, State};
use crate::exact::Exact;
use crate::lines::Line;
use crate::reference::{Motion, Reference};
use crate::report::{Report, digits};
use crate::scene::{DURATION, SAMPLES, SPAN, Scene};

/// A larger error, in RMS distances from the start, is a failure.
const FAILED: f64 = 10.0;

/// How long points are measured.
#[derive(Clone, Copy)]
pub struct Effort {
    pub quick: bool,
    /// Timed runs after the first, of points that take less than a second.
    pub runs: usize,
    /// A run that takes longer, or would by the one before it, is given up, s.
    pub patience: f64,
    /// Nothing is followed to its rest for longer, s.
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

/// A setting and what came of it.
pub struct Point {
    pub setup: Setup,
    /// s, of what the solver takes at once.
    pub step: f64,
    /// What setting up took, s.
    pub preparation: f64,
    pub outcome: Result<Measured, Missing>,
}

/// Why a point has no figures.
#[derive(Clone, Debug)]
pub enum Missing {
    Failed(String),
    /// Stopped, or not begun: it takes longer, or would, than so many seconds per simulated second.
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
    /// RMS over nodes and samples, in RMS distances from the start.
    pub error: f64,
    /// Of the force on all pins together, RMS over samples, in the RMS of that force.
    pub force_error: f64,
    /// Of the volume, RMS over samples, in the volume at the start; `None`: there are no tetrahedra.
    pub volume_error: Option<f64>,
    /// Per simulated second.
    pub seconds: f64,
    /// Of a step, where they were the solver's choice.
    pub iterations: Option<f64>,
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
    let outcome = run(contender.as_mut(), setup, effort.patience).and_then(|first| {
        let error = reference.error(&first.motion, scene);
        // A NaN is not below either.
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
    let mut off = 0.0;
    let mut size = 0.0;
    for (positions, reference) in motion.iter().zip(&reference.motion) {
        let force = exact.force_on_pins(reference);
        off += exact.force_on_pins(positions).distance_squared(force);
        size += force.length_squared();
    }
    (off / size).sqrt()
}

/// See [`Measured`].
fn volume_error(scene: &Scene, motion: &Motion, reference: &Reference) -> Option<f64> {
    let off = |(positions, reference): (&Vec<DVec3>, &Vec<DVec3>)| {
        (scene.volume(positions) - scene.volume(reference)).powi(2)
    };
    let squares: f64 = motion.iter().zip(&reference.motion).map(off).sum();
    (!scene.tetrahedra.is_empty()).then(|| (squares / SAMPLES as f64).sqrt() / scene.volume(&scene.start()))
}

/// What one run showed.
struct Run {
    seconds: f64,
    motion: Motion,
    /// The end.
    last: State,
    /// Taken in all, where they were the solver's choice.
    substeps: Option<u32>,
    iterations: Option<u32>,
}

/// Runs a motion from its start, unless it takes longer than `patience`, s.
fn run(contender: &mut dyn Contender, setup: Setup, patience: f64) -> Result<Run, Missing> {
    contender.restart();
    let mut seconds = 0.0;
    let mut motion = Motion::new();
    let mut substeps = Some(0);
    let mut iterations = Some(0);
    let mut last = contender.read();
    for sample in 0..SAMPLES {
        // A fraction of the motion tells how long the whole of it takes.
        if seconds > patience {
            return Err(Missing::TooSlow(seconds / (sample as f64 * SPAN)));
        }
        let mut advanced = Ok(());
        let elapsed = clock::time(|| advanced = contender.advance());
        advanced.map_err(Missing::Failed)?;
        seconds += setup.counted(elapsed);
        substeps = contender.substeps().and_then(|taken| Some(substeps? + taken));
        iterations = contender.iterations().and_then(|taken| Some(iterations? + taken));
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
