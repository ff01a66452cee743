//! Conjugate gradients, preconditioned (Hestenes, Stiefel 1952), which end where the matrix turns out to be indefinite.

use glam::DVec3;

use super::equation::Equation;
use super::factor;
use super::matrix::Matrix;
use super::network::Network;
use crate::base::{Result, memory};
use crate::codec::saved;

/// So many iterations in a row must change little before the solution counts as found.
const WINDOW: usize = 10;

/// A curvature below minus this part of the preconditioner's is negative; one above zero by less than rounding is none.
const NEGATIVE: f64 = 1e-10;
const ROUNDING: f64 = 1e-15;

/// What the iterations need.
#[derive(Debug)]
pub(super) struct Gradient {
    /// The solution, m.
    pub corrections: Vec<DVec3>,
    /// The direction of the last search; where the curvature was negative it is the direction of that.
    pub searches: Vec<DVec3>,
    residuals: Vec<DVec3>,
    preconditioned: Vec<DVec3>,
    products: Vec<DVec3>,
    /// Of rings.
    pressure_changes: Vec<f64>,
}

saved! { Gradient { corrections, searches, residuals, preconditioned, products, pressure_changes } }

/// How the iterations ended.
#[derive(Clone, Copy, Debug)]
pub(super) struct Solved {
    pub products: u32,
    /// Whether a direction of negative curvature was met.
    pub is_negative: bool,
}

impl Gradient {
    /// For so many nodes, and rings.
    pub fn new(node_count: usize, ring_count: usize) -> Result<Self> {
        let vectors = || memory::filled(DVec3::ZERO, node_count);
        Ok(Self {
            corrections: vectors()?,
            searches: vectors()?,
            residuals: vectors()?,
            preconditioned: vectors()?,
            products: vectors()?,
            pressure_changes: memory::filled(0.0, ring_count)?,
        })
    }

    /// Solves for the right-hand side that `right` has at each node, until less than `part` of the solution is missing as far as
    /// one can tell, or after so many products.
    pub fn solve(
        &mut self,
        network: &Network,
        equation: &Equation,
        [matrix, factor]: [&Matrix; 2],
        mut right: impl FnMut(usize) -> DVec3,
        part: f64,
        budget: u32,
    ) -> Solved {
        for (node, residual) in self.residuals.iter_mut().enumerate() {
            *residual = right(node);
        }
        self.corrections.fill(DVec3::ZERO);
        self.searches.fill(DVec3::ZERO);
        let mut solved = Solved {
            products: 0,
            is_negative: false,
        };
        // How far the last iterations went, m.
        let mut lately = [0.0; WINDOW];
        let (mut last_square, mut first_square) = (0.0, 0.0);
        loop {
            factor::solve(
                factor,
                network,
                &self.residuals,
                &mut self.preconditioned,
                &mut self.products,
            );
            let square = dot(&self.residuals, &self.preconditioned);
            if solved.products == 0 {
                first_square = square;
            }
            let recent: f64 = lately.iter().sum();
            let is_small = square <= part * part * first_square && recent <= part * longest(&self.corrections);
            let is_over = solved.products >= budget || !(square > 0.0 && square.is_finite());
            if is_over || is_small && (solved.products as usize >= WINDOW || square <= 1e-24 * first_square) {
                return solved;
            }
            let carried = if last_square > 0.0 { square / last_square } else { 0.0 };
            last_square = square;
            for (search, preconditioned) in self.searches.iter_mut().zip(&self.preconditioned) {
                *search = *preconditioned + *search * carried;
            }
            matrix.multiply(network, &self.searches, &mut self.products);
            equation.add_products(network, &self.searches, &mut self.products, &mut self.pressure_changes);
            let curvature = dot(&self.searches, &self.products);
            let scale: f64 = self
                .searches
                .iter()
                .zip(&matrix.diagonal)
                .map(|(s, d)| s.dot(*d * *s).abs())
                .sum();
            solved.products += 1;
            solved.is_negative = curvature < -NEGATIVE * scale;
            if solved.is_negative || !(curvature > ROUNDING * scale) {
                return solved;
            }
            let length = square / curvature;
            for node in 0..self.searches.len() {
                self.corrections[node] += self.searches[node] * length;
                self.residuals[node] -= self.products[node] * length;
            }
            lately[solved.products as usize % WINDOW] = length * longest(&self.searches);
        }
    }
}

/// The longest of some vectors; infinite where one is not finite.
pub(super) fn longest(vectors: &[DVec3]) -> f64 {
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

/// The sum of products.
pub(super) fn dot(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
}
