//! The longest substep that an explicit solver may take.
//!
//! A spring's stiffness is at most `k n n^T + k max(0, 1 - L0/L) (I - n n^T)`: along it, and across it where it is
//! stretched. With `q(x_i - x_j) <= (1 + t) q(x_i) + (1 + 1/t) q(x_j)` for each such form and t = m_i/m_j, the squares
//! of the body's frequencies are at most the largest eigenvalue of any node's 3x3 matrix
//! `sum_j (1/m_i + 1/m_j) K_ij`: exact for two masses, and for a long chain or a grid of equal ones. The same sum over
//! the dampings bounds the rates of damping, and `h < 2 / (sqrt(omega² + delta²/4) + delta/2)` is leapfrog's limit with
//! both (Belytschko, Liu, Moran 2000, section 6.2.1, with zeta = delta / 2 omega).

use glam::Vec3;

use crate::body::Vectors;
use crate::springs::{Packed, separation};

/// How far neighbours may move against each other, as a fraction of the mean rest length, before the limit is
/// estimated again. It then changes by less than what a chosen substep keeps in reserve.
const TRAVEL_BEFORE_ESTIMATE: f32 = 0.25;

/// What is known about the longest stable substep of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stability {
    /// The longest stable substep at the positions of the last estimate, s; `None`: not estimated since the body's
    /// springs, masses or pins changed.
    pub limit: Option<f32>,
    /// How far neighbours can have moved against each other since then, m.
    pub travel: f32,
}

impl Stability {
    pub const UNKNOWN: Self = Self {
        limit: None,
        travel: 0.0,
    };

    /// What holds at these positions.
    pub fn estimate(springs: &Packed, inverse_masses: &[f32], positions: &Vectors) -> Self {
        Self {
            limit: Some(longest_stable_substep(springs, inverse_masses, positions)),
            travel: 0.0,
        }
    }

    /// Whether the estimate still holds in a body whose springs are `rest_length` long on average.
    pub fn holds(&self, rest_length: f32) -> bool {
        self.limit.is_some() && self.travel <= TRAVEL_BEFORE_ESTIMATE * rest_length
    }
}

/// The longest stable substep at these positions, s; infinity where there is no limit.
fn longest_stable_substep(springs: &Packed, inverse_masses: &[f32], positions: &Vectors) -> f32 {
    let mut stiffest = 0.0_f32;
    let mut most_damped = 0.0_f32;
    for (node, &inverse_mass) in inverse_masses.iter().enumerate() {
        if inverse_mass == 0.0 {
            continue;
        }
        let position = positions.lanes(node);
        let mut along = Symmetric::default();
        let mut across = 0.0_f32;
        let mut damping = Symmetric::default();
        for link in springs.links(node) {
            let neighbour = link.neighbour as usize;
            let (length, direction) = separation(node, neighbour, positions.lanes(neighbour) - position);
            let inverse_mass = inverse_mass + inverse_masses[neighbour];
            let axial = link.stiffness * inverse_mass;
            let transverse = if length > link.rest_length {
                axial * (1.0 - link.rest_length / length)
            } else {
                0.0
            };
            along.add_outer(direction.into(), axial - transverse);
            across += transverse;
            if link.damping > 0.0 {
                damping.add_outer(direction.into(), link.damping * inverse_mass);
            }
        }
        stiffest = stiffest.max(along.largest_eigenvalue_beyond(stiffest - across) + across);
        most_damped = damping.largest_eigenvalue_beyond(most_damped);
    }
    let damping = 0.5 * most_damped;
    2.0 / ((stiffest + damping * damping).sqrt() + damping)
}

/// The same whatever the positions, s: every spring's matrix is at most its stiffness times the unit matrix.
pub(crate) fn substep_stable_anywhere(springs: &Packed, inverse_masses: &[f32]) -> f32 {
    let mut stiffest = 0.0_f32;
    let mut most_damped = 0.0_f32;
    for (node, &inverse_mass) in inverse_masses.iter().enumerate() {
        if inverse_mass == 0.0 {
            continue;
        }
        let (mut stiffness, mut damping) = (0.0_f32, 0.0_f32);
        for link in springs.links(node) {
            let inverse_mass = inverse_mass + inverse_masses[link.neighbour as usize];
            stiffness += link.stiffness * inverse_mass;
            damping += link.damping * inverse_mass;
        }
        stiffest = stiffest.max(stiffness);
        most_damped = most_damped.max(damping);
    }
    let damping = 0.5 * most_damped;
    2.0 / ((stiffest + damping * damping).sqrt() + damping)
}

/// A symmetric 3x3 matrix.
#[derive(Clone, Copy, Default)]
struct Symmetric {
    diagonal: Vec3,
    /// yz, zx, xy
    off_diagonal: Vec3,
}

impl Symmetric {
    /// Adds `factor` times `vector vector^T`.
    #[inline(always)]
    fn add_outer(&mut self, vector: Vec3, factor: f32) {
        let scaled = vector * factor;
        self.diagonal += scaled * vector;
        self.off_diagonal += Vec3::new(scaled.y * vector.z, scaled.z * vector.x, scaled.x * vector.y);
    }

    /// The larger of `known` and the largest eigenvalue; its exact value is computed only where a simple bound does
    /// not rule it out (Smith 1961).
    fn largest_eigenvalue_beyond(&self, known: f32) -> f32 {
        let mean = self.diagonal.element_sum() / 3.0;
        let deviation = self.diagonal - mean;
        let p = ((deviation.length_squared() + 2.0 * self.off_diagonal.length_squared()) / 6.0).sqrt();
        if mean + 2.0 * p <= known {
            return known;
        }
        if p == 0.0 {
            return mean;
        }
        let (d, o) = (deviation / p, self.off_diagonal / p);
        let determinant = d.x * (d.y * d.z - o.x * o.x) - o.z * (o.z * d.z - o.x * o.y) + o.y * (o.z * o.x - d.y * o.y);
        let cosine = (0.5 * determinant).clamp(-1.0, 1.0);
        known.max(mean + 2.0 * p * libm::cosf(libm::acosf(cosine) / 3.0))
    }
}
