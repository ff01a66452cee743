//! The coarse level: a few dozen clusters of nodes, each with the affine motions it can make as a whole.
//!
//! What a conjugate gradient is slow at is what reaches across the body; what a cluster does as a whole is found here at
//! once, by a small dense matrix (aggregation, as in Vanek, Mandel, Brezina 1996, without smoothing). Its inverse may be that
//! of an older state of the body: then it is a worse preconditioner, and still one.

use std::array::from_fn;

use glam::{BVec3, DMat3, DVec3, Mat3, Vec3};

use super::gradient::add_lanes;
use crate::base::{Result, StateHasher, memory};
use crate::codec::saved;
use crate::forces::Forces;
use crate::nodes::Pins;
use crate::simd::{ChosenKernel, Loops};
use crate::soa::{PerNode, TILE, Vectors};
use crate::solver::held::without_held;
use crate::springs::Tangent;

/// Nodes that always belong to one cluster together: as many as are worked on side by side.
const BLOCK: usize = 16;

/// The most clusters, and the fewest nodes that are worth one.
const CLUSTERS: usize = 16;
const NODES: usize = 64;

/// Functions of a cluster: 1 and three coordinates.
const FUNCTIONS: usize = 4;

/// Numbers of a cluster: each of its functions along each axis.
pub(super) const MOTIONS: usize = 3 * FUNCTIONS;

/// The coarse level of a body.
#[derive(Debug)]
pub(super) struct Coarse {
    /// The cluster of each sixteen nodes.
    clusters: Vec<u16>,
    count: usize,
    /// Where each node is in its cluster, in units of the cluster's size.
    places: Vectors,
    /// 1 for a node that is free to move.
    free: Vec<f32>,
    /// The springs' part of the matrix.
    stiffness: Vec<f64>,
    /// The inverse of the whole. Functions that hardly differ on the nodes of a cluster, or motions that hardly cost anything,
    /// make its entries so large that the products of loads with it, rounded to `f32`, might be below 0.
    inverse: Vec<f64>,
    /// What the last residual comes to, and its solution.
    pub loads: Vec<f64>,
    motions: Vec<f32>,
    sums: Vec<f64>,
}

saved! { Coarse { clusters, count, places, free, stiffness, inverse, loads, motions, sums } }

impl PerNode for Coarse {
    fn reserve_nodes(&mut self, node_count: usize) -> Result<()> {
        memory::reserve(&mut self.clusters, node_count.div_ceil(BLOCK))?;
        self.places.reserve_nodes(node_count)?;
        memory::reserve(&mut self.free, node_count)
    }

    fn grow(&mut self, node_count: usize) {
        let last = self.clusters.last().copied().unwrap_or(0);
        self.clusters.resize(node_count.div_ceil(BLOCK), last);
        self.places.grow(node_count);
        self.free.resize(node_count, 0.0);
    }
}

impl Coarse {
    /// Clusters of nodes at these positions.
    pub fn new(positions: &Vectors) -> Result<Self> {
        let node_count = positions.len();
        let blocks = node_count.div_ceil(BLOCK);
        let count = (node_count / NODES).clamp(1, CLUSTERS);
        let centres = memory::collected((0..blocks).map(|block| {
            let nodes = block * BLOCK..node_count.min((block + 1) * BLOCK);
            let size = nodes.len() as f32;
            nodes.map(|node| positions.get(node)).sum::<Vec3>() / size
        }))?;
        let mut order: Vec<u32> = memory::collected(0..blocks as u32)?;
        let mut clusters = memory::filled(0, blocks)?;
        let mut next = 0;
        split(&centres, &mut order, count, &mut next, &mut clusters);
        let size = count * MOTIONS;
        Ok(Self {
            clusters,
            count,
            places: Vectors::zeros(node_count)?,
            free: memory::filled(0.0, node_count)?,
            stiffness: memory::filled(0.0, size * size)?,
            inverse: memory::filled(0.0, size * size)?,
            loads: memory::filled(0.0, size)?,
            motions: memory::filled(0.0, size)?,
            sums: memory::filled(0.0, size)?,
        })
    }

    /// How many numbers describe a motion of all clusters.
    pub fn size(&self) -> usize {
        self.count * MOTIONS
    }

    /// Takes in forces at these positions, and which nodes move. A node that is held along some axes takes part along the others.
    pub fn gather(
        &mut self,
        forces: &Forces,
        inverse_masses: &[f32],
        pins: &Pins,
        positions: &Vectors,
        tangent: Tangent,
    ) {
        let node_count = positions.len();
        let mut centres = [(Vec3::ZERO, 0.0_f32); CLUSTERS];
        for node in 0..node_count {
            self.free[node] = if inverse_masses[node] > 0.0 { 1.0 } else { 0.0 };
            let centre = &mut centres[usize::from(self.clusters[node / BLOCK])];
            centre.0 += positions.get(node);
            centre.1 += 1.0;
        }
        let mut sizes = [f32::MIN_POSITIVE; CLUSTERS];
        for node in 0..node_count {
            let cluster = usize::from(self.clusters[node / BLOCK]);
            let place = positions.get(node) - centres[cluster].0 / centres[cluster].1;
            sizes[cluster] = sizes[cluster].max(place.abs().max_element());
            self.places.set(node, place);
        }
        for node in 0..node_count {
            let size = sizes[usize::from(self.clusters[node / BLOCK])];
            self.places.set(node, self.places.get(node) * (self.free[node] / size));
        }
        self.stiffness.fill(0.0);
        for node in 0..node_count {
            if self.free[node] == 0.0 {
                continue;
            }
            forces.springs.visit(node, &mut |link| {
                let neighbour = link.neighbour as usize;
                if neighbour > node || self.free[neighbour] == 0.0 {
                    let way = positions.get(neighbour) - positions.get(node);
                    let (direction, matrix) = tangent.of(node, &link, way);
                    let matrix = outer(direction) * matrix.x + Mat3::from_diagonal(Vec3::splat(matrix.y));
                    let held = [node, neighbour].map(|node| pins.partial_axes_of(node as u32));
                    if (held[0] | held[1]).any() {
                        self.add_held([node, neighbour], held, matrix.as_dmat3());
                    } else {
                        self.add(node, neighbour, &matrix);
                    }
                }
            });
        }
        self.add_elements(forces, pins, positions);
        self.add_terms(forces, pins, positions);
        self.add_cavities(forces, positions);
    }

    /// Adds elements at these positions.
    fn add_elements(&mut self, forces: &Forces, pins: &Pins, positions: &Vectors) {
        forces.show_deformed(positions, 1.0, &mut |corners, gradients, deformed| {
            let nodes = corners.map(|node| node as usize);
            let clusters = nodes.map(|node| usize::from(self.clusters[node / BLOCK]));
            let parts = nodes.map(|node| self.part(node));
            let held = corners.map(|node| pins.partial_axes_of(node));
            let is_free = parts.iter().all(|part| part[0] == 1.0) && !held.iter().any(|held| held.any());
            if is_free && clusters.iter().all(|&cluster| cluster == clusters[0]) {
                // The functions have one gradient each in all of it, and 1 has none.
                let gradient = |function: usize| -> DVec3 {
                    let terms = parts.iter().zip(gradients);
                    terms
                        .map(|(part, &gradient)| gradient * f64::from(part[function]))
                        .sum()
                };
                let gradients = [1, 2, 3].map(gradient);
                for (row, &of_row) in (1..).zip(&gradients) {
                    for (column, &of_column) in (1..).zip(&gradients) {
                        let matrix = deformed.clamped_stiffness(of_row, of_column);
                        self.add_block([clusters[0], row], [clusters[0], column], matrix);
                    }
                }
                return;
            }
            let blocks = gradients.map(|a| gradients.map(|b| deformed.clamped_stiffness(a, b)));
            self.add_blocks(&corners, blocks, pins, false);
        });
    }

    /// Adds terms at these positions.
    fn add_terms(&mut self, forces: &Forces, pins: &Pins, positions: &Vectors) {
        forces.show_term_blocks(positions, &mut |nodes, blocks| {
            let cluster = |node: u32| self.clusters[node as usize / BLOCK];
            let are_together = nodes.iter().all(|&node| cluster(node) == cluster(nodes[0]));
            self.add_blocks(nodes, *blocks, pins, are_together);
        });
    }

    /// Adds what acts between these nodes. Nodes of one cluster share its functions: their blocks are added up first, where they
    /// `are_together`.
    fn add_blocks(&mut self, nodes: &[u32], mut blocks: [[DMat3; 4]; 4], pins: &Pins, are_together: bool) {
        if pins.are_partial() {
            for (a, &of_a) in nodes.iter().enumerate() {
                for (b, &of_b) in nodes.iter().enumerate() {
                    let held = [of_a, of_b].map(|node| pins.partial_axes_of(node));
                    blocks[a][b] = without_held(blocks[a][b], held);
                }
            }
        }
        let cluster = |&node: &u32| usize::from(self.clusters[node as usize / BLOCK]);
        let clusters: [usize; 4] = from_fn(|place| nodes.get(place).map_or(0, cluster));
        let parts: [[f32; FUNCTIONS]; 4] = from_fn(|place| {
            nodes
                .get(place)
                .map_or([0.0; FUNCTIONS], |&node| self.part(node as usize))
        });
        for row in 0..FUNCTIONS {
            for column in 0..FUNCTIONS {
                let mut sum = DMat3::ZERO;
                for a in 0..nodes.len() {
                    for b in 0..nodes.len() {
                        let factor = f64::from(parts[a][row] * parts[b][column]);
                        if are_together {
                            sum += blocks[a][b] * factor;
                        } else if factor != 0.0 {
                            self.add_block([clusters[a], row], [clusters[b], column], blocks[a][b] * factor);
                        }
                    }
                }
                if are_together {
                    self.add_block([clusters[0], row], [clusters[0], column], sum);
                }
            }
        }
    }

    /// Adds cavities at these positions.
    fn add_cavities(&mut self, forces: &Forces, positions: &Vectors) {
        let size = self.size();
        forces.show_cavity_factors(positions, &mut |stiffness, gradients| {
            // How the volume changes with each motion.
            self.sums.fill(0.0);
            for (node, gradient) in gradients {
                let first = usize::from(self.clusters[node / BLOCK]) * MOTIONS;
                for (function, part) in self.part(node).into_iter().enumerate() {
                    let sums = &mut self.sums[first + 3 * function..][..3];
                    for (sum, growth) in sums.iter_mut().zip((gradient * f64::from(part)).to_array()) {
                        *sum += growth;
                    }
                }
            }
            for (row, &of_row) in self.stiffness.chunks_exact_mut(size).zip(&self.sums) {
                for (entry, &of_column) in row.iter_mut().zip(&self.sums) {
                    *entry += stiffness * of_row * of_column;
                }
            }
        });
    }

    /// Adds what joins two functions of clusters.
    fn add_block(&mut self, [row_cluster, row]: [usize; 2], [column_cluster, column]: [usize; 2], matrix: DMat3) {
        let size = self.size();
        let transposed = matrix.transpose();
        for axis in 0..3 {
            let place = (row_cluster * MOTIONS + 3 * row + axis) * size + column_cluster * MOTIONS + 3 * column;
            let entries = self.stiffness[place..place + 3].iter_mut();
            for (entry, term) in entries.zip(transposed.col(axis).to_array()) {
                *entry += term;
            }
        }
    }

    /// All that it was made of.
    pub fn hash(&self, hasher: &mut StateHasher) {
        hasher.write_doubles(&self.stiffness);
        hasher.write_vectors(self.places.iter());
    }

    /// Adds a spring between two nodes.
    fn add(&mut self, a: usize, b: usize, matrix: &Mat3) {
        let [of_a, of_b] = [self.part(a), self.part(b)];
        let [cluster_a, cluster_b] = [a, b].map(|node| usize::from(self.clusters[node / BLOCK]));
        let rows = if cluster_a == cluster_b {
            [
                (cluster_a, from_fn(|f| of_a[f] - of_b[f])),
                (cluster_a, [0.0; FUNCTIONS]),
            ]
        } else {
            [(cluster_a, of_a), (cluster_b, of_b.map(|value| -value))]
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
                            let place =
                                (row_cluster * MOTIONS + 3 * row + axis) * size + column_cluster * MOTIONS + 3 * column;
                            for (entry, term) in self.stiffness[place..place + 3]
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

    /// Adds a spring between two nodes that are held along some axes.
    fn add_held(&mut self, nodes: [usize; 2], held: [BVec3; 2], matrix: DMat3) {
        let clusters = nodes.map(|node| usize::from(self.clusters[node / BLOCK]));
        let parts = nodes.map(|node| self.part(node));
        for (a, b) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let sign = if a == b { 1.0 } else { -1.0 };
            let block = without_held(matrix, [held[a], held[b]]) * sign;
            for row in 0..FUNCTIONS {
                for column in 0..FUNCTIONS {
                    let factor = f64::from(parts[a][row] * parts[b][column]);
                    if factor != 0.0 {
                        self.add_block([clusters[a], row], [clusters[b], column], block * factor);
                    }
                }
            }
        }
    }

    /// Makes the inverse, with this inertia of each node, N/m. Where it has none, the level does nothing.
    pub fn invert(&mut self, inertia: &[f32], pins: &Pins) {
        let size = self.size();
        self.inverse.copy_from_slice(&self.stiffness);
        for (node, &inertia) in inertia.iter().enumerate() {
            let values = self.part(node);
            let first = usize::from(self.clusters[node / BLOCK]) * MOTIONS;
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
            // What no node takes part in does not move.
            let diagonal = &mut self.inverse[row * size + row];
            *diagonal = if *diagonal > 0.0 { *diagonal * (1.0 + 1e-7) } else { 1.0 };
        }
        if !invert(&mut self.inverse, size) {
            self.inverse.fill(0.0);
        }
    }

    /// Solves for `loads`: the work done, `loads . motions`.
    pub fn solve(&mut self, kernel: ChosenKernel) -> f64 {
        let work = kernel.run(Solve {
            inverse: &self.inverse,
            loads: &self.loads,
            motions: &mut self.sums,
        });
        for (motion, &sum) in self.motions.iter_mut().zip(&self.sums) {
            *motion = sum as f32;
        }
        work
    }

    /// What forces on the nodes of a tile come to for each cluster: added to `loads`.
    #[inline(always)]
    pub fn restrict(&self, tile: usize, forces: [&[f32]; 3], loads: &mut [f32]) {
        let first = tile * TILE;
        let count = forces[0].len();
        let [x, y, z] = self.places.slices(first..first + count);
        let free = &self.free[first..first + count];
        let functions = [free, x, y, z];
        let clusters = &self.clusters[first / BLOCK..];
        let whole = count / BLOCK;
        let mut block = 0;
        while block < whole {
            // Blocks of one cluster, one after another.
            let cluster = clusters[block];
            let end = whole.min(block + clusters[block..].iter().take_while(|&&other| other == cluster).count());
            let loads = &mut loads[usize::from(cluster) * MOTIONS..][..MOTIONS];
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
        for place in whole * BLOCK..count {
            let loads = &mut loads[usize::from(clusters[whole]) * MOTIONS..][..MOTIONS];
            for (axis, forces) in forces.iter().enumerate() {
                for (function, values) in functions.iter().enumerate() {
                    loads[3 * function + axis] += forces[place] * values[place];
                }
            }
        }
    }

    /// What a node takes of its cluster's motions.
    pub fn part(&self, node: usize) -> [f32; FUNCTIONS] {
        let place = self.places.get(node);
        [self.free[node], place.x, place.y, place.z]
    }

    /// Lets it take another part; nothing: it is left to the fine level.
    pub fn set_part(&mut self, node: usize, part: [f32; FUNCTIONS]) {
        self.free[node] = part[0];
        self.places.set(node, Vec3::new(part[1], part[2], part[3]));
    }

    /// Adds what the clusters' motions are for the nodes of a tile.
    #[inline(always)]
    pub fn prolong(&self, tile: usize, ways: &mut [&mut [f32]; 3]) {
        let first = tile * TILE;
        let count = ways[0].len();
        let [x, y, z] = self.places.slices(first..first + count);
        let free = &self.free[first..first + count];
        let motions_of =
            |block: usize| &self.motions[usize::from(self.clusters[first / BLOCK + block]) * MOTIONS..][..MOTIONS];
        for (axis, ways) in ways.iter_mut().enumerate() {
            let (blocks, rest) = ways.as_chunks_mut::<BLOCK>();
            let whole = blocks.len();
            for (block, ways) in blocks.iter_mut().enumerate() {
                let motions = motions_of(block);
                let (free, x, y, z) = (lanes(free, block), lanes(x, block), lanes(y, block), lanes(z, block));
                for lane in 0..BLOCK {
                    ways[lane] += motions[axis] * free[lane]
                        + motions[3 + axis] * x[lane]
                        + motions[6 + axis] * y[lane]
                        + motions[9 + axis] * z[lane];
                }
            }
            for (way, place) in rest.iter_mut().zip(whole * BLOCK..) {
                let motions = motions_of(whole);
                *way += motions[axis] * free[place]
                    + motions[3 + axis] * x[place]
                    + motions[6 + axis] * y[place]
                    + motions[9 + axis] * z[place];
            }
        }
    }
}

/// Sixteen of them.
#[inline(always)]
fn lanes(values: &[f32], block: usize) -> &[f32; BLOCK] {
    &values.as_chunks::<BLOCK>().0[block]
}

fn outer(vector: Vec3) -> Mat3 {
    Mat3::from_cols(vector * vector.x, vector * vector.y, vector * vector.z)
}

/// Gives each block a cluster: halves of the blocks along the longest axis, and so on.
fn split(centres: &[Vec3], order: &mut [u32], count: usize, next: &mut u16, clusters: &mut [u16]) {
    if count <= 1 || order.len() <= 1 {
        order.iter().for_each(|&block| clusters[block as usize] = *next);
        *next += 1;
        return;
    }
    let bounds = crate::geometry::Bounds::of(order.iter().map(|&block| centres[block as usize]));
    let extent = bounds.max - bounds.min;
    let axis = extent.max_position();
    order.sort_unstable_by(|&a, &b| {
        centres[a as usize][axis]
            .total_cmp(&centres[b as usize][axis])
            .then(a.cmp(&b))
    });
    let left = count / 2;
    let (low, high) = order.split_at_mut(order.len() * left / count);
    split(centres, low, left, next, clusters);
    split(centres, high, count - left, next, clusters);
}

/// Replaces a symmetric positive definite matrix by its inverse; false where it is not one.
fn invert(matrix: &mut [f64], size: usize) -> bool {
    // Gauss-Jordan in place, without pivots.
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

/// The inverse times the loads.
struct Solve<'a> {
    inverse: &'a [f64],
    loads: &'a [f64],
    motions: &'a mut [f64],
}

impl Loops for Solve<'_> {
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
