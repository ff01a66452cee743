//! Incomplete Cholesky preconditioner `(D + U) D^-1 (D + U)^T` with the sparsity of the matrix (Meijerink, van der
//! Vorst 1977), in 3x3 blocks.

use glam::{DMat3, DVec3};

use super::matrix::{Matrix, transposed_product};
use super::sparsity::Sparsity;

/// Smallest accepted pivot, relative to the trace of its block.
const MIN_PIVOT: f64 = 1e-11;

/// Replaces a positive definite matrix by its factor: the inverse of D on the diagonal, U off the diagonal.
pub(super) fn factorize(matrix: &mut Matrix, sparsity: &Sparsity) {
    let Matrix { diagonal, off_diagonal } = matrix;
    for node in 0..sparsity.node_count() {
        let original = diagonal[node];
        let mut pivot = original;
        let row = sparsity.row(node);
        for index in row.clone() {
            let neighbor = sparsity.neighbor(index);
            let mut block = off_diagonal[index];
            // Common columns of both rows.
            let (mut column, mut other_column) = (row.start, sparsity.row(neighbor));
            while column < index && other_column.start < other_column.end {
                let (a, b) = (sparsity.neighbor(column), sparsity.neighbor(other_column.start));
                if a == b {
                    block -= off_diagonal[column] * diagonal[a] * off_diagonal[other_column.start].transpose();
                }
                column += usize::from(a <= b);
                other_column.start += usize::from(b <= a);
            }
            off_diagonal[index] = block;
            pivot -= block * diagonal[neighbor] * block.transpose();
        }
        // If fill-in that was dropped makes the pivot indefinite, use the unmodified block.
        diagonal[node] = inverse(pivot).or_else(|| inverse(original)).unwrap_or(DMat3::IDENTITY);

        fn inverse(block: DMat3) -> Option<DMat3> {
            let columns = block.to_cols_array_2d();
            let least = MIN_PIVOT * (columns[0][0] + columns[1][1] + columns[2][2]);
            // The pivots of a Cholesky factorization show if the block is positive definite.
            let first = columns[0][0];
            let (ratio_y, ratio_z) = (columns[0][1] / first, columns[0][2] / first);
            let second = columns[1][1] - ratio_y * columns[0][1];
            let off_diagonal = columns[1][2] - ratio_y * columns[0][2];
            let third = columns[2][2] - ratio_z * columns[0][2] - off_diagonal * (off_diagonal / second);
            (first > least && second > least && third > least).then(|| symmetric(block.inverse()))
        }
    }
}

fn symmetric(block: DMat3) -> DMat3 {
    (block + block.transpose()) * 0.5
}

/// Solves with the factor. `sums` is scratch space.
pub(super) fn solve(factor: &Matrix, sparsity: &Sparsity, rhs: &[DVec3], solution: &mut [DVec3], sums: &mut [DVec3]) {
    for node in 0..sparsity.node_count() {
        let mut sum = rhs[node];
        for index in sparsity.row(node) {
            sum -= factor.off_diagonal[index] * solution[sparsity.neighbor(index)];
        }
        solution[node] = factor.diagonal[node] * sum;
    }
    // The rows of (D + U)^T are columns: each value is added to the sums of its neighbors, which have lower numbers.
    sums.fill(DVec3::ZERO);
    for node in (0..sparsity.node_count()).rev() {
        let value = solution[node] - factor.diagonal[node] * sums[node];
        solution[node] = value;
        for index in sparsity.row(node) {
            sums[sparsity.neighbor(index)] += transposed_product(&factor.off_diagonal[index], value);
        }
    }
}
