//! Nodal masses, and bounds of nodal frequencies.

use crate::codec::saved;

/// Bound of the frequency and damping of a node and its springs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FrequencyBound {
    /// Highest frequency squared, 1/s².
    pub omega_sq: f32,
    /// Highest damping rate, 1/s.
    pub damping_rate: f32,
}

saved! { FrequencyBound { omega_sq, damping_rate } }

impl FrequencyBound {
    pub const ZERO: Self = Self {
        omega_sq: 0.0,
        damping_rate: 0.0,
    };

    /// Longest stable substep, s; infinite if unlimited. It is 0 for springs beyond the range of `f32`.
    pub fn limit(self) -> f32 {
        let damping = 0.5 * self.damping_rate;
        let limit = 2.0 / ((self.omega_sq + damping * damping).sqrt() + damping);
        if limit.is_nan() { 0.0 } else { limit }
    }

    /// Sum of both bounds.
    pub fn and(self, other: Self) -> Self {
        Self {
            omega_sq: self.omega_sq + other.omega_sq,
            damping_rate: self.damping_rate + other.damping_rate,
        }
    }
}

/// Largest mass ratio that is assumed for the ends of a spring. It shortens substeps by 1 % on meshes of organs, and by
/// 11 % if a light node on a heavy one sets the limit.
const MAX_MASS_RATIO: f32 = 4.0;

/// Masses of a body, with or without mass scaling.
#[derive(Clone, Copy)]
pub(crate) struct NodalMasses<'a> {
    /// Masses, kg.
    pub masses: &'a [f32],
    /// 0 for a pinned node, 1/kg.
    pub inverse_masses: &'a [f32],
    /// True if the inverse masses include mass scaling.
    pub are_scaled: bool,
}

impl<'a> NodalMasses<'a> {
    /// Masses without mass scaling.
    pub fn new(masses: &'a [f32], inverse_masses: &'a [f32]) -> Self {
        Self {
            masses,
            inverse_masses,
            are_scaled: false,
        }
    }

    /// Inverse mass, 1/kg; 0 for a pinned node.
    #[inline(always)]
    pub fn inverse(&self, node: usize) -> f32 {
        if self.are_scaled {
            self.inverse_masses[node]
        } else if self.inverse_masses[node] > 0.0 {
            1.0 / self.masses[node]
        } else {
            0.0
        }
    }

    /// Factor of a spring's stiffness in the frequency bound of a node with this inverse mass, 1/kg.
    ///
    /// The bound for a heavy node with many light neighbors is reduced: see `solver/stability.rs`.
    #[inline(always)]
    pub fn spring_factor(&self, inverse_mass: f32, neighbor: usize) -> f32 {
        let other = self.inverse(neighbor);
        if other == 0.0 {
            return inverse_mass;
        }
        inverse_mass
            + other
                .max(inverse_mass / MAX_MASS_RATIO)
                .min(inverse_mass * MAX_MASS_RATIO)
    }
}
