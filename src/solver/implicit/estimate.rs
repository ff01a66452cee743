//! How far a conjugate gradient's result still is from the solution.
//!
//! A residual alone does not say: where one spring in five is a thousand times stiffer it has fallen to 0.002 while nine
//! tenths of the error remain. With A the matrix, B the preconditioner and `t` the smallest eigenvalue of B A, the error e has
//! `e^T A e <= r^T B r / t`, and the gradient's own coefficients are those of a tridiagonal matrix (Lanczos 1950) whose
//! smallest eigenvalue comes down to t as soon as the error has a part there (Golub, Meurant 2010).
//!
//! That bound says far too much where what is left of the residual lies along stiff springs, which a short way relieves. So
//! the ways of the iterations are looked at too: how much shorter those of the last quarter were than those of the one before
//! tells how far all that would follow may lead.

/// How many coefficients are kept: the smallest eigenvalue is found long before.
const KEPT: usize = 256;

/// The tridiagonal matrix that belongs to a conjugate gradient.
#[derive(Debug)]
pub(super) struct Spectrum {
    diagonal: Vec<f64>,
    /// Squares of what lies beside the diagonal.
    beside: Vec<f64>,
    last_length: f64,
    last_growth: f64,
    smallest: f64,
}

impl Spectrum {
    /// With room for all it takes.
    pub fn new() -> crate::error::Result<Self> {
        Ok(Self {
            diagonal: crate::memory::reserved(KEPT)?,
            beside: crate::memory::reserved(KEPT)?,
            last_length: 0.0,
            last_growth: 0.0,
            smallest: 1.0,
        })
    }

    /// Begins anew; what was known of the smallest eigenvalue stays known until there is more.
    pub fn begin(&mut self) {
        self.diagonal.clear();
        self.beside.clear();
        self.last_growth = 0.0;
    }

    /// Takes in an iteration: how long its way was in units of the search direction, and what part of that direction goes
    /// into the next.
    pub fn take(&mut self, length: f64, growth: f64) {
        if self.diagonal.len() < KEPT && length > 0.0 && growth >= 0.0 {
            if !self.diagonal.is_empty() {
                self.beside
                    .push(self.last_growth / (self.last_length * self.last_length));
            }
            let carried = if self.diagonal.is_empty() {
                0.0
            } else {
                self.last_growth / self.last_length
            };
            self.diagonal.push(1.0 / length + carried);
            self.last_length = length;
            self.last_growth = growth;
        }
    }

    /// The smallest eigenvalue as far as it is known without looking again.
    pub fn known_smallest(&self) -> f64 {
        self.smallest
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

/// How far the iterations of a conjugate gradient have led.
#[derive(Debug)]
pub(super) struct Ways {
    /// The sums of their lengths up to each iteration.
    sums: Vec<f64>,
}

impl Ways {
    /// With room for so many iterations.
    pub fn new(iterations: u32) -> crate::error::Result<Self> {
        Ok(Self {
            sums: crate::memory::reserved(iterations as usize)?,
        })
    }

    pub fn begin(&mut self) {
        self.sums.clear();
    }

    /// Takes in the way of one iteration.
    pub fn take(&mut self, length: f64) {
        if self.sums.len() < self.sums.capacity() {
            let last = self.sums.last().copied().unwrap_or(0.0);
            self.sums.push(last + length);
        }
    }

    /// How far all iterations to come may lead, if they go on as they did; infinite where there are too few to say.
    pub fn remaining(&self) -> f64 {
        /// The fewest iterations that say anything.
        const FEWEST: usize = 3;
        let count = self.sums.len();
        let window = FEWEST.max(count / 4);
        if count <= 2 * window {
            return f64::INFINITY;
        }
        let end = |windows: usize| self.sums[count - 1 - windows * window];
        let (last, before) = (end(0) - end(1), end(1) - end(2));
        // What does not shrink may go on for as long as it has.
        let ratio = (last / before).min(0.9);
        if ratio.is_finite() {
            last * ratio / (1.0 - ratio)
        } else {
            0.0
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_geometric_series_is_summed() {
        let mut ways = Ways::new(100).expect("memory");
        let lengths: Vec<f64> = (0..60).map(|i| 0.9_f64.powi(i)).collect();
        for count in 0..30 {
            ways.take(lengths[count]);
            let left: f64 = lengths[count + 1..].iter().sum::<f64>() + 0.9_f64.powi(60) / 0.1;
            let found = ways.remaining();
            assert!(
                count < 6 || (found / left - 1.0).abs() < 1e-9,
                "{count}: {found} of {left}"
            );
        }
    }

    #[test]
    fn the_smallest_eigenvalue_is_that_of_the_matrix() {
        // Conjugate gradients on a diagonal matrix, all of whose eigenvalues the right-hand side has a part of.
        let eigenvalues: Vec<f64> = (0..40).map(|i| 0.01 * 1.3_f64.powi(i)).collect();
        let mut spectrum = Spectrum::new().expect("memory");
        spectrum.begin();
        let mut residual = vec![1.0; eigenvalues.len()];
        let mut search = residual.clone();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        for _ in 0..60 {
            let product: Vec<f64> = search.iter().zip(&eigenvalues).map(|(s, e)| s * e).collect();
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
        let found = spectrum.smallest();
        assert!((found - 0.01).abs() < 0.06 * 0.01, "{found}");
    }
}
