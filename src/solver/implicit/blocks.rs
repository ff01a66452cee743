//! Block-Jacobi level of the preconditioner: the 3x3 diagonal block of each node, and its inverse.

use std::ops::Range;

use glam::{BVec3, DMat3, Vec3};

use crate::base::{Result, StateHasher, memory};
use crate::codec::saved;
use crate::forces::Forces;
use crate::soa::{TILE, Vectors, per_node, tile_count, tile_nodes};
use crate::springs::{Springs, Tangent};
use crate::threads::{Team, Tiles};

/// Entries of a symmetric matrix: xx, yy, zz, yz, zx, xy.
pub(super) type Symmetric = [f32; 6];

/// Energies due to rounding of coordinates, J. The fields of the blocks are per square of the coordinate error, N/m.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct RoundoffBound {
    /// Squared inertia norm of the solution error.
    pub error: f64,
    /// Product of the residual and the preconditioned residual.
    pub residual_sq: f64,
    /// Error of the stored energy, without the effect of inertia.
    pub energy: f64,
}

saved! { RoundoffBound { error, residual_sq, energy } }

/// Share of the ring stiffness on the diagonal, relative to tetrahedra that keep their volumes individually. It holds
/// for an inner node of a regular mesh, which has about twenty tetrahedra.
const RING_STIFFNESS_SHARE: f32 = 0.05;

/// Diagonal blocks of a body.
#[derive(Debug)]
pub(super) struct Blocks {
    /// Stiffness block of each node.
    stiffness: Vec<Symmetric>,
    /// Inverse blocks, one array per entry; 0 for pinned nodes.
    inverse: [Vec<f32>; 6],
}

saved! { Blocks { stiffness, inverse } }

per_node! { Blocks { stiffness, inverse } }

impl Blocks {
    pub fn new(node_count: usize) -> Result<Self> {
        let entry = || memory::filled(0.0, node_count);
        Ok(Self {
            stiffness: memory::filled([0.0; 6], node_count)?,
            inverse: [entry()?, entry()?, entry()?, entry()?, entry()?, entry()?],
        })
    }

    /// Assembles the stiffness at these positions.
    pub fn assemble(&mut self, forces: &Forces, positions: &Vectors, tangent: Tangent, team: &Team) {
        let node_count = positions.len();
        let written = Tiles::new(&mut self.stiffness, TILE);
        team.pass(tile_count(node_count), written, |tile, blocks| {
            for (node, block) in tile_nodes(tile, node_count).zip(blocks) {
                *block = block_of(node, &*forces.springs, positions, tangent);
            }
        });
        forces.visit_deformed(positions, RING_STIFFNESS_SHARE, &mut |corners, gradients, deformed| {
            for (node, &gradient) in corners.into_iter().zip(gradients) {
                self.add(node, deformed.clamped_stiffness(gradient, gradient));
            }
        });
        forces.visit_term_blocks(positions, &mut |nodes, blocks| {
            for (index, &node) in nodes.iter().enumerate() {
                self.add(node, blocks[index][index]);
            }
        });
        forces.visit_cavity_diagonal(positions, &mut |node, block| self.add(node as u32, block));
    }

    fn add(&mut self, node: u32, matrix: DMat3) {
        let [x, y, z] = [matrix.x_axis, matrix.y_axis, matrix.z_axis];
        let entries = [x.x, y.y, z.z, z.y, x.z, y.x];
        for (entry, added) in self.stiffness[node as usize].iter_mut().zip(entries) {
            *entry += added as f32;
        }
    }

    /// Removes the stiffness along the held axes of a partially held node, so that its inverse does not couple them
    /// with the others.
    pub fn decouple_axes(&mut self, node: usize, axes: BVec3) {
        let BVec3 { x, y, z } = axes;
        let held = [x, y, z, y | z, z | x, x | y];
        for (entry, held) in self.stiffness[node].iter_mut().zip(held) {
            if held {
                *entry = 0.0;
            }
        }
    }

    /// Hashes the data that the inverses are computed from.
    pub fn hash(&self, hasher: &mut StateHasher) {
        self.stiffness.iter().for_each(|block| hasher.write_floats(block));
    }

    /// Computes the inverses with this inertia of each node, N/m. An inertia of 0 marks a pinned node.
    pub fn invert(&mut self, inertia: &[f32], team: &Team) {
        let stiffness = &self.stiffness;
        let count = stiffness.len();
        let written = self.inverse.each_mut().map(|entry| Tiles::new(entry, TILE));
        team.pass(tile_count(count), written, |tile, mut inverse| {
            for (index, node) in tile_nodes(tile, count).enumerate() {
                let entries = inverse_of(stiffness[node], inertia[node]);
                for (to, entry) in inverse.iter_mut().zip(entries) {
                    to[index] = entry;
                }
            }
        });
    }

    /// Recomputes the inverse of one node's block with added stiffness.
    pub fn invert_one(&mut self, node: usize, inertia: f32, added: Symmetric) {
        let mut block = self.stiffness[node];
        for (entry, added) in block.iter_mut().zip(added) {
            *entry += added;
        }
        for (to, entry) in self.inverse.iter_mut().zip(inverse_of(block, inertia)) {
            to[node] = entry;
        }
    }

    /// Returns the effect of rounding on the residual, per square of the coordinate error.
    pub fn roundoff(&self, inertia: &[f32]) -> RoundoffBound {
        let mut roundoff = RoundoffBound::default();
        for (block, &inertia) in self.stiffness.iter().zip(inertia) {
            let stiffness = f64::from(block[0] + block[1] + block[2]) / 3.0;
            let inertia = f64::from(inertia);
            if inertia > 0.0 {
                // Springs that are weak compared to inertia hardly move a node.
                let share = stiffness / (stiffness + inertia);
                roundoff.error += inertia * share * share;
                roundoff.residual_sq += stiffness * share;
                roundoff.energy += stiffness;
            }
        }
        roundoff
    }

    /// Entries of the inverses of these nodes.
    #[inline(always)]
    pub fn inverse_slices(&self, nodes: Range<usize>) -> [&[f32]; 6] {
        self.inverse.each_ref().map(|entry| &entry[nodes.clone()])
    }
}

fn block_of(node: usize, springs: &dyn Springs, positions: &Vectors, tangent: Tangent) -> Symmetric {
    let position = positions.get(node);
    let mut block = [0.0; 6];
    springs.visit(node, &mut |link| {
        let edge = positions.get(link.neighbor as usize) - position;
        let (n, matrix) = tangent.direction_and_matrix(node, &link, edge);
        let scaled: Vec3 = n * matrix.x;
        block[0] += scaled.x * n.x + matrix.y;
        block[1] += scaled.y * n.y + matrix.y;
        block[2] += scaled.z * n.z + matrix.y;
        block[3] += scaled.y * n.z;
        block[4] += scaled.z * n.x;
        block[5] += scaled.x * n.y;
    });
    block
}

/// Returns the inverse of a block with this inertia. It is computed in `f64` because the block may be nearly singular.
fn inverse_of(block: Symmetric, inertia: f32) -> Symmetric {
    if inertia == 0.0 {
        return [0.0; 6];
    }
    let [xx, yy, zz, yz, zx, xy] = block.map(f64::from);
    // Regularizes matrices that are singular due to rounding.
    let inertia = f64::from(inertia) + 1e-7 * (xx + yy + zz);
    let [xx, yy, zz] = [xx, yy, zz].map(|entry| entry + inertia);
    let minors = [
        yy * zz - yz * yz,
        xx * zz - zx * zx,
        xx * yy - xy * xy,
        zx * xy - xx * yz,
        xy * yz - yy * zx,
        yz * zx - zz * xy,
    ];
    let determinant = xx * minors[0] + xy * minors[5] + zx * minors[4];
    let inverse = minors.map(|minor| (minor / determinant) as f32);
    if inverse.iter().all(|entry| entry.is_finite()) {
        inverse
    } else {
        [0.0; 6]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_times_its_inverse_is_one() {
        let (block, inertia) = ([3.0, 2.0, 5.0, 0.5, -0.25, 1.0], 0.125);
        let [a, b, c, d, e, f] = inverse_of(block, inertia);
        let [xx, yy, zz, yz, zx, xy] = block;
        let matrix = glam::Mat3::from_cols_array(&[xx + inertia, xy, zx, xy, yy + inertia, yz, zx, yz, zz + inertia]);
        let product = matrix * glam::Mat3::from_cols_array(&[a, f, e, f, b, d, e, d, c]);
        assert!(product.abs_diff_eq(glam::Mat3::IDENTITY, 1e-6), "{product}");
    }
}
