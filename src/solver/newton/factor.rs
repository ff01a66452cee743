//! The preconditioner: an incomplete factor `(D + U) D^-1 (D + U)^T` of a matrix, with the matrix's own pattern
//! (Meijerink, van der Vorst 1977), in blocks of 3x3.

use glam::{DMat3, DVec3};

use super::matrix::{Matrix, transposed_product};
use super::network::Network;

/// A pivot that has lost more than this of its block's size is not to be trusted.
const LOST: f64 = 1e-11;

/// Turns a positive definite matrix into its factor: the inverse of D on the diagonal, U beside it.
pub(super) fn factorise(matrix: &mut Matrix, network: &Network) {
    let Matrix { diagonal, beside } = matrix;
    for node in 0..network.node_count() {
        let whole = diagonal[node];
        let mut pivot = whole;
        let row = network.row(node);
        for place in row.clone() {
            let neighbour = network.neighbour(place);
            let mut block = beside[place];
            // What both rows share to the left.
            let (mut own, mut others) = (row.start, network.row(neighbour));
            while own < place && others.start < others.end {
                let (a, b) = (network.neighbour(own), network.neighbour(others.start));
                if a == b {
                    block -= beside[own] * diagonal[a] * beside[others.start].transpose();
                }
                own += usize::from(a <= b);
                others.start += usize::from(b <= a);
            }
            beside[place] = block;
            pivot -= block * diagonal[neighbour] * block.transpose();
        }
        // Where what was left out would make it indefinite, nothing is taken off.
        diagonal[node] = inverse(pivot).or_else(|| inverse(whole)).unwrap_or(DMat3::IDENTITY);

        fn inverse(block: DMat3) -> Option<DMat3> {
            let columns = block.to_cols_array_2d();
            let least = LOST * (columns[0][0] + columns[1][1] + columns[2][2]);
            // By Cholesky's factor, whose pivots tell whether the block is positive definite.
            let first = columns[0][0];
            let (ratio_y, ratio_z) = (columns[0][1] / first, columns[0][2] / first);
            let second = columns[1][1] - ratio_y * columns[0][1];
            let beside = columns[1][2] - ratio_y * columns[0][2];
            let third = columns[2][2] - ratio_z * columns[0][2] - beside * (beside / second);
            (first > least && second > least && third > least).then(|| symmetric(block.inverse()))
        }
    }
}

fn symmetric(block: DMat3) -> DMat3 {
    (block + block.transpose()) * 0.5
}

/// Solves the factor's equation; `sums` are for the work.
pub(super) fn solve(factor: &Matrix, network: &Network, right: &[DVec3], solution: &mut [DVec3], sums: &mut [DVec3]) {
    for node in 0..network.node_count() {
        let mut sum = right[node];
        for place in network.row(node) {
            sum -= factor.beside[place] * solution[network.neighbour(place)];
        }
        solution[node] = factor.diagonal[node] * sum;
    }
    // The rows of (D + U)^T are columns: what is found at a node is added to its neighbours' sums, all of which have lower
    // numbers.
    sums.fill(DVec3::ZERO);
    for node in (0..network.node_count()).rev() {
        let found = solution[node] - factor.diagonal[node] * sums[node];
        solution[node] = found;
        for place in network.row(node) {
            sums[network.neighbour(place)] += transposed_product(&factor.beside[place], found);
        }
    }
}
