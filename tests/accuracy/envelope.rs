//! A symmetric matrix stored from the first entry of each row to its diagonal, and its Cholesky factor, which fits in
//! the same storage.

/// Rows of the lower triangle.
#[derive(Clone)]
pub struct Envelope {
    firsts: Vec<usize>,
    rows: Vec<Vec<f64>>,
}

impl Envelope {
    /// Creates rows that begin at these columns.
    pub fn new(firsts: Vec<usize>) -> Self {
        let rows = firsts.iter().enumerate();
        Self {
            rows: rows.map(|(row, first)| vec![0.0; row - first + 1]).collect(),
            firsts,
        }
    }

    /// Adds to an entry of the lower triangle; entries above it are ignored.
    pub fn add(&mut self, row: usize, column: usize, value: f64) {
        if column <= row {
            self.rows[row][column - self.firsts[row]] += value;
        }
    }

    /// Fixes an unknown at 0, whatever its row contains.
    pub fn hold(&mut self, unknown: usize) {
        self.rows[unknown].fill(0.0);
        for row in unknown..self.rows.len() {
            if self.firsts[row] <= unknown {
                self.rows[row][unknown - self.firsts[row]] = 0.0;
            }
        }
        *self.rows[unknown].last_mut().expect("a diagonal") = 1.0;
    }

    /// Returns the matrix with diagonals enlarged by this fraction.
    pub fn lifted(&self, part: f64) -> Self {
        let mut lifted = self.clone();
        for row in &mut lifted.rows {
            *row.last_mut().expect("a diagonal") *= 1.0 + part;
        }
        lifted
    }

    /// Returns its factor, or `None` if it is not positive definite.
    pub fn factor(mut self) -> Option<Factor> {
        for i in 0..self.rows.len() {
            let (before, rest) = self.rows.split_at_mut(i);
            let row = &mut rest[0];
            let first = self.firsts[i];
            for j in first..i {
                let from = first.max(self.firsts[j]);
                let other = &before[j];
                let sum = dot(
                    &row[from - first..j - first],
                    &other[from - self.firsts[j]..j - self.firsts[j]],
                );
                row[j - first] = (row[j - first] - sum) / other[j - self.firsts[j]];
            }
            let square = row[i - first] - dot(&row[..i - first], &row[..i - first]);
            if !(square > 0.0) {
                return None;
            }
            row[i - first] = square.sqrt();
        }
        Some(Factor(self))
    }
}

/// The lower triangle whose product with its transpose is the matrix.
pub struct Factor(Envelope);

impl Factor {
    /// Solves in place.
    pub fn solve(&self, vector: &mut [f64]) {
        let Envelope { rows, firsts } = &self.0;
        for (i, row) in rows.iter().enumerate() {
            let (first, last) = (firsts[i], row.len() - 1);
            vector[i] = (vector[i] - dot(&row[..last], &vector[first..i])) / row[last];
        }
        for (i, row) in rows.iter().enumerate().rev() {
            let (first, last) = (firsts[i], row.len() - 1);
            vector[i] /= row[last];
            let value = vector[i];
            for (entry, factor) in vector[first..i].iter_mut().zip(row) {
                *entry -= value * factor;
            }
        }
    }
}

/// Sums up in eight lanes, which the processor adds in parallel.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (chunks_a, chunks_b) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = chunks_a
        .remainder()
        .iter()
        .zip(chunks_b.remainder())
        .map(|(a, b)| a * b)
        .sum();
    for (a, b) in chunks_a.zip(chunks_b) {
        for lane in 0..8 {
            sums[lane] += a[lane] * b[lane];
        }
    }
    sums.iter().sum::<f64>() + rest
}
