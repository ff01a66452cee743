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

/// What bounds a body's frequencies and its dampings.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Rates {
    /// The highest frequency squared, 1/s².
    stiffest: f32,
    /// The highest rate of damping, 1/s.
    most_damped: f32,
}

impl Rates {
    const ZERO: Self = Self {
        stiffest: 0.0,
        most_damped: 0.0,
    };

    /// The longest stable substep, s; infinity where there is no limit.
    fn limit(self) -> f32 {
        let damping = 0.5 * self.most_damped;
        2.0 / ((self.stiffest + damping * damping).sqrt() + damping)
    }

    /// Takes a node in, as it is now.
    fn take(&mut self, sums: &Sums) {
        let across = sums.across;
        let directed = sums.along.largest_eigenvalue_beyond(self.stiffest - across);
        self.stiffest = self.stiffest.max(directed + across);
        self.most_damped = sums.damping.largest_eigenvalue_beyond(self.most_damped);
        self.forbid_unless_finite(sums.anywhere);
    }

    /// Takes in a node's rates.
    fn take_rates(&mut self, rates: Self) {
        self.stiffest = self.stiffest.max(rates.stiffest);
        self.most_damped = self.most_damped.max(rates.most_damped);
        self.forbid_unless_finite(rates);
    }

    /// Springs beyond the range of `f32` allow no substep at all.
    fn forbid_unless_finite(&mut self, rates: Self) {
        if !(rates.stiffest.is_finite() && rates.most_damped.is_finite()) {
            self.stiffest = f32::INFINITY;
        }
    }
}

/// What is known about the longest stable substep of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stability {
    /// At the positions of the last estimate; `None`: not estimated since the body's masses or pins changed.
    now: Option<Rates>,
    /// Wherever the nodes are.
    anywhere: Rates,
    /// How far neighbours may still move against each other before the estimate is stale, m.
    reach: f32,
}

impl Stability {
    pub const UNKNOWN: Self = Self {
        now: None,
        anywhere: Rates::ZERO,
        reach: 0.0,
    };

    /// The longest stable substep, s, where it is known.
    pub fn limit(&self) -> Option<f32> {
        self.now.map(Rates::limit)
    }

    /// The longest substep that is stable wherever the nodes are, s, where `limit` is known.
    pub fn limit_anywhere(&self) -> f32 {
        self.anywhere.limit()
    }

    /// Whether the estimate still holds after neighbours have moved against each other by up to `travel` more.
    pub fn holds_after(&mut self, travel: f32) -> bool {
        self.reach -= travel;
        self.reach >= 0.0
    }

    /// For how many substeps the estimate holds in which neighbours move against each other by up to `travel` each, m.
    pub fn substeps_of(&self, travel: f32) -> f32 {
        if travel > 0.0 {
            self.reach / travel
        } else {
            f32::INFINITY
        }
    }

    /// The same estimate, where `substep` is so short that the nodes may be anywhere: an estimate that never gets stale.
    pub fn for_short(self, substep: f32) -> Option<Self> {
        (self.now.is_some() && substep <= self.limit_anywhere()).then_some(Self {
            now: Some(self.anywhere),
            reach: f32::INFINITY,
            ..self
        })
    }

    /// Whether another estimate may allow longer substeps at the positions as they are now.
    pub fn is_coarse(&self) -> bool {
        self.reach == f32::INFINITY && self.now.is_some_and(|rates| rates.limit().is_finite())
    }

    /// The longest stable substep at these positions, and how long that is true.
    pub fn estimate(springs: &dyn Springs, inverse_masses: &[f32], positions: &Vectors) -> Self {
        let mut now = Rates::ZERO;
        let mut anywhere = Rates::ZERO;
        let mut reach = f32::INFINITY;
        for node in 0..inverse_masses.len() {
            if let Some(sums) = Sums::of(node, springs, inverse_masses, positions) {
                now.take(&sums);
                anywhere.take_rates(sums.anywhere);
                // Nothing that moves can make a node matter whose springs are too weak even together.
                if sums.may_exceed(&now) {
                    reach = reach.min(sums.shortest);
                }
            }
        }
        Self {
            now: Some(now),
            anywhere,
            reach: TRAVEL_BEFORE_ESTIMATE * reach,
        }
    }

    /// The same after these nodes got another spring: no other node has to be looked at.
    pub fn joined(self, nodes: [u32; 2], springs: &dyn Springs, inverse_masses: &[f32], positions: &Vectors) -> Self {
        let Some(mut now) = self.now else {
            return self;
        };
        let mut joined = self;
        for node in nodes {
            let Some(sums) = Sums::of(node as usize, springs, inverse_masses, positions) else {
                continue;
            };
            joined.anywhere.take_rates(sums.anywhere);
            if self.is_coarse() {
                now.take_rates(sums.anywhere);
                continue;
            }
            now.take(&sums);
            if sums.may_exceed(&now) {
                joined.reach = joined.reach.min(TRAVEL_BEFORE_ESTIMATE * sums.shortest);
            }
        }
        joined.now = Some(now);
        joined
    }

    /// What the next step depends on.
    pub fn floats(&self) -> [f32; 5] {
        let now = self.now.unwrap_or(Rates {
            stiffest: -1.0,
            most_damped: -1.0,
        });
        let Rates { stiffest, most_damped } = self.anywhere;
        [now.stiffest, now.most_damped, stiffest, most_damped, self.reach]
    }
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
    anywhere: Rates,
    /// The shortest length over which one of the matrices changes, m.
    shortest: f32,
}

impl Sums {
    /// `None`: the node is pinned.
    fn of(node: usize, springs: &dyn Springs, inverse_masses: &[f32], positions: &Vectors) -> Option<Self> {
        let inverse_mass = inverse_masses[node];
        if inverse_mass == 0.0 {
            return None;
        }
        let position = positions.get(node);
        let mut sums = Self {
            along: Symmetric::default(),
            across: 0.0,
            damping: Symmetric::default(),
            anywhere: Rates::ZERO,
            shortest: f32::INFINITY,
        };
        springs.visit(node, &mut |link| {
            let neighbour = link.neighbour as usize;
            let (length, direction) = separation(node, neighbour, positions.get(neighbour) - position);
            let inverse_mass = inverse_mass + inverse_masses[neighbour];
            let stiffness = link.stiffness * inverse_mass;
            sums.anywhere.stiffest += stiffness;
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
                sums.anywhere.most_damped += damping;
                sums.damping.add_outer(direction, damping);
                sums.shortest = sums.shortest.min(length);
            }
        });
        Some(sums)
    }

    /// Whether the node can get rates beyond these by moving.
    fn may_exceed(&self, rates: &Rates) -> bool {
        self.anywhere.stiffest > rates.stiffest || self.anywhere.most_damped > rates.most_damped
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
