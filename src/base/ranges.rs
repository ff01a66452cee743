//! Range checks of numeric arguments.

use std::fmt::Display;

use super::{Result, ensure};

/// Refuses a value that is not above 0 and finite.
pub(crate) fn above_zero<N: Display + Copy + Into<f64>>(name: &str, value: N) -> Result<()> {
    in_range(name, value, |value| value > 0.0, "above 0 and finite")
}

/// Refuses a value that is not at least 0 and finite.
pub(crate) fn not_negative<N: Display + Copy + Into<f64>>(name: &str, value: N) -> Result<()> {
    in_range(name, value, |value| value >= 0.0, "at least 0 and finite")
}

/// Refuses a value that is not finite.
pub(crate) fn finite(name: &str, value: f32) -> Result<()> {
    in_range(name, value, |_| true, "finite")
}

/// Refuses values if one is not finite.
pub(crate) fn all_finite(name: &str, values: &[f32]) -> Result<()> {
    for (index, value) in values.iter().enumerate() {
        ensure!(value.is_finite(), "{name}[{index}] is {value}: must be finite");
    }
    Ok(())
}

fn in_range<N: Display + Copy + Into<f64>>(name: &str, value: N, holds: fn(f64) -> bool, range: &str) -> Result<()> {
    ensure!(
        holds(value.into()) && value.into().is_finite(),
        "{name} is {value}: must be {range}"
    );
    Ok(())
}
