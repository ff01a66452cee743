//! Projected Gauss-Seidel over contact rows (sequential impulses, Catto 2005).
//!
//! A sweep accesses only the contiguous data here. The velocities are those of the contacts' nodes alone.

use glam::{Vec3, Vec3A};

use super::constraint::Constraint;
use super::corner_weights::MAX_FEATURE_NODES;
use super::dynamic_tools::SolverTool;
use super::sweep_control::{PgsLimits, PgsPass, sweep_until_converged};
use crate::base::{Result, memory};
use crate::codec::saved;
use crate::soa::Vectors;

/// A contact as a row of the solver.
#[derive(Clone, Copy, Debug)]
pub(super) struct ContactRow {
    /// Index of the tool among the dynamic ones; [`u32::MAX`] for a kinematic tool.
    pub dynamic_index: u32,
    /// Vector from a dynamic tool's center of mass, m.
    pub arm: Vec3A,
    /// True if another tool supports one of the nodes from behind.
    pub is_backed: bool,
    /// Indices of the nodes' velocities. Unused entries have a share of 0.
    pub indices: [u32; MAX_FEATURE_NODES],
    pub shares: [f32; MAX_FEATURE_NODES],
    /// Velocity change of each node per impulse, 1/kg.
    pub inv_mass_weights: [Vec3A; MAX_FEATURE_NODES],
    pub normal: Vec3A,
    /// m/s
    pub surface_velocity: Vec3A,
    /// m/s
    pub target_velocity: f32,
    pub friction: f32,
    /// kg
    pub effective_mass: f32,
    /// kg
    pub tangent_mass: f32,
    /// Fraction of the impulse that is lost per sweep.
    pub softness: f32,
    /// Accumulated normal impulse, at least 0, and accumulated friction impulse, N s.
    pub impulse: f32,
    pub friction_impulse: Vec3A,
}

saved! { ContactRow {
    dynamic_index, arm, is_backed, indices, shares, inv_mass_weights, normal, surface_velocity, target_velocity,
    friction, effective_mass, tangent_mass, softness, impulse, friction_impulse,
} }

impl ContactRow {
    /// Updates the impulse of the row. Returns the change of the contact's velocity, m/s.
    #[inline]
    fn solve(&mut self, velocities: &mut [Vec3A], dynamic_tools: &mut [SolverTool]) -> f32 {
        let indices = self.indices.map(|index| index as usize);
        let mut velocity = velocities[indices[0]] * self.shares[0];
        for index in 1..MAX_FEATURE_NODES {
            velocity += velocities[indices[index]] * self.shares[index];
        }
        let mut tool = dynamic_tools.get_mut(self.dynamic_index as usize);
        if let Some(tool) = &tool {
            velocity -= tool.velocity_change(self.arm);
        }
        let velocity_error = self.target_velocity - velocity.dot(self.normal);
        let impulse = (self.impulse * (1.0 - self.softness) + velocity_error * self.effective_mass).max(0.0);
        let change = impulse - self.impulse;
        self.impulse = impulse;
        let is_idle = impulse == 0.0 && self.friction_impulse == Vec3A::ZERO;
        if change == 0.0 && (self.friction == 0.0 || is_idle) {
            return 0.0;
        }
        let mut applied = self.normal * change;
        if self.friction > 0.0 {
            let slip = (velocity - self.surface_velocity).reject_from_normalized(self.normal);
            let trial = self.friction_impulse - slip * self.tangent_mass;
            let friction = trial.clamp_length_max(self.friction * impulse);
            applied += friction - self.friction_impulse;
            self.friction_impulse = friction;
        }
        for index in 0..MAX_FEATURE_NODES {
            velocities[indices[index]] += applied * self.inv_mass_weights[index];
        }
        if let Some(tool) = &mut tool {
            tool.recoil(self.arm, applied);
        }
        applied.length() / self.tangent_mass
    }

    /// Solves the row of a contact with nodes that are supported from behind. The kinematic tool behind a node
    /// absorbs the part of the velocity change that points into it.
    fn solve_backed(
        &mut self,
        velocities: &mut [Vec3A],
        dynamic_tools: &mut [SolverTool],
        back_supports: &mut [BackSupport],
    ) -> f32 {
        let indices = self.indices.map(|index| index as usize);
        let before = indices.map(|index| velocities[index]);
        let change = self.solve(velocities, dynamic_tools);
        for index in (0..MAX_FEATURE_NODES).filter(|&index| self.shares[index] > 0.0) {
            let support = &mut back_supports[indices[index]];
            let inv_mass = self.inv_mass_weights[index].max_element();
            if support.normal == Vec3A::ZERO || inv_mass == 0.0 {
                continue;
            }
            let along = (velocities[indices[index]] - before[index]).dot(support.normal);
            velocities[indices[index]] -= support.normal * along;
            support.pending_impulse -= along * self.shares[index] / inv_mass;
        }
        change
    }

    /// True for a pressing contact of a kinematic tool with a single node.
    fn is_back_support(&self) -> bool {
        self.dynamic_index == u32::MAX && self.shares[0] == 1.0 && self.impulse > 0.0 && self.softness == 0.0
    }

    /// True if the contact presses.
    fn is_pressing(&self) -> bool {
        self.impulse > 0.0
    }
}

/// A node is held between two tools if the cosine between one normal and the opposite of the other exceeds this value.
const MIN_OPPOSITION: f32 = 0.1;

/// The contacts of a slice while they are solved.
#[derive(Debug, Default)]
pub(super) struct ContactRows {
    rows: Vec<ContactRow>,
    /// The nodes of all rows, sorted, and their velocities.
    nodes: Vec<u32>,
    velocities: Vec<Vec3A>,
    /// The dynamic tools; empty if there are none.
    pub dynamic_tools: Vec<SolverTool>,
    /// The support of each node against a dynamic tool.
    back_supports: Vec<BackSupport>,
}

saved! { ContactRows { rows, nodes, velocities } leaves { dynamic_tools: Vec::new(), back_supports: Vec::new() } }

/// A kinematic tool that presses a node. It takes the impulses of a dynamic tool on the node against it.
#[derive(Clone, Copy, Debug)]
struct BackSupport {
    /// Normal away from that tool; 0 if there is none.
    normal: Vec3A,
    /// Impulse that the support took and its contact has not added yet, N s.
    pending_impulse: f32,
    /// Impulse of the support's contact, N s.
    impulse: f32,
}

impl ContactRows {
    /// Reserves memory for `contacts` contacts.
    pub fn reserve(&mut self, contacts: usize) -> Result<()> {
        memory::reserve(&mut self.rows, contacts)?;
        memory::reserve(&mut self.nodes, MAX_FEATURE_NODES * contacts)?;
        memory::reserve(&mut self.velocities, MAX_FEATURE_NODES * contacts)?;
        let is_used = self.dynamic_tools.capacity() > 0;
        memory::reserve(
            &mut self.back_supports,
            if is_used { MAX_FEATURE_NODES * contacts } else { 0 },
        )
    }

    /// Reserves memory for `count` dynamic tools.
    pub fn reserve_dynamic_tools(&mut self, count: usize, contacts: usize) -> Result<()> {
        memory::reserve(&mut self.dynamic_tools, count)?;
        memory::reserve(
            &mut self.back_supports,
            if count > 0 { MAX_FEATURE_NODES * contacts } else { 0 },
        )
    }

    /// Lists the nodes of these contacts.
    pub fn list_nodes(&mut self, constraints: &[Constraint]) {
        self.nodes.clear();
        for constraint in constraints {
            self.nodes.extend_from_slice(constraint.nodes());
        }
        memory::sort_once(&mut self.nodes);
    }

    /// True if a node is listed.
    pub fn contains(&self, node: u32) -> bool {
        self.nodes.binary_search(&node).is_ok()
    }

    /// Solves these contacts in at most `sweeps` sweeps. Their memory is reserved. Returns the largest velocity change
    /// of the first sweep, m/s.
    pub fn solve(&mut self, constraints: &mut [Constraint], velocities: &mut Vectors, sweeps: u32) -> f32 {
        self.list_nodes(constraints);
        let Self { rows, nodes, .. } = self;
        let index_of = |node: u32| nodes.binary_search(&node).unwrap_or_default() as u32;
        rows.clear();
        rows.extend(
            constraints
                .iter()
                .map(|constraint| constraint.row(index_of, &self.dynamic_tools)),
        );

        self.gather_velocities(|node| velocities.get(node).into());
        let limits = PgsLimits::new(sweeps);
        let first = sweep_until_converged(limits, None, |sweep| self.sweep_rows(sweep));
        if !self.dynamic_tools.is_empty() && self.find_back_supports() {
            sweep_until_converged(limits, Some(first), |sweep| self.sweep_backed(sweep));
        }
        for (&node, &velocity) in self.nodes.iter().zip(&self.velocities) {
            velocities.set(node as usize, velocity.into());
        }
        self.store_impulses(constraints);
        first
    }

    /// Sweeps once over the rows that [`ContactRows::solve`] gathered, with velocities that other solvers have changed.
    /// Returns the largest velocity change, m/s.
    pub fn sweep(&mut self, velocities: &mut [Vec3A], sweep: PgsPass) -> f32 {
        self.gather_velocities(|node| velocities[node]);
        let largest = self.sweep_rows(sweep);
        for (&node, &velocity) in self.nodes.iter().zip(&self.velocities) {
            velocities[node as usize] = velocity;
        }
        largest
    }

    /// Copies the impulses to the constraints.
    pub fn store_impulses(&self, constraints: &mut [Constraint]) {
        for (constraint, row) in constraints.iter_mut().zip(&self.rows) {
            constraint.store_impulse(row);
        }
    }

    fn gather_velocities(&mut self, velocity_of: impl Fn(usize) -> Vec3A) {
        self.velocities.clear();
        self.velocities
            .extend(self.nodes.iter().map(|&node| velocity_of(node as usize)));
    }

    /// Finds nodes that are held between a kinematic and a dynamic tool, and marks the rows of the dynamic tool.
    /// True if there are any. These rows stop the tool at any mass ratio.
    /// Without them the number of sweeps would grow with that ratio.
    fn find_back_supports(&mut self) -> bool {
        let none = BackSupport {
            normal: Vec3A::ZERO,
            pending_impulse: 0.0,
            impulse: 0.0,
        };
        self.back_supports.clear();
        self.back_supports.resize(self.nodes.len(), none);
        for row in self.rows.iter().filter(|row| row.is_back_support()) {
            let support = &mut self.back_supports[row.indices[0] as usize];
            if row.impulse > support.impulse {
                (support.normal, support.impulse) = (row.normal, row.impulse);
            }
        }
        let mut has_supports = false;
        for row in &mut self.rows {
            let Some(tool) = self.dynamic_tools.get(row.dynamic_index as usize) else {
                continue;
            };
            let indices = row.indices.map(|index| index as usize);
            let is_held = |index: usize| self.back_supports[indices[index]].normal.dot(row.normal) < -MIN_OPPOSITION;
            if !(0..MAX_FEATURE_NODES).any(is_held) {
                continue;
            }
            has_supports = true;
            let inverse_masses = (0..MAX_FEATURE_NODES).map(|index| {
                let change = row.normal * row.inv_mass_weights[index];
                let normal = self.back_supports[indices[index]].normal;
                row.shares[index] * row.normal.dot(change - normal * change.dot(normal))
            });
            row.is_backed = true;
            row.effective_mass = 1.0 / (inverse_masses.sum::<f32>() + tool.response(row.arm, row.normal));
            row.softness = 0.0;
        }
        has_supports
    }

    /// Sweeps once over the rows. Rows of dynamic tools act through nodes on their supports.
    fn sweep_backed(&mut self, sweep: PgsPass) -> f32 {
        let mut largest = 0.0_f32;
        for row in &mut self.rows {
            if row.is_back_support() {
                let support = &mut self.back_supports[row.indices[0] as usize];
                if support.normal == row.normal {
                    row.impulse += std::mem::take(&mut support.pending_impulse);
                }
            }
            if sweep == PgsPass::All || row.is_pressing() {
                let change = if row.is_backed {
                    row.solve_backed(&mut self.velocities, &mut self.dynamic_tools, &mut self.back_supports)
                } else {
                    row.solve(&mut self.velocities, &mut self.dynamic_tools)
                };
                largest = largest.max(change);
            }
        }
        largest
    }

    fn sweep_rows(&mut self, sweep: PgsPass) -> f32 {
        let mut largest = 0.0_f32;
        for row in &mut self.rows {
            if sweep == PgsPass::All || row.is_pressing() {
                largest = largest.max(row.solve(&mut self.velocities, &mut self.dynamic_tools));
            }
        }
        largest
    }
}

/// Solves one contact independently of all others.
pub(super) fn solve_alone(constraint: &mut Constraint, velocities: &mut Vectors, dynamic_tools: &mut [SolverTool]) {
    let mut node_velocities = [Vec3A::ZERO; MAX_FEATURE_NODES];
    for (velocity, &node) in node_velocities.iter_mut().zip(constraint.nodes()) {
        *velocity = velocities.get(node as usize).into();
    }
    let index_of = |node: u32| {
        constraint
            .nodes()
            .iter()
            .position(|&other| other == node)
            .unwrap_or_default() as u32
    };
    let mut row = constraint.row(index_of, dynamic_tools);
    row.solve(&mut node_velocities, dynamic_tools);
    constraint.store_impulse(&row);
    for (velocity, &node) in node_velocities.iter().zip(constraint.nodes()) {
        velocities.set(node as usize, Vec3::from(*velocity));
    }
}
