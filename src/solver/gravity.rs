//! Gravity's share of a kick, given so that `f32` loses none of it.
//!
//! Every node gets the same, kick after kick: what adding it to a velocity rounds away is the same each time too, and adds
//! up. So it is given in whole units of the last place of the fastest node, and what is left is kept for the next kick.

use glam::{DVec3, Vec3};

use crate::codec::saved;
use crate::geometry::Bounds;

/// Gravity's kicks over a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct GravityKicks {
    /// What has not been given yet, m/s.
    residual: DVec3,
    /// The box of all velocities after the last kick.
    pub velocities: Bounds,
}

saved! { GravityKicks { residual, velocities } }

impl GravityKicks {
    /// Nothing left over, for nodes with velocities in this box.
    pub fn new(velocities: Bounds) -> Self {
        Self {
            residual: DVec3::ZERO,
            velocities,
        }
    }

    /// The change of velocity to be given where gravity asks for `change`, m/s.
    pub fn next(&mut self, change: DVec3) -> Vec3 {
        let wanted = change + self.residual;
        let fastest = self.velocities.magnitudes().as_dvec3() + wanted.abs();
        let given = DVec3::new(
            whole_units(wanted.x, fastest.x),
            whole_units(wanted.y, fastest.y),
            whole_units(wanted.z, fastest.z),
        )
        .as_vec3();
        let left = wanted - given.as_dvec3();
        self.residual = if left.is_finite() { left } else { DVec3::ZERO };
        given
    }

    /// What the next kick depends on, as bits.
    pub fn bits(&self) -> impl Iterator<Item = u64> {
        let velocities = [self.velocities.min, self.velocities.max];
        let velocities = velocities.into_iter().flat_map(|corner| corner.as_dvec3().to_array());
        self.residual.to_array().into_iter().chain(velocities).map(f64::to_bits)
    }
}

/// `wanted` in whole units of the last place of `fastest`; as it is where that would be coarse.
fn whole_units(wanted: f64, fastest: f64) -> f64 {
    const COARSE: f64 = 0.125;
    let unit = f64::from_bits(fastest.to_bits() & !((1 << 52) - 1)) * f64::from(f32::EPSILON);
    if unit > 0.0 && unit < COARSE * wanted.abs() {
        (wanted / unit).round() * unit
    } else {
        wanted
    }
}
