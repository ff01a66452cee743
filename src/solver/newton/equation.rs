//! Objective function: `Phi(s) = sum (c s² / 2 - b s) + E(x + s)`, where E is the internal energy.
//!
//! In a step with coefficient t, c is `m/t² + gamma/t` and b contains all forces that do not depend on s. In static
//! equilibrium, c is 0. Spring damping has such a potential, too, if the spring directions are fixed; each iteration
//! updates them.

use glam::{DMat3, DVec3};

use super::matrix::Matrix;
use super::sparsity::{Element, PAIRS, Sparsity, Tetrahedron};
use crate::base::{Result, memory, outer, trace};
use crate::codec::saved;
use crate::contact::ContactMultipliers;
use crate::elements::DeformedTet;
use crate::nodes::Pins;
use crate::solver::masked_axes::mask_axes;
use crate::springs::Link;

/// Objective function and current state.
#[derive(Debug)]
pub(super) struct Equation {
    /// x, positions for s = 0, m.
    pub predicted_positions: Vec<DVec3>,
    /// s, m; 0 for held nodes.
    pub displacements: Vec<DVec3>,
    /// c, N/m.
    pub inertia: Vec<f64>,
    /// b, N.
    pub loads: Vec<DVec3>,
    /// Masses, kg; 0 for held nodes.
    pub masses: Vec<f64>,
    /// Velocities for s = 0, m/s. They are used by spring damping only.
    pub predicted_velocities: Vec<DVec3>,
    /// Contact constraints of tools.
    pub multipliers: ContactMultipliers,
    /// Pins, borrowed from the body during a solve. Displacements along held axes are 0.
    pub pins: Pins,
    /// Velocity per displacement, 1/s; 0 without damping.
    pub rate: f64,
    /// Nodal pressures of rings, Pa, at the displacements of the last forces and matrices.
    pressures: Vec<f64>,
    /// Gradient of each tetrahedron's volume at its corners, m², at the same displacements.
    volume_gradients: Vec<[DVec3; 4]>,
}

saved! { Equation {
    predicted_positions, displacements, inertia, loads, masses, predicted_velocities, multipliers, pins, rate, pressures,
    volume_gradients,
} }

/// Share of the ring stiffness in the factor, relative to tetrahedra that keep their volumes individually.
const RING_STIFFNESS_SHARE: f32 = 0.05;

/// Kind of matrix to assemble.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum HessianKind {
    /// All second derivatives.
    Exact,
    /// Without the lateral softening of compressed springs: positive semidefinite.
    Clamped,
    /// `Clamped`, restricted to the sparsity pattern, for the factor.
    Factor,
}

/// State of a spring.
struct CurrentSpring {
    edge: DVec3,
    length: f64,
    direction: DVec3,
    /// Rate of elongation, m/s.
    speed: f64,
}

impl Equation {
    /// Creates the equation for these numbers of nodes, of rings, and of tetrahedra in rings.
    pub fn new(node_count: usize, ring_count: usize, member_count: usize) -> Result<Self> {
        let vectors = || memory::filled(DVec3::ZERO, node_count);
        Ok(Self {
            predicted_positions: vectors()?,
            displacements: vectors()?,
            inertia: memory::filled(0.0, node_count)?,
            loads: vectors()?,
            masses: memory::filled(0.0, node_count)?,
            predicted_velocities: vectors()?,
            multipliers: ContactMultipliers::default(),
            pins: Pins::default(),
            rate: 0.0,
            pressures: memory::filled(0.0, ring_count)?,
            volume_gradients: memory::reserved(member_count)?,
        })
    }

    #[inline(always)]
    pub fn is_free(&self, node: usize) -> bool {
        self.masses[node] > 0.0
    }

    /// Components of a node's vector along free axes.
    #[inline]
    pub fn free_part(&self, node: usize, vector: DVec3) -> DVec3 {
        if self.is_free(node) {
            DVec3::select(self.pins.partial_axes_of(node as u32), DVec3::ZERO, vector)
        } else {
            DVec3::ZERO
        }
    }

    #[inline(always)]
    pub fn position(&self, node: usize) -> DVec3 {
        self.predicted_positions[node] + self.displacements[node]
    }

    /// Largest extent of the nodes along an axis, m.
    pub fn extent(&self) -> f64 {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for node in 0..self.predicted_positions.len() {
            low = low.min(self.position(node));
            high = high.max(self.position(node));
        }
        (high - low).max_element()
    }

    /// Computes minus the gradient, N: the force on each node, including held ones.
    pub fn residuals(&mut self, sparsity: &Sparsity, residuals: &mut [DVec3]) {
        self.find_pressures(sparsity);
        for (node, residual) in residuals.iter_mut().enumerate() {
            *residual = self.loads[node] - self.displacements[node] * self.inertia[node];
        }
        for (_, node, link) in sparsity.springs() {
            let spring = self.spring(node, link);
            let pull = stiffness(link) * (spring.length - rest_length(link)) + damping(link) * spring.speed;
            let force = spring.direction * pull;
            residuals[node] += force;
            residuals[link.neighbor as usize] -= force;
        }
        for element in sparsity.tetrahedra() {
            let tetrahedron = element.of;
            let deformed = self.deformed(&element).with_mean_pressure(&self.pressures, tetrahedron);
            for (corner, gradient) in tetrahedron.corners.into_iter().zip(tetrahedron.rest.gradients()) {
                residuals[corner] += deformed.force(gradient);
            }
        }
        let at = |node: usize| self.position(node);
        sparsity
            .non_spring
            .visit_forces(&at, &mut |node, force| residuals[node] += force);
        let displacement = |node: usize| self.displacements[node];
        self.multipliers.visit_forces(displacement, |node, force| {
            residuals[node] += self.free_part(node, force)
        });
    }

    /// Returns the change of the function for the displacement `fraction * corrections`, and the sum of the magnitudes
    /// of its terms, J. Each term is computed without differences of large sums.
    pub fn change(&self, sparsity: &Sparsity, corrections: &[DVec3], fraction: f64) -> [f64; 2] {
        let mut sums = [0.0; 2];
        let mut add = |change: f64| {
            sums[0] += change;
            sums[1] += change.abs();
        };
        for (node, &correction) in corrections.iter().enumerate() {
            let (displacement, inertia) = (correction * fraction, self.inertia[node]);
            add(displacement.dot(self.displacements[node] * inertia - self.loads[node])
                + 0.5 * inertia * displacement.length_squared());
        }
        for (_, node, link) in sparsity.springs() {
            let neighbor = link.neighbor as usize;
            let spring = self.spring(node, link);
            let edge_change = (corrections[neighbor] - corrections[node]) * fraction;
            let new_edge = spring.edge + edge_change;
            let length_sum = spring.length + new_edge.length();
            if length_sum > 0.0 {
                let elongation = edge_change.dot(spring.edge + new_edge) / length_sum;
                add(0.5 * stiffness(link) * elongation * (length_sum - 2.0 * rest_length(link)));
            }
            let along = edge_change.dot(spring.direction);
            add(0.5 * damping(link) * along * (2.0 * spring.speed + self.rate * along));
        }
        for element in sparsity.tetrahedra() {
            let tetrahedron = element.of;
            let edge_changes = edges(&tetrahedron.corners, |node| corrections[node] * fraction);
            let [strain_change, volume_change, load_change, _] =
                self.deformed(&element).change(&tetrahedron.rest, edge_changes);
            add(strain_change);
            add(volume_change);
            add(load_change);
        }
        for node in 0..sparsity.ring_count() {
            let (mut volume_change, mut increment) = (0.0, 0.0);
            for element in sparsity.ring(node) {
                let tetrahedron = element.of;
                let deformed = self.deformed(&element);
                volume_change += 0.25 * deformed.volume_change();
                let edge_changes = edges(&tetrahedron.corners, |node| corrections[node] * fraction);
                increment += 0.25 * deformed.change(&tetrahedron.rest, edge_changes)[3];
            }
            let volume = sparsity.volumes[node];
            if volume > 0.0 {
                add(0.5 * sparsity.kappa() / volume * increment * (2.0 * volume_change + increment));
                add(sparsity.ring_load(node) * increment);
            }
        }
        let (displacement, increment) = (
            |node: usize| self.displacements[node],
            |node: usize| corrections[node] * fraction,
        );
        sparsity
            .non_spring
            .visit_changes(&|node| self.position(node), &increment, &mut add);
        self.multipliers.visit_energy_changes(displacement, increment, add);
        sums
    }

    /// Assembles the second derivatives plus `shift` (1/s²) times the masses.
    pub fn assemble(&mut self, sparsity: &Sparsity, kind: HessianKind, shift: f64, matrix: &mut Matrix) {
        self.find_pressures(sparsity);
        for (node, block) in matrix.diagonal.iter_mut().enumerate() {
            *block = if self.is_free(node) {
                DMat3::from_diagonal(DVec3::splat(self.inertia[node] + shift * self.masses[node]))
            } else {
                DMat3::IDENTITY
            };
        }
        matrix.off_diagonal.resize(sparsity.pair_count(), DMat3::ZERO);
        for (index, node, link) in sparsity.springs() {
            let neighbor = link.neighbor as usize;
            let block = self.stiffness_of(node, link, kind);
            for end in [node, neighbor] {
                if self.is_free(end) {
                    matrix.diagonal[end] += block;
                }
            }
            let joins = self.is_free(node) && self.is_free(neighbor);
            matrix.off_diagonal[index] = if joins { -block } else { DMat3::ZERO };
        }
        for element in sparsity.tetrahedra() {
            self.add_tetrahedron(element, kind, matrix);
        }
        self.add_terms(sparsity, kind, matrix);
        if kind == HessianKind::Exact {
            self.add_pressure(sparsity, matrix);
        }
        self.multipliers.visit_blocks(|node, block| {
            if self.is_free(node) {
                matrix.diagonal[node] += symmetric_matrix(block);
            }
        });
        if self.pins.are_partial() {
            self.remove_held_axes(sparsity, matrix);
        }
    }

    /// Removes the rows and columns of held axes. Their diagonal entries remain positive.
    fn remove_held_axes(&self, sparsity: &Sparsity, matrix: &mut Matrix) {
        let held = |node: usize| self.pins.partial_axes_of(node as u32);
        for node in 0..sparsity.node_count() {
            for index in sparsity.row(node) {
                let nodes = [node, sparsity.neighbor(index)];
                matrix.off_diagonal[index] = mask_axes(matrix.off_diagonal[index], nodes.map(held));
            }
        }
        for pin in self.pins.partial() {
            let block = &mut matrix.diagonal[pin.node as usize];
            *block = mask_axes(*block, [pin.axes; 2]);
            let size = trace(block);
            let size = if size > 0.0 { size } else { 1.0 };
            *block += DMat3::from_diagonal(DVec3::select(pin.axes, DVec3::splat(size), DVec3::ZERO));
        }
    }

    fn add_tetrahedron(&self, mut element: Element, kind: HessianKind, matrix: &mut Matrix) {
        let (law, tetrahedron) = (&mut element.law, element.of);
        if kind == HessianKind::Factor && law.nodal_pressure {
            law.nodal_pressure = false;
            law.kappa *= RING_STIFFNESS_SHARE;
        }
        let deformed = self.deformed(&element);
        let gradients = tetrahedron.rest.gradients();
        let with_pressure = deformed.with_mean_pressure(&self.pressures, tetrahedron);
        let stiffness = |a: usize, b: usize| match kind {
            HessianKind::Exact => with_pressure.stiffness(gradients[a], gradients[b]),
            HessianKind::Clamped | HessianKind::Factor => deformed.clamped_stiffness(gradients[a], gradients[b]),
        };
        let corners = tetrahedron.corners;
        for corner in (0..4).filter(|&corner| self.is_free(corners[corner])) {
            matrix.diagonal[corners[corner]] += stiffness(corner, corner);
        }
        for ([a, b], index) in PAIRS.into_iter().zip(tetrahedron.pair_indices) {
            if self.is_free(corners[a]) && self.is_free(corners[b]) {
                let (high, low) = if corners[a] > corners[b] { (a, b) } else { (b, a) };
                matrix.off_diagonal[index] += stiffness(high, low);
            }
        }
    }

    fn add_terms(&self, sparsity: &Sparsity, kind: HessianKind, matrix: &mut Matrix) {
        let (at, is_exact) = (|node: usize| self.position(node), kind == HessianKind::Exact);
        sparsity.non_spring.visit_blocks(&at, is_exact, &mut |nodes, blocks| {
            if kind == HessianKind::Factor && nodes.len() > 2 {
                self.add_pairs(sparsity, nodes, blocks, matrix);
                return;
            }
            for (a, &node_a) in nodes.iter().enumerate() {
                if !self.is_free(node_a as usize) {
                    continue;
                }
                matrix.diagonal[node_a as usize] += blocks[a][a];
                for (b, &node_b) in nodes.iter().enumerate() {
                    if node_b < node_a && self.is_free(node_b as usize) {
                        matrix.off_diagonal[sparsity.pair_index([node_a, node_b])] += blocks[a][b];
                    }
                }
            }
        });
    }

    /// Adds the coupling by pressure on a rotating surface. It is indefinite, so the clamped matrix has none of it.
    fn add_pressure(&self, sparsity: &Sparsity, matrix: &mut Matrix) {
        let at = |node: usize| self.position(node);
        sparsity.non_spring.visit_pressure_blocks(&at, &mut |[a, b], block| {
            if self.is_free(a as usize) && self.is_free(b as usize) {
                matrix.off_diagonal[sparsity.pair_index([a, b])] += if a > b { block } else { block.transpose() };
            }
        });
    }

    /// Adds a term of several nodes to the matrix for the factor, as springs between nodes that attract each other.
    /// With repulsive couplings the incomplete factor could be arbitrarily bad.
    fn add_pairs(&self, sparsity: &Sparsity, nodes: &[u32], blocks: &[[DMat3; 4]; 4], matrix: &mut Matrix) {
        for (a, &node_a) in nodes.iter().enumerate() {
            for (b, &node_b) in nodes[..a].iter().enumerate() {
                let [x, y, z] = [0, 1, 2].map(|axis| blocks[a][b].col(axis)[axis]);
                let stiffness = -(x + y + z) / 3.0;
                if !(stiffness > 0.0) {
                    continue;
                }
                let block = DMat3::from_diagonal(DVec3::splat(stiffness));
                let ends = [node_a, node_b].map(|node| node as usize);
                for end in ends.into_iter().filter(|&end| self.is_free(end)) {
                    matrix.diagonal[end] += block;
                }
                if ends.into_iter().all(|end| self.is_free(end)) {
                    matrix.off_diagonal[sparsity.pair_index([node_a, node_b])] -= block;
                }
            }
        }
    }

    /// Updates the ring pressures and volume gradients to the current displacements.
    fn find_pressures(&mut self, sparsity: &Sparsity) {
        if self.pressures.is_empty() {
            return;
        }
        self.pressures.fill(0.0);
        self.volume_gradients.clear();
        for element in sparsity.tetrahedra() {
            let (deformed, tetrahedron) = (self.deformed(&element), element.of);
            for corner in tetrahedron.corners {
                self.pressures[corner] += 0.25 * deformed.volume_change();
            }
            let volume_gradients = tetrahedron.rest.gradients().map(|gradient| deformed.area(gradient));
            self.volume_gradients.push(volume_gradients);
        }
        sparsity.convert_to_pressures(&mut self.pressures);
        for (node, pressure) in self.pressures.iter_mut().enumerate() {
            *pressure += sparsity.ring_load(node);
        }
    }

    /// Adds the ring part of products with the matrix. `changes` is scratch space.
    fn add_ring_products(&self, sparsity: &Sparsity, vectors: &[DVec3], products: &mut [DVec3], changes: &mut [f64]) {
        changes.fill(0.0);
        let tetrahedra = || {
            sparsity
                .tetrahedra()
                .map(|element| element.of.corners)
                .zip(&self.volume_gradients)
        };
        for (corners, volume_gradients) in tetrahedra() {
            let volume_change = |(corner, area): (usize, &DVec3)| 0.25 * area.dot(vectors[corner]);
            let growth: f64 = corners.into_iter().zip(volume_gradients).map(volume_change).sum();
            for corner in corners {
                changes[corner] += growth;
            }
        }
        sparsity.convert_to_pressures(changes);
        for (corners, volume_gradients) in tetrahedra() {
            let change: f64 = corners.iter().map(|&corner| 0.25 * changes[corner]).sum();
            for (corner, area) in corners.into_iter().zip(volume_gradients) {
                products[corner] += self.free_part(corner, *area * change);
            }
        }
    }

    fn deformed(&self, element: &Element) -> DeformedTet {
        let edges = edges(&element.of.corners, |node| self.position(node));
        DeformedTet::new(element.law, &element.of.rest, edges).with_extra_stress(element.load)
    }

    /// Updates contact forces to the current displacements, for the matrix.
    pub fn update_contacts(&mut self) {
        let displacements = &self.displacements;
        self.multipliers.evaluate(|node| displacements[node]);
    }

    /// Adds the parts of products that the assembled matrix lacks: rings, cavities, and off-diagonal blocks of
    /// contacts. `changes` has one entry per ring.
    pub fn add_products(&self, sparsity: &Sparsity, vectors: &[DVec3], products: &mut [DVec3], changes: &mut [f64]) {
        if !changes.is_empty() {
            self.add_ring_products(sparsity, vectors, products, changes);
        }
        let at = |node: usize| self.position(node);
        sparsity.non_spring.visit_products(&at, vectors, &mut |node, product| {
            products[node] += self.free_part(node, product);
        });
        let vector = |node: usize| vectors[node];
        self.multipliers.visit_products(vector, |node, product| {
            products[node] += self.free_part(node, product);
        });
        self.multipliers.visit_blocks(|node, block| {
            products[node] -= self.free_part(node, symmetric_matrix(block) * vectors[node]);
        });
    }

    /// Stiffness matrix of a spring, `x n n^T + y I`.
    fn stiffness_of(&self, node: usize, link: &Link, kind: HessianKind) -> DMat3 {
        let CurrentSpring {
            length,
            direction,
            speed,
            ..
        } = self.spring(node, link);
        let (stiffness, rest_length) = (stiffness(link), rest_length(link));
        let mut across = if rest_length == 0.0 {
            stiffness
        } else if length > 0.0 {
            stiffness * (1.0 - rest_length / length)
        } else {
            // Coincident ends have no lateral direction.
            0.0
        };
        if length > 0.0 {
            across += damping(link) * speed / length;
        }
        if kind != HessianKind::Exact {
            across = across.max(0.0);
        }
        let along = stiffness + damping(link) * self.rate - across;
        outer(direction, direction) * along + DMat3::from_diagonal(DVec3::splat(across))
    }

    /// Returns the potential energy of springs, elements, terms, cavities and loads, J. The coordinates are relative to
    /// `origin`.
    pub fn potential(&mut self, sparsity: &Sparsity, origin: DVec3) -> f64 {
        let elastic: f64 = sparsity
            .springs()
            .map(|(_, node, link)| 0.5 * stiffness(link) * (self.spring(node, link).length - rest_length(link)).powi(2))
            .sum();
        let mut element_energy: f64 = sparsity
            .tetrahedra()
            .map(|element| self.deformed(&element).energy())
            .sum();
        self.find_pressures(sparsity);
        for (pressure, volume) in self.pressures.iter().zip(&sparsity.volumes) {
            element_energy += 0.5 * pressure * pressure * volume / sparsity.kappa();
        }
        let [term_energy, stored, work] = sparsity.non_spring.energy(&|node| self.position(node));
        let loads = self.loads.iter().enumerate();
        elastic + element_energy + term_energy + stored
            - work
            - loads
                .map(|(node, load)| load.dot(self.position(node) + origin))
                .sum::<f64>()
    }

    #[inline(always)]
    fn spring(&self, node: usize, link: &Link) -> CurrentSpring {
        let neighbor = link.neighbor as usize;
        let edge = self.position(neighbor) - self.position(node);
        let length = edge.length();
        // If the ends coincide, the direction is along x, from the node with the lower number, which is the neighbor.
        let direction = if length > 0.0 { edge / length } else { DVec3::NEG_X };
        let speed = if self.rate > 0.0 {
            let velocity = self.predicted_velocities[neighbor] - self.predicted_velocities[node]
                + (self.displacements[neighbor] - self.displacements[node]) * self.rate;
            velocity.dot(direction)
        } else {
            0.0
        };
        CurrentSpring {
            edge,
            length,
            direction,
            speed,
        }
    }
}

impl DeformedTet {
    /// Applies the mean pressure of the corners, if there are ring pressures, Pa.
    fn with_mean_pressure(self, pressures: &[f64], tetrahedron: &Tetrahedron) -> Self {
        if pressures.is_empty() {
            return self;
        }
        let pressures = tetrahedron.corners.map(|corner| 0.25 * pressures[corner]);
        self.with_pressure(pressures.iter().sum())
    }
}

/// Edges from the first corner to the others.
fn edges([a, b, c, d]: &[usize; 4], at: impl Fn(usize) -> DVec3) -> DMat3 {
    let first = at(*a);
    DMat3::from_cols(at(*b) - first, at(*c) - first, at(*d) - first)
}

fn stiffness(link: &Link) -> f64 {
    f64::from(link.stiffness)
}

fn rest_length(link: &Link) -> f64 {
    f64::from(link.rest_length)
}

fn damping(link: &Link) -> f64 {
    f64::from(link.damping)
}

fn symmetric_matrix([xx, yy, zz, yz, zx, xy]: [f64; 6]) -> DMat3 {
    DMat3::from_cols_array(&[xx, xy, zx, xy, yy, yz, zx, yz, zz])
}
