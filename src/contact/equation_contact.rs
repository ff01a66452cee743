//! A contact as a part of a step's implicit equation.

use glam::DVec3;

use super::augmented_lagrangian::PENALTY_FACTOR;
use super::corner_weights::{CornerWeights, MAX_FEATURE_NODES};
use super::gap::{Gap, GapSurface};
use crate::codec::saved;

/// A unilateral contact in the step's equation: penalty stiffness plus multiplier.
#[derive(Clone, Copy, Debug)]
pub(super) struct EquationContact {
    /// Nodes that move the feature.
    pub nodes: [u32; MAX_FEATURE_NODES],
    pub count: usize,
    pub corner_count: usize,
    pub corner_weights: Option<CornerWeights>,
    /// Positions of its corners without contact forces, m.
    pub free_corners: [DVec3; 3],
    pub surface: GapSurface,
    /// Lower bound of the gap, m; below 0 if the contact began inside the tool.
    pub min_gap: f64,
    /// Penalty stiffness, N/m.
    pub stiffness: f64,
    /// Lagrange multiplier: the force at the gap's lower bound, N.
    pub multiplier: f64,
    /// Fraction of the force that becomes the multiplier. It is below 1 for a compliant contact, whose pinned nodes
    /// cannot leave the tool.
    pub retention: f64,
    /// True if the contact may pull. The first solve treats a contact that pushed before as bilateral, since a node
    /// without it might separate from the tool for once.
    pub may_pull: bool,
    /// True if it pushed in the last equation.
    pub was_active: bool,
    /// Response at the last evaluated positions.
    pub response: ContactResponse,
    /// True if it pushed when the active set was last compared.
    pub was_pushing: bool,
    /// Indices of its nodes' friction.
    pub friction: [Option<usize>; MAX_FEATURE_NODES],
}

saved! { EquationContact {
    nodes, count, corner_count, corner_weights, free_corners, surface, min_gap, stiffness, multiplier, retention, may_pull, was_active, response, was_pushing,
    friction,
} }

/// Force and stiffness of a contact for given node positions.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ContactResponse {
    pub gap: Gap,
    /// Along the normal, N.
    pub force: f64,
    /// Weight of each node in the force.
    pub shares: [f64; MAX_FEATURE_NODES],
    /// Stiffness matrix of the nodes' displacements along the normal, N/m.
    pub stiffness: [[f64; MAX_FEATURE_NODES]; MAX_FEATURE_NODES],
}

saved! { ContactResponse { gap, force, shares, stiffness } }

impl EquationContact {
    /// Evaluates the contact for these displacements of the nodes, m.
    pub fn respond(&self, displacement_of: impl Fn(usize) -> DVec3) -> ContactResponse {
        let mut corners = self.free_corners;
        for (corner, displacement) in corners.iter_mut().zip(self.corner_vectors(displacement_of)) {
            *corner += displacement;
        }
        let gap = self.surface.measure(&corners[..self.corner_count]);
        let mut force = self.multiplier + self.stiffness * (self.min_gap - gap.distance);
        if !self.may_pull {
            force = force.max(0.0);
        }
        let shares = self.spread_to_nodes(gap.weights);
        let mut stiffness = [[0.0; MAX_FEATURE_NODES]; MAX_FEATURE_NODES];
        if force != 0.0 {
            let neg_hessian = self.spread_to_nodes(gap.neg_hessian.map(|row| self.spread_to_nodes(row)));
            for (row, entries) in stiffness.iter_mut().enumerate() {
                for (column, entry) in entries.iter_mut().enumerate() {
                    *entry = self.stiffness * shares[row] * shares[column] + force.max(0.0) * neg_hessian[row][column];
                }
            }
        }
        ContactResponse {
            gap,
            force,
            shares,
            stiffness,
        }
    }

    /// Returns how much an updated multiplier would change the force, N.
    pub fn multiplier_error(&self, displacement_of: impl Fn(usize) -> DVec3) -> f64 {
        let updated = Self {
            multiplier: self.retention * self.response.force,
            ..*self
        };
        updated.respond(displacement_of).force - self.response.force
    }

    /// Returns the stiffness of its nodes without the contact (N/m), given the relaxation of its constraint.
    pub fn resistance(&self, relaxation: f32) -> f64 {
        self.stiffness / f64::from(PENALTY_FACTOR * relaxation)
    }

    /// Interpolates vectors of its nodes to its corners.
    pub fn corners(&self, vectors: [DVec3; MAX_FEATURE_NODES]) -> [DVec3; 3] {
        let [a, b, c, _] = vectors;
        let Some(corner_weights) = &self.corner_weights else {
            return [a, b, c];
        };
        corner_weights.map(|tie| {
            let terms = vectors.iter().zip(tie);
            terms.map(|(&vector, weight)| vector * f64::from(weight)).sum()
        })
    }

    pub fn corner_vectors(&self, vector_of: impl Fn(usize) -> DVec3) -> [DVec3; 3] {
        let mut vectors = [DVec3::ZERO; MAX_FEATURE_NODES];
        for (vector, &node) in vectors.iter_mut().zip(&self.nodes).take(self.count) {
            *vector = vector_of(node as usize);
        }
        self.corners(vectors)
    }

    /// Transposed interpolation: distributes values of the corners to the nodes.
    fn spread_to_nodes<T: Distribute>(&self, of_corners: [T; 3]) -> [T; MAX_FEATURE_NODES] {
        let Some(corner_weights) = &self.corner_weights else {
            let [a, b, c] = of_corners;
            return [a, b, c, T::default()];
        };
        let mut sums = [T::default(); MAX_FEATURE_NODES];
        for (tie, of_corner) in corner_weights.iter().zip(of_corners) {
            for (sum, &weight) in sums.iter_mut().zip(tie) {
                sum.add(of_corner, f64::from(weight));
            }
        }
        sums
    }

    /// Returns the normal component of the vectors' weighted sum.
    pub fn weighted(&self, vector_of: impl Fn(usize) -> DVec3) -> f64 {
        let nodes = self.nodes.iter().zip(self.response.shares).take(self.count);
        let sum: DVec3 = nodes.map(|(&node, share)| vector_of(node as usize) * share).sum();
        sum.dot(self.response.gap.normal)
    }

    /// Returns the product of the stiffness with the vectors, for each node along the normal.
    pub fn products(&self, vector_of: impl Fn(usize) -> DVec3) -> [f64; MAX_FEATURE_NODES] {
        let mut products = [0.0; MAX_FEATURE_NODES];
        for (column, &node) in self.nodes.iter().enumerate().take(self.count) {
            let along = vector_of(node as usize).dot(self.response.gap.normal);
            for (product, row) in products.iter_mut().zip(&self.response.stiffness) {
                *product += row[column] * along;
            }
        }
        products
    }

    pub fn distribute(&self, response: &ContactResponse, force: f64, add: &mut impl FnMut(usize, DVec3)) {
        for (&node, share) in self.nodes.iter().zip(response.shares).take(self.count) {
            if share > 0.0 && force != 0.0 {
                add(node as usize, response.gap.normal * (force * share));
            }
        }
    }
}

/// A value that corners distribute to their nodes.
trait Distribute: Copy + Default {
    fn add(&mut self, other: Self, weight: f64);
}

impl Distribute for f64 {
    fn add(&mut self, other: Self, weight: f64) {
        *self += other * weight;
    }
}

impl Distribute for [f64; MAX_FEATURE_NODES] {
    fn add(&mut self, other: Self, weight: f64) {
        for (sum, other) in self.iter_mut().zip(other) {
            *sum += other * weight;
        }
    }
}
