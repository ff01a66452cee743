//! What keeps subnormal numbers out of steps: processors may take a hundred times as long for them.

/// A velocity, m/s, or 0 where its square would be no normal number: nothing moves by it.
#[inline(always)]
pub(super) fn still_or(velocity: f32) -> f32 {
    /// m/s: 2^-63.
    const SLOWEST: f32 = 1.0842022e-19;
    if velocity.abs() < SLOWEST { 0.0 } else { velocity }
}

/// m: 2^-40.
const FINE: f32 = 9.094947e-13;

/// A coordinate, m, rounded to a multiple of 2^-62 m below 2^-40 m; from there on it is one of 2^-63 m in any case.
///
/// So two nodes are at the same coordinate or so far apart that the square of that is a normal number. A sheet that comes to
/// rest in a plane through the origin would otherwise come nearer to it for ever, and its springs would take several times
/// as long.
#[inline(always)]
pub(super) fn on_grid(coordinate: f32) -> f32 {
    // Whatever is added to it that is less than `FINE`, the last place of the sum is 2^-62.
    const MIDDLE: f32 = 3.0 * FINE;
    let rounded = (coordinate + MIDDLE) - MIDDLE;
    if coordinate.abs() < FINE { rounded } else { coordinate }
}

/// The same for steps whose equations are solved to a part of what they change: a coordinate, m, or 0 below 2^-40 m, so that
/// what such solutions leave there comes to rest too.
#[inline(always)]
pub(super) fn or_zero(coordinate: f32) -> f32 {
    if coordinate.abs() < FINE { 0.0 } else { coordinate }
}

#[cfg(test)]
mod tests {
    use super::{on_grid, still_or};

    #[test]
    fn squares_of_velocities_and_of_differences_of_coordinates_are_normal_or_zero() {
        let is_normal_or_zero = |value: f32| value == 0.0 || (value * value).is_normal();
        let mut coordinates = vec![0.0_f32];
        for exponent in -149..8 {
            for factor in [1.0, 1.0 + f32::EPSILON, 1.3, 1.7, 2.0 - f32::EPSILON] {
                let value = factor * 2.0_f32.powi(exponent);
                coordinates.extend([value, -value]);
            }
        }
        for &value in &coordinates {
            assert!(is_normal_or_zero(still_or(value)), "{value:e}");
            let rounded = on_grid(value);
            assert!(
                (rounded - value).abs() <= 2.0_f32.powi(-63),
                "{value:e} becomes {rounded:e}"
            );
            assert_eq!(rounded, on_grid(rounded), "{value:e}");
            assert_eq!(-rounded, on_grid(-value), "{value:e}");
            for &other in &coordinates {
                let difference = rounded - on_grid(other);
                assert!(is_normal_or_zero(difference), "{value:e} and {other:e}");
            }
        }
        assert!(on_grid(f32::NAN).is_nan() && on_grid(f32::INFINITY).is_infinite());
    }
}
