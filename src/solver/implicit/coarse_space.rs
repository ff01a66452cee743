//! Coarse space of the preconditioner: up to 16 clusters of nodes, each with its affine motions.
//!
//! The conjugate gradient converges slowly for modes that span the body. The coarse space solves for them directly with
//! a small dense matrix (aggregation, as in Vanek, Mandel, Brezina 1996, without smoothing). The inverse may belong to
//! an older state of the body; it then preconditions less well, but remains valid.

use std::array::from_fn;

use glam::{BVec3, DMat3, DVec3, Mat3, Vec3};

use super::conjugate_gradient::add_lanes;
use crate::base::{Result, StateHasher, memory};
use crate::codec::saved;
use crate::forces::Forces;
use crate::nodes::Pins;
use crate::simd::{ChosenKernel, Loops};
use crate::soa::{PerNode, TILE, Vectors};
use crate::solver::masked_axes::mask_axes;
use crate::springs::Tangent;

/// Nodes per block; the nodes of a block belong to one cluster and are processed together.
const BLOCK: usize = 16;

/// Maximum number of clusters, and minimum number of nodes per cluster.
const MAX_CLUSTERS: usize = 16;
const MIN_CLUSTER_NODES: usize = 64;

/// Basis functions of a cluster: 1 and three coordinates.
const FUNCTIONS: usize = 4;

/// Degrees of freedom of a cluster: each function along each axis.
pub(super) const CLUSTER_DOFS: usize = 3 * FUNCTIONS;

/// The coarse space of a body.
#[derive(Debug)]
pub(super) struct CoarseSpace {
    /// Cluster of each block.
    clusters: Vec<u16>,
    count: usize,
    /// Position of each node relative to its cluster's center, in units of the cluster's size.
    offsets: Vectors,
    /// 1 for a free node, 0 otherwise.
    free: Vec<f32>,
    /// Stiffness part of the coarse matrix.
    stiffness: Vec<f64>,
    /// Inverse of the coarse matrix, in `f64`. It is nearly singular if the functions are almost dependent on the nodes
    /// of a cluster or if motions have almost no stiffness. Then products with the inverse rounded to `f32` could be
    /// negative.
    inverse: Vec<f64>,
    /// Restricted residual, and the coarse solution.
    pub loads: Vec<f64>,
    motions: Vec<f32>,
    scratch: Vec<f64>,
}

saved! { CoarseSpace { clusters, count, offsets, free, stiffness, inverse, loads, motions, scratch } }

impl PerNode for CoarseSpace {
    fn reserve_nodes(&mut self, node_count: usize) -> Result<()> {
        memory::reserve(&mut self.clusters, node_count.div_ceil(BLOCK))?;
        self.offsets.reserve_nodes(node_count)?;
        memory::reserve(&mut self.free, node_count)
    }

    fn grow(&mut self, node_count: usize) {
        let last = self.clusters.last().copied().unwrap_or(0);
        self.clusters.resize(node_count.div_ceil(BLOCK), last);
        self.offsets.grow(node_count);
        self.free.resize(node_count, 0.0);
    }
}

impl CoarseSpace {
    /// Creates clusters of nodes at these positions.
    pub fn new(positions: &Vectors) -> Result<Self> {
        let node_count = positions.len();
        let blocks = node_count.div_ceil(BLOCK);
        let count = (node_count / MIN_CLUSTER_NODES).clamp(1, MAX_CLUSTERS);
        let centers = memory::collected((0..blocks).map(|block| {
            let nodes = block * BLOCK..node_count.min((block + 1) * BLOCK);
            let size = nodes.len() as f32;
            nodes.map(|node| positions.get(node)).sum::<Vec3>() / size
        }))?;
        let mut order: Vec<u32> = memory::collected(0..blocks as u32)?;
        let mut clusters = memory::filled(0, blocks)?;
        let mut next = 0;
        split(&centers, &mut order, count, &mut next, &mut clusters);
        let size = count * CLUSTER_DOFS;
        Ok(Self {
            clusters,
            count,
            offsets: Vectors::zeros(node_count)?,
            free: memory::filled(0.0, node_count)?,
            stiffness: memory::filled(0.0, size * size)?,
            inverse: memory::filled(0.0, size * size)?,
            loads: memory::filled(0.0, size)?,
            motions: memory::filled(0.0, size)?,
            scratch: memory::filled(0.0, size)?,
        })
    }

    /// Number of degrees of freedom of all clusters.
    pub fn size(&self) -> usize {
        self.count * CLUSTER_DOFS
    }

    /// Assembles the stiffness at these positions. A node that is held along some axes takes part along the others.
    pub fn assemble(
        &mut self,
        forces: &Forces,
        inverse_masses: &[f32],
        pins: &Pins,
        positions: &Vectors,
        tangent: Tangent,
    ) {
        let node_count = positions.len();
        let mut centers = [(Vec3::ZERO, 0.0_f32); MAX_CLUSTERS];
        for node in 0..node_count {
            self.free[node] = if inverse_masses[node] > 0.0 { 1.0 } else { 0.0 };
            let center = &mut centers[usize::from(self.clusters[node / BLOCK])];
            center.0 += positions.get(node);
            center.1 += 1.0;
        }
        let mut sizes = [f32::MIN_POSITIVE; MAX_CLUSTERS];
        for node in 0..node_count {
            let cluster = usize::from(self.clusters[node / BLOCK]);
            let offset = positions.get(node) - centers[cluster].0 / centers[cluster].1;
            sizes[cluster] = sizes[cluster].max(offset.abs().max_element());
            self.offsets.set(node, offset);
        }
        for node in 0..node_count {
            let size = sizes[usize::from(self.clusters[node / BLOCK])];
            self.offsets
                .set(node, self.offsets.get(node) * (self.free[node] / size));
        }
        self.stiffness.fill(0.0);
        for node in 0..node_count {
            if self.free[node] == 0.0 {
                continue;
            }
            forces.springs.visit(node, &mut |link| {
                let neighbor = link.neighbor as usize;
                if neighbor > node || self.free[neighbor] == 0.0 {
                    let edge = positions.get(neighbor) - positions.get(node);
                    let (direction, matrix) = tangent.direction_and_matrix(node, &link, edge);
                    let matrix = outer(direction) * matrix.x + Mat3::from_diagonal(Vec3::splat(matrix.y));
                    let held = [node, neighbor].map(|node| pins.partial_axes_of(node as u32));
                    if (held[0] | held[1]).any() {
                        self.add_held([node, neighbor], held, matrix.as_dmat3());
                    } else {
                        self.add(node, neighbor, &matrix);
                    }
                }
            });
        }
        self.add_elements(forces, pins, positions);
        self.add_terms(forces, pins, positions);
        self.add_cavities(forces, positions);
    }

    /// Adds the stiffness of elements.
    fn add_elements(&mut self, forces: &Forces, pins: &Pins, positions: &Vectors) {
        forces.visit_deformed(positions, 1.0, &mut |corners, gradients, deformed| {
            let nodes = corners.map(|node| node as usize);
            let clusters = nodes.map(|node| usize::from(self.clusters[node / BLOCK]));
            let node_values = nodes.map(|node| self.function_values(node));
            let held = corners.map(|node| pins.partial_axes_of(node));
            let is_free = node_values.iter().all(|values| values[0] == 1.0) && !held.iter().any(|held| held.any());
            if is_free && clusters.iter().all(|&cluster| cluster == clusters[0]) {
                // Each function has one gradient in the element; that of 1 is zero.
                let gradient = |function: usize| -> DVec3 {
                    let terms = node_values.iter().zip(gradients);
                    terms
                        .map(|(values, &gradient)| gradient * f64::from(values[function]))
                        .sum()
                };
                let gradients = [1, 2, 3].map(gradient);
                for (row, &row_gradient) in (1..).zip(&gradients) {
                    for (column, &column_gradient) in (1..).zip(&gradients) {
                        let matrix = deformed.clamped_stiffness(row_gradient, column_gradient);
                        self.add_block([clusters[0], row], [clusters[0], column], matrix);
                    }
                }
                return;
            }
            let blocks = gradients.map(|a| gradients.map(|b| deformed.clamped_stiffness(a, b)));
            self.add_blocks(&corners, blocks, pins, false);
        });
    }

    /// Adds the stiffness of terms.
    fn add_terms(&mut self, forces: &Forces, pins: &Pins, positions: &Vectors) {
        forces.visit_term_blocks(positions, &mut |nodes, blocks| {
            let cluster = |node: u32| self.clusters[node as usize / BLOCK];
            let share_cluster = nodes.iter().all(|&node| cluster(node) == cluster(nodes[0]));
            self.add_blocks(nodes, *blocks, pins, share_cluster);
        });
    }

    /// Adds stiffness blocks between these nodes. If the nodes share a cluster, their blocks are summed first.
    fn add_blocks(&mut self, nodes: &[u32], mut blocks: [[DMat3; 4]; 4], pins: &Pins, share_cluster: bool) {
        if pins.are_partial() {
            for (a, &node_a) in nodes.iter().enumerate() {
                for (b, &node_b) in nodes.iter().enumerate() {
                    let held = [node_a, node_b].map(|node| pins.partial_axes_of(node));
                    blocks[a][b] = mask_axes(blocks[a][b], held);
                }
            }
        }
        let cluster = |&node: &u32| usize::from(self.clusters[node as usize / BLOCK]);
        let clusters: [usize; 4] = from_fn(|index| nodes.get(index).map_or(0, cluster));
        let node_values: [[f32; FUNCTIONS]; 4] = from_fn(|index| {
            nodes
                .get(index)
                .map_or([0.0; FUNCTIONS], |&node| self.function_values(node as usize))
        });
        for row in 0..FUNCTIONS {
            for column in 0..FUNCTIONS {
                let mut sum = DMat3::ZERO;
                for a in 0..nodes.len() {
                    for b in 0..nodes.len() {
                        let factor = f64::from(node_values[a][row] * node_values[b][column]);
                        if share_cluster {
                            sum += blocks[a][b] * factor;
                        } else if factor != 0.0 {
                            self.add_block([clusters[a], row], [clusters[b], column], blocks[a][b] * factor);
                        }
                    }
                }
                if share_cluster {
                    self.add_block([clusters[0], row], [clusters[0], column], sum);
                }
            }
        }
    }

    /// Adds the stiffness of cavities.
    fn add_cavities(&mut self, forces: &Forces, positions: &Vectors) {
        let size = self.size();
        forces.visit_cavity_factors(positions, &mut |stiffness, gradients| {
            // Derivative of the volume with respect to each degree of freedom.
            self.scratch.fill(0.0);
            for (node, gradient) in gradients {
                let first = usize::from(self.clusters[node / BLOCK]) * CLUSTER_DOFS;
                for (function, value) in self.function_values(node).into_iter().enumerate() {
                    let sums = &mut self.scratch[first + 3 * function..][..3];
                    for (sum, change) in sums.iter_mut().zip((gradient * f64::from(value)).to_array()) {
                        *sum += change;
                    }
                }
            }
            for (row, &row_value) in self.stiffness.chunks_exact_mut(size).zip(&self.scratch) {
                for (entry, &column_value) in row.iter_mut().zip(&self.scratch) {
                    *entry += stiffness * row_value * column_value;
                }
            }
        });
    }

    /// Adds a block that couples two functions of clusters.
    fn add_block(&mut self, [row_cluster, row]: [usize; 2], [column_cluster, column]: [usize; 2], matrix: DMat3) {
        let size = self.size();
        let transposed = matrix.transpose();
        for axis in 0..3 {
            let index =
                (row_cluster * CLUSTER_DOFS + 3 * row + axis) * size + column_cluster * CLUSTER_DOFS + 3 * column;
            let entries = self.stiffness[index..index + 3].iter_mut();
            for (entry, term) in entries.zip(transposed.col(axis).to_array()) {
                *entry += term;
            }
        }
    }

    /// Hashes the data that the inverse is computed from.
    pub fn hash(&self, hasher: &mut StateHasher) {
        hasher.write_doubles(&self.stiffness);
        hasher.write_vectors(self.offsets.iter());
    }

    /// Adds the stiffness of a spring between two nodes.
    fn add(&mut self, a: usize, b: usize, matrix: &Mat3) {
        let [values_a, values_b] = [self.function_values(a), self.function_values(b)];
        let [cluster_a, cluster_b] = [a, b].map(|node| usize::from(self.clusters[node / BLOCK]));
        let rows = if cluster_a == cluster_b {
            [
                (cluster_a, from_fn(|f| values_a[f] - values_b[f])),
                (cluster_a, [0.0; FUNCTIONS]),
            ]
        } else {
            [(cluster_a, values_a), (cluster_b, values_b.map(|value| -value))]
        };
        let size = self.size();
        for (row_cluster, row_values) in rows {
            for (column_cluster, column_values) in rows {
                for (row, &value) in row_values.iter().enumerate() {
                    for (column, &other) in column_values.iter().enumerate() {
                        let factor = value * other;
                        if factor == 0.0 {
                            continue;
                        }
                        for axis in 0..3 {
                            let index = (row_cluster * CLUSTER_DOFS + 3 * row + axis) * size
                                + column_cluster * CLUSTER_DOFS
                                + 3 * column;
                            for (entry, term) in self.stiffness[index..index + 3]
                                .iter_mut()
                                .zip(matrix.col(axis).to_array())
                            {
                                *entry += f64::from(factor * term);
                            }
                        }
                    }
                }
            }
        }
    }

    /// Adds the stiffness of a spring whose nodes are held along some axes.
    fn add_held(&mut self, nodes: [usize; 2], held: [BVec3; 2], matrix: DMat3) {
        let clusters = nodes.map(|node| usize::from(self.clusters[node / BLOCK]));
        let node_values = nodes.map(|node| self.function_values(node));
        for (a, b) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let sign = if a == b { 1.0 } else { -1.0 };
            let block = mask_axes(matrix, [held[a], held[b]]) * sign;
            for row in 0..FUNCTIONS {
                for column in 0..FUNCTIONS {
                    let factor = f64::from(node_values[a][row] * node_values[b][column]);
                    if factor != 0.0 {
                        self.add_block([clusters[a], row], [clusters[b], column], block * factor);
                    }
                }
            }
        }
    }

    /// Computes the inverse, with this inertia of each node, N/m. If the matrix is not positive definite, the inverse
    /// is 0 and the coarse space has no effect.
    pub fn invert(&mut self, inertia: &[f32], pins: &Pins) {
        let size = self.size();
        self.inverse.copy_from_slice(&self.stiffness);
        for (node, &inertia) in inertia.iter().enumerate() {
            let values = self.function_values(node);
            let first = usize::from(self.clusters[node / BLOCK]) * CLUSTER_DOFS;
            let held = pins.partial_axes_of(node as u32);
            for row in 0..FUNCTIONS {
                for column in 0..FUNCTIONS {
                    let value = f64::from(values[row] * values[column] * inertia) * f64::from(self.free[node]);
                    for axis in (0..3).filter(|&axis| !held.test(axis)) {
                        self.inverse[(first + 3 * row + axis) * size + first + 3 * column + axis] += value;
                    }
                }
            }
        }
        for row in 0..size {
            // A degree of freedom without nodes does not move.
            let diagonal = &mut self.inverse[row * size + row];
            *diagonal = if *diagonal > 0.0 { *diagonal * (1.0 + 1e-7) } else { 1.0 };
        }
        if !invert(&mut self.inverse, size) {
            self.inverse.fill(0.0);
        }
    }

    /// Solves for `loads` and returns `loads . motions`.
    pub fn solve(&mut self, kernel: ChosenKernel) -> f64 {
        let work = kernel.run(ApplyInverse {
            inverse: &self.inverse,
            loads: &self.loads,
            motions: &mut self.scratch,
        });
        for (motion, &sum) in self.motions.iter_mut().zip(&self.scratch) {
            *motion = sum as f32;
        }
        work
    }

    /// Adds the restriction of a tile's nodal forces to `loads`.
    #[inline(always)]
    pub fn restrict(&self, tile: usize, forces: [&[f32]; 3], loads: &mut [f32]) {
        let first = tile * TILE;
        let count = forces[0].len();
        let [x, y, z] = self.offsets.slices(first..first + count);
        let free = &self.free[first..first + count];
        let functions = [free, x, y, z];
        let clusters = &self.clusters[first / BLOCK..];
        let block_count = count / BLOCK;
        let mut block = 0;
        while block < block_count {
            // Consecutive blocks of one cluster.
            let cluster = clusters[block];
            let end = block_count.min(block + clusters[block..].iter().take_while(|&&other| other == cluster).count());
            let loads = &mut loads[usize::from(cluster) * CLUSTER_DOFS..][..CLUSTER_DOFS];
            for (axis, forces) in forces.iter().enumerate() {
                let [mut ones, mut xs, mut ys, mut zs] = [[0.0_f32; BLOCK]; FUNCTIONS];
                for block in block..end {
                    let forces = lanes(forces, block);
                    add_lanes(&mut ones, forces, lanes(free, block));
                    add_lanes(&mut xs, forces, lanes(x, block));
                    add_lanes(&mut ys, forces, lanes(y, block));
                    add_lanes(&mut zs, forces, lanes(z, block));
                }
                for (function, sums) in [ones, xs, ys, zs].into_iter().enumerate() {
                    loads[3 * function + axis] += sums.into_iter().sum::<f32>();
                }
            }
            block = end;
        }
        for index in block_count * BLOCK..count {
            let loads = &mut loads[usize::from(clusters[block_count]) * CLUSTER_DOFS..][..CLUSTER_DOFS];
            for (axis, forces) in forces.iter().enumerate() {
                for (function, values) in functions.iter().enumerate() {
                    loads[3 * function + axis] += forces[index] * values[index];
                }
            }
        }
    }

    /// Values of the cluster's functions at a node.
    pub fn function_values(&self, node: usize) -> [f32; FUNCTIONS] {
        let offset = self.offsets.get(node);
        [self.free[node], offset.x, offset.y, offset.z]
    }

    /// Sets the values of the cluster's functions at a node. Zeros exclude the node from the coarse space.
    pub fn set_function_values(&mut self, node: usize, values: [f32; FUNCTIONS]) {
        self.free[node] = values[0];
        self.offsets.set(node, Vec3::new(values[1], values[2], values[3]));
    }

    /// Adds the cluster motions to the nodal values of a tile.
    #[inline(always)]
    pub fn prolong(&self, tile: usize, displacements: &mut [&mut [f32]; 3]) {
        let first = tile * TILE;
        let count = displacements[0].len();
        let [x, y, z] = self.offsets.slices(first..first + count);
        let free = &self.free[first..first + count];
        let motions_of = |block: usize| {
            &self.motions[usize::from(self.clusters[first / BLOCK + block]) * CLUSTER_DOFS..][..CLUSTER_DOFS]
        };
        for (axis, displacements) in displacements.iter_mut().enumerate() {
            let (blocks, rest) = displacements.as_chunks_mut::<BLOCK>();
            let block_count = blocks.len();
            for (block, displacements) in blocks.iter_mut().enumerate() {
                let motions = motions_of(block);
                let (free, x, y, z) = (lanes(free, block), lanes(x, block), lanes(y, block), lanes(z, block));
                for lane in 0..BLOCK {
                    displacements[lane] += motions[axis] * free[lane]
                        + motions[3 + axis] * x[lane]
                        + motions[6 + axis] * y[lane]
                        + motions[9 + axis] * z[lane];
                }
            }
            for (displacement, index) in rest.iter_mut().zip(block_count * BLOCK..) {
                let motions = motions_of(block_count);
                *displacement += motions[axis] * free[index]
                    + motions[3 + axis] * x[index]
                    + motions[6 + axis] * y[index]
                    + motions[9 + axis] * z[index];
            }
        }
    }
}

/// Returns the values of a block.
#[inline(always)]
fn lanes(values: &[f32], block: usize) -> &[f32; BLOCK] {
    &values.as_chunks::<BLOCK>().0[block]
}

fn outer(vector: Vec3) -> Mat3 {
    Mat3::from_cols(vector * vector.x, vector * vector.y, vector * vector.z)
}

/// Assigns a cluster to each block by recursive bisection along the longest axis.
fn split(centers: &[Vec3], order: &mut [u32], count: usize, next: &mut u16, clusters: &mut [u16]) {
    if count <= 1 || order.len() <= 1 {
        order.iter().for_each(|&block| clusters[block as usize] = *next);
        *next += 1;
        return;
    }
    let bounds = crate::geometry::Aabb::of(order.iter().map(|&block| centers[block as usize]));
    let extent = bounds.max - bounds.min;
    let axis = extent.max_position();
    order.sort_unstable_by(|&a, &b| {
        centers[a as usize][axis]
            .total_cmp(&centers[b as usize][axis])
            .then(a.cmp(&b))
    });
    let left = count / 2;
    let (low, high) = order.split_at_mut(order.len() * left / count);
    split(centers, low, left, next, clusters);
    split(centers, high, count - left, next, clusters);
}

/// Replaces a symmetric positive definite matrix by its inverse. Returns false if the matrix is not positive definite.
fn invert(matrix: &mut [f64], size: usize) -> bool {
    // Gauss-Jordan in place, without pivoting.
    for pivot in 0..size {
        let value = matrix[pivot * size + pivot];
        if !(value > 0.0 && value.is_finite()) {
            return false;
        }
        let inverse = 1.0 / value;
        let (above, rest) = matrix.split_at_mut(pivot * size);
        let (row, below) = rest.split_at_mut(size);
        row[pivot] = 1.0;
        row.iter_mut().for_each(|entry| *entry *= inverse);
        for other in above.chunks_exact_mut(size).chain(below.chunks_exact_mut(size)) {
            let factor = other[pivot];
            if factor == 0.0 {
                continue;
            }
            other[pivot] = 0.0;
            for (entry, &pivoted) in other.iter_mut().zip(&*row) {
                *entry -= factor * pivoted;
            }
        }
    }
    true
}

/// Product of the inverse and the loads.
struct ApplyInverse<'a> {
    inverse: &'a [f64],
    loads: &'a [f64],
    motions: &'a mut [f64],
}

impl Loops for ApplyInverse<'_> {
    type Output = f64;

    #[inline(always)]
    fn run(self) -> f64 {
        let size = self.loads.len();
        self.motions.fill(0.0);
        for (row, &load) in self.inverse.chunks_exact(size).zip(self.loads) {
            for (motion, &entry) in self.motions.iter_mut().zip(row) {
                *motion += load * entry;
            }
        }
        self.loads
            .iter()
            .zip(&*self.motions)
            .map(|(&load, &motion)| load * motion)
            .sum()
    }
}
