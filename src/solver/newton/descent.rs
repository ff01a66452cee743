//! Minimization by Newton's method with exact second derivatives and a line search. Added inertia (a shift of the
//! matrix) regularizes steps for which the quadratic model is poor. It decreases as the model improves.

use glam::DVec3;

use super::conjugate_gradient::{ConjugateGradient, dot, max_norm};
use super::equation::{Equation, HessianKind};
use super::incomplete_cholesky;
use super::matrix::Matrix;
use super::sparsity::Sparsity;
use crate::base::{Result, memory};
use crate::codec::saved;
use crate::forces::Forces;

/// Relative error allowed in each linear solve.
const LINEAR_TOLERANCE: f64 = 0.01;

/// Minimum decrease as a fraction of the decrease that the slope predicts (Armijo 1966).
const ARMIJO: f64 = 1e-4;

/// Ratio of actual to predicted decrease above which a longer step is tried. The function then curves less than the
/// matrix.
const EXTEND_RATIO: f64 = 1.3;

/// Rounding error of a sum, relative to its terms.
const ROUNDING: f64 = 1e-13;

/// Preallocated data of a minimization.
#[derive(Debug)]
pub(super) struct Descent {
    pub sparsity: Sparsity,
    pub equation: Equation,
    /// Force on each node, including held ones, N.
    pub residuals: Vec<DVec3>,
    pub cg: ConjugateGradient,
    matrix: Matrix,
    factor: Matrix,
}

saved! { Descent { sparsity, equation, residuals, cg, matrix, factor } }

/// Stopping criteria of a minimization.
#[derive(Clone, Copy, Debug)]
pub(super) struct DescentGoal {
    /// Length below which a correction is the last one, m.
    pub absolute: f64,
    /// The same, relative to the largest displacement.
    pub relative: f64,
    /// Length below which corrections that stop decreasing are due to rounding, m.
    pub rounding: f64,
    /// Maximum number of linear solves, and of products in all.
    pub iterations: u32,
    pub budget: u32,
    /// Initial shift, minimum shift, and shift after the first poor step, 1/s².
    pub shift: f64,
    pub least_shift: f64,
    pub next_shift: f64,
}

/// Result of a minimization.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::solver) struct DescentReport {
    pub iterations: u32,
    pub products: u32,
    /// Largest displacement of the last correction, m.
    pub error: f64,
    pub converged: bool,
}

impl Descent {
    /// Creates the data for a body with these forces.
    pub fn new(forces: &Forces) -> Result<Self> {
        let node_count = forces.springs.node_count();
        let sparsity = Sparsity::new(forces)?;
        let pair_count = sparsity.pair_count();
        Ok(Self {
            equation: Equation::new(node_count, sparsity.ring_count(), sparsity.member_count())?,
            residuals: memory::filled(DVec3::ZERO, node_count)?,
            cg: ConjugateGradient::new(node_count, sparsity.ring_count())?,
            matrix: Matrix::new(node_count, pair_count)?,
            factor: Matrix::new(node_count, pair_count)?,
            sparsity,
        })
    }

    /// Reserves capacity for this number of springs.
    pub fn reserve(&mut self, spring_count: usize) -> Result<()> {
        let pair_count = self.sparsity.reserve(spring_count)?;
        self.matrix.reserve(pair_count)?;
        self.factor.reserve(pair_count)
    }

    /// Computes the force on each node.
    pub fn update_residuals(&mut self) {
        self.equation.residuals(&self.sparsity, &mut self.residuals);
    }

    /// Minimizes until the goal is reached.
    pub fn run(&mut self, goal: &DescentGoal) -> DescentReport {
        let mut report = DescentReport {
            error: f64::INFINITY,
            ..DescentReport::default()
        };
        let mut shift = goal.shift;
        let mut stagnant_count = 0;
        let mut largest_displacement = 0.0_f64;
        while report.iterations < goal.iterations && report.products < goal.budget {
            report.iterations += 1;
            self.update_residuals();
            if self.solve_correction(HessianKind::Exact, shift, goal, &mut report) {
                // Follow the direction of negative curvature, then use a positive semidefinite matrix.
                let length = max_norm(&self.cg.corrections);
                self.follow_search_direction(if report.error.is_finite() { report.error } else { length });
                self.update_residuals();
                self.solve_correction(HessianKind::Clamped, shift, goal, &mut report);
            }
            let predicted = dot(&self.residuals, &self.cg.corrections);
            let size = max_norm(&self.cg.corrections);
            if !(predicted > 0.0 && size.is_finite()) {
                // No correction is left, or the result is not finite.
                report.converged = size == 0.0;
                report.error = size;
                break;
            }
            self.equation.multipliers.forbid_tension();
            let (step_fraction, decrease_ratio) = self.line_search(predicted);
            let used_shift = shift;
            largest_displacement = largest_displacement.max(max_norm(&self.equation.displacements));
            if decrease_ratio > 0.75 && step_fraction >= 1.0 {
                shift *= 0.1;
            } else if decrease_ratio < 0.25 || step_fraction < 0.5 {
                shift = (4.0 * shift).max(goal.next_shift);
            }
            if shift < goal.least_shift.max(1e-3 * goal.next_shift) {
                shift = goal.least_shift;
            }
            stagnant_count = if step_fraction > 0.0 && size < 0.5 * report.error {
                0
            } else {
                stagnant_count + 1
            };
            report.error = size * step_fraction.max(1.0);
            let shift_work = shift.min(used_shift) * self.inertia_of_correction();
            let is_short = report.error <= goal.absolute.max(goal.relative * largest_displacement);
            // The decrease by such a short correction is due to rounding and may be negative.
            let is_negligible = size <= goal.absolute;
            let is_noise = size <= goal.rounding && stagnant_count >= 3;
            if (is_short && step_fraction >= 1.0 || is_negligible || is_noise) && shift_work <= 0.1 * predicted {
                report.converged = true;
                break;
            }
        }
        report
    }

    /// Finds a descent direction of negative curvature at a stationary point and moves along it. Returns true if there
    /// is one.
    pub fn leave_saddle(&mut self, shift: f64, length: f64, report: &mut DescentReport, budget: u32) -> bool {
        self.equation
            .assemble(&self.sparsity, HessianKind::Factor, shift, &mut self.factor);
        incomplete_cholesky::factorize(&mut self.factor, &self.sparsity);
        self.equation
            .assemble(&self.sparsity, HessianKind::Exact, shift, &mut self.matrix);
        let equation = &self.equation;
        // Pseudorandom numbers, so that no eigenvector is orthogonal to the right-hand side.
        let mut seed = 1_u64;
        let mut number = || {
            seed = seed
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) as f64 / f64::from(1_u32 << 30) - 1.0
        };
        let rhs = |node: usize| {
            let vector = DVec3::new(number(), number(), number());
            equation.free_part(node, vector)
        };
        let solved = self.cg.solve(
            &self.sparsity,
            equation,
            [&self.matrix, &self.factor],
            rhs,
            1e-3,
            budget,
        );
        report.products += solved.products;
        if !solved.is_negative {
            return false;
        }
        self.follow_search_direction(length)
    }

    /// Moves along the search direction of negative curvature, first by `length` m, then further while the function
    /// decreases. Returns true if it has decreased.
    fn follow_search_direction(&mut self, length: f64) -> bool {
        let search_directions = &self.cg.search_directions;
        let change = |fraction: f64| self.equation.change(&self.sparsity, search_directions, fraction)[0];
        let first = length / max_norm(search_directions);
        let mut fraction = if change(first) <= change(-first) { first } else { -first };
        let mut lowest = change(fraction);
        for _ in 0..30 {
            let is_falling = lowest < 0.0;
            let next = if is_falling { 2.0 * fraction } else { 0.5 * fraction };
            let change = change(next);
            if is_falling && !(change < lowest) {
                break;
            }
            (fraction, lowest) = (next, change);
        }
        if !(lowest < 0.0) {
            return false;
        }
        for (displacement, search) in self.equation.displacements.iter_mut().zip(search_directions) {
            *displacement += *search * fraction;
        }
        true
    }

    /// Solves the linearized equation. Returns true if the matrix is indefinite.
    fn solve_correction(
        &mut self,
        kind: HessianKind,
        shift: f64,
        goal: &DescentGoal,
        report: &mut DescentReport,
    ) -> bool {
        self.equation.update_contacts();
        self.equation
            .assemble(&self.sparsity, HessianKind::Factor, shift, &mut self.factor);
        incomplete_cholesky::factorize(&mut self.factor, &self.sparsity);
        self.equation.assemble(&self.sparsity, kind, shift, &mut self.matrix);
        let (equation, residuals) = (&self.equation, &self.residuals);
        let rhs = |node: usize| equation.free_part(node, residuals[node]);
        let budget = goal.budget.saturating_sub(report.products);
        let solved = self.cg.solve(
            &self.sparsity,
            equation,
            [&self.matrix, &self.factor],
            rhs,
            LINEAR_TOLERANCE,
            budget,
        );
        report.products += solved.products;
        solved.is_negative
    }

    /// Moves along the correction until the function has decreased enough. Returns the fraction of the correction, and
    /// the ratio of actual to predicted decrease.
    fn line_search(&mut self, predicted: f64) -> (f64, f64) {
        let corrections = &self.cg.corrections;
        let mut fraction = 1.0;
        for _ in 0..50 {
            let [change, terms] = self.equation.change(&self.sparsity, corrections, fraction);
            let is_noise = change.abs() <= ROUNDING * terms;
            if change <= -ARMIJO * fraction * predicted || is_noise {
                let decrease_ratio = if is_noise {
                    1.0
                } else {
                    -change / (fraction * (1.0 - 0.5 * fraction) * predicted)
                };
                if decrease_ratio > EXTEND_RATIO && fraction == 1.0 {
                    fraction = self.extend_step(change);
                }
                for (displacement, correction) in self.equation.displacements.iter_mut().zip(corrections) {
                    *displacement += *correction * fraction;
                }
                return (fraction, decrease_ratio);
            }
            // Minimum of the interpolating parabola.
            let lowest = 0.5 * fraction * predicted / (predicted + change / fraction);
            fraction = if lowest.is_finite() {
                lowest.clamp(0.1 * fraction, 0.5 * fraction)
            } else {
                0.1 * fraction
            };
        }
        (0.0, 0.0)
    }

    /// Doubles the step while the function decreases. Returns the fraction of the correction.
    fn extend_step(&self, change: f64) -> f64 {
        let (mut fraction, mut lowest) = (1.0, change);
        for _ in 0..30 {
            let [change, _] = self
                .equation
                .change(&self.sparsity, &self.cg.corrections, 2.0 * fraction);
            if !(change < lowest) {
                break;
            }
            (fraction, lowest) = (2.0 * fraction, change);
        }
        fraction
    }

    fn inertia_of_correction(&self) -> f64 {
        let corrections = self.cg.corrections.iter().zip(&self.equation.masses);
        corrections
            .map(|(correction, mass)| mass * correction.length_squared())
            .sum()
    }
}
