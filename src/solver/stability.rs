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
use crate::springs::{Springs, separation};

/// How far neighbours may move against each other before the limit is estimated again, as a fraction of the length over
/// which the matrices of their springs change. It then changes by less than what a chosen substep keeps in reserve.
const TRAVEL_BEFORE_ESTIMATE: f32 = 0.25;

/// What is known about the longest stable substep of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stability {
    /// The longest stable substep at the positions of the last estimate, s; `None`: not estimated since the body's
    /// springs, masses or pins changed.
    pub limit: Option<f32>,
    /// How far neighbours may still move against each other before the estimate is stale, m.
    pub reach: f32,
    /// The longest substep that is stable wherever the nodes are, s; 0 where `limit` is not known.
    pub anywhere: f32,
}

impl Stability {
    pub const UNKNOWN: Self = Self {
        limit: None,
        reach: 0.0,
        anywhere: 0.0,
    };

    /// Whether the estimate still holds after neighbours have moved against each other by up to `travel` more.
    pub fn holds_after(&mut self, travel: f32) -> bool {
        self.reach -= travel;
        self.reach >= 0.0
    }

    /// The same, where `substep` is so short that the nodes may be anywhere: an estimate that never gets stale.
    pub fn for_short(self, substep: f32) -> Option<Self> {
        (substep <= self.anywhere).then_some(Self {
            limit: Some(self.anywhere),
            reach: f32::INFINITY,
            ..self
        })
    }

    /// Whether another estimate may allow longer substeps at the positions as they are now.
    pub fn is_coarse(&self) -> bool {
        self.reach == f32::INFINITY && self.limit.is_some_and(f32::is_finite)
    }

    /// The longest stable substep at these positions, and how long that is true.
    pub fn estimate(springs: &dyn Springs, inverse_masses: &[f32], positions: &Vectors) -> Self {
        let mut stiffest = 0.0_f32;
        let mut most_damped = 0.0_f32;
        let mut reach = f32::INFINITY;
        let (mut stiffest_anywhere, mut most_damped_anywhere) = (0.0_f32, 0.0_f32);
        for (node, &inverse_mass) in inverse_masses.iter().enumerate() {
            if inverse_mass == 0.0 {
                continue;
            }
            let sums = Sums::of(node, inverse_mass, springs, inverse_masses, positions);
            let across = sums.across;
            stiffest = stiffest.max(sums.along.largest_eigenvalue_beyond(stiffest - across) + across);
            most_damped = sums.damping.largest_eigenvalue_beyond(most_damped);
            stiffest_anywhere = stiffest_anywhere.max(sums.stiffness_anywhere);
            most_damped_anywhere = most_damped_anywhere.max(sums.damping_anywhere);
            // Springs beyond the range of `f32` allow no substep at all.
            if !(sums.stiffness_anywhere.is_finite() && sums.damping_anywhere.is_finite()) {
                stiffest = f32::INFINITY;
            }
            // Nothing that moves can make a node matter whose springs are too weak even together.
            if sums.stiffness_anywhere > stiffest || sums.damping_anywhere > most_damped {
                reach = reach.min(sums.shortest);
            }
        }
        Self {
            limit: Some(limit(stiffest, most_damped)),
            reach: TRAVEL_BEFORE_ESTIMATE * reach,
            anywhere: limit(stiffest_anywhere, most_damped_anywhere),
        }
    }
}

/// The longest stable substep for squared frequencies up to `stiffest` and rates of damping up to `most_damped`, s;
/// infinity where there is no limit.
fn limit(stiffest: f32, most_damped: f32) -> f32 {
    let damping = 0.5 * most_damped;
    2.0 / ((stiffest + damping * damping).sqrt() + damping)
}

/// The springs of one node, added up.
struct Sums {
    /// The directed part of the matrices of stiffness, 1/s².
    along: Symmetric,
    /// The part that is the same in all directions, 1/s².
    across: f32,
    /// The matrices of damping, 1/s.
    damping: Symmetric,
    /// What stiffness and damping can be at most, wherever the nodes are.
    stiffness_anywhere: f32,
    damping_anywhere: f32,
    /// The shortest length over which one of the matrices changes, m.
    shortest: f32,
}

impl Sums {
    fn of(node: usize, inverse_mass: f32, springs: &dyn Springs, inverse_masses: &[f32], positions: &Vectors) -> Self {
        let position = positions.get(node);
        let mut sums = Self {
            along: Symmetric::default(),
            across: 0.0,
            damping: Symmetric::default(),
            stiffness_anywhere: 0.0,
            damping_anywhere: 0.0,
            shortest: f32::INFINITY,
        };
        springs.visit(node, &mut |link| {
            let neighbour = link.neighbour as usize;
            let (length, direction) = separation(node, neighbour, positions.get(neighbour) - position);
            let inverse_mass = inverse_mass + inverse_masses[neighbour];
            let stiffness = link.stiffness * inverse_mass;
            sums.stiffness_anywhere += stiffness;
            // Stretched to twice its rest length a spring is half as stiff across as along, and so on: only the rest
            // has a direction.
            let directed = if length > link.rest_length {
                link.rest_length / length
            } else {
                1.0
            };
            sums.along.add_outer(direction, stiffness * directed);
            sums.across += stiffness * (1.0 - directed);
            if directed > 0.0 {
                sums.shortest = sums.shortest.min(length / directed);
            }
            if link.damping > 0.0 {
                let damping = link.damping * inverse_mass;
                sums.damping_anywhere += damping;
                sums.damping.add_outer(direction, damping);
                sums.shortest = sums.shortest.min(length);
            }
        });
        sums
    }
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
