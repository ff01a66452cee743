//! Symmetric matrix with a 3x3 block per node and per pair of nodes.

use glam::{DMat3, DVec3};

use super::sparsity::Sparsity;
use crate::base::{Result, memory};
use crate::codec::saved;

/// Blocks on the diagonal and below it.
#[derive(Debug)]
pub(super) struct Matrix {
    pub diagonal: Vec<DMat3>,
    pub off_diagonal: Vec<DMat3>,
}

saved! { Matrix { diagonal, off_diagonal } }

impl Matrix {
    pub fn new(node_count: usize, spring_count: usize) -> Result<Self> {
        Ok(Self {
            diagonal: memory::filled(DMat3::ZERO, node_count)?,
            off_diagonal: memory::reserved(spring_count)?,
        })
    }

    /// Reserves capacity for this number of pairs.
    pub fn reserve(&mut self, spring_count: usize) -> Result<()> {
        let more = spring_count.saturating_sub(self.off_diagonal.len());
        Ok(self.off_diagonal.try_reserve(more)?)
    }

    /// Multiplies `vectors` by the matrix.
    pub fn multiply(&self, sparsity: &Sparsity, vectors: &[DVec3], products: &mut [DVec3]) {
        for (node, block) in self.diagonal.iter().enumerate() {
            let mut sum = *block * vectors[node];
            for index in sparsity.row(node) {
                let (neighbor, off_diagonal) = (sparsity.neighbor(index), &self.off_diagonal[index]);
                sum += *off_diagonal * vectors[neighbor];
                products[neighbor] += transposed_product(off_diagonal, vectors[node]);
            }
            // Rows of higher numbers add to this entry later.
            products[node] = sum;
        }
    }
}

/// Product of the transposed block and a vector.
#[inline(always)]
pub(super) fn transposed_product(block: &DMat3, vector: DVec3) -> DVec3 {
    DVec3::new(
        block.x_axis.dot(vector),
        block.y_axis.dot(vector),
        block.z_axis.dot(vector),
    )
}
