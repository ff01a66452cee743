//! Summary figures of a sweep: the time for an error, and the error in a time, interpolated on logarithmic axes.

use crate::motion::{Measured, Missing, Point, Sweep};
use crate::reference::Reference;
use crate::report::digits;

/// The least time for this error, in seconds per simulated second.
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

/// A family's times for errors of 10 %, 1 % and 0.1 %, or words if there is no figure.
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

/// The least error within this time, in seconds per simulated second.
pub fn error_in(sweeps: &[&Sweep], seconds: f64) -> Option<f64> {
    best(sweeps, |point| (point.seconds, point.error), seconds)
}

/// The smallest second figure whose first is at most `limit`, at points and where lines cross the limit.
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
