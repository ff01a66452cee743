//! How far a conjugate gradient's result still is from the solution.
//!
//! A residual alone does not say: where one spring in five is a thousand times stiffer it has fallen to 0.002 while nine
//! tenths of the error remain. With A the matrix, B the preconditioner and `t` the smallest eigenvalue of B A, the error e has
//! `e^T A e <= r^T B r / t`, and the gradient's own coefficients are those of a tridiagonal matrix (Lanczos 1950) whose
//! smallest eigenvalue comes down to t as soon as the error has a part there (Golub, Meurant 2010).
//!
//! That bound says far too much where what is left of the residual lies along stiff springs, which a short way relieves. The same
//! coefficients give a better one, by Gauss-Radau quadrature with a node at t (Meurant, Tichy 2013): its factor takes the place
//! of 1/t, and comes down as soon as the stiff part has been dealt with.

use crate::base::{Result, memory};
use crate::codec::saved;

/// How many iterations are kept at most, and for each node; of longer solutions the bound is that of the first so many, and too high. Without rounding
/// a solution takes three for each node.
const MOST_KEPT: usize = 1024;
const KEPT_PER_NODE: usize = 6;

/// The smallest eigenvalue is found from above: it may be less by this.
const SAFETY: f64 = 0.5;

/// The tridiagonal matrix that belongs to a conjugate gradient.
#[derive(Debug)]
pub(super) struct Spectrum {
    diagonal: Vec<f64>,
    /// Squares of what lies beside the diagonal.
    beside: Vec<f64>,
    /// Of each iteration, how long its way was in units of the search direction, and what part of that direction goes into the
    /// next.
    steps: Vec<[f64; 2]>,
    /// How many iterations are kept.
    most: usize,
    smallest: f64,
}

saved! { Spectrum { diagonal, beside, steps, most, smallest } }

impl Spectrum {
    /// With room for the solutions of so many nodes.
    pub fn new(node_count: usize) -> Result<Self> {
        let mut spectrum = Self {
            diagonal: Vec::new(),
            beside: Vec::new(),
            steps: Vec::new(),
            most: 0,
            smallest: 1.0,
        };
        spectrum.reserve(node_count)?;
        Ok(spectrum)
    }

    /// Makes room for the solutions of so many nodes in all.
    pub fn reserve(&mut self, node_count: usize) -> Result<()> {
        let most = MOST_KEPT.min(KEPT_PER_NODE * node_count);
        memory::reserve(&mut self.diagonal, most)?;
        memory::reserve(&mut self.beside, most)?;
        memory::reserve(&mut self.steps, most)?;
        self.most = most;
        Ok(())
    }

    /// Begins anew; what was known of the smallest eigenvalue stays known until there is more.
    pub fn begin(&mut self) {
        self.diagonal.clear();
        self.beside.clear();
        self.steps.clear();
    }

    /// Takes in an iteration: how long its way was in units of the search direction, and what part of that direction goes
    /// into the next.
    pub fn take(&mut self, length: f64, growth: f64) {
        if self.steps.len() >= self.most || !(length > 0.0 && growth >= 0.0) {
            return;
        }
        let mut carried = 0.0;
        if let Some([last_length, last_growth]) = self.steps.last() {
            self.beside.push(last_growth / (last_length * last_length));
            carried = last_growth / last_length;
        }
        self.diagonal.push(1.0 / length + carried);
        self.steps.push([length, growth]);
    }

    /// The smallest eigenvalue as far as it is known without looking again.
    pub fn known_smallest(&self) -> f64 {
        self.smallest
    }

    /// What the squared error is at most, as a multiple of `r^T B r`, if no eigenvalue is smaller than the one known.
    pub fn factor(&self) -> f64 {
        let smallest = SAFETY * self.smallest;
        let mut factor = 1.0 / smallest;
        for &[length, growth] in &self.steps {
            // What is left beyond the way gone is less than nothing where the eigenvalue was not the smallest.
            let beyond = (factor - length).max(0.0);
            factor = beyond / (smallest * beyond + growth);
        }
        factor
    }

    /// Takes this for it until there is more.
    pub fn assume(&mut self, smallest: f64) {
        self.smallest = smallest;
    }

    /// Looks for the smallest eigenvalue again.
    pub fn smallest(&mut self) -> f64 {
        if let Some(&first) = self.diagonal.first() {
            // Bisection by Sturm's count, within a few per cent.
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

    /// Whether an eigenvalue lies below `value`.
    fn has_below(&self, value: f64) -> bool {
        let mut pivot = self.diagonal[0] - value;
        for (diagonal, beside) in self.diagonal[1..].iter().zip(&self.beside) {
            if pivot <= 0.0 {
                return true;
            }
            pivot = diagonal - value - beside / pivot;
        }
        pivot <= 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// So many conjugate gradients on a diagonal matrix with these eigenvalues; `look` is shown the residual before each.
    fn run(
        spectrum: &mut Spectrum,
        eigenvalues: &[f64],
        right: Vec<f64>,
        iterations: usize,
        mut look: impl FnMut(usize, &Spectrum, &[f64]),
    ) {
        spectrum.begin();
        let (mut residual, mut search) = (right.clone(), right);
        for iteration in 0..iterations {
            look(iteration, spectrum, &residual);
            let product: Vec<f64> = search.iter().zip(eigenvalues).map(|(s, e)| s * e).collect();
            let square = dot(&residual, &residual);
            let length = square / dot(&search, &product);
            for (r, p) in residual.iter_mut().zip(&product) {
                *r -= length * p;
            }
            let growth = dot(&residual, &residual) / square;
            spectrum.take(length, growth);
            for (s, r) in search.iter_mut().zip(&residual) {
                *s = r + growth * *s;
            }
        }
    }

    fn dot(a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).map(|(a, b)| a * b).sum()
    }

    #[test]
    fn the_smallest_eigenvalue_is_that_of_the_matrix() {
        // All of whose eigenvalues the right-hand side has a part of.
        let eigenvalues: Vec<f64> = (0..40).map(|i| 0.01 * 1.2_f64.powi(i)).collect();
        let mut spectrum = Spectrum::new(40).expect("memory");
        run(&mut spectrum, &eigenvalues, vec![1.0; 40], 80, |_, _, _| ());
        let found = spectrum.smallest();
        assert!((found - 0.01).abs() < 0.06 * 0.01, "{found}");
    }

    #[test]
    fn the_error_is_bounded_and_not_by_far_too_much() {
        // A right-hand side that lies along the stiffest by a thousand times more than along the others.
        let eigenvalues: Vec<f64> = (0..40).map(|i| 0.01 * 1.3_f64.powi(i)).collect();
        let right: Vec<f64> = (0..40).map(|i| if i > 35 { 1000.0 } else { 1.0 }).collect();
        let mut spectrum = Spectrum::new(40).expect("memory");
        spectrum.assume(0.01);
        run(
            &mut spectrum,
            &eigenvalues,
            right,
            36,
            |iteration, spectrum, residual| {
                let error: f64 = residual.iter().zip(&eigenvalues).map(|(r, e)| r * r / e).sum();
                let bound = dot(residual, residual) * spectrum.factor();
                assert!(bound >= error, "{iteration}: {bound} is less than {error}");
                assert!(
                    iteration < 8 || bound < 30.0 * error,
                    "{iteration}: {bound} is far more than {error}"
                );
            },
        );
    }
}
