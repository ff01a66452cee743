//! The preconditioned conjugate gradient (Hestenes, Stiefel 1952) that solves the linearised equation of a step.
//!
//! The matrix is never made: its product with a vector is a sum over springs, tile by tile, as forces are. Sums over nodes
//! are made tile by tile too and added up in the order of tiles, so that they are the same for any number of threads.

use glam::Vec3;

use super::Implicit;
use super::coarse::Coarse;
use crate::codec::saved;
use crate::contact::Contacts;
use crate::nodes::Pins;
use crate::simd::Loops;
use crate::soa::{Records, TileForces, Vectors, WriteRecords, tile_count, tile_nodes};
use crate::solver::System;
use crate::springs::{Course, Tangent};
use crate::threads::{Items, Team, Tiles};

/// Sums over the nodes of a tile.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Partial {
    pub first: f64,
    pub second: f64,
}

saved! { Partial { first, second } }

/// When the gradient may stop.
#[derive(Clone, Copy, Debug)]
pub(super) struct Goal {
    /// Products it may take.
    pub budget: u32,
    /// The error allowed, in the squared norm of inertia, J; and as a fraction of the correction's.
    pub absolute: f64,
    pub relative: f64,
    /// The squared norm of inertia of the corrections before, J.
    pub size: f64,
    /// The error allowed as a fraction of this correction's, where it is not the last.
    pub own: f64,
}

/// How it ended.
#[derive(Clone, Copy, Debug)]
pub(super) struct Solved {
    pub products: u32,
    /// The product of the correction and the residual there was, J.
    pub work: f64,
    /// The squared norm of inertia of the correction, J.
    pub size: f64,
    /// The same of what is missing, as far as it is known.
    pub error: f64,
}

impl Implicit {
    /// Solves the equation linearised at the newest positions of `body` for the residual: the correction.
    /// The preconditioner has been applied to it, and `square` is the product of both; the spectrum has begun anew.
    pub(super) fn solve(
        &mut self,
        body: &System,
        positions: &Vectors,
        tangent: Tangent,
        goal: Goal,
        square: f64,
        team: &Team,
    ) -> Solved {
        let mut square = square;
        let mut solved = Solved {
            products: 0,
            work: 0.0,
            size: 0.0,
            error: square * self.spectrum.factor(),
        };
        self.search(body, 0.0, team);
        while solved.products < goal.budget && square > 0.0 {
            let curvature = self.multiply(body, positions, tangent, body.contacts.as_deref(), team);
            solved.products += 1;
            // Rounding may leave nothing to go along; what was found before that stands.
            if !(curvature > 0.0 && curvature.is_finite()) {
                break;
            }
            let length = square / curvature;
            let sums = self.precondition(body, length, team);
            let growth = sums.first / square;
            if !sums.first.is_finite() || growth < 0.0 {
                break;
            }
            self.spectrum.take(length, growth);
            solved.work += length * square;
            square = sums.first;
            solved.size = sums.second;
            let allowed =
                (goal.absolute.max(goal.relative * f64::max(goal.size, solved.size))).max(goal.own * solved.size);
            solved.error = square * self.spectrum.factor();
            if solved.error <= allowed {
                // What is known of the smallest eigenvalue may be old.
                self.spectrum.smallest();
                solved.error = square * self.spectrum.factor();
            }
            if solved.error <= allowed {
                break;
            }
            self.search(body, growth, team);
        }
        let known = self.spectrum.known_smallest();
        if self.spectrum.smallest() > known && solved.products == goal.budget && self.is_bounded() {
            // Cut short, it has seen less of the matrix than those before it.
            self.spectrum.assume(known);
        }
        solved
    }

    /// The matrix, with what these contacts add to it, times the search direction: the product of both.
    pub(super) fn multiply(
        &mut self,
        body: &System,
        positions: &Vectors,
        tangent: Tangent,
        contacts: Option<&Contacts>,
        team: &Team,
    ) -> f64 {
        let node_count = positions.len();
        body.forces.find_changes(&self.searches, &mut self.changes, team);
        let sum = body.forces.sum_of(&self.changes);
        let (searches, inertia) = (&self.searches, &self.inertia);
        let course = Course {
            node_count,
            positions: body.forces.view(positions),
            ways: searches.view().with_records(self.changes.records.as_ref()),
            tangent,
        };
        let written = (self.products.tiles_mut(), Items::new(&mut self.partials));
        team.pass(tile_count(node_count), written, |tile, (mut products, partial)| {
            let nodes = tile_nodes(tile, node_count);
            let mut changes = TileForces::ZERO;
            sum.write_changes(tile, nodes.clone(), &course, &mut changes);
            partial.first = body.kernel.run(Product {
                inertia: &inertia[nodes.clone()],
                searches: searches.slices(nodes.clone()),
                changes: &changes,
                products: &mut products,
            });
            if let Some(contacts) = contacts {
                let search = |node: usize| searches.get(node);
                partial.first += contacts.holds.add_products(&nodes, search, &mut products);
            }
            hold(&body.pins, tile, nodes.start, &mut products);
        });
        self.partials.iter().map(|partial| partial.first).sum()
    }

    /// Goes `length` along the search direction, and applies the preconditioner to what remains of the residual: the product
    /// of both, and the squared norm of inertia of the correction so far.
    pub(super) fn precondition(&mut self, body: &System, length: f64, team: &Team) -> Partial {
        let node_count = self.inertia.len();
        let size = self.coarse.size();
        let (blocks, inertia, coarse) = (&self.blocks, &self.inertia, &self.coarse);
        let (searches, products) = (&self.searches, &self.products);
        let written = (
            self.corrections.tiles_mut(),
            self.residuals.tiles_mut(),
            self.preconditioned.tiles_mut(),
            Items::new(&mut self.partials),
            Tiles::new(&mut self.loads, size),
        );
        team.pass(
            tile_count(node_count),
            written,
            |tile, (corrections, residuals, preconditioned, partial, loads)| {
                let nodes = tile_nodes(tile, node_count);
                *partial = body.kernel.run(Precondition {
                    length: length as f32,
                    inverse: blocks.of(nodes.clone()),
                    inertia: &inertia[nodes.clone()],
                    searches: searches.slices(nodes.clone()),
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
        let mut sums = Partial::default();
        self.coarse.loads.fill(0.0);
        for (partial, loads) in self.partials.iter().zip(self.loads.chunks_exact(size)) {
            sums.first += partial.first;
            sums.second += partial.second;
            for (sum, &load) in self.coarse.loads.iter_mut().zip(loads) {
                *sum += f64::from(load);
            }
        }
        sums.first += self.coarse.solve(body.kernel);
        sums
    }

    /// The next search direction, with this part of the last.
    fn search(&mut self, body: &System, growth: f64, team: &Team) {
        let node_count = self.inertia.len();
        let (coarse, preconditioned) = (&self.coarse, &self.preconditioned);
        let records = self.changes.records.as_mut().map(Records::tiles_mut);
        let written = (self.searches.tiles_mut(), records);
        team.pass(tile_count(node_count), written, |tile, (mut searches, records)| {
            body.kernel.run(Search {
                growth: growth as f32,
                preconditioned: preconditioned.slices(tile_nodes(tile, node_count)),
                searches: &mut searches,
                tile,
                coarse,
            });
            hold(&body.pins, tile, tile_nodes(tile, node_count).start, &mut searches);
            if let Some(records) = records {
                let axes = searches.each_ref().map(|axis| &**axis);
                body.kernel.run(WriteRecords { axes, records });
            }
        });
    }
}

/// What is held takes no part (the filter of Baraff, Witkin 1998, section 5.3).
fn hold(pins: &Pins, tile: usize, first: usize, vectors: &mut [&mut [f32]; 3]) {
    for pin in pins.of_tile(tile) {
        pin.put(vectors, pin.node as usize - first, Vec3::ZERO);
    }
}

/// A sum of products in lanes, so that it does not wait for itself.
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

/// A sum of weighted squares.
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
    searches: [&'a [f32]; 3],
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
            let searches = &self.searches[axis][..count];
            let changes = &self.changes.axes()[axis][..count];
            let products = &mut products[..count];
            for place in 0..count {
                products[place] = self.inertia[place] * searches[place] - changes[place];
            }
            add_products(&mut sums, products, searches);
        }
        total(sums)
    }
}

struct Precondition<'a> {
    length: f32,
    inverse: [&'a [f32]; 6],
    inertia: &'a [f32],
    searches: [&'a [f32]; 3],
    products: [&'a [f32]; 3],
    corrections: [&'a mut [f32]; 3],
    residuals: [&'a mut [f32]; 3],
    preconditioned: [&'a mut [f32]; 3],
    tile: usize,
    coarse: &'a Coarse,
    loads: &'a mut [f32],
}

impl Loops for Precondition<'_> {
    type Output = Partial;

    #[inline(always)]
    fn run(self) -> Partial {
        let count = self.inertia.len();
        let length = self.length;
        let mut partial = Partial::default();
        let [mut rx, mut ry, mut rz] = self.residuals;
        if length > 0.0 {
            let mut sizes = [0.0; 16];
            let axes = [&mut *rx, &mut *ry, &mut *rz].into_iter().zip(self.corrections);
            for (axis, (residuals, corrections)) in axes.enumerate() {
                let (searches, products) = (&self.searches[axis][..count], &self.products[axis][..count]);
                let (residuals, corrections) = (&mut residuals[..count], &mut corrections[..count]);
                for place in 0..count {
                    residuals[place] -= length * products[place];
                    corrections[place] += length * searches[place];
                }
                add_squares(&mut sizes, self.inertia, corrections);
            }
            partial.second = total(sizes);
        }
        let [xx, yy, zz, yz, zx, xy] = self.inverse.map(|entry| &entry[..count]);
        let [px, py, pz] = self.preconditioned;
        let (px, py, pz) = (&mut px[..count], &mut py[..count], &mut pz[..count]);
        (rx, ry, rz) = (&mut rx[..count], &mut ry[..count], &mut rz[..count]);
        for place in 0..count {
            let (x, y, z) = (rx[place], ry[place], rz[place]);
            px[place] = xx[place] * x + xy[place] * y + zx[place] * z;
            py[place] = xy[place] * x + yy[place] * y + yz[place] * z;
            pz[place] = zx[place] * x + yz[place] * y + zz[place] * z;
        }
        let mut sums = [0.0; 16];
        add_products(&mut sums, rx, px);
        add_products(&mut sums, ry, py);
        add_products(&mut sums, rz, pz);
        partial.first = total(sums);
        self.loads.fill(0.0);
        self.coarse.restrict(self.tile, [rx, ry, rz], self.loads);
        partial
    }
}

struct Search<'a, 'b> {
    growth: f32,
    preconditioned: [&'a [f32]; 3],
    searches: &'b mut [&'a mut [f32]; 3],
    tile: usize,
    coarse: &'a Coarse,
}

impl Loops for Search<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        for (searches, preconditioned) in self.searches.iter_mut().zip(self.preconditioned) {
            for (search, &preconditioned) in searches.iter_mut().zip(preconditioned) {
                *search = preconditioned + self.growth * *search;
            }
        }
        self.coarse.prolong(self.tile, self.searches);
    }
}
