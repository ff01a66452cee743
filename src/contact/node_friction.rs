//! Friction in a step's implicit equation, between tools and the nodes that they press.
//!
//! Friction is resolved per node, since edges and faces with common nodes could not separate their shares. Its limit
//! follows the normal force of the last evaluation: Tresca friction, iterated to Coulomb's law as a fixed point
//! (Kikuchi, Oden 1988, chapter 10). The equation then minimizes a convex function, which Coulomb's cone does not
//! allow. The method is an augmented Lagrangian, as for the [contacts](super::augmented_lagrangian).

use std::ops::Range;

use glam::{DMat3, DVec3, Vec3};

use crate::base::{Result, StateHasher, memory, outer};
use crate::codec::saved;

/// A node sticks if its friction is below this fraction of the limit.
const STICKING: f64 = 0.99;

/// Friction of one tool at one node.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct NodeFriction {
    pub node: u32,
    /// Index of the tool among the tools of the step.
    pub tool: usize,
    /// Index of the tool in the world.
    pub slot: usize,
    pub friction: f64,
    /// Unit vector away from the tool.
    pub normal: DVec3,
    /// Tangential slip of the node without contact forces, m.
    pub slip: DVec3,
    /// Penalty stiffness, N/m.
    pub stiffness: f64,
    /// Fraction of the force that becomes the multiplier.
    pub retention: f64,
    /// Force without slip, N.
    pub multiplier: DVec3,
    /// Largest friction force, N.
    pub limit: f64,
    /// True if the force may exceed the limit. The first solve treats a node that stuck before as bilateral.
    pub may_exceed_limit: bool,
    /// Normal force on the node, N.
    pub normal_force: f64,
    pub response: FrictionResponse,
}

saved! { NodeFriction {
    node, tool, slot, friction, normal, slip, stiffness, retention, multiplier, limit, may_exceed_limit, normal_force, response,
} }

/// Friction at the last evaluated position.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct FrictionResponse {
    /// Force on the tissue, N.
    force: DVec3,
    /// Negated derivative of the force by the slip, N/m.
    stiffness: DMat3,
    /// Tangential slip, m.
    slip: DVec3,
}

saved! { FrictionResponse { force, stiffness, slip } }

/// Friction at the end of a step, from which the next one begins.
#[derive(Clone, Copy, Debug)]
struct FrictionWarmStart {
    /// Index of the tool in the world.
    slot: usize,
    node: u32,
    /// Friction force, N.
    force: DVec3,
    /// True if the force was below its limit.
    sticks: bool,
}

saved! { FrictionWarmStart { slot, node, force, sticks } }

/// The friction of a body with all tools in the current equation.
#[derive(Debug, Default)]
pub(super) struct FrictionMultipliers {
    /// Sorted by node and tool.
    nodes: Vec<NodeFriction>,
    /// Friction before the current equation and before the step, both sorted by tool and node.
    warm_starts: Vec<FrictionWarmStart>,
    committed: Vec<FrictionWarmStart>,
}

saved! { FrictionMultipliers { nodes, warm_starts, committed } }

impl FrictionMultipliers {
    /// Reserves memory for `count` nodes.
    pub fn reserve(&mut self, count: usize) -> Result<()> {
        memory::reserve(&mut self.nodes, count)?;
        memory::reserve(&mut self.warm_starts, count)?;
        memory::reserve(&mut self.committed, count)
    }

    pub fn begin_step(&mut self) {
        self.warm_starts.clone_from(&self.committed);
    }

    pub fn commit(&mut self) {
        self.committed.clone_from(&self.warm_starts);
    }

    pub fn reset_warm_starts(&mut self) {
        self.committed.clear();
    }

    pub fn remove_tool(&mut self, slot: usize) {
        for starts in [&mut self.warm_starts, &mut self.committed] {
            starts.retain(|start| start.slot != slot);
        }
    }

    pub fn hash(&self, hasher: &mut StateHasher) {
        for start in &self.committed {
            hasher.write_u64(start.slot as u64);
            hasher.write_u64(start.node.into());
            hasher.write_doubles(&start.force.to_array());
            hasher.write_u64(start.sticks.into());
        }
    }

    /// Stores the current friction as the start of the next equation.
    pub fn update_warm_starts(&mut self) {
        self.warm_starts.clear();
        let acting = self.nodes.iter().filter(|entry| entry.response.force != DVec3::ZERO);
        self.warm_starts.extend(acting.map(|entry| FrictionWarmStart {
            slot: entry.slot,
            node: entry.node,
            force: entry.response.force,
            sticks: entry.response.force.length() < STICKING * entry.limit,
        }));
        self.warm_starts.sort_unstable_by_key(FrictionWarmStart::key);
    }

    pub fn clear(&mut self) {
        self.nodes.clear();
    }

    /// Adds the normal and slip of a contact, weighted by `weight`, to the friction of the same node and tool. A new
    /// entry is dropped if there is no memory left. Until [`FrictionMultipliers::begin`], `normal_force` is the sum
    /// of the weights.
    pub fn add(&mut self, weight: f64, friction: NodeFriction) {
        let index = self.nodes.partition_point(|entry| entry.key() < friction.key());
        let exists = self.nodes.get(index).is_some_and(|entry| entry.key() == friction.key());
        if !exists {
            if self.nodes.len() == self.nodes.capacity() {
                return;
            }
            let empty = NodeFriction {
                normal: DVec3::ZERO,
                slip: DVec3::ZERO,
                ..friction
            };
            self.nodes.insert(index, empty);
        }
        let entry = &mut self.nodes[index];
        entry.normal += friction.normal * weight;
        entry.slip += friction.slip * weight;
        entry.normal_force += weight;
        entry.retention = entry.retention.min(friction.retention);
    }

    /// Computes the weighted means and starts from the friction of the last step.
    pub fn begin(&mut self) {
        for entry in &mut self.nodes {
            entry.slip /= entry.normal_force;
            entry.normal = entry.normal.normalize_or_zero();
            entry.normal_force = 0.0;
            let key = (entry.slot, entry.node);
            if let Ok(index) = self.warm_starts.binary_search_by_key(&key, FrictionWarmStart::key) {
                let start = self.warm_starts[index];
                entry.multiplier = entry.tangential(start.force) * entry.retention;
                entry.may_exceed_limit = start.sticks;
            }
        }
    }

    /// Returns the index of the friction of a node and a tool.
    pub fn find(&self, node: u32, tool: usize) -> Option<usize> {
        self.nodes.binary_search_by_key(&(node, tool), NodeFriction::key).ok()
    }

    /// Sets all normal forces to 0.
    pub fn clear_normal_forces(&mut self) {
        self.nodes.iter_mut().for_each(|entry| entry.normal_force = 0.0);
    }

    /// Adds to the normal force on a node, N.
    pub fn add_normal_force(&mut self, index: usize, force: f64) {
        self.nodes[index].normal_force += force;
    }

    /// Updates the friction limits from the normal forces.
    pub fn update_limits(&mut self) {
        for entry in &mut self.nodes {
            entry.limit = entry.friction * entry.normal_force;
        }
    }

    /// Enforces the friction limits from now on.
    pub fn forbid_tension(&mut self) {
        self.nodes.iter_mut().for_each(|entry| entry.may_exceed_limit = false);
    }

    /// Evaluates all friction for these displacements of the nodes, m.
    pub fn evaluate(&mut self, displacement_of: impl Fn(usize) -> DVec3) {
        for entry in &mut self.nodes {
            entry.response = entry.evaluate(displacement_of(entry.node as usize));
        }
    }

    /// Returns how much updated multipliers and limits would change the forces, N.
    pub fn multiplier_error(&self, displacement_of: impl Fn(usize) -> DVec3) -> f64 {
        let change = |entry: &NodeFriction| {
            let updated = entry.updated().evaluate(displacement_of(entry.node as usize));
            (updated.force - entry.response.force).length()
        };
        self.nodes.iter().map(change).sum()
    }

    /// Makes the current forces the multipliers and updates the limits. Visits the change of force at each node, N.
    pub fn update_multipliers(&mut self, displacement_of: impl Fn(usize) -> DVec3, mut add: impl FnMut(usize, DVec3)) {
        for entry in &mut self.nodes {
            let before = entry.response.force;
            *entry = entry.updated();
            entry.response = entry.evaluate(displacement_of(entry.node as usize));
            add(entry.node as usize, entry.response.force - before);
        }
    }

    /// Visits the friction at each node for these displacements, N.
    pub fn visit_forces(&self, displacement_of: impl Fn(usize) -> DVec3, mut add: impl FnMut(usize, DVec3)) {
        for entry in &self.nodes {
            let node = entry.node as usize;
            add(node, entry.evaluate(displacement_of(node)).force);
        }
    }

    /// Visits the product of the stiffness with the vectors, node by node.
    pub fn visit_products(&self, vector_of: impl Fn(usize) -> DVec3, mut add: impl FnMut(usize, DVec3)) {
        for entry in &self.nodes {
            let node = entry.node as usize;
            add(node, entry.response.stiffness * vector_of(node));
        }
    }

    /// Visits the change of each node's energy when the displacements grow by these vectors, J.
    pub fn visit_energy_changes(
        &self,
        displacement_of: impl Fn(usize) -> DVec3,
        vector_of: impl Fn(usize) -> DVec3,
        mut add: impl FnMut(f64),
    ) {
        for entry in self.nodes.iter().filter(|entry| entry.limit > 0.0) {
            let (displacement, more) = (displacement_of(entry.node as usize), vector_of(entry.node as usize));
            add(entry.change(displacement, more));
        }
    }

    /// Returns the friction force on the tissue per newton of normal force.
    pub fn per_force(&self, index: usize) -> DVec3 {
        let entry = &self.nodes[index];
        if entry.normal_force > 0.0 {
            entry.response.force / entry.normal_force
        } else {
            DVec3::ZERO
        }
    }

    /// Adds the forces on these nodes.
    pub fn add_forces(&self, nodes: &Range<usize>, to: &mut [&mut [f32]; 3]) {
        for entry in self.of_nodes(nodes) {
            add(to, entry.node as usize - nodes.start, entry.response.force.as_vec3());
        }
    }

    /// Adds the product of the stiffness with `vector_of` to the entries of these nodes. Returns the dot product of
    /// the vectors and that product.
    pub fn add_products(
        &self,
        nodes: &Range<usize>,
        vector_of: impl Fn(usize) -> Vec3,
        to: &mut [&mut [f32]; 3],
    ) -> f64 {
        let mut sum = 0.0;
        for entry in self.of_nodes(nodes) {
            let vector = vector_of(entry.node as usize);
            let product = (entry.response.stiffness * vector.as_dvec3()).as_vec3();
            add(to, entry.node as usize - nodes.start, product);
            sum += f64::from(product.dot(vector));
        }
        sum
    }

    /// Returns the friction stiffness at a node.
    pub fn stiffness(&self, node: u32) -> DMat3 {
        let node = node as usize;
        let stiffnesses = self
            .of_nodes(&(node..node + 1))
            .iter()
            .map(|entry| entry.response.stiffness);
        stiffnesses.fold(DMat3::ZERO, |sum, stiffness| sum + stiffness)
    }

    /// Returns the work of friction on the nodes' displacements, J. It does no work beyond the tool's own
    /// displacement.
    pub fn work(&self, displacement_of: impl Fn(usize) -> DVec3) -> f64 {
        let work = |entry: &NodeFriction| {
            let FrictionResponse { force, slip, .. } = entry.response;
            (displacement_of(entry.node as usize) - slip).dot(force) + slip.dot(force).min(0.0)
        };
        self.nodes.iter().map(work).sum()
    }

    fn of_nodes(&self, nodes: &Range<usize>) -> &[NodeFriction] {
        let start_of = |node: usize| self.nodes.partition_point(|entry| (entry.node as usize) < node);
        if self.nodes.is_empty() {
            return &[];
        }
        &self.nodes[start_of(nodes.start)..start_of(nodes.end)]
    }
}

impl FrictionWarmStart {
    fn key(&self) -> (usize, u32) {
        (self.slot, self.node)
    }
}

impl NodeFriction {
    fn key(&self) -> (u32, usize) {
        (self.node, self.tool)
    }

    fn tangential(&self, vector: DVec3) -> DVec3 {
        vector - self.normal * vector.dot(self.normal)
    }

    fn updated(&self) -> Self {
        Self {
            multiplier: self.response.force * self.retention,
            limit: self.friction * self.normal_force,
            ..*self
        }
    }

    /// Returns the force for this slip without a limit (N), and true if the limit allows it.
    fn trial_force(&self, slip: DVec3) -> (DVec3, bool) {
        let trial = self.multiplier - slip * self.stiffness;
        (trial, self.may_exceed_limit || trial.length() <= self.limit)
    }

    /// Returns the change of energy from this displacement of the node (m) to one longer by `more`, J. While the node
    /// keeps sticking or slipping it is computed as a product, which avoids the difference of two large numbers.
    fn change(&self, displacement: DVec3, more: DVec3) -> f64 {
        let (slip, more) = (self.tangential(self.slip + displacement), self.tangential(more));
        let [(before, stuck), (after, sticks)] = [slip, slip + more].map(|slip| self.trial_force(slip));
        let twice_sticking = -more.dot(before + after);
        match (stuck, sticks) {
            (true, true) => 0.5 * twice_sticking,
            (false, false) => self.limit * twice_sticking / (before.length() + after.length()),
            _ => {
                let energy = |trial: DVec3, sticks: bool| {
                    let length = trial.length();
                    let twice = if sticks {
                        length * length
                    } else {
                        self.limit * (2.0 * length - self.limit)
                    };
                    0.5 * twice / self.stiffness
                };
                energy(after, sticks) - energy(before, stuck)
            }
        }
    }

    /// Evaluates the friction for this displacement of the node, m.
    fn evaluate(&self, displacement: DVec3) -> FrictionResponse {
        let slip = self.tangential(self.slip + displacement);
        if self.limit == 0.0 {
            return FrictionResponse {
                slip,
                ..FrictionResponse::default()
            };
        }
        let outer_product = |direction: DVec3| outer(direction, direction);
        let (trial, sticks) = self.trial_force(slip);
        let tangent_projector = DMat3::IDENTITY - outer_product(self.normal);
        if sticks {
            return FrictionResponse {
                force: trial,
                stiffness: tangent_projector * self.stiffness,
                slip,
            };
        }
        let length = trial.length();
        let scale = self.limit / length;
        FrictionResponse {
            force: trial * scale,
            stiffness: (tangent_projector - outer_product(trial / length)) * (self.stiffness * scale),
            slip,
        }
    }
}

pub(super) fn add(to: &mut [&mut [f32]; 3], index: usize, vector: Vec3) {
    for (axis, value) in to.iter_mut().zip(vector.to_array()) {
        axis[index] += value;
    }
}
