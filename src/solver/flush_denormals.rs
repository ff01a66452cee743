//! Flushes subnormal numbers to zero: processors may take a hundred times as long for them.

/// Returns a velocity, or 0 if its square would be subnormal, m/s.
#[inline(always)]
pub(super) fn flush_velocity(velocity: f32) -> f32 {
    /// 2^-63 m/s.
    const SLOWEST: f32 = 1.0842022e-19;
    if velocity.abs() < SLOWEST { 0.0 } else { velocity }
}

/// 2^-40 m.
const FINE: f32 = 9.094947e-13;

/// Rounds a coordinate below 2^-40 m to a multiple of 2^-62 m. Larger coordinates are multiples of 2^-63 m anyway.
///
/// The difference of two coordinates is thus zero, or its square is a normal number. Otherwise a sheet that comes to
/// rest in a plane through the origin would approach it forever, and its springs would take several times as long.
#[inline(always)]
pub(super) fn round_to_grid(coordinate: f32) -> f32 {
    // The last bit of its sum with any value below `FINE` is 2^-62.
    const MIDDLE: f32 = 3.0 * FINE;
    let rounded = (coordinate + MIDDLE) - MIDDLE;
    if coordinate.abs() < FINE { rounded } else { coordinate }
}

/// Returns a coordinate, or 0 below 2^-40 m, for solvers whose tolerance is relative to the change. Their small
/// residual motion then comes to rest too.
#[inline(always)]
pub(super) fn flush_coordinate(coordinate: f32) -> f32 {
    if coordinate.abs() < FINE { 0.0 } else { coordinate }
}

#[cfg(test)]
mod tests {
    use super::{flush_velocity, round_to_grid};

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
            assert!(is_normal_or_zero(flush_velocity(value)), "{value:e}");
            let rounded = round_to_grid(value);
            assert!(
                (rounded - value).abs() <= 2.0_f32.powi(-63),
                "{value:e} becomes {rounded:e}"
            );
            assert_eq!(rounded, round_to_grid(rounded), "{value:e}");
            assert_eq!(-rounded, round_to_grid(-value), "{value:e}");
            for &other in &coordinates {
                let difference = rounded - round_to_grid(other);
                assert!(is_normal_or_zero(difference), "{value:e} and {other:e}");
            }
        }
        assert!(round_to_grid(f32::NAN).is_nan() && round_to_grid(f32::INFINITY).is_infinite());
    }
}
