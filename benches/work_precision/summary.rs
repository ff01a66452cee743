//! What a sweep says at a glance: the time for an error, and the error in a time, between points on logarithmic axes.

use crate::motion::{Measured, Missing, Point, Sweep};
use crate::reference::Reference;
use crate::report::digits;

/// The least seconds per simulated second for so small an error.
pub fn time_for(sweeps: &[&Sweep], error: f64) -> Option<f64> {
    best(sweeps, |point| (point.error, point.seconds), error)
}

/// The lines of each family.
pub fn families(sweeps: &[Sweep]) -> Vec<(&'static str, Vec<&Sweep>)> {
    let mut names: Vec<&str> = sweeps.iter().map(|sweep| sweep.line.family).collect();
    names.dedup();
    let lines = |name| sweeps.iter().filter(|sweep| sweep.line.family == name).collect();
    names.into_iter().map(|name| (name, lines(name))).collect()
}

/// What a family needs for 10 %, 1 % and 0.1 %, in words where there is no such figure.
pub fn times(reference: &Reference, lines: &[&Sweep]) -> [String; 3] {
    let too_slow = |line: &&Sweep| {
        let points = line.points.as_deref().unwrap_or_default();
        points
            .iter()
            .any(|point| matches!(point.outcome, Err(Missing::TooSlow(_))))
    };
    [0.1, 0.01, 0.001].map(|error| match time_for(lines, error) {
        _ if error < reference.uncertainty => "unresolved".to_owned(),
        Some(seconds) => digits(seconds),
        None if lines.iter().any(too_slow) => "too slow".to_owned(),
        None => "never".to_owned(),
    })
}

/// The least error in so many seconds per simulated second.
pub fn error_in(sweeps: &[&Sweep], seconds: f64) -> Option<f64> {
    best(sweeps, |point| (point.seconds, point.error), seconds)
}

/// The least second figure where the first is no larger than `limit`, at points and where lines pass the limit.
fn best(sweeps: &[&Sweep], figures: impl Fn(&Measured) -> (f64, f64), limit: f64) -> Option<f64> {
    let mut least: Option<f64> = None;
    let mut take = |value: f64| least = Some(least.map_or(value, |least| least.min(value)));
    for points in sweeps.iter().filter_map(|sweep| sweep.points.as_ref().ok()) {
        for point in points.iter().filter_map(measured) {
            let (first, second) = figures(point);
            if first <= limit {
                take(second);
            }
        }
        for pair in points.windows(2) {
            let [Some(a), Some(b)] = [measured(&pair[0]), measured(&pair[1])] else {
                continue;
            };
            let ((a_first, a_second), (b_first, b_second)) = (figures(a), figures(b));
            if (a_first - limit) * (b_first - limit) < 0.0 {
                let share = (limit / a_first).ln() / (b_first / a_first).ln();
                take(a_second * (b_second / a_second).powf(share));
            }
        }
    }
    least
}

pub fn measured(point: &Point) -> Option<&Measured> {
    point.outcome.as_ref().ok()
}
