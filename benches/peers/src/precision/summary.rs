//! The time that each engine needs for an error, over all of its lines.

use crate::precision::{End, EngineOutcome};

/// Errors relative to the motion.
pub const TARGETS: [f64; 3] = [0.1, 0.01, 0.001];

/// The time that an engine needs for an error.
#[derive(Clone, Debug, PartialEq)]
pub enum Need {
    /// Seconds of one thread per simulated second, of its fastest point within the error.
    Seconds(f64),
    /// No line reached the error, and one was stopped by the time limit.
    NotWithinTheLimit,
    /// No line reached the error, and all are flat.
    Never,
    /// No line reached the error with the measured settings.
    NotTried,
    /// The engine cannot simulate the scene, or is not available.
    Absent,
}

impl Need {
    pub fn text(&self) -> String {
        match self {
            Self::Seconds(seconds) => number(*seconds),
            Self::NotWithinTheLimit => "not within the limit".into(),
            Self::Never => "never".into(),
            Self::NotTried => "not at the settings tried".into(),
            Self::Absent => "-".into(),
        }
    }
}

/// Formats a number with three digits.
pub fn number(value: f64) -> String {
    match value {
        _ if value >= 100.0 => format!("{value:.0}"),
        _ if value >= 10.0 => format!("{value:.1}"),
        _ if value >= 1.0 => format!("{value:.2}"),
        _ if value >= 0.1 => format!("{value:.3}"),
        _ => format!("{value:.4}"),
    }
}

/// The time that an engine needs for an error of at most `target`.
pub fn need(engine: &EngineOutcome, target: f64) -> Need {
    let Ok(lines) = &engine.lines else {
        return Need::Absent;
    };
    let points = lines.iter().flat_map(|line| &line.points);
    let near = points.filter(|point| point.error <= target);
    if let Some(seconds) = near.map(|point| point.seconds).min_by(f64::total_cmp) {
        return Need::Seconds(seconds);
    }
    let ended = |is: fn(&End) -> bool| lines.iter().any(|line| is(&line.end));
    if lines.iter().all(|line| line.points.is_empty()) && !ended(|end| matches!(end, End::Limit(_))) {
        return Need::Absent;
    }
    if ended(|end| matches!(end, End::Limit(_))) {
        return Need::NotWithinTheLimit;
    }
    match ended(|end| matches!(end, End::Tried)) {
        true => Need::NotTried,
        false => Need::Never,
    }
}
