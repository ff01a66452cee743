//! Augmented Lagrangian for contacts that are part of a step's implicit equation (Hestenes 1969, Powell 1969).
//!
//! The equation includes the reaction of springs to a tool. Otherwise a step would let springs push tissue into the
//! tool and stop it only afterwards, with too small a force. Each contact pushes with a multiplier and a penalty
//! stiffness, and never pulls. Its force then becomes its multiplier. While multipliers are fixed, the equation
//! minimizes a convex function.
//!
//! [Friction](super::node_friction) is part of the equation too: an impulse after it would move nodes of stiff tissue
//! back against hardly any force. Contact impulses remove the penetration that remains.

use std::ops::Range;

use glam::{DVec3, Vec3};

use super::constraint::Constraint;
use super::corner_weights::{FeatureNodes, MAX_FEATURE_NODES};
use super::equation_contact::{ContactResponse, EquationContact};
use super::features::Feature;
use super::gap::Gap;
use super::node_friction::{FrictionMultipliers, NodeFriction, add};
use crate::base::{Result, StateHasher};
use crate::codec::saved;
use crate::nodes::{Bindings, Pins};

/// Penalty stiffness of a contact, relative to the stiffness of its nodes. A larger value makes multipliers converge
/// faster and worsens the conditioning.
pub(super) const PENALTY_FACTOR: f32 = 3.0;

/// Maximum number of nodes with friction in an equation. Friction of further nodes acts after the solve.
const MAX_FRICTION_NODES: usize = 1024;

/// A node's share of a contact.
#[derive(Clone, Copy, Debug)]
struct NodeShare {
    node: u32,
    contact: u32,
    /// Index of the node within the contact.
    index: usize,
}

saved! { NodeShare { node, contact, index } }

/// Force of a contact at the end of a step, from which the same contact begins in the next one.
#[derive(Clone, Copy, Debug)]
struct ContactWarmStart {
    /// Index of the tool in the world.
    slot: usize,
    feature: Feature,
    tip: u8,
    /// Normal force, N.
    force: f64,
    /// Friction force, N.
    friction: DVec3,
    /// Unit vector away from the tool.
    normal: Vec3,
    /// From the tool's position, m.
    arm: Vec3,
}

saved! { ContactWarmStart { slot, feature, tip, force, friction, normal, arm } }

/// The contacts of a body with all tools in the current equation.
#[derive(Debug, Default)]
pub(crate) struct ContactMultipliers {
    contacts: Vec<EquationContact>,
    /// Sorted by node.
    shares: Vec<NodeShare>,
    /// Tool, feature and tip of each contact, sorted.
    order: Vec<(usize, Feature, u8)>,
    /// Contact forces before the current equation and before the step, both sorted by tool, feature and tip.
    warm_starts: Vec<ContactWarmStart>,
    committed: Vec<ContactWarmStart>,
    friction_multipliers: FrictionMultipliers,
}

saved! { ContactMultipliers { contacts, shares, order, warm_starts, committed, friction_multipliers } }

impl ContactMultipliers {
    /// Reserves memory for `count` contacts and the friction of their nodes.
    pub fn reserve(&mut self, count: usize) -> Result<()> {
        self.contacts.try_reserve(count.saturating_sub(self.contacts.len()))?;
        let shares = MAX_FEATURE_NODES * count;
        self.shares.try_reserve(shares.saturating_sub(self.shares.len()))?;
        self.order.try_reserve(count.saturating_sub(self.order.len()))?;
        for starts in [&mut self.warm_starts, &mut self.committed] {
            starts.try_reserve(count.saturating_sub(starts.len()))?;
        }
        self.friction_multipliers.reserve(count.min(MAX_FRICTION_NODES))
    }

    /// Removes all contacts and restores the forces from before the step.
    pub fn begin_step(&mut self) {
        self.clear();
        self.warm_starts.clone_from(&self.committed);
        self.friction_multipliers.begin_step();
    }

    /// Stores the current forces of the contacts as the start of the next equation.
    pub(super) fn update_warm_starts(&mut self, constraints: &[Constraint], slot_of: impl Fn(usize) -> usize) {
        self.friction_multipliers.update_warm_starts();
        self.warm_starts.clear();
        for (index, (contact, constraint)) in self.contacts.iter().zip(constraints).enumerate() {
            if contact.response.force > 0.0 {
                let feature = constraint.feature.part(contact.response.gap.weights);
                let is_whole = feature.nodes().len() == constraint.feature.nodes().len();
                self.warm_starts.push(ContactWarmStart {
                    slot: slot_of(constraint.tool),
                    feature,
                    tip: if is_whole { constraint.tip } else { 0 },
                    force: contact.response.force,
                    friction: self.friction_force(index),
                    normal: contact.response.gap.normal.as_vec3(),
                    arm: constraint.arm,
                });
            }
        }
        // At its border a feature is in contact as a smaller feature, which takes over its force. The force is a sort
        // key too, since sums depend on the order.
        self.warm_starts
            .sort_unstable_by(|a, b| a.key().cmp(&b.key()).then(a.force.total_cmp(&b.force)));
        self.warm_starts.dedup_by(|other, first| {
            let is_same = other.key() == first.key();
            if is_same {
                first.force += other.force;
                first.friction += other.friction;
            }
            is_same
        });
    }

    /// Visits the force on each tool at the end of the last equation: the tool's index in the world, the force, N
    /// and its offset from the tool's position, m.
    pub(super) fn visit_warm_starts(&self, mut visit: impl FnMut(usize, DVec3, Vec3)) {
        for start in &self.warm_starts {
            visit(
                start.slot,
                -(start.normal.as_dvec3() * start.force + start.friction),
                start.arm,
            );
        }
    }

    /// Commits the forces of the last step.
    pub fn commit(&mut self) {
        self.committed.clone_from(&self.warm_starts);
        self.friction_multipliers.commit();
    }

    /// Discards the committed forces.
    pub fn reset_warm_starts(&mut self) {
        self.committed.clear();
        self.friction_multipliers.reset_warm_starts();
    }

    /// Discards the forces of the tool at this index of the world.
    pub fn remove_tool(&mut self, slot: usize) {
        for starts in [&mut self.warm_starts, &mut self.committed] {
            starts.retain(|start| start.slot != slot);
        }
        self.friction_multipliers.remove_tool(slot);
    }

    /// Hashes the state that the next step depends on.
    pub fn hash(&self, hasher: &mut StateHasher) {
        for start in &self.committed {
            hasher.write_u64(start.slot as u64);
            start
                .feature
                .nodes()
                .iter()
                .for_each(|&node| hasher.write_u64(node.into()));
            hasher.write_u64(start.tip.into());
            hasher.write_doubles(&[start.force]);
            hasher.write_doubles(&start.friction.to_array());
            hasher.write_floats(&start.normal.to_array());
            hasher.write_floats(&start.arm.to_array());
        }
        self.friction_multipliers.hash(hasher);
    }

    pub fn is_empty(&self) -> bool {
        self.contacts.is_empty()
    }

    pub fn len(&self) -> usize {
        self.contacts.len()
    }

    pub fn clear(&mut self) {
        self.contacts.clear();
        self.shares.clear();
        self.order.clear();
        self.friction_multipliers.clear();
    }

    /// Rebuilds the contacts for an equation over `duration` seconds. `stiffness_of` returns the stiffness of a node
    /// (N/m), infinite where it is pinned. `free_displacement_of` returns the displacement of a node without contact
    /// forces.
    pub(super) fn begin(
        &mut self,
        constraints: &[Constraint],
        slot_of: impl Fn(usize) -> usize,
        (duration, bindings, pins): (f32, Option<&Bindings>, &Pins),
        stiffness_of: impl Fn(usize) -> f32,
        free_displacement_of: impl Fn(usize) -> Vec3,
    ) {
        self.clear();
        for constraint in constraints {
            let supports = FeatureNodes::new(constraint.feature, bindings);
            let mut contact = EquationContact {
                nodes: [0; MAX_FEATURE_NODES],
                count: supports.nodes().len(),
                corner_count: constraint.feature.nodes().len(),
                corner_weights: supports.corner_weights,
                free_corners: [DVec3::ZERO; 3],
                surface: constraint.gap_surface(duration),
                min_gap: -f64::from(constraint.depth.max(0.0)),
                stiffness: 0.0,
                multiplier: 0.0,
                retention: f64::from(1.0 - constraint.softness),
                may_pull: false,
                was_active: false,
                response: ContactResponse::default(),
                was_pushing: false,
                friction: [None; MAX_FEATURE_NODES],
            };
            let mut compliance = 0.0;
            let mut free_corners = [DVec3::ZERO; MAX_FEATURE_NODES];
            for (index, &node) in supports.nodes().iter().enumerate() {
                let share = constraint.shares[index];
                let (stiffness, displacement) = (stiffness_of(node as usize), free_displacement_of(node as usize));
                contact.nodes[index] = node;
                free_corners[index] = constraint.starts[index].as_dvec3() + displacement.as_dvec3();
                compliance += share * share / stiffness;
                // Friction on a node that is pinned along some axes is left out: a node wedged between those axes and
                // a tool would be dragged without bound.
                let has_friction = constraint.friction > 0.0 && share > 0.0 && stiffness.is_finite();
                if has_friction && !pins.partial_axes_of(node).any() {
                    let friction = NodeFriction {
                        node,
                        tool: constraint.tool,
                        slot: slot_of(constraint.tool),
                        friction: constraint.friction.into(),
                        normal: constraint.normal.as_dvec3(),
                        slip: (displacement - constraint.surface_velocity * duration).as_dvec3(),
                        stiffness: f64::from(PENALTY_FACTOR * constraint.relaxation * stiffness),
                        retention: contact.retention,
                        ..NodeFriction::default()
                    };
                    self.friction_multipliers.add(share.into(), friction);
                }
                self.shares.push(NodeShare {
                    node,
                    contact: self.contacts.len() as u32,
                    index,
                });
            }
            contact.free_corners = contact.corners(free_corners);
            let stiffness = PENALTY_FACTOR * constraint.relaxation / compliance;
            if stiffness.is_finite() {
                contact.stiffness = f64::from(stiffness);
            }
            let key = (slot_of(constraint.tool), constraint.feature, constraint.tip);
            if let Ok(index) = self.warm_starts.binary_search_by_key(&key, ContactWarmStart::key) {
                contact.multiplier = contact.retention * self.warm_starts[index].force;
                contact.may_pull = true;
                contact.was_active = true;
            }
            self.contacts.push(contact);
        }
        self.friction_multipliers.begin();
        for (contact, constraint) in self.contacts.iter_mut().zip(constraints) {
            let node_data = contact.friction.iter_mut().zip(&contact.nodes).zip(constraint.shares);
            for ((friction, &node), share) in node_data.take(contact.count) {
                *friction = self.friction_multipliers.find(node, constraint.tool);
                if let Some(index) = *friction {
                    self.friction_multipliers
                        .add_normal_force(index, contact.multiplier * f64::from(share));
                }
            }
        }
        self.friction_multipliers.update_limits();
        self.shares.sort_unstable_by_key(|share| (share.node, share.contact));
        self.order.extend(
            constraints
                .iter()
                .map(|constraint| (constraint.tool, constraint.feature, constraint.tip)),
        );
        self.order.sort_unstable();
    }

    /// Evaluates all contacts for these displacements of the nodes, m.
    pub fn evaluate(&mut self, displacement_of: impl Fn(usize) -> DVec3) {
        for contact in &mut self.contacts {
            contact.response = contact.respond(&displacement_of);
        }
        self.update_normal_forces();
        self.friction_multipliers.evaluate(displacement_of);
    }

    /// Updates the normal force on each node that limits its friction.
    fn update_normal_forces(&mut self) {
        self.friction_multipliers.clear_normal_forces();
        for contact in &self.contacts {
            for (friction, share) in contact.friction.iter().zip(contact.response.shares) {
                if let &Some(index) = friction {
                    self.friction_multipliers
                        .add_normal_force(index, contact.response.force.max(0.0) * share);
                }
            }
        }
    }

    /// Forbids tension: from now on no contact pulls and no friction exceeds its limit.
    pub fn forbid_tension(&mut self) {
        self.friction_multipliers.forbid_tension();
        for contact in &mut self.contacts {
            contact.may_pull = false;
            if contact.response.force < 0.0 {
                contact.response.force = 0.0;
                contact.response.stiffness = [[0.0; MAX_FEATURE_NODES]; MAX_FEATURE_NODES];
            }
        }
    }

    /// Returns the relative change of the contact forces that updated multipliers would cause.
    pub fn multiplier_error(&self, displacement_of: impl Fn(usize) -> DVec3) -> f64 {
        let (mut missing, mut all) = (0.0, 0.0);
        for contact in &self.contacts {
            missing += contact.multiplier_error(&displacement_of).abs();
            all += contact.response.force;
        }
        missing += self.friction_multipliers.multiplier_error(displacement_of);
        if missing > 0.0 { missing / all } else { 0.0 }
    }

    /// Makes the current forces the multipliers and evaluates the contacts again. Visits the change of force at each
    /// node, N.
    pub fn update_multipliers(&mut self, displacement_of: impl Fn(usize) -> DVec3, mut add: impl FnMut(usize, DVec3)) {
        for contact in &mut self.contacts {
            let before = contact.response.force;
            contact.multiplier = contact.retention * before;
            contact.response = contact.respond(&displacement_of);
            contact.distribute(&contact.response, contact.response.force - before, &mut add);
        }
        self.update_normal_forces();
        self.friction_multipliers.update_multipliers(displacement_of, add);
    }

    /// Returns the residual along the contacts' normals, relative to the contact forces.
    pub fn imbalance(&self, residual_of: impl Fn(usize) -> DVec3) -> f64 {
        let active = || self.contacts.iter().filter(|contact| contact.response.force != 0.0);
        let off: f64 = active().map(|contact| contact.weighted(&residual_of).abs()).sum();
        let all: f64 = active().map(|contact| contact.response.force).sum();
        if all > 0.0 { off / all } else { 0.0 }
    }

    /// True if the set of pushing contacts has changed since the last call; the equation is then another one.
    pub fn active_set_changed(&mut self) -> bool {
        let mut changed = false;
        for contact in &mut self.contacts {
            let pushes = contact.response.force != 0.0;
            changed |= pushes != contact.was_pushing;
            contact.was_pushing = pushes;
        }
        changed
    }

    /// True if contact `index` is part of the equation and pushed in the last one too.
    pub(super) fn was_active(&self, index: usize) -> bool {
        self.contacts.get(index).is_some_and(|contact| contact.was_active)
    }

    /// Iterates over the contacts that push, with their indices.
    pub(super) fn active(&self) -> impl Iterator<Item = (usize, &EquationContact)> {
        self.contacts
            .iter()
            .enumerate()
            .filter(|(_, contact)| contact.response.force > 0.0)
    }

    /// True if any contact pushed at the end of the last equation.
    pub(super) fn had_active(&self) -> bool {
        !self.warm_starts.is_empty()
    }

    /// True if any contact is active.
    pub fn has_active(&self) -> bool {
        self.contacts.iter().any(|contact| contact.response.force != 0.0)
    }

    /// Visits the contact force at each node for these displacements, N.
    pub fn visit_forces(&self, displacement_of: impl Fn(usize) -> DVec3, mut add: impl FnMut(usize, DVec3)) {
        for contact in &self.contacts {
            let response = contact.respond(&displacement_of);
            contact.distribute(&response, response.force, &mut add);
        }
        self.friction_multipliers.visit_forces(displacement_of, add);
    }

    /// Visits the product of the contact stiffness with the vectors, node by node.
    pub fn visit_products(&self, vector_of: impl Fn(usize) -> DVec3, mut add: impl FnMut(usize, DVec3)) {
        for contact in self.contacts.iter().filter(|contact| contact.response.force != 0.0) {
            let products = contact.products(&vector_of);
            for (&node, product) in contact.nodes.iter().zip(products).take(contact.count) {
                add(node as usize, contact.response.gap.normal * product);
            }
        }
        self.friction_multipliers.visit_products(vector_of, add);
    }

    /// Visits the change of each contact's energy when the displacements grow by these vectors, J.
    pub fn visit_energy_changes(
        &self,
        displacement_of: impl Fn(usize) -> DVec3,
        vector_of: impl Fn(usize) -> DVec3,
        mut add: impl FnMut(f64),
    ) {
        for contact in &self.contacts {
            let before = contact.respond(&displacement_of);
            let after = contact.respond(|node| displacement_of(node) + vector_of(node));
            // For a contact that pushes throughout, this avoids the difference of two large numbers.
            let growth = if before.force.min(after.force) > 0.0 {
                let displacements = contact.corner_vectors(&vector_of);
                -contact.stiffness
                    * contact
                        .surface
                        .opening(&before.gap, &after.gap, &displacements[..contact.corner_count])
            } else {
                after.force - before.force
            };
            if growth != 0.0 {
                add(0.5 * growth * (before.force + after.force) / contact.stiffness);
            }
        }
        self.friction_multipliers
            .visit_energy_changes(displacement_of, vector_of, add);
    }

    /// Visits each loaded node with the diagonal block of its contact stiffness: xx, yy, zz, yz, zx, xy.
    pub fn visit_blocks(&self, mut visit: impl FnMut(usize, [f64; 6])) {
        for shares in self.shares.chunk_by(|a, b| a.node == b.node) {
            let mut block = [0.0; 6];
            for share in shares {
                let response = &self.contacts[share.contact as usize].response;
                let n = response.gap.normal;
                let product = n * response.stiffness[share.index][share.index];
                let entries = [
                    product.x * n.x,
                    product.y * n.y,
                    product.z * n.z,
                    product.y * n.z,
                    product.z * n.x,
                    product.x * n.y,
                ];
                for (entry, product) in block.iter_mut().zip(entries) {
                    *entry += product;
                }
            }
            let [x, y, z] = self.friction_multipliers.stiffness(shares[0].node).to_cols_array_2d();
            for (entry, entry_of_friction) in block.iter_mut().zip([x[0], y[1], z[2], y[2], z[0], x[1]]) {
                *entry += entry_of_friction;
            }
            if block[0] + block[1] + block[2] > 0.0 {
                visit(shares[0].node as usize, block);
            }
        }
    }

    /// Adds the forces on these nodes, as last evaluated.
    pub fn add_forces(&self, nodes: &Range<usize>, to: &mut [&mut [f32]; 3]) {
        for share in self.shares_of(nodes) {
            let response = &self.contacts[share.contact as usize].response;
            let force = response.gap.normal * (response.force * response.shares[share.index]);
            add(to, share.node as usize - nodes.start, force.as_vec3());
        }
        self.friction_multipliers.add_forces(nodes, to);
    }

    /// Adds the product of the contact stiffness with `vector_of` to the entries of these nodes. Returns the dot
    /// product of the vectors and that product.
    pub fn add_products(
        &self,
        nodes: &Range<usize>,
        vector_of: impl Fn(usize) -> Vec3,
        to: &mut [&mut [f32]; 3],
    ) -> f64 {
        let mut sum = self.friction_multipliers.add_products(nodes, &vector_of, to);
        for share in self.shares_of(nodes) {
            let contact = &self.contacts[share.contact as usize];
            if contact.response.force != 0.0 {
                let products = contact.products(|node| vector_of(node).as_dvec3());
                let product = (contact.response.gap.normal * products[share.index]).as_vec3();
                add(to, share.node as usize - nodes.start, product);
                sum += f64::from(product.dot(vector_of(share.node as usize)));
            }
        }
        sum
    }

    /// Returns the work of the contacts on the nodes' displacements, J. A contact does no work beyond its tool's own
    /// displacement: otherwise the push of an unconverged equation would count as energy input.
    pub fn work(&self, displacement_of: impl Fn(usize) -> Vec3) -> f64 {
        let displacement_of = |node: usize| displacement_of(node).as_dvec3();
        let work = |contact: &EquationContact| {
            let beyond = (contact.response.gap.distance - contact.min_gap).max(0.0);
            contact.response.force * (contact.weighted(displacement_of) - beyond)
        };
        let active = self.contacts.iter().filter(|contact| contact.response.force > 0.0);
        active.map(work).sum::<f64>() + self.friction_multipliers.work(displacement_of)
    }

    /// Returns the gap of contact `index` as last evaluated, its force (N) and how far it is open, m.
    pub(super) fn gap_state(&self, index: usize) -> (Gap, f64, f64) {
        let EquationContact { response, min_gap, .. } = &self.contacts[index];
        (response.gap, response.force, response.gap.distance - min_gap)
    }

    /// Returns the force of contact `index` on the tissue including friction, N.
    pub(super) fn force(&self, index: usize) -> DVec3 {
        let ContactResponse { gap, force, .. } = &self.contacts[index].response;
        gap.normal * *force + self.friction_force(index)
    }

    /// Returns the friction force of contact `index`, N: the friction of its nodes in proportion to its share of
    /// their normal force.
    pub(super) fn friction_force(&self, index: usize) -> DVec3 {
        let contact = &self.contacts[index];
        let node_data = contact.friction.iter().zip(contact.response.shares);
        let force = contact.response.force.max(0.0);
        let forces = node_data.filter_map(|(friction, share)| {
            friction.map(|index| self.friction_multipliers.per_force(index) * (force * share))
        });
        forces.sum()
    }

    /// True if friction of contact `index` is part of the equation.
    pub(super) fn has_friction(&self, index: usize) -> bool {
        self.contacts[index].friction.iter().any(Option::is_some)
    }

    /// Returns the penetration of contact `index` beyond its limit at these positions of its nodes, m; 0 for a
    /// contact that is inactive or compliant.
    pub(super) fn penetration(&self, index: usize, position_of: impl Fn(usize) -> Vec3) -> f64 {
        let contact = &self.contacts[index];
        if contact.response.force <= 0.0 || contact.retention < 1.0 {
            return 0.0;
        }
        let corners = contact.corner_vectors(|node| position_of(node).as_dvec3());
        let gap = contact.surface.measure(&corners[..contact.corner_count]);
        (contact.min_gap - gap.distance).max(0.0)
    }

    /// True if a contact of this tool, feature and tip is part of the equation.
    pub(super) fn contains(&self, key: (usize, Feature, u8)) -> bool {
        self.order.binary_search(&key).is_ok()
    }

    fn shares_of(&self, nodes: &Range<usize>) -> &[NodeShare] {
        let start_of = |node: usize| self.shares.partition_point(|share| (share.node as usize) < node);
        &self.shares[start_of(nodes.start)..start_of(nodes.end)]
    }
}

impl ContactWarmStart {
    fn key(&self) -> (usize, Feature, u8) {
        (self.slot, self.feature, self.tip)
    }
}
