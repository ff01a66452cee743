//! Preconditioned conjugate gradient (Hestenes, Stiefel 1952) that stops at negative curvature.

use glam::DVec3;

use super::equation::Equation;
use super::incomplete_cholesky;
use super::matrix::Matrix;
use super::sparsity::Sparsity;
use crate::base::{Result, memory};
use crate::codec::saved;

/// Number of consecutive iterations with small changes after which the solve has converged.
const WINDOW: usize = 10;

/// Thresholds of curvature, relative to the preconditioner's: below minus the first it is negative; above zero by less
/// than the second it is zero up to rounding.
const NEGATIVE_CURVATURE: f64 = 1e-10;
const ROUNDING: f64 = 1e-15;

/// Arrays of the conjugate gradient.
#[derive(Debug)]
pub(super) struct ConjugateGradient {
    /// Solution, m.
    pub corrections: Vec<DVec3>,
    /// Last search direction. After negative curvature, it is the direction of that curvature.
    pub search_directions: Vec<DVec3>,
    residuals: Vec<DVec3>,
    preconditioned: Vec<DVec3>,
    products: Vec<DVec3>,
    /// Pressure changes of rings.
    pressure_changes: Vec<f64>,
}

saved! { ConjugateGradient { corrections, search_directions, residuals, preconditioned, products, pressure_changes } }

/// Result of a solve.
#[derive(Clone, Copy, Debug)]
pub(super) struct CgResult {
    pub products: u32,
    /// True if a direction of negative curvature was found.
    pub is_negative: bool,
}

impl ConjugateGradient {
    /// Creates arrays for this number of nodes and rings.
    pub fn new(node_count: usize, ring_count: usize) -> Result<Self> {
        let vectors = || memory::filled(DVec3::ZERO, node_count);
        Ok(Self {
            corrections: vectors()?,
            search_directions: vectors()?,
            residuals: vectors()?,
            preconditioned: vectors()?,
            products: vectors()?,
            pressure_changes: memory::filled(0.0, ring_count)?,
        })
    }

    /// Solves for the right-hand side `rhs` until the estimated relative error is below `tolerance`, or the budget of
    /// products is used up.
    pub fn solve(
        &mut self,
        sparsity: &Sparsity,
        equation: &Equation,
        [matrix, factor]: [&Matrix; 2],
        mut rhs: impl FnMut(usize) -> DVec3,
        tolerance: f64,
        budget: u32,
    ) -> CgResult {
        for (node, residual) in self.residuals.iter_mut().enumerate() {
            *residual = rhs(node);
        }
        self.corrections.fill(DVec3::ZERO);
        self.search_directions.fill(DVec3::ZERO);
        let mut solved = CgResult {
            products: 0,
            is_negative: false,
        };
        // Lengths of the last updates, m.
        let mut recent_lengths = [0.0; WINDOW];
        let (mut last_residual_sq, mut first_residual_sq) = (0.0, 0.0);
        loop {
            incomplete_cholesky::solve(
                factor,
                sparsity,
                &self.residuals,
                &mut self.preconditioned,
                &mut self.products,
            );
            let residual_sq = dot(&self.residuals, &self.preconditioned);
            if solved.products == 0 {
                first_residual_sq = residual_sq;
            }
            let recent: f64 = recent_lengths.iter().sum();
            let is_small = residual_sq <= tolerance * tolerance * first_residual_sq
                && recent <= tolerance * max_norm(&self.corrections);
            let is_over = solved.products >= budget || !(residual_sq > 0.0 && residual_sq.is_finite());
            if is_over || is_small && (solved.products as usize >= WINDOW || residual_sq <= 1e-24 * first_residual_sq) {
                return solved;
            }
            let beta = if last_residual_sq > 0.0 {
                residual_sq / last_residual_sq
            } else {
                0.0
            };
            last_residual_sq = residual_sq;
            for (search, preconditioned) in self.search_directions.iter_mut().zip(&self.preconditioned) {
                *search = *preconditioned + *search * beta;
            }
            matrix.multiply(sparsity, &self.search_directions, &mut self.products);
            equation.add_products(
                sparsity,
                &self.search_directions,
                &mut self.products,
                &mut self.pressure_changes,
            );
            let curvature = dot(&self.search_directions, &self.products);
            let scale: f64 = self
                .search_directions
                .iter()
                .zip(&matrix.diagonal)
                .map(|(s, d)| s.dot(*d * *s).abs())
                .sum();
            solved.products += 1;
            solved.is_negative = curvature < -NEGATIVE_CURVATURE * scale;
            if solved.is_negative || !(curvature > ROUNDING * scale) {
                return solved;
            }
            let alpha = residual_sq / curvature;
            for node in 0..self.search_directions.len() {
                self.corrections[node] += self.search_directions[node] * alpha;
                self.residuals[node] -= self.products[node] * alpha;
            }
            recent_lengths[solved.products as usize % WINDOW] = alpha * max_norm(&self.search_directions);
        }
    }
}

/// Length of the longest vector; infinite if one is not finite.
pub(super) fn max_norm(vectors: &[DVec3]) -> f64 {
    let square = vectors.iter().fold(0.0, |most: f64, vector| {
        let square = vector.length_squared();
        if square.is_finite() {
            most.max(square)
        } else {
            f64::INFINITY
        }
    });
    square.sqrt()
}

/// Scalar product.
pub(super) fn dot(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
}
