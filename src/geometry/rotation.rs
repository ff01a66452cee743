//! Rotations as axis times angle. Their sines come from `libm`, which is the same on every platform; those of glam are
//! the system's and differ in the last bits.

use glam::{DQuat, DVec3};

/// Below this angle, rad, a sine is its angle.
const SMALL: f64 = 1e-12;

/// An orientation rotated by axis times angle, rad.
pub(crate) fn turned(from: DQuat, by: DVec3) -> DQuat {
    let half = 0.5 * by.length();
    let part = if half < SMALL {
        0.5
    } else {
        0.5 * libm::sin(half) / half
    };
    let axis = by * part;
    (DQuat::from_xyzw(axis.x, axis.y, axis.z, libm::cos(half)) * from).normalize()
}

/// The rotation between two orientations through the smaller angle, as axis times angle, rad.
pub(crate) fn turn_between(from: DQuat, to: DQuat) -> DVec3 {
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
    fn a_turn_leads_from_one_orientation_to_the_other() {
        let start = DQuat::from_xyzw(0.1, -0.7, 0.3, 0.4).normalize();
        for angle in [0.0, 1e-13, 1e-6, 0.3, 2.0, 3.1] {
            let by = DVec3::new(0.6, 0.0, -0.8) * angle;
            let end = turned(start, by);
            assert!(
                (turn_between(start, end) - by).length() < 1e-14 + 1e-12 * angle,
                "{angle}"
            );
            assert!(
                end.dot(DQuat::from_scaled_axis(by) * start) > 1.0 - 1e-15,
                "{angle}: as glam turns"
            );
        }
    }
}
