//! Rotation vectors, axis times angle. Sines come from `libm`, which gives the same results on every platform; those
//! of glam are the system's and differ in the last bits.

use glam::{DQuat, DVec3};

/// Angles below this count as equal to their sine, rad.
const SMALL: f64 = 1e-12;

/// The orientation `from`, rotated by a rotation vector, rad.
pub(crate) fn rotated(from: DQuat, by: DVec3) -> DQuat {
    let half = 0.5 * by.length();
    let factor = if half < SMALL {
        0.5
    } else {
        0.5 * libm::sin(half) / half
    };
    let axis = by * factor;
    (DQuat::from_xyzw(axis.x, axis.y, axis.z, libm::cos(half)) * from).normalize()
}

/// The rotation vector between two orientations, through the smaller angle, rad.
pub(crate) fn rotation_between(from: DQuat, to: DQuat) -> DVec3 {
    let change = to * from.conjugate();
    let change = if change.w < 0.0 { -change } else { change };
    let axis = DVec3::new(change.x, change.y, change.z);
    let sine = axis.length();
    if sine < SMALL {
        return 2.0 * axis;
    }
    axis * (2.0 * libm::atan2(sine, change.w) / sine)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotation_between_leads_from_one_orientation_to_the_other() {
        let start = DQuat::from_xyzw(0.1, -0.7, 0.3, 0.4).normalize();
        for angle in [0.0, 1e-13, 1e-6, 0.3, 2.0, 3.1] {
            let by = DVec3::new(0.6, 0.0, -0.8) * angle;
            let end = rotated(start, by);
            assert!(
                (rotation_between(start, end) - by).length() < 1e-14 + 1e-12 * angle,
                "{angle}"
            );
            assert!(
                end.dot(DQuat::from_scaled_axis(by) * start) > 1.0 - 1e-15,
                "{angle}: as glam turns"
            );
        }
    }
}
