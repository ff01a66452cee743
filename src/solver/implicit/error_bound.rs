//! Error bounds of the conjugate gradient.
//!
//! The residual alone is no measure of the error. If every fifth spring is a thousand times stiffer, the residual has
//! fallen to 0.002 while nine tenths of the error remain. Let A be the matrix, B the preconditioner and `t` the
//! smallest eigenvalue of B A. The error e satisfies `e^T A e <= r^T B r / t`. The coefficients of the iteration form a
//! tridiagonal matrix (Lanczos 1950). Its smallest eigenvalue converges to t from above once the error has a component
//! there (Golub, Meurant 2010).
//!
//! This bound is far too large if the residual lies along stiff springs, which a small displacement relieves. The same
//! coefficients yield a better bound by Gauss-Radau quadrature with a node at t (Meurant, Tichy 2013). Its factor
//! replaces 1/t and decreases as soon as the stiff components have converged.

use crate::base::{Result, memory};
use crate::codec::saved;

/// Maximum number of stored iterations, in all and per node. The bound of a longer solve uses the first ones and is too
/// large. Without rounding, a solve takes three iterations per node.
const MAX_ITERATIONS: usize = 1024;
const ITERATIONS_PER_NODE: usize = 6;

/// The smallest eigenvalue is approximated from above. The true one may be smaller by this factor.
const SAFETY: f64 = 0.5;

/// Tridiagonal Lanczos matrix of a conjugate gradient.
#[derive(Debug)]
pub(super) struct RitzBounds {
    diagonal: Vec<f64>,
    /// Squares of the off-diagonal entries.
    off_diagonal_sq: Vec<f64>,
    /// alpha (step length) and beta (direction update) of each iteration.
    steps: Vec<[f64; 2]>,
    /// Capacity for iterations.
    max_iterations: usize,
    smallest: f64,
}

saved! { RitzBounds { diagonal, off_diagonal_sq, steps, max_iterations, smallest } }

impl RitzBounds {
    /// Creates bounds for solves with this number of nodes.
    pub fn new(node_count: usize) -> Result<Self> {
        let mut ritz = Self {
            diagonal: Vec::new(),
            off_diagonal_sq: Vec::new(),
            steps: Vec::new(),
            max_iterations: 0,
            smallest: 1.0,
        };
        ritz.reserve(node_count)?;
        Ok(ritz)
    }

    /// Reserves capacity for solves with this number of nodes.
    pub fn reserve(&mut self, node_count: usize) -> Result<()> {
        let max_iterations = MAX_ITERATIONS.min(ITERATIONS_PER_NODE * node_count);
        memory::reserve(&mut self.diagonal, max_iterations)?;
        memory::reserve(&mut self.off_diagonal_sq, max_iterations)?;
        memory::reserve(&mut self.steps, max_iterations)?;
        self.max_iterations = max_iterations;
        Ok(())
    }

    /// Starts a solve. The last smallest eigenvalue is kept until there is a new one.
    pub fn begin(&mut self) {
        self.diagonal.clear();
        self.off_diagonal_sq.clear();
        self.steps.clear();
    }

    /// Adds an iteration with step length `alpha` and direction update `beta`.
    pub fn add_iteration(&mut self, alpha: f64, beta: f64) {
        if self.steps.len() >= self.max_iterations || !(alpha > 0.0 && beta >= 0.0) {
            return;
        }
        let mut carried = 0.0;
        if let Some([last_alpha, last_beta]) = self.steps.last() {
            self.off_diagonal_sq.push(last_beta / (last_alpha * last_alpha));
            carried = last_beta / last_alpha;
        }
        self.diagonal.push(1.0 / alpha + carried);
        self.steps.push([alpha, beta]);
    }

    /// Last computed smallest eigenvalue.
    pub fn last_smallest(&self) -> f64 {
        self.smallest
    }

    /// Upper bound of the squared error as a multiple of `r^T B r`, if no eigenvalue is smaller than the known one.
    pub fn factor(&self) -> f64 {
        let smallest = SAFETY * self.smallest;
        let mut factor = 1.0 / smallest;
        for &[alpha, beta] in &self.steps {
            // The rest is negative if the known eigenvalue is not the smallest.
            let beyond = (factor - alpha).max(0.0);
            factor = beyond / (smallest * beyond + beta);
        }
        factor
    }

    /// Sets the smallest eigenvalue until a new one is computed.
    pub fn assume(&mut self, smallest: f64) {
        self.smallest = smallest;
    }

    /// Recomputes the smallest eigenvalue.
    pub fn smallest(&mut self) -> f64 {
        if let Some(&first) = self.diagonal.first() {
            // Bisection with Sturm's count, to a few percent.
            let (mut low, mut high) = (0.0, first);
            for &diagonal in &self.diagonal {
                high = f64::min(high, diagonal);
            }
            while high > 0.0 && high - low > 0.05 * high {
                let middle = 0.5 * (low + high);
                if self.has_below(middle) {
                    high = middle
                } else {
                    low = middle
                }
                if high < f64::MIN_POSITIVE {
                    break;
                }
            }
            self.smallest = high.max(f64::MIN_POSITIVE);
        }
        self.smallest
    }

    /// True if an eigenvalue is below `value`.
    fn has_below(&self, value: f64) -> bool {
        let mut pivot = self.diagonal[0] - value;
        for (diagonal, off_diagonal_sq) in self.diagonal[1..].iter().zip(&self.off_diagonal_sq) {
            if pivot <= 0.0 {
                return true;
            }
            pivot = diagonal - value - off_diagonal_sq / pivot;
        }
        pivot <= 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs conjugate gradients on a diagonal matrix with these eigenvalues; `visit` receives the residual before each
    /// iteration.
    fn run(
        ritz: &mut RitzBounds,
        eigenvalues: &[f64],
        right: Vec<f64>,
        iterations: usize,
        mut visit: impl FnMut(usize, &RitzBounds, &[f64]),
    ) {
        ritz.begin();
        let (mut residual, mut search) = (right.clone(), right);
        for iteration in 0..iterations {
            visit(iteration, ritz, &residual);
            let product: Vec<f64> = search.iter().zip(eigenvalues).map(|(s, e)| s * e).collect();
            let square = dot(&residual, &residual);
            let alpha = square / dot(&search, &product);
            for (r, p) in residual.iter_mut().zip(&product) {
                *r -= alpha * p;
            }
            let beta = dot(&residual, &residual) / square;
            ritz.add_iteration(alpha, beta);
            for (s, r) in search.iter_mut().zip(&residual) {
                *s = r + beta * *s;
            }
        }
    }

    fn dot(a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).map(|(a, b)| a * b).sum()
    }

    #[test]
    fn the_smallest_ritz_value_converges() {
        // The right-hand side has a component along every eigenvector.
        let eigenvalues: Vec<f64> = (0..40).map(|i| 0.01 * 1.2_f64.powi(i)).collect();
        let mut ritz = RitzBounds::new(40).expect("memory");
        run(&mut ritz, &eigenvalues, vec![1.0; 40], 80, |_, _, _| ());
        let found = ritz.smallest();
        assert!((found - 0.01).abs() < 0.06 * 0.01, "{found}");
    }

    #[test]
    fn the_error_bound_holds_and_is_tight() {
        // The components along the stiffest eigenvectors are a thousand times larger than the others.
        let eigenvalues: Vec<f64> = (0..40).map(|i| 0.01 * 1.3_f64.powi(i)).collect();
        let right: Vec<f64> = (0..40).map(|i| if i > 35 { 1000.0 } else { 1.0 }).collect();
        let mut ritz = RitzBounds::new(40).expect("memory");
        ritz.assume(0.01);
        run(&mut ritz, &eigenvalues, right, 36, |iteration, ritz, residual| {
            let error: f64 = residual.iter().zip(&eigenvalues).map(|(r, e)| r * r / e).sum();
            let bound = dot(residual, residual) * ritz.factor();
            assert!(bound >= error, "{iteration}: {bound} is less than {error}");
            assert!(
                iteration < 8 || bound < 30.0 * error,
                "{iteration}: {bound} is far more than {error}"
            );
        });
    }
}
