//! How a line of points is played: from coarse to fine, until it need not or may not go on.

use std::path::PathBuf;

use super::motion::Motion;
use super::{DIVERGES, End, LineOutcome, Point, contact, model};
use crate::players::{self, Line, Played, Said};
use crate::scenes::Scene;

/// A line ends once a point is as near to the reference as this: well below the finest target.
const FINE_ENOUGH: f64 = 3e-4;

/// A line is flat where two halvings of the step leave more than this of its error.
const FLAT: f64 = 0.8;

/// How many times the limit the first point of a line may take that is any good.
const PATIENCE: f64 = 4.0;

/// Plays a line's points from coarse to fine, until it need not or may not go on.
pub fn follow(
    scene: &Scene,
    engine: &str,
    program: &[PathBuf],
    line: &Line,
    error: &dyn Fn(&Motion) -> f64,
    limit: f64,
) -> (LineOutcome, Said) {
    let mut outcome = LineOutcome {
        name: line.name.clone(),
        law: line.law,
        points: Vec::new(),
        end: End::Tried,
    };
    let mut said = Said::default();
    let simulated = scene.model.frames as f64 * model::FRAME;
    let mut failure = None;
    for settings in &line.points {
        // A line that needs fine steps from the start has its chance.
        let is_begun = outcome.points.iter().any(|point| point.error < 1.0);
        let limit = if is_begun { limit } else { PATIENCE * limit };
        let (played, words) = players::play(program, &scene.model, settings, limit * simulated);
        said.version = words.version.or(said.version);
        said.notes.extend(words.notes);
        let label = settings.join(" ");
        match played {
            Played::Whole { motion, seconds } => {
                let error = error(&motion);
                let seconds = seconds / simulated;
                eprintln!(
                    "{}: {engine}, {}, {label}: {seconds:.4} s, {error:.2e}",
                    scene.name, line.name
                );
                outcome.points.push(Point {
                    settings: label,
                    seconds,
                    error,
                    height: motion.height(),
                    speed: motion.speed_at_end(),
                    gain: contact::energy_gain(&scene.model, &motion),
                });
            }
            Played::Cut { expected } => {
                eprintln!("{}: {engine}, {}, {label}: over the limit", scene.name, line.name);
                outcome.end = End::Limit(expected / simulated);
                return (outcome, said);
            }
            Played::Refused(reason) => {
                eprintln!("{}: {engine}, {}, {label}: {reason}", scene.name, line.name);
                if reason != DIVERGES {
                    said.notes.push(format!("{}, {label}: {reason}", line.name));
                }
                // An engine that cannot do it says the same again; one that is unstable may not be with finer steps.
                if failure.as_ref() == Some(&reason) && reason != DIVERGES {
                    break;
                }
                failure = Some(reason);
            }
        }
        if outcome.points.last().is_some_and(|point| point.error < FINE_ENOUGH) {
            outcome.end = End::Reached;
            return (outcome, said);
        }
        if is_flat(&outcome.points) {
            outcome.end = End::Flat;
            return (outcome, said);
        }
    }
    if let (true, Some(reason)) = (outcome.points.is_empty(), failure) {
        outcome.end = End::Failed(reason);
    }
    (outcome, said)
}

/// Whether two halvings of the step have changed little. The first points of a line may be flat because they are coarse.
fn is_flat(points: &[Point]) -> bool {
    match points {
        [_, .., a, _, c] => c.error > FLAT * a.error && a.error < 0.3,
        _ => false,
    }
}
