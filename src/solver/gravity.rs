//! Gravity's part of a kick, without cumulative `f32` rounding.
//!
//! All nodes receive the same velocity change in every kick. Adding it to a velocity would round in the same direction
//! each time, and the error would accumulate. The change is therefore a multiple of the last bit of the fastest node's
//! velocity. The residual is added to the next kick.

use glam::{DVec3, Vec3};

use crate::codec::saved;
use crate::geometry::Aabb;

/// The state of gravity's kicks over a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct GravityKicks {
    /// The velocity change that was not applied yet, m/s.
    residual: DVec3,
    /// The bounding box of all velocities after the last kick.
    pub velocities: Aabb,
}

saved! { GravityKicks { residual, velocities } }

impl GravityKicks {
    /// Starts without a residual, for nodes with velocities in this box.
    pub fn new(velocities: Aabb) -> Self {
        Self {
            residual: DVec3::ZERO,
            velocities,
        }
    }

    /// Returns the velocity change to apply for a requested `change`, m/s.
    pub fn next(&mut self, change: DVec3) -> Vec3 {
        let requested = change + self.residual;
        let fastest = self.velocities.magnitudes().as_dvec3() + requested.abs();
        let applied = DVec3::new(
            whole_units(requested.x, fastest.x),
            whole_units(requested.y, fastest.y),
            whole_units(requested.z, fastest.z),
        )
        .as_vec3();
        let left = requested - applied.as_dvec3();
        self.residual = if left.is_finite() { left } else { DVec3::ZERO };
        applied
    }

    /// The state that the next kick depends on, as bits.
    pub fn bits(&self) -> impl Iterator<Item = u64> {
        let velocities = [self.velocities.min, self.velocities.max];
        let velocities = velocities.into_iter().flat_map(|corner| corner.as_dvec3().to_array());
        self.residual.to_array().into_iter().chain(velocities).map(f64::to_bits)
    }
}

/// Rounds `requested` to a multiple of the last bit of `fastest`. Returns `requested` unchanged if that rounding is too
/// coarse.
fn whole_units(requested: f64, fastest: f64) -> f64 {
    const COARSE: f64 = 0.125;
    let unit = f64::from_bits(fastest.to_bits() & !((1 << 52) - 1)) * f64::from(f32::EPSILON);
    if unit > 0.0 && unit < COARSE * requested.abs() {
        (requested / unit).round() * unit
    } else {
        requested
    }
}
