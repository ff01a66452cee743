//! A bound on the angular frequencies of nodes under pressure.
//!
//! With g the gradient of a volume V, the second derivatives of the energy are `kappa/V0 g g^T - P H`. The highest
//! squared frequency of the first term is `kappa/V0 sum |g_i|²/m_i`. Here g_i is a sixth of the sum of the vectors n
//! of the node's v_i triangles. The term is therefore at most `kappa/V0 sum_t |n|² sum_corners v_i / (36 m_i)`, with
//! equality if the triangles around a node are equal. A node's row of H has, for each neighbor, a sixth of the vector
//! between the two nodes opposite that edge. By Gershgorin's theorem its part is at most `|P| v_i l / (3 m_i)`, with l
//! the longest edge there.

use glam::DVec3;

use super::Cavities;
use crate::base::{Result, memory};
use crate::codec::saved;
use crate::def::{NodalStiffness, Viscosity};
use crate::soa::{FrequencyBound, NodalMasses, Vectors};
use crate::springs::{Springs, spring_rates};

/// The weights of a triangle in the rate bound: of its vector's square and of its longest edge, 1/kg.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Weights {
    vector_weight: f32,
    edge_weight: f32,
}

saved! { Weights { vector_weight, edge_weight } }

/// Sums over the triangles of a block or a cavity.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct CavityBounds {
    /// The sum of `|g|²/m`, m⁴/kg.
    gradient_sum: f64,
    /// The largest square of `v l / 3 m`, m²/kg².
    edge_square: f64,
}

saved! { CavityBounds { gradient_sum, edge_square } }

impl CavityBounds {
    /// Adds a triangle with this vector and these two edges from its first corner.
    #[inline(always)]
    pub fn add(&mut self, weights: &Weights, vector: DVec3, [ab, ac]: [DVec3; 2]) {
        self.gradient_sum += f64::from(weights.vector_weight) * vector.length_squared();
        let square = ab.length_squared().max(ac.length_squared());
        let square = square.max((ac - ab).length_squared());
        self.edge_square = self.edge_square.max(square * f64::from(weights.edge_weight).powi(2));
    }

    pub fn merge(&mut self, other: &Self) {
        self.gradient_sum += other.gradient_sum;
        self.edge_square = self.edge_square.max(other.edge_square);
    }
}

/// The rate bound of all cavities: their maximum, or their sum if any node belongs to two cavities.
pub(super) struct RateBound {
    nodes_are_shared: bool,
    total: f64,
}

impl RateBound {
    pub fn new(nodes_are_shared: bool) -> Self {
        Self {
            nodes_are_shared,
            total: 0.0,
        }
    }

    /// Adds a cavity with this stiffness over rest volume, Pa/m³, and pressure, Pa.
    pub fn add(&mut self, stiffness: f64, pressure: f64, bounds: &CavityBounds) {
        let rate = stiffness * bounds.gradient_sum + pressure.abs() * bounds.edge_square.sqrt();
        self.total = if self.nodes_are_shared {
            self.total + rate
        } else {
            self.total.max(rate)
        };
    }

    pub fn total(&self) -> f64 {
        self.total
    }
}

impl Cavities {
    /// Computes the weights for these masses, and the bound of `springs` if no other bound includes it. Returns true
    /// if they were up to date.
    pub fn find_rates(&mut self, springs: Option<&dyn Springs>, masses: &NodalMasses) -> bool {
        if self.rates_known {
            return true;
        }
        let surface = &self.surface;
        for weights in &mut self.weights {
            *weights = Weights::default();
        }
        surface.visit(&mut |node, _, triangles| {
            let triangle_mobility = triangles.len() as f32 * masses.inverse(node);
            for &triangle in triangles {
                let weights = &mut self.weights[triangle as usize];
                weights.vector_weight += triangle_mobility / 36.0;
                weights.edge_weight = weights.edge_weight.max(triangle_mobility / 3.0);
            }
        });
        self.spring_rates = FrequencyBound::ZERO;
        if let Some(springs) = springs {
            for node in 0..masses.masses.len() {
                let spring_rates = spring_rates(node, springs, masses).unwrap_or(FrequencyBound::ZERO);
                self.spring_rates.omega_sq = self.spring_rates.omega_sq.max(spring_rates.omega_sq);
                self.spring_rates.damping_rate = self.spring_rates.damping_rate.max(spring_rates.damping_rate);
            }
        }
        self.rates_known = true;
        false
    }

    /// Adds the volume stiffness at each free node, with nodes at `positions`, distributed by the nodes' shares of the
    /// gradient.
    pub fn add_to(&self, positions: &Vectors, masses: &NodalMasses, carried: &mut [NodalStiffness]) -> Result<()> {
        let mut sums = memory::filled(0.0, self.cavities.len())?;
        let gradient_length = |triangles: &[u32]| {
            let at = |node: usize| positions.get(node).as_dvec3();
            self.surface.gradient(triangles, &at).length()
        };
        let is_free = |node: usize| masses.inverse(node) > 0.0;
        self.surface.visit(&mut |node, cavity, triangles| {
            if is_free(node) {
                sums[cavity] += gradient_length(triangles);
            }
        });
        self.surface.visit(&mut |node, cavity, triangles| {
            if is_free(node) {
                let stiffness = f64::from(self.stiffness) / self.cavities[cavity].rest_volume;
                carried[node].add(
                    (stiffness * gradient_length(triangles) * sums[cavity]) as f32,
                    Viscosity::default(),
                );
            }
        });
        Ok(())
    }

    /// Invalidates the bounds, after a change of masses, pins or springs.
    pub fn forget_rates(&mut self) {
        self.rates_known = false;
    }

    /// The rate bounds at the current state, if `is_settled`, or at the last computed forces.
    pub fn rates(&self, is_settled: bool) -> FrequencyBound {
        FrequencyBound {
            omega_sq: self.spring_rates.omega_sq
                + if is_settled {
                    self.committed_rate_bound
                } else {
                    self.rate_bound
                },
            ..self.spring_rates
        }
    }
}
