//! Plays a line of points from coarse to fine, until a stop criterion is met.

use std::path::PathBuf;

use super::motion::Motion;
use super::{DIVERGES, End, LineOutcome, Point, contact, model};
use crate::players::{self, Line, Messages, Played};
use crate::scenes::Scene;

/// A line ends at this error, well below the finest target.
const FINE_ENOUGH: f64 = 3e-4;

/// A line is flat if two halvings of the step leave more than this fraction of its error.
const FLAT: f64 = 0.8;

/// The time limit of a line's first useful point, as a multiple of the limit.
const PATIENCE: f64 = 4.0;

/// Plays a line's points from coarse to fine, until a stop criterion is met.
pub fn follow(
    scene: &Scene,
    engine: &str,
    program: &[PathBuf],
    line: &Line,
    error: &dyn Fn(&Motion) -> f64,
    limit: f64,
) -> (LineOutcome, Messages) {
    let mut outcome = LineOutcome {
        name: line.name.clone(),
        law: line.law,
        points: Vec::new(),
        end: End::Tried,
    };
    let mut messages = Messages::default();
    let simulated = scene.model.frames as f64 * model::FRAME;
    let mut failure = None;
    for settings in &line.points {
        // A line that needs fine steps from the start has a larger limit.
        let is_begun = outcome.points.iter().any(|point| point.error < 1.0);
        let limit = if is_begun { limit } else { PATIENCE * limit };
        let (played, words) = players::play(program, &scene.model, settings, limit * simulated);
        messages.version = words.version.or(messages.version);
        messages.notes.extend(words.notes);
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
                return (outcome, messages);
            }
            Played::Refused(reason) => {
                eprintln!("{}: {engine}, {}, {label}: {reason}", scene.name, line.name);
                if reason != DIVERGES {
                    messages.notes.push(format!("{}, {label}: {reason}", line.name));
                }
                // An unsupported scene fails again in the same way; an unstable step may succeed when finer.
                if failure.as_ref() == Some(&reason) && reason != DIVERGES {
                    break;
                }
                failure = Some(reason);
            }
        }
        if outcome.points.last().is_some_and(|point| point.error < FINE_ENOUGH) {
            outcome.end = End::Reached;
            return (outcome, messages);
        }
        if is_flat(&outcome.points) {
            outcome.end = End::Flat;
            return (outcome, messages);
        }
    }
    if let (true, Some(reason)) = (outcome.points.is_empty(), failure) {
        outcome.end = End::Failed(reason);
    }
    (outcome, messages)
}

/// True if two halvings of the step changed the error little. The first points of a line may be flat because they are
/// coarse.
fn is_flat(points: &[Point]) -> bool {
    match points {
        [_, .., a, _, c] => c.error > FLAT * a.error && a.error < 0.3,
        _ => false,
    }
}
