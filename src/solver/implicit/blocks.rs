//! The 3x3 blocks of the matrix on its diagonal, one for each node, and their inverses: the fine level of the preconditioner.

use std::ops::Range;

use glam::{BVec3, DMat3, Vec3};

use crate::base::{Result, StateHasher, memory};
use crate::codec::saved;
use crate::forces::Forces;
use crate::soa::{TILE, Vectors, per_node, tile_count, tile_nodes};
use crate::springs::{Springs, Tangent};
use crate::threads::{Team, Tiles};

/// A symmetric matrix as xx, yy, zz, yz, zx, xy.
pub(super) type Symmetric = [f32; 6];

/// What rounding leaves, J; of the blocks alone, for coordinates that are off by 1 m, N/m.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Noise {
    /// The squared norm of inertia of what nodes are off.
    pub error: f64,
    /// The product of the residual and what the preconditioner makes of it.
    pub square: f64,
    /// What the stored energy is off, which no inertia holds up.
    pub energy: f64,
}

saved! { Noise { error, square, energy } }

/// What of the stiffness of rings stands on the diagonal, as a part of what it were if each tetrahedron kept its volume: about a node in
/// the middle of even ones, of which some twenty have it in common.
const PART_OF_RINGS: f32 = 0.05;

/// The blocks of a body.
#[derive(Debug)]
pub(super) struct Blocks {
    /// The springs' part of each node.
    stiffness: Vec<Symmetric>,
    /// The inverses along each entry; 0 for what is pinned.
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

    /// Takes in forces at these positions.
    pub fn gather(&mut self, forces: &Forces, positions: &Vectors, tangent: Tangent, team: &Team) {
        let node_count = positions.len();
        let written = Tiles::new(&mut self.stiffness, TILE);
        team.pass(tile_count(node_count), written, |tile, blocks| {
            for (node, block) in tile_nodes(tile, node_count).zip(blocks) {
                *block = block_of(node, &*forces.springs, positions, tangent);
            }
        });
        forces.show_deformed(positions, PART_OF_RINGS, &mut |corners, gradients, deformed| {
            for (node, &gradient) in corners.into_iter().zip(gradients) {
                self.add(node, deformed.clamped_stiffness(gradient, gradient));
            }
        });
        forces.show_term_blocks(positions, &mut |nodes, blocks| {
            for (place, &node) in nodes.iter().enumerate() {
                self.add(node, blocks[place][place]);
            }
        });
        forces.show_cavity_diagonal(positions, &mut |node, block| self.add(node as u32, block));
    }

    fn add(&mut self, node: u32, matrix: DMat3) {
        let [x, y, z] = [matrix.x_axis, matrix.y_axis, matrix.z_axis];
        let entries = [x.x, y.y, z.z, z.y, x.z, y.x];
        for (entry, more) in self.stiffness[node as usize].iter_mut().zip(entries) {
            *entry += more as f32;
        }
    }

    /// Leaves a node that is held along some axes no stiffness along those: its inverse keeps the others apart from them.
    pub fn hold(&mut self, node: usize, axes: BVec3) {
        let BVec3 { x, y, z } = axes;
        let held = [x, y, z, y | z, z | x, x | y];
        for (entry, held) in self.stiffness[node].iter_mut().zip(held) {
            if held {
                *entry = 0.0;
            }
        }
    }

    /// All that it was made of.
    pub fn hash(&self, hasher: &mut StateHasher) {
        self.stiffness.iter().for_each(|block| hasher.write_floats(block));
    }

    /// Makes the inverses, with this inertia of each node, N/m; 0: it is pinned.
    pub fn invert(&mut self, inertia: &[f32], team: &Team) {
        let stiffness = &self.stiffness;
        let count = stiffness.len();
        let written = self.inverse.each_mut().map(|entry| Tiles::new(entry, TILE));
        team.pass(tile_count(count), written, |tile, mut inverse| {
            for (place, node) in tile_nodes(tile, count).enumerate() {
                let entries = inverse_of(stiffness[node], inertia[node]);
                for (to, entry) in inverse.iter_mut().zip(entries) {
                    to[place] = entry;
                }
            }
        });
    }

    /// Makes the inverse of one node's block anew, with so much more stiffness.
    pub fn invert_one(&mut self, node: usize, inertia: f32, more: Symmetric) {
        let mut block = self.stiffness[node];
        for (entry, more) in block.iter_mut().zip(more) {
            *entry += more;
        }
        for (to, entry) in self.inverse.iter_mut().zip(inverse_of(block, inertia)) {
            to[node] = entry;
        }
    }

    /// What rounding does to the residual, for each square of what coordinates are off.
    pub fn noise(&self, inertia: &[f32]) -> Noise {
        let mut noise = Noise::default();
        for (block, &inertia) in self.stiffness.iter().zip(inertia) {
            let stiffness = f64::from(block[0] + block[1] + block[2]) / 3.0;
            let inertia = f64::from(inertia);
            if inertia > 0.0 {
                // Where springs are weak against inertia they hardly move a node.
                let share = stiffness / (stiffness + inertia);
                noise.error += inertia * share * share;
                noise.square += stiffness * share;
                noise.energy += stiffness;
            }
        }
        noise
    }

    /// The entries of the inverses of some nodes.
    #[inline(always)]
    pub fn of(&self, nodes: Range<usize>) -> [&[f32]; 6] {
        self.inverse.each_ref().map(|entry| &entry[nodes.clone()])
    }
}

fn block_of(node: usize, springs: &dyn Springs, positions: &Vectors, tangent: Tangent) -> Symmetric {
    let position = positions.get(node);
    let mut block = [0.0; 6];
    springs.visit(node, &mut |link| {
        let way = positions.get(link.neighbour as usize) - position;
        let (n, matrix) = tangent.of(node, &link, way);
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

/// The inverse of a block with this inertia: in `f64`, because it may be nearly singular.
fn inverse_of(block: Symmetric, inertia: f32) -> Symmetric {
    if inertia == 0.0 {
        return [0.0; 6];
    }
    let [xx, yy, zz, yz, zx, xy] = block.map(f64::from);
    // What rounds to a singular matrix is kept from being one.
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
