//! A symmetric matrix with a block of 3x3 for each node and each spring.

use glam::{DMat3, DVec3};

use super::network::Network;
use crate::base::{Result, memory};
use crate::codec::saved;

/// The blocks on the diagonal, and those below it.
#[derive(Debug)]
pub(super) struct Matrix {
    pub diagonal: Vec<DMat3>,
    pub beside: Vec<DMat3>,
}

saved! { Matrix { diagonal, beside } }

impl Matrix {
    pub fn new(node_count: usize, spring_count: usize) -> Result<Self> {
        Ok(Self {
            diagonal: memory::filled(DMat3::ZERO, node_count)?,
            beside: memory::reserved(spring_count)?,
        })
    }

    /// Makes room for so many springs in all.
    pub fn make_room(&mut self, spring_count: usize) -> Result<()> {
        let more = spring_count.saturating_sub(self.beside.len());
        Ok(self.beside.try_reserve(more)?)
    }

    /// The product with `vectors`.
    pub fn multiply(&self, network: &Network, vectors: &[DVec3], products: &mut [DVec3]) {
        for (node, block) in self.diagonal.iter().enumerate() {
            let mut sum = *block * vectors[node];
            for place in network.row(node) {
                let (neighbour, beside) = (network.neighbour(place), &self.beside[place]);
                sum += *beside * vectors[neighbour];
                products[neighbour] += transposed_product(beside, vectors[node]);
            }
            // What comes from nodes of higher numbers is added to it later.
            products[node] = sum;
        }
    }
}

/// The transposed of a block times a vector.
#[inline(always)]
pub(super) fn transposed_product(block: &DMat3, vector: DVec3) -> DVec3 {
    DVec3::new(
        block.x_axis.dot(vector),
        block.y_axis.dot(vector),
        block.z_axis.dot(vector),
    )
}
