//! The longest substep that an explicit solver may take.
//!
//! A spring's stiffness is at most `k n n^T + k max(0, 1 - L0/L) (I - n n^T)`: along it, and across it where it is
//! stretched. With `q(x_i - x_j) <= (1 + t) q(x_i) + (1 + 1/t) q(x_j)` for each such form and t = m_i/m_j, the squares
//! of the body's frequencies are at most the largest eigenvalue of any node's 3x3 matrix
//! `sum_j (1/m_i + 1/m_j) K_ij`: exact for two masses, and for a long chain or a grid of equal ones. Any t holds; here it is between
//! 1/4 and 4, or a heavy node with many light neighbours, as cuts make them, would have a bound far above any frequency. The same sum over
//! the dampings bounds the rates of damping, and `h < 2 / (sqrt(omega² + delta²/4) + delta/2)` is leapfrog's limit with
//! both (Belytschko, Liu, Moran 2000, section 6.2.1, with zeta = delta / 2 omega).

use glam::Vec3;

use super::watched::{Candidate, Watched};
use crate::codec::saved;
use crate::soa::{Masses, Rates, Vectors};
use crate::springs::{Springs, separation};

/// The part of the longest stable substep that is used.
pub(crate) const RESERVE: f32 = 0.8;

/// How far neighbours may move against each other before the limit is estimated again, as a fraction of the length over
/// which the matrices of their springs change. It then changes by less than what a chosen substep keeps in reserve.
const TRAVEL_BEFORE_ESTIMATE: f32 = 0.25;

/// How much longer substeps have to be to be worth estimates of all nodes of a moving body.
///
/// A node's largest eigenvalue is at least a third of the sum of all three, which is no less than what its springs' stiffnesses
/// add up to: without damping along springs an estimate allows at most sqrt(3) times the substep that is stable anywhere, as in
/// even lattices in three dimensions. A moving body would pay for that with the time of several substeps every few substeps.
const WORTH_LENGTHENING: f32 = 2.0;

/// So few nodes are sorted into those that are watched one by one.
const FEW: usize = 8;

/// What is known about the longest stable substep of a body, with its masses as they are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stability {
    /// The limit at the positions of the last estimate, s; `None`: not estimated since the body's masses or pins changed.
    now: Option<f32>,
    /// The limit wherever the nodes are, s.
    anywhere: f32,
    /// What the last estimate found, s.
    found: f32,
    /// How far neighbours may still move against each other before the estimate is stale, m.
    reach: f32,
}

saved! { Stability { now, anywhere, found, reach } }

impl Stability {
    pub const UNKNOWN: Self = Self {
        now: None,
        anywhere: 0.0,
        found: 0.0,
        reach: 0.0,
    };

    /// The longest stable substep, s, where it is known.
    pub fn limit(&self) -> Option<f32> {
        self.now
    }

    /// The longest substep that is stable wherever the nodes are, s, where `limit` is known.
    pub fn limit_anywhere(&self) -> f32 {
        self.anywhere
    }

    /// What the last estimate found, s, wherever the nodes have gone since.
    pub fn found(&self) -> f32 {
        self.found
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
        (self.now.is_some() && substep <= self.anywhere).then_some(Self {
            now: Some(self.anywhere),
            reach: f32::INFINITY,
            ..self
        })
    }

    /// Whether another estimate may allow longer substeps at the positions as they are now.
    pub fn is_coarse(&self) -> bool {
        self.reach == f32::INFINITY && self.now.is_some_and(f32::is_finite)
    }

    /// Whether estimates allow substeps so much longer than those that are stable anywhere that they are worth their time.
    pub fn is_worth_estimating(&self) -> bool {
        self.found > WORTH_LENGTHENING * self.anywhere
    }

    /// The same, where the limit is found to be no longer than `limit`, s.
    pub fn shortened_to(self, limit: f32) -> Self {
        Self {
            now: self.now.map(|now| now.min(limit)),
            ..self
        }
    }

    /// The longest stable substep at these positions, and how long that is true. `watched` are up to date.
    ///
    /// Where the watched nodes show a limit that no other node can go below, wherever it is, no other is looked at.
    pub fn estimate(springs: &dyn Springs, masses: Masses, positions: &Vectors, watched: &Watched) -> Self {
        let mut found = Tightest {
            limit: f32::INFINITY,
            shortest: f32::INFINITY,
        };
        for candidate in watched.candidates() {
            if candidate.limit >= found.limit {
                break;
            }
            if let Some(sums) = NodeBound::of(candidate.node as usize, springs, &masses, positions) {
                found.take(&sums);
            }
        }
        if watched.limit_of_others() < found.limit {
            for node in 0..masses.masses.len() {
                if let Some(sums) = NodeBound::of(node, springs, &masses, positions) {
                    found.take(&sums);
                }
            }
        }
        Self {
            now: Some(found.limit),
            anywhere: watched.limit(),
            found: found.limit,
            reach: TRAVEL_BEFORE_ESTIMATE * found.shortest,
        }
    }

    /// The node whose springs allow the shortest substep at these positions, the other end of its stiffest spring, and that substep, s;
    /// `None`: no node that is free has springs.
    pub fn tightest(springs: &dyn Springs, masses: Masses, positions: &Vectors) -> Option<([usize; 2], f32)> {
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
            let inverse_mass = masses.of_spring(masses.inverse(node), link.neighbour as usize);
            let stiffness = (link.stiffness + link.damping / shortest) * inverse_mass;
            if stiffness > stiffest {
                (other, stiffest) = (link.neighbour as usize, stiffness);
            }
        });
        Some(([node, other], shortest))
    }

    /// What the last estimate tells of the springs that it looked at.
    fn tightest_known(&self) -> Option<Tightest> {
        let shortest = self.reach / TRAVEL_BEFORE_ESTIMATE;
        self.now.map(|limit| Tightest { limit, shortest })
    }

    /// The same after springs of these nodes, given in order, have come or changed: no other node has to be looked at. Where they
    /// became softer it may be lower than it has to be.
    pub fn changed(
        self,
        nodes: &[u32],
        springs: &dyn Springs,
        masses: Masses,
        positions: &Vectors,
        watched: &mut Watched,
    ) -> Self {
        let Some(mut found) = self.tightest_known() else {
            return self;
        };
        let is_few = nodes.len() <= FEW;
        if !is_few {
            watched.renew(nodes, springs, masses);
        }
        for &node in nodes {
            let Some(sums) = NodeBound::of(node as usize, springs, &masses, positions) else {
                continue;
            };
            if is_few {
                watched.insert(node, sums.anywhere.limit());
            }
            found.take_changed(&sums, self.is_coarse());
        }
        self.with(&found, watched)
    }

    /// The same after a cut has changed these nodes, in one walk over those that are watched. There is room for a candidate of each.
    pub fn cut(
        self,
        nodes: &[u32],
        springs: &dyn Springs,
        masses: Masses,
        positions: &Vectors,
        (watched, mut candidates): (&mut Watched, Vec<Candidate>),
    ) -> Self {
        let Some(mut found) = self.tightest_known() else {
            return self;
        };
        for &node in nodes {
            if let Some(sums) = NodeBound::of(node as usize, springs, &masses, positions) {
                let limit = sums.anywhere.limit();
                candidates.push(Candidate { limit, node });
                found.take_changed(&sums, self.is_coarse());
            }
        }
        watched.take_all(candidates);
        self.with(&found, watched)
    }

    fn with(self, found: &Tightest, watched: &Watched) -> Self {
        Self {
            now: Some(found.limit),
            found: self.found.min(found.limit),
            anywhere: watched.limit(),
            reach: TRAVEL_BEFORE_ESTIMATE * found.shortest,
        }
    }

    /// What the next step depends on.
    pub fn floats(&self) -> [f32; 4] {
        [self.now.unwrap_or(-1.0), self.anywhere, self.found, self.reach]
    }
}

/// What the nodes show that have been looked at.
struct Tightest {
    /// s
    limit: f32,
    /// The shortest length over which the matrix of a node changes that may set the limit, m.
    shortest: f32,
}

impl Tightest {
    /// Takes a node in that has changed; `is_coarse`: wherever it goes.
    fn take_changed(&mut self, sums: &NodeBound, is_coarse: bool) {
        if is_coarse {
            self.limit = self.limit.min(sums.anywhere.limit());
        } else {
            self.take(sums);
        }
    }

    /// Takes a node in. Nothing that moves can make a node matter whose springs are too weak even together.
    fn take(&mut self, sums: &NodeBound) {
        if sums.anywhere.limit() < self.limit {
            self.limit = self.limit.min(sums.limit_below(self.limit));
            self.shortest = self.shortest.min(sums.shortest);
        }
    }
}

/// The springs of one node, added up.
struct NodeBound {
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

impl NodeBound {
    /// `None`: the node is pinned.
    fn of(node: usize, springs: &dyn Springs, masses: &Masses, positions: &Vectors) -> Option<Self> {
        let inverse_mass = masses.inverse(node);
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
            let inverse_mass = masses.of_spring(inverse_mass, neighbour);
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

    /// The longest substep that is stable for the node where it is, s, or anything from `known` on where it is no shorter.
    fn limit_below(&self, known: f32) -> f32 {
        let bound = Rates {
            stiffest: self.along.eigenvalue_bound() + self.across,
            most_damped: self.damping.eigenvalue_bound(),
        };
        if bound.limit() >= known {
            return known;
        }
        Rates {
            stiffest: self.along.largest_eigenvalue() + self.across,
            most_damped: self.damping.largest_eigenvalue(),
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
    /// Adds `factor` times `vector vector^T`.
    #[inline(always)]
    fn add_outer(&mut self, vector: Vec3, factor: f32) {
        let scaled = vector * factor;
        self.diagonal += scaled * vector;
        self.off_diagonal += Vec3::new(scaled.y * vector.z, scaled.z * vector.x, scaled.x * vector.y);
    }

    /// What the largest eigenvalue is at most.
    fn eigenvalue_bound(&self) -> f32 {
        self.mean() + 2.0 * self.spread()
    }

    /// A third of the sum of the eigenvalues.
    fn mean(&self) -> f32 {
        self.diagonal.element_sum() / 3.0
    }

    /// How far apart the eigenvalues are: none is further than twice that from their mean.
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
