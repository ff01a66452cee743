//! Preconditioned conjugate gradient (Hestenes, Stiefel 1952) for the linearized equation of a step.
//!
//! A product with the matrix is a sum over springs, tile by tile, like forces; only the tangent of elements is
//! assembled. Sums over nodes are computed per tile and added in tile order, so that they do not depend on the number
//! of threads.

use glam::Vec3;

use super::Implicit;
use super::coarse_space::CoarseSpace;
use crate::codec::saved;
use crate::contact::Contacts;
use crate::def::SolverReport;
use crate::nodes::Pins;
use crate::simd::Loops;
use crate::soa::{Records, TileForces, Vectors, WriteRecords, tile_count, tile_nodes};
use crate::solver::System;
use crate::springs::{DirectionInput, Tangent};
use crate::threads::{Items, Team, Tiles};

/// The number of products of a solve from which on assembling the tangent of elements saves time.
const WORTH_ASSEMBLING: u32 = 12;

/// Sums over the nodes of a tile.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PartialSums {
    /// Scalar product, or energy.
    pub product: f64,
    pub norm_sq: f64,
}

saved! { PartialSums { product, norm_sq } }

/// Stopping criteria of the conjugate gradient.
#[derive(Clone, Copy, Debug)]
pub(super) struct SolveGoal {
    /// Maximum number of products.
    pub budget: u32,
    /// Allowed error in the squared inertia norm, J, and relative to that of the correction.
    pub absolute: f64,
    pub relative: f64,
    /// Squared inertia norm of the previous corrections, J.
    pub previous_norm_sq: f64,
    /// Allowed error relative to this correction, if it is not the last one.
    pub self_relative: f64,
}

/// Result of the conjugate gradient.
#[derive(Clone, Copy, Debug)]
pub(super) struct SolveResult {
    pub products: u32,
    /// Product of the correction and the initial residual, J.
    pub work: f64,
    /// Squared inertia norm of the correction, J.
    pub norm_sq: f64,
    /// Estimate of the squared inertia norm of the error, J.
    pub error: f64,
}

impl Implicit {
    /// Solves the equation, linearized at the newest positions of `body`, for the correction. The preconditioner must
    /// have been applied to the residual. `residual_sq` is the product of both. The Ritz bounds must have been
    /// restarted.
    pub(super) fn solve(
        &mut self,
        body: &System,
        positions: &Vectors,
        tangent: Tangent,
        goal: SolveGoal,
        residual_sq: f64,
        team: &Team,
    ) -> SolveResult {
        let mut residual_sq = residual_sq;
        let SolverReport { iterations, solves, .. } = self.last_report;
        if goal.budget.min(iterations.div_ceil(solves.max(1))) >= WORTH_ASSEMBLING || solves == 0 {
            body.forces.assemble(&mut self.changes, team);
        }
        let mut solved = SolveResult {
            products: 0,
            work: 0.0,
            norm_sq: 0.0,
            error: residual_sq * self.ritz.factor(),
        };
        self.search(body, 0.0, team);
        while solved.products < goal.budget && residual_sq > 0.0 {
            let curvature = self.multiply(body, positions, tangent, body.contacts.as_deref(), team);
            solved.products += 1;
            // Rounding may leave no direction. The solution so far is kept.
            if !(curvature > 0.0 && curvature.is_finite()) {
                break;
            }
            let alpha = residual_sq / curvature;
            let sums = self.precondition(body, alpha, team);
            let beta = sums.product / residual_sq;
            if !sums.product.is_finite() || beta < 0.0 {
                break;
            }
            self.ritz.add_iteration(alpha, beta);
            solved.work += alpha * residual_sq;
            residual_sq = sums.product;
            solved.norm_sq = sums.norm_sq;
            let allowed = (goal
                .absolute
                .max(goal.relative * f64::max(goal.previous_norm_sq, solved.norm_sq)))
            .max(goal.self_relative * solved.norm_sq);
            solved.error = residual_sq * self.ritz.factor();
            if solved.error <= allowed {
                // The known smallest eigenvalue may be out of date.
                self.ritz.smallest();
                solved.error = residual_sq * self.ritz.factor();
            }
            if solved.error <= allowed {
                break;
            }
            self.search(body, beta, team);
        }
        self.changes.discard_tangent();
        let previous = self.ritz.last_smallest();
        if self.ritz.smallest() > previous && solved.products == goal.budget && self.is_bounded() {
            // A truncated solve has sampled less of the spectrum than earlier ones.
            self.ritz.assume(previous);
        }
        solved
    }

    /// Multiplies the search direction by the matrix, including these contacts. Returns the product of direction and
    /// result.
    pub(super) fn multiply(
        &mut self,
        body: &System,
        positions: &Vectors,
        tangent: Tangent,
        contacts: Option<&Contacts>,
        team: &Team,
    ) -> f64 {
        let node_count = positions.len();
        body.forces
            .find_changes(&self.search_directions, &mut self.changes, team);
        let sum = body.forces.sum_of(&self.changes);
        let (search_directions, inertia) = (&self.search_directions, &self.inertia);
        let course = DirectionInput {
            node_count,
            positions: body.forces.view(positions),
            displacements: search_directions.view().with_records(self.changes.records.as_ref()),
            tangent,
        };
        let written = (self.products.tiles_mut(), Items::new(&mut self.tile_sums));
        team.pass(tile_count(node_count), written, |tile, (mut products, partial)| {
            let nodes = tile_nodes(tile, node_count);
            let mut changes = TileForces::ZERO;
            sum.write_changes(tile, nodes.clone(), &course, &mut changes);
            partial.product = body.kernel.run(Product {
                inertia: &inertia[nodes.clone()],
                search_directions: search_directions.slices(nodes.clone()),
                changes: &changes,
                products: &mut products,
            });
            if let Some(contacts) = contacts {
                let search = |node: usize| search_directions.get(node);
                partial.product += contacts.multipliers.add_products(&nodes, search, &mut products);
            }
            zero_held(&body.pins, tile, nodes.start, &mut products);
        });
        self.tile_sums.iter().map(|partial| partial.product).sum()
    }

    /// Moves `alpha` along the search direction and preconditions the new residual. Returns the product of both, and
    /// the squared inertia norm of the correction so far.
    pub(super) fn precondition(&mut self, body: &System, alpha: f64, team: &Team) -> PartialSums {
        let node_count = self.inertia.len();
        let size = self.coarse.size();
        let (blocks, inertia, coarse) = (&self.blocks, &self.inertia, &self.coarse);
        let (search_directions, products) = (&self.search_directions, &self.products);
        let written = (
            self.corrections.tiles_mut(),
            self.residuals.tiles_mut(),
            self.preconditioned.tiles_mut(),
            Items::new(&mut self.tile_sums),
            Tiles::new(&mut self.loads, size),
        );
        team.pass(
            tile_count(node_count),
            written,
            |tile, (corrections, residuals, preconditioned, partial, loads)| {
                let nodes = tile_nodes(tile, node_count);
                *partial = body.kernel.run(Precondition {
                    alpha: alpha as f32,
                    inverse: blocks.inverse_slices(nodes.clone()),
                    inertia: &inertia[nodes.clone()],
                    search_directions: search_directions.slices(nodes.clone()),
                    products: products.slices(nodes),
                    corrections,
                    residuals,
                    preconditioned,
                    tile,
                    coarse,
                    loads,
                });
            },
        );
        let mut sums = PartialSums::default();
        self.coarse.loads.fill(0.0);
        for (partial, loads) in self.tile_sums.iter().zip(self.loads.chunks_exact(size)) {
            sums.product += partial.product;
            sums.norm_sq += partial.norm_sq;
            for (sum, &load) in self.coarse.loads.iter_mut().zip(loads) {
                *sum += f64::from(load);
            }
        }
        sums.product += self.coarse.solve(body.kernel);
        sums
    }

    /// Updates the search direction, keeping `beta` times the last one.
    fn search(&mut self, body: &System, beta: f64, team: &Team) {
        let node_count = self.inertia.len();
        let (coarse, preconditioned) = (&self.coarse, &self.preconditioned);
        let records = self.changes.records.as_mut().map(Records::tiles_mut);
        let written = (self.search_directions.tiles_mut(), records);
        team.pass(
            tile_count(node_count),
            written,
            |tile, (mut search_directions, records)| {
                body.kernel.run(Search {
                    beta: beta as f32,
                    preconditioned: preconditioned.slices(tile_nodes(tile, node_count)),
                    search_directions: &mut search_directions,
                    tile,
                    coarse,
                });
                zero_held(
                    &body.pins,
                    tile,
                    tile_nodes(tile, node_count).start,
                    &mut search_directions,
                );
                if let Some(records) = records {
                    let axes = search_directions.each_ref().map(|axis| &**axis);
                    body.kernel.run(WriteRecords { axes, records });
                }
            },
        );
    }
}

/// Zeroes held axes (the filter of Baraff, Witkin 1998, section 5.3).
fn zero_held(pins: &Pins, tile: usize, first: usize, vectors: &mut [&mut [f32]; 3]) {
    for pin in pins.of_tile(tile) {
        pin.write_held(vectors, pin.node as usize - first, Vec3::ZERO);
    }
}

/// Adds products to 16 independent sums, which avoids one dependency chain.
#[inline(always)]
pub(super) fn add_products(sums: &mut [f32; 16], a: &[f32], b: &[f32]) {
    let (a, rest_a) = a.as_chunks::<16>();
    let (b, rest_b) = b.as_chunks::<16>();
    for (a, b) in a.iter().zip(b) {
        add_lanes(sums, a, b);
    }
    for (lane, (a, b)) in rest_a.iter().zip(rest_b).enumerate() {
        sums[lane] += a * b;
    }
}

#[inline(always)]
pub(super) fn add_lanes(sums: &mut [f32; 16], a: &[f32; 16], b: &[f32; 16]) {
    for lane in 0..16 {
        sums[lane] += a[lane] * b[lane];
    }
}

/// Adds weighted squares.
#[inline(always)]
fn add_squares(sums: &mut [f32; 16], weights: &[f32], values: &[f32]) {
    let (weights, rest_weights) = weights.as_chunks::<16>();
    let (values, rest_values) = values.as_chunks::<16>();
    for (weights, values) in weights.iter().zip(values) {
        for lane in 0..16 {
            sums[lane] += weights[lane] * values[lane] * values[lane];
        }
    }
    for (lane, (weight, value)) in rest_weights.iter().zip(rest_values).enumerate() {
        sums[lane] += weight * value * value;
    }
}

#[inline(always)]
pub(super) fn total(sums: [f32; 16]) -> f64 {
    sums.into_iter().map(f64::from).sum()
}

struct Product<'a, 'b> {
    inertia: &'a [f32],
    search_directions: [&'a [f32]; 3],
    changes: &'a TileForces,
    products: &'b mut [&'a mut [f32]; 3],
}

impl Loops for Product<'_, '_> {
    type Output = f64;

    #[inline(always)]
    fn run(self) -> f64 {
        let count = self.inertia.len();
        let mut sums = [0.0; 16];
        for (axis, products) in self.products.iter_mut().enumerate() {
            let search_directions = &self.search_directions[axis][..count];
            let changes = &self.changes.axes()[axis][..count];
            let products = &mut products[..count];
            for node in 0..count {
                products[node] = self.inertia[node] * search_directions[node] - changes[node];
            }
            add_products(&mut sums, products, search_directions);
        }
        total(sums)
    }
}

struct Precondition<'a> {
    alpha: f32,
    inverse: [&'a [f32]; 6],
    inertia: &'a [f32],
    search_directions: [&'a [f32]; 3],
    products: [&'a [f32]; 3],
    corrections: [&'a mut [f32]; 3],
    residuals: [&'a mut [f32]; 3],
    preconditioned: [&'a mut [f32]; 3],
    tile: usize,
    coarse: &'a CoarseSpace,
    loads: &'a mut [f32],
}

impl Loops for Precondition<'_> {
    type Output = PartialSums;

    #[inline(always)]
    fn run(self) -> PartialSums {
        let count = self.inertia.len();
        let alpha = self.alpha;
        let mut partial = PartialSums::default();
        let [mut rx, mut ry, mut rz] = self.residuals;
        if alpha > 0.0 {
            let mut sizes = [0.0; 16];
            let axes = [&mut *rx, &mut *ry, &mut *rz].into_iter().zip(self.corrections);
            for (axis, (residuals, corrections)) in axes.enumerate() {
                let (search_directions, products) =
                    (&self.search_directions[axis][..count], &self.products[axis][..count]);
                let (residuals, corrections) = (&mut residuals[..count], &mut corrections[..count]);
                for node in 0..count {
                    residuals[node] -= alpha * products[node];
                    corrections[node] += alpha * search_directions[node];
                }
                add_squares(&mut sizes, self.inertia, corrections);
            }
            partial.norm_sq = total(sizes);
        }
        let [xx, yy, zz, yz, zx, xy] = self.inverse.map(|entry| &entry[..count]);
        let [px, py, pz] = self.preconditioned;
        let (px, py, pz) = (&mut px[..count], &mut py[..count], &mut pz[..count]);
        (rx, ry, rz) = (&mut rx[..count], &mut ry[..count], &mut rz[..count]);
        for node in 0..count {
            let (x, y, z) = (rx[node], ry[node], rz[node]);
            px[node] = xx[node] * x + xy[node] * y + zx[node] * z;
            py[node] = xy[node] * x + yy[node] * y + yz[node] * z;
            pz[node] = zx[node] * x + yz[node] * y + zz[node] * z;
        }
        let mut sums = [0.0; 16];
        add_products(&mut sums, rx, px);
        add_products(&mut sums, ry, py);
        add_products(&mut sums, rz, pz);
        partial.product = total(sums);
        self.loads.fill(0.0);
        self.coarse.restrict(self.tile, [rx, ry, rz], self.loads);
        partial
    }
}

struct Search<'a, 'b> {
    beta: f32,
    preconditioned: [&'a [f32]; 3],
    search_directions: &'b mut [&'a mut [f32]; 3],
    tile: usize,
    coarse: &'a CoarseSpace,
}

impl Loops for Search<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        for (search_directions, preconditioned) in self.search_directions.iter_mut().zip(self.preconditioned) {
            for (search, &preconditioned) in search_directions.iter_mut().zip(preconditioned) {
                *search = preconditioned + self.beta * *search;
            }
        }
        self.coarse.prolong(self.tile, self.search_directions);
    }
}
