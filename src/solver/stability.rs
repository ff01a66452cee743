//! The longest substep that an explicit solver may take.
//!
//! A spring's stiffness is at most `k n n^T + k max(0, 1 - L0/L) (I - n n^T)`: the first part acts along the spring,
//! the second one across it if it is stretched. For each such form `q(x_i - x_j) <= (1 + t) q(x_i) + (1 + 1/t) q(x_j)`
//! with t = m_i/m_j. The squares of the body's frequencies are therefore at most the largest eigenvalue of any node's
//! 3x3 matrix `sum_j (1/m_i + 1/m_j) K_ij`. The bound is exact for two masses, and for a long chain or a grid of equal
//! masses. It holds for any t. Here t is limited to 1/4 to 4: otherwise a heavy node with many light neighbors, as cuts
//! create them, would have a bound far above any frequency. The same sum over the dampings bounds the damping rates.
//! With both, the limit of leapfrog is `h < 2 / (sqrt(omega² + delta²/4) + delta/2)` (Belytschko, Liu, Moran 2000,
//! section 6.2.1, with zeta = delta / 2 omega).

use glam::Vec3;

use super::critical_nodes::{CriticalNode, CriticalNodes};
use crate::codec::saved;
use crate::soa::{FrequencyBound, NodalMasses, Vectors};
use crate::springs::{Springs, separation};

/// The used fraction of the longest stable substep.
pub(crate) const RESERVE: f32 = 0.8;

/// The relative displacement of neighbors before the limit is estimated again, as a fraction of the length over which
/// the matrices of their springs change. The limit then changes by less than the reserve of the substep.
const TRAVEL_BEFORE_ESTIMATE: f32 = 0.25;

/// The gain in substep length that makes repeated estimates of a moving body worthwhile.
///
/// A node's largest eigenvalue is at least a third of the trace, and the trace is at least the sum of its springs'
/// stiffnesses. Without spring damping, an estimate thus allows at most sqrt(3) times the substep that is stable at all
/// positions, for example in regular 3D lattices. A moving body would pay for this gain with the cost of several
/// substeps every few substeps.
const WORTH_LENGTHENING: f32 = 2.0;

/// Up to this many nodes are inserted into the critical nodes one by one.
const FEW_NODES: usize = 8;

/// The longest stable substep of a body with unscaled masses, as far as it is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stability {
    /// The limit at the positions of the last estimate, s. `None` if masses or pins have changed since.
    current: Option<f32>,
    /// The limit at all positions, s.
    anywhere: f32,
    /// The result of the last estimate, s.
    last_estimate: f32,
    /// The relative displacement of neighbors for which the estimate remains valid, m.
    valid_travel: f32,
}

saved! { Stability { current, anywhere, last_estimate, valid_travel } }

impl Stability {
    pub const UNKNOWN: Self = Self {
        current: None,
        anywhere: 0.0,
        last_estimate: 0.0,
        valid_travel: 0.0,
    };

    /// The longest stable substep, if it is known, s.
    pub fn limit(&self) -> Option<f32> {
        self.current
    }

    /// The longest substep that is stable at all positions, s. Valid if `limit` is known.
    pub fn limit_anywhere(&self) -> f32 {
        self.anywhere
    }

    /// The result of the last estimate at its positions, s.
    pub fn last_estimate(&self) -> f32 {
        self.last_estimate
    }

    /// Subtracts a relative displacement of neighbors from `valid_travel`. Returns true if the estimate is still valid.
    pub fn remains_valid_after(&mut self, travel: f32) -> bool {
        self.valid_travel -= travel;
        self.valid_travel >= 0.0
    }

    /// The number of substeps for which the estimate is valid, if neighbors move relative to each other by `travel` in
    /// each, m.
    pub fn valid_substeps(&self, travel: f32) -> f32 {
        if travel > 0.0 {
            self.valid_travel / travel
        } else {
            f32::INFINITY
        }
    }

    /// Returns a permanently valid limit if `substep` is stable at all positions.
    pub fn if_stable_anywhere(self, substep: f32) -> Option<Self> {
        (self.current.is_some() && substep <= self.anywhere).then_some(Self {
            current: Some(self.anywhere),
            valid_travel: f32::INFINITY,
            ..self
        })
    }

    /// True if an estimate at the current positions may allow longer substeps.
    pub fn is_coarse(&self) -> bool {
        self.valid_travel == f32::INFINITY && self.current.is_some_and(f32::is_finite)
    }

    /// True if estimates allow substeps enough longer than the limit at all positions to justify their cost.
    pub fn is_worth_estimating(&self) -> bool {
        self.last_estimate > WORTH_LENGTHENING * self.anywhere
    }

    /// Returns a copy with the limit reduced to at most `limit`, s.
    pub fn shortened_to(self, limit: f32) -> Self {
        Self {
            current: self.current.map(|current| current.min(limit)),
            ..self
        }
    }

    /// Estimates the longest stable substep at these positions, and its validity. The critical nodes must be up to
    /// date.
    ///
    /// If they give a limit that no other node can go below at any position, no other node is visited.
    pub fn estimate(
        springs: &dyn Springs,
        masses: NodalMasses,
        positions: &Vectors,
        critical_nodes: &CriticalNodes,
    ) -> Self {
        let mut tightest = Tightest {
            limit: f32::INFINITY,
            shortest: f32::INFINITY,
        };
        for candidate in critical_nodes.candidates() {
            if candidate.limit >= tightest.limit {
                break;
            }
            if let Some(sums) = NodeBound::of(candidate.node as usize, springs, &masses, positions) {
                tightest.include(&sums);
            }
        }
        if critical_nodes.other_limit() < tightest.limit {
            for node in 0..masses.masses.len() {
                if let Some(sums) = NodeBound::of(node, springs, &masses, positions) {
                    tightest.include(&sums);
                }
            }
        }
        Self {
            current: Some(tightest.limit),
            anywhere: critical_nodes.limit(),
            last_estimate: tightest.limit,
            valid_travel: TRAVEL_BEFORE_ESTIMATE * tightest.shortest,
        }
    }

    /// Finds the node with the shortest stable substep at these positions, the other end of its stiffest spring, and
    /// that substep, s. `None` if no free node has springs.
    pub fn tightest(springs: &dyn Springs, masses: NodalMasses, positions: &Vectors) -> Option<([usize; 2], f32)> {
        let mut tightest = None;
        let mut shortest = f32::INFINITY;
        for node in 0..masses.masses.len() {
            if let Some(sums) = NodeBound::of(node, springs, &masses, positions)
                && sums.anywhere.limit() < shortest
            {
                let limit = sums.limit_below(shortest);
                if limit < shortest {
                    (tightest, shortest) = (Some(node), limit);
                }
            }
        }
        let node = tightest?;
        let (mut other, mut stiffest) = (node, -1.0);
        springs.visit(node, &mut |link| {
            let inverse_mass = masses.spring_factor(masses.inverse(node), link.neighbor as usize);
            let stiffness = (link.stiffness + link.damping / shortest) * inverse_mass;
            if stiffness > stiffest {
                (other, stiffest) = (link.neighbor as usize, stiffness);
            }
        });
        Some(([node, other], shortest))
    }

    /// Recovers the bound of the last estimate.
    fn tightest_known(&self) -> Option<Tightest> {
        let shortest = self.valid_travel / TRAVEL_BEFORE_ESTIMATE;
        self.current.map(|limit| Tightest { limit, shortest })
    }

    /// Updates the limit after springs of these nodes were added or changed, without visiting other nodes. `nodes` are
    /// sorted. After softening, the limit may be lower than necessary.
    pub fn changed(
        self,
        nodes: &[u32],
        springs: &dyn Springs,
        masses: NodalMasses,
        positions: &Vectors,
        critical_nodes: &mut CriticalNodes,
    ) -> Self {
        let Some(mut tightest) = self.tightest_known() else {
            return self;
        };
        let is_few = nodes.len() <= FEW_NODES;
        if !is_few {
            critical_nodes.update(nodes, springs, masses);
        }
        for &node in nodes {
            let Some(sums) = NodeBound::of(node as usize, springs, &masses, positions) else {
                continue;
            };
            if is_few {
                critical_nodes.insert(node, sums.anywhere.limit());
            }
            tightest.include_changed(&sums, self.is_coarse());
        }
        self.with(&tightest, critical_nodes)
    }

    /// Updates the limit after a cut has changed these nodes, in one pass over the critical nodes. `candidates` must
    /// have capacity for all nodes.
    pub fn cut(
        self,
        nodes: &[u32],
        springs: &dyn Springs,
        masses: NodalMasses,
        positions: &Vectors,
        (critical_nodes, mut candidates): (&mut CriticalNodes, Vec<CriticalNode>),
    ) -> Self {
        let Some(mut tightest) = self.tightest_known() else {
            return self;
        };
        for &node in nodes {
            if let Some(sums) = NodeBound::of(node as usize, springs, &masses, positions) {
                let limit = sums.anywhere.limit();
                candidates.push(CriticalNode { limit, node });
                tightest.include_changed(&sums, self.is_coarse());
            }
        }
        critical_nodes.merge(candidates);
        self.with(&tightest, critical_nodes)
    }

    fn with(self, tightest: &Tightest, critical_nodes: &CriticalNodes) -> Self {
        Self {
            current: Some(tightest.limit),
            last_estimate: self.last_estimate.min(tightest.limit),
            anywhere: critical_nodes.limit(),
            valid_travel: TRAVEL_BEFORE_ESTIMATE * tightest.shortest,
        }
    }

    /// The values that the next step depends on.
    pub fn floats(&self) -> [f32; 4] {
        [
            self.current.unwrap_or(-1.0),
            self.anywhere,
            self.last_estimate,
            self.valid_travel,
        ]
    }
}

/// The bound of the visited nodes.
struct Tightest {
    /// The shortest stable substep, s.
    limit: f32,
    /// The shortest length over which the matrix of a critical node changes, m.
    shortest: f32,
}

impl Tightest {
    /// Includes a changed node. `is_coarse`: with its limit at all positions.
    fn include_changed(&mut self, sums: &NodeBound, is_coarse: bool) {
        if is_coarse {
            self.limit = self.limit.min(sums.anywhere.limit());
        } else {
            self.include(sums);
        }
    }

    /// Includes a node. Nodes whose limit at all positions is above the current limit cannot matter.
    fn include(&mut self, sums: &NodeBound) {
        if sums.anywhere.limit() < self.limit {
            self.limit = self.limit.min(sums.limit_below(self.limit));
            self.shortest = self.shortest.min(sums.shortest);
        }
    }
}

/// The sums over the springs of a node.
struct NodeBound {
    /// The directional part of the stiffness matrices, 1/s².
    along: Symmetric,
    /// The isotropic part, 1/s².
    across: f32,
    /// The damping matrices, 1/s.
    damping: Symmetric,
    /// The bounds of stiffness and damping at all positions.
    anywhere: FrequencyBound,
    /// The shortest length over which one of the matrices changes, m.
    shortest: f32,
}

impl NodeBound {
    /// Returns `None` for a pinned node.
    fn of(node: usize, springs: &dyn Springs, masses: &NodalMasses, positions: &Vectors) -> Option<Self> {
        let inverse_mass = masses.inverse(node);
        if inverse_mass == 0.0 {
            return None;
        }
        let position = positions.get(node);
        let mut sums = Self {
            along: Symmetric::default(),
            across: 0.0,
            damping: Symmetric::default(),
            anywhere: FrequencyBound::ZERO,
            shortest: f32::INFINITY,
        };
        springs.visit(node, &mut |link| {
            let neighbor = link.neighbor as usize;
            let (length, direction) = separation(node, neighbor, positions.get(neighbor) - position);
            let inverse_mass = masses.spring_factor(inverse_mass, neighbor);
            let stiffness = link.stiffness * inverse_mass;
            sums.anywhere.omega_sq += stiffness;
            // A spring that is stretched to twice its rest length has half its stiffness across. Only the difference is
            // directional.
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
                sums.anywhere.damping_rate += damping;
                sums.damping.add_outer(direction, damping);
                sums.shortest = sums.shortest.min(length);
            }
        });
        Some(sums)
    }

    /// The longest stable substep of the node, s. Returns `known` if it is not shorter.
    fn limit_below(&self, known: f32) -> f32 {
        let bound = FrequencyBound {
            omega_sq: self.along.eigenvalue_bound() + self.across,
            damping_rate: self.damping.eigenvalue_bound(),
        };
        if bound.limit() >= known {
            return known;
        }
        FrequencyBound {
            omega_sq: self.along.largest_eigenvalue() + self.across,
            damping_rate: self.damping.largest_eigenvalue(),
        }
        .limit()
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
    /// Adds `factor * vector * vector^T`.
    #[inline(always)]
    fn add_outer(&mut self, vector: Vec3, factor: f32) {
        let scaled = vector * factor;
        self.diagonal += scaled * vector;
        self.off_diagonal += Vec3::new(scaled.y * vector.z, scaled.z * vector.x, scaled.x * vector.y);
    }

    /// An upper bound of the largest eigenvalue.
    fn eigenvalue_bound(&self) -> f32 {
        self.mean() + 2.0 * self.spread()
    }

    /// The mean of the eigenvalues.
    fn mean(&self) -> f32 {
        self.diagonal.element_sum() / 3.0
    }

    /// Half of a bound of the distance of eigenvalues from their mean.
    fn spread(&self) -> f32 {
        let deviation = self.diagonal - self.mean();
        ((deviation.length_squared() + 2.0 * self.off_diagonal.length_squared()) / 6.0).sqrt()
    }

    /// The largest eigenvalue (Smith 1961).
    fn largest_eigenvalue(&self) -> f32 {
        let (mean, p) = (self.mean(), self.spread());
        if p == 0.0 {
            return mean;
        }
        let (d, o) = ((self.diagonal - mean) / p, self.off_diagonal / p);
        let determinant = d.x * (d.y * d.z - o.x * o.x) - o.z * (o.z * d.z - o.x * o.y) + o.y * (o.z * o.x - d.y * o.y);
        let cosine = (0.5 * determinant).clamp(-1.0, 1.0);
        mean + 2.0 * p * libm::cosf(libm::acosf(cosine) / 3.0)
    }
}
