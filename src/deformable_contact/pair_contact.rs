//! A contact between two deformable bodies, or of a body with itself.

use glam::{BVec3, Vec3, Vec3A};

use super::collision_surface::CollisionSurface;
use crate::codec::saved;
use crate::contact::corner_weights::MAX_FEATURE_NODES;
use crate::contact::sweep_control::LEVERAGE;
use crate::contact::time_of_impact::Separation;
use crate::solver::System;

/// A point on a node, edge or face of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ContactSide {
    /// Body index.
    pub body: usize,
    /// Corners of the feature. Unused corners have weight 0.
    pub nodes: [u32; 3],
    pub weights: [f32; 3],
}

saved! { ContactSide { body, nodes, weights } }

/// The two features of a contact, without the points on them.
pub(super) type ContactKey = [(usize, [u32; 3]); 2];

/// Maximum fraction of the penetration depth that a contact corrects in a substep. With more, a body that rests on a
/// tip trembles.
const CORRECTION_FRACTION: f32 = 0.05;

/// A contact in one substep: the first side stays outside the second.
#[derive(Clone, Copy, Debug)]
pub(super) struct PairContact {
    pub sides: [ContactSide; 2],
    /// Unit vector from the second side to the first.
    pub normal: Vec3,
    /// Lower bound of the mean relative normal velocity of the first side, m/s.
    pub target_velocity: f32,
    /// Penetration depth at the start of the substep, m; negative is a gap.
    pub depth: f32,
    /// True if both sides were one before a cut separated them.
    pub is_cut_apart: bool,
    /// True if the sides only come near. Contacts that touch replace it if memory is short.
    pub is_speculative: bool,
    pub friction: f32,
    /// Simulation nodes that move each side, and their numbers. They differ from the corners of the side if the side is
    /// bound to other nodes.
    movers: [[Mover; MAX_FEATURE_NODES]; 2],
    counts: [u32; 2],
    effective_mass: f32,
    /// Normal impulse so far, N s.
    impulse: f32,
    friction_impulse: Vec3,
    /// Normal impulse from the warm start, N s.
    warm_start_impulse: f32,
    /// Accumulated position correction, which does not change velocities, kg m.
    correction: f32,
}

saved! { PairContact {
    sides, normal, target_velocity, depth, is_cut_apart, is_speculative, friction, movers, counts, effective_mass,
    impulse, friction_impulse, warm_start_impulse, correction,
} }

/// A simulation node that moves a side of a contact.
#[derive(Clone, Copy, Debug, Default)]
struct Mover {
    node: u32,
    /// Weight of the node in the side's point.
    weight: f32,
    /// Change of the node's velocity per impulse on the side, 1/kg.
    weighted_inverse_mass: Vec3A,
}

saved! { Mover { node, weight, weighted_inverse_mass } }

impl ContactSide {
    /// Returns the side for a node of a body.
    pub fn of_node(body: usize, node: u32) -> Self {
        Self {
            body,
            nodes: [node; 3],
            weights: [1.0, 0.0, 0.0],
        }
    }

    /// Returns the sides for the closest points of two edges of these bodies.
    pub fn of_edges(bodies: [usize; 2], edges: [[u32; 2]; 2], separation: &Separation) -> [Self; 2] {
        let weights = [[1.0 - separation.along, separation.along, 0.0], separation.weights];
        std::array::from_fn(|side| {
            let [from, to] = edges[side];
            Self {
                body: bodies[side],
                nodes: [from, to, to],
                weights: weights[side],
            }
        })
    }

    /// Returns the feature, without the point on it.
    pub fn key(&self) -> (usize, [u32; 3]) {
        (self.body, self.nodes)
    }

    /// Returns the simulation nodes that move the point, with weights: its corners, or the nodes that they are bound
    /// to.
    fn movers(&self, body: &System) -> [(u32, f32); MAX_FEATURE_NODES] {
        let mut movers = [(0, 0.0); MAX_FEATURE_NODES];
        let own_nodes = self.nodes.into_iter().zip(self.weights);
        let Some(bindings) = &body.bindings else {
            movers
                .iter_mut()
                .zip(own_nodes)
                .for_each(|(mover, own_nodes)| *mover = own_nodes);
            return movers;
        };
        let mut count = 0;
        for (node, weight) in own_nodes.filter(|(_, weight)| *weight > 0.0) {
            for (node, bound_weight) in bindings.weighted_nodes(node) {
                let known_index = movers[..count].iter().position(|mover| mover.0 == node);
                // A triangle lies in one cell, so there is a free entry. If there were none, the sum of weights would
                // still be right.
                let mover_index = known_index.unwrap_or(count.min(MAX_FEATURE_NODES - 1));
                count = count.max(mover_index + 1);
                movers[mover_index] = (node, movers[mover_index].1 + weight * bound_weight);
            }
        }
        movers
    }

    /// Returns the weighted mean of a vector over the corners.
    pub fn weighted(&self, vector_of: impl Fn(u32) -> Vec3) -> Vec3 {
        let used = self
            .nodes
            .into_iter()
            .zip(self.weights)
            .filter(|(_, weight)| *weight > 0.0);
        used.map(|(node, weight)| vector_of(node) * weight).sum()
    }
}

impl PairContact {
    /// Creates a contact without impulse; `None` if neither side can move.
    pub fn new(sides: [ContactSide; 2], normal: Vec3, bodies: [&System; 2]) -> Option<Self> {
        let (mut inverse_mass, mut leverage) = (0.0, 0.0_f32);
        let (mut movers, mut counts) = ([[Mover::default(); MAX_FEATURE_NODES]; 2], [0; 2]);
        for side in 0..2 {
            let body = bodies[side];
            let weighted_nodes = sides[side].movers(body).into_iter().filter(|(_, weight)| *weight > 0.0);
            for (mover, (node, weight)) in movers[side].iter_mut().zip(weighted_nodes) {
                let mobility = body.inverse_masses[node as usize] * weight;
                let pinned_axes: BVec3 = body.pins.partial_axes_of(node);
                let weighted_inverse_mass = Vec3::select(pinned_axes, Vec3::ZERO, Vec3::splat(mobility));
                *mover = Mover {
                    node,
                    weight,
                    weighted_inverse_mass: weighted_inverse_mass.into(),
                };
                inverse_mass += weight * (weighted_inverse_mass * normal).dot(normal);
                leverage = leverage.max(mobility / LEVERAGE);
                counts[side] += 1;
            }
        }
        (inverse_mass > 0.0).then(|| Self {
            sides,
            normal,
            target_velocity: 0.0,
            depth: 0.0,
            is_cut_apart: false,
            is_speculative: false,
            friction: 0.0,
            movers,
            counts,
            effective_mass: 1.0 / inverse_mass.max(leverage),
            impulse: 0.0,
            friction_impulse: Vec3::ZERO,
            warm_start_impulse: 0.0,
            correction: 0.0,
        })
    }

    /// Sets the gap at the start of the substep, m. A positive gap may close within `duration` seconds; a negative one
    /// may not deepen.
    pub fn set_gap(&mut self, gap: f32, duration: f32) {
        self.depth = -gap;
        self.target_velocity = self.gap_velocity(duration);
    }

    /// Returns the normal velocity that closes the gap, m/s; 0 if the sides penetrate.
    pub fn gap_velocity(&self, duration: f32) -> f32 {
        self.depth.min(0.0) / duration
    }

    /// Raises the target velocity by the gap that is lost because the normal turns, m.
    pub fn raise_target_velocity(&mut self, lost_gap: f32, duration: f32) {
        self.target_velocity = self.gap_velocity(duration) + lost_gap.max(0.0) / duration;
    }

    /// True if the contact has a normal impulse.
    pub fn is_pressing(&self) -> bool {
        self.impulse > 0.0
    }

    /// Solves the contact once by projected Gauss-Seidel. Returns the change of the relative velocity, m/s.
    pub fn solve(&mut self, surfaces: &mut [Option<CollisionSurface>]) -> f32 {
        let velocity = self.velocity(surfaces);
        let impulse =
            (self.impulse + (self.target_velocity - velocity.dot(self.normal)) * self.effective_mass).max(0.0);
        if impulse == 0.0 && self.impulse == 0.0 {
            return 0.0;
        }
        let mut impulse_change = self.normal * (impulse - self.impulse);
        self.impulse = impulse;
        let slip = velocity.reject_from_normalized(self.normal);
        let trial_friction = self.friction_impulse - slip * self.effective_mass;
        let friction = trial_friction.clamp_length_max(self.friction * impulse);
        impulse_change += friction - self.friction_impulse;
        self.friction_impulse = friction;
        if impulse_change != Vec3::ZERO {
            self.apply(impulse_change, surfaces, |surface| &mut surface.velocities);
        }
        impulse_change.length() / self.effective_mass
    }

    /// Adds the response of the contact's nodes to an impulse to their `values`.
    #[inline]
    fn apply(
        &self,
        impulse: Vec3,
        surfaces: &mut [Option<CollisionSurface>],
        values: impl Fn(&mut CollisionSurface) -> &mut Vec<Vec3A>,
    ) {
        let impulse = Vec3A::from(impulse);
        for (index, impulse) in [impulse, -impulse].into_iter().enumerate() {
            if let Some(surface) = &mut surfaces[self.sides[index].body] {
                let values = values(surface);
                for mover in self.movers_of(index) {
                    values[mover.node as usize] += impulse * mover.weighted_inverse_mass;
                }
            }
        }
    }

    /// Moves penetrating sides apart by at most `max_displacement`, m, in a substep of `duration` seconds. Sides that
    /// do not penetrate come no closer than their gap allows. [`CollisionSurface::predicted_velocities`] contains the
    /// displacements of nodes so far.
    ///
    /// Sides that a cut separated begin too close. Their correction is limited by the contact impulse, so that sides
    /// that nothing presses stay.
    pub fn correct_penetration(
        &mut self,
        max_displacement: f32,
        duration: f32,
        surfaces: &mut [Option<CollisionSurface>],
    ) {
        let displacement = self
            .relative_value(surfaces, |surface| &surface.predicted_velocities)
            .dot(self.normal);
        let target_displacement = if self.depth > 0.0 {
            max_displacement.min(CORRECTION_FRACTION * self.depth)
        } else if displacement < 0.0 {
            let speed = self.velocity(surfaces).dot(self.normal);
            (self.target_velocity - speed).min(0.0) * duration
        } else {
            return;
        };
        let mut correction = (self.correction + (target_displacement - displacement) * self.effective_mass).max(0.0);
        if self.depth > 0.0 {
            correction = correction.min(target_displacement * self.effective_mass);
        }
        if self.is_cut_apart {
            correction = correction.min(self.impulse * duration);
        }
        let increment = self.normal * (correction - self.correction);
        self.correction = correction;
        self.apply(increment, surfaces, |surface| &mut surface.predicted_velocities);
    }

    /// Returns the simulation nodes that move a side, with their weights.
    pub fn movers(&self, side: usize) -> impl Iterator<Item = (u32, f32)> + '_ {
        self.movers_of(side).iter().map(|mover| (mover.node, mover.weight))
    }

    fn movers_of(&self, side: usize) -> &[Mover] {
        &self.movers[side][..self.counts[side] as usize]
    }

    /// Returns the impulse on the first side, N s.
    pub fn total_impulse(&self) -> Vec3 {
        self.normal * self.impulse + self.friction_impulse
    }

    /// Returns the velocity of the first side relative to the second, m/s.
    #[inline]
    fn velocity(&self, surfaces: &[Option<CollisionSurface>]) -> Vec3 {
        self.relative_value(surfaces, |surface| &surface.velocities)
    }

    /// Returns the difference of a quantity of nodes between the first and the second side.
    #[inline]
    fn relative_value(
        &self,
        surfaces: &[Option<CollisionSurface>],
        values: impl Fn(&CollisionSurface) -> &[Vec3A],
    ) -> Vec3 {
        let [first, second] = [0, 1].map(|side| {
            surfaces[self.sides[side].body].as_ref().map_or(Vec3A::ZERO, |surface| {
                let (values, movers) = (values(surface), self.movers_of(side).iter());
                movers.map(|mover| values[mover.node as usize] * mover.weight).sum()
            })
        });
        (first - second).into()
    }

    /// Returns body index and node of all simulation nodes that move the two sides.
    pub fn all_movers(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        (0..2).flat_map(move |side| {
            self.movers(side)
                .map(move |(node, _)| (self.sides[side].body, node as usize))
        })
    }

    /// Returns the features of both sides, without the points on them.
    pub fn key(&self) -> ContactKey {
        self.sides.map(|side| side.key())
    }

    /// Sets the impulses from a warm start. [`apply_warm_start`](super::warm_start::apply_warm_start) applies them to
    /// nodes.
    pub fn set_impulses(&mut self, impulse: f32, friction: Vec3) {
        self.impulse = impulse;
        let friction = friction.reject_from_normalized(self.normal);
        self.friction_impulse = friction.clamp_length_max(self.friction * impulse);
    }

    /// Returns the impulses along the normal and across it, N s.
    pub fn impulses(&self) -> (f32, Vec3) {
        (self.impulse, self.friction_impulse)
    }

    /// Returns the work of the impulse at the current relative velocity, J, and the part of it that the target velocity
    /// allows.
    pub fn work(&self, surfaces: &[Option<CollisionSurface>]) -> [f32; 2] {
        let impulse_change = self.total_impulse();
        [
            impulse_change.dot(self.velocity(surfaces)),
            self.impulse * self.target_velocity,
        ]
    }

    /// Applies a fraction of the impulse to nodes.
    pub fn apply_fraction(&self, fraction: f32, surfaces: &mut [Option<CollisionSurface>]) {
        self.apply(self.total_impulse() * fraction, surfaces, |surface| {
            &mut surface.velocities
        });
    }

    /// Returns the fraction of the normal impulse that exceeds the warm start.
    pub fn new_fraction(&self) -> f32 {
        ((self.impulse - self.warm_start_impulse) / self.impulse).clamp(-1.0, 1.0)
    }

    /// Scales the warm-started impulses.
    pub fn scale_warm_start(&mut self, fraction: f32) {
        self.impulse *= fraction;
        self.warm_start_impulse = self.impulse;
        self.friction_impulse *= fraction;
    }

    /// Returns the change of relative velocity that the impulse alone causes, m/s.
    pub fn velocity_change(&self) -> f32 {
        self.total_impulse().length() / self.effective_mass
    }
}
