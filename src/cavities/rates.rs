//! What bounds the frequencies of nodes under pressure.
//!
//! With g the gradient of a volume V, the second derivatives are `kappa/V0 g g^T - P H`. The highest squared frequency of the first is
//! `kappa/V0 sum |g_i|²/m_i`; g_i is a sixth of the sum of the vectors n of its v_i triangles, so that it is at most
//! `kappa/V0 sum_t |n|² sum_corners v_i / (36 m_i)`, and just that where the triangles about a node are alike. In H, a node's row has for
//! each neighbour a sixth of the vector between the two nodes beside that edge: by Gershgorin's theorem its part is at most
//! `|P| v_i l / (3 m_i)`, l the longest edge there.

use glam::DVec3;

use super::Enclosed;
use crate::base::{Result, memory};
use crate::codec::saved;
use crate::def::{Carried, Viscosity};
use crate::soa::{Masses, Rates, Vectors};
use crate::springs::{Springs, rates_anywhere};

/// What a triangle counts for: the factors of the square of its vector, and of its longest edge, 1/kg.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Weights {
    of_square: f32,
    of_length: f32,
}

saved! { Weights { of_square, of_length } }

/// What the triangles of a block, or of a cavity, add up to.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct CavityBounds {
    /// The sum of `|g|²/m`, m⁴/kg.
    of_squares: f64,
    /// The largest square of `v l / 3 m`.
    of_lengths: f64,
}

saved! { CavityBounds { of_squares, of_lengths } }

impl CavityBounds {
    /// Adds a triangle with this vector, and these edges and the one between their ends.
    #[inline(always)]
    pub fn add(&mut self, weights: &Weights, vector: DVec3, [ab, ac]: [DVec3; 2]) {
        self.of_squares += f64::from(weights.of_square) * vector.length_squared();
        let square = ab.length_squared().max(ac.length_squared());
        let square = square.max((ac - ab).length_squared());
        self.of_lengths = self.of_lengths.max(square * f64::from(weights.of_length).powi(2));
    }

    pub fn and(&mut self, other: &Self) {
        self.of_squares += other.of_squares;
        self.of_lengths = self.of_lengths.max(other.of_lengths);
    }
}

/// The bound of all cavities: the largest, as no node moves with two of them, or where nodes are shared the sum.
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

    /// Adds a cavity of this stiffness over its volume at rest, Pa/m³, and this pressure, Pa.
    pub fn add(&mut self, stiffness: f64, pressure: f64, bounds: &CavityBounds) {
        let stiffest = stiffness * bounds.of_squares + pressure.abs() * bounds.of_lengths.sqrt();
        self.total = if self.nodes_are_shared {
            self.total + stiffest
        } else {
            self.total.max(stiffest)
        };
    }

    pub fn total(&self) -> f64 {
        self.total
    }
}

impl Enclosed {
    /// Makes the bound that of these masses, with these springs if they are not part of another bound: whether it was before.
    pub fn find_rates(&mut self, springs: Option<&dyn Springs>, masses: &Masses) -> bool {
        if self.rates_known {
            return true;
        }
        let surface = &self.surface;
        for weights in &mut self.weights {
            *weights = Weights::default();
        }
        surface.visit(&mut |node, _, triangles| {
            let mobility = triangles.len() as f32 * masses.inverse(node);
            for &triangle in triangles {
                let weights = &mut self.weights[triangle as usize];
                weights.of_square += mobility / 36.0;
                weights.of_length = weights.of_length.max(mobility / 3.0);
            }
        });
        self.of_springs = Rates::ZERO;
        if let Some(springs) = springs {
            for node in 0..masses.masses.len() {
                let rates = rates_anywhere(node, springs, masses).unwrap_or(Rates::ZERO);
                self.of_springs.stiffest = self.of_springs.stiffest.max(rates.stiffest);
                self.of_springs.most_damped = self.of_springs.most_damped.max(rates.most_damped);
            }
        }
        self.rates_known = true;
        false
    }

    /// Adds what the nodes that are free carry of cavities, as they are with nodes at `positions`, by the parts that they have in volumes.
    pub fn add_to(&self, positions: &Vectors, masses: &Masses, all: &mut [Carried]) -> Result<()> {
        let mut sums = memory::filled(0.0, self.cavities.len())?;
        let size = |triangles: &[u32]| {
            let at = |node: usize| positions.get(node).as_dvec3();
            self.surface.gradient(triangles, &at).length()
        };
        let is_free = |node: usize| masses.inverse(node) > 0.0;
        self.surface.visit(&mut |node, cavity, triangles| {
            if is_free(node) {
                sums[cavity] += size(triangles);
            }
        });
        self.surface.visit(&mut |node, cavity, triangles| {
            if is_free(node) {
                let stiffness = f64::from(self.stiffness) / self.cavities[cavity].rest_volume;
                all[node].add(
                    (stiffness * size(triangles) * sums[cavity]) as f32,
                    Viscosity::default(),
                );
            }
        });
        Ok(())
    }

    /// Masses, pins or springs have changed.
    pub fn forget_rates(&mut self) {
        self.rates_known = false;
    }

    /// What bounds frequencies with the nodes at the current state, where `is_settled`, or where forces were last worked out.
    pub fn rates(&self, is_settled: bool) -> Rates {
        Rates {
            stiffest: self.of_springs.stiffest + if is_settled { self.settled } else { self.highest },
            ..self.of_springs
        }
    }
}
