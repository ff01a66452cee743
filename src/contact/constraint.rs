//! The non-penetration constraint between one node, edge or face and a tool.

use glam::{BVec3, DVec3, Vec3, Vec3A};

use super::corner_weights::{FeatureNodes, MAX_FEATURE_NODES};
use super::dynamic_tools::SolverTool;
use super::features::Feature;
use super::gap::{Gap, GapSurface};
use super::pgs::ContactRow;
use super::sweep_control::{LEVERAGE, depth_correction};
use crate::codec::saved;
use crate::nodes::Mobility;
use crate::soa::Vectors;

/// A contact constraint over one slice of a substep.
///
/// The weighted velocity of the nodes along the normal is at least `target_velocity`, so that they are clear of the
/// tool at the end of the slice. Coulomb friction opposes tangential motion against the tool's surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Constraint {
    pub feature: Feature,
    /// Barycentric weights of the feature's corners; the sum is 1.
    pub weights: [f32; 3],
    /// The nodes that move the feature.
    nodes: [u32; MAX_FEATURE_NODES],
    count: usize,
    /// Positions of the nodes when the contact begins.
    pub starts: [Vec3; MAX_FEATURE_NODES],
    /// Fraction of the contact's impulse that each node receives; the sum is 1.
    pub shares: [f32; MAX_FEATURE_NODES],
    /// Velocity change of each node along each axis per impulse at the contact, 1/kg.
    inv_mass_weights: [Vec3; MAX_FEATURE_NODES],
    /// Unit normal, away from the tool.
    pub normal: Vec3,
    target_velocity: f32,
    /// Velocity of the tool's surface at the contact, m/s.
    pub surface_velocity: Vec3,
    /// Vector from the tool's position to the contact, m.
    pub arm: Vec3,
    /// Penetration depth at the start, m; not positive outside.
    pub depth: f32,
    pub friction: f32,
    /// Index of the tool among those near the body.
    pub tool: usize,
    /// Index of the tool among the dynamic tools of the step; [`u32::MAX`] for a kinematic tool.
    pub dynamic_index: u32,
    /// The end of a capsule that a face touches, since it may touch both; otherwise 0.
    pub tip: u8,
    /// Effective mass along the normal, kg. It is smaller if nodes are held along axes near the normal.
    effective_mass: f32,
    /// Smallest effective mass along any direction, kg.
    tangent_mass: f32,
    /// Fraction of the impulse that is dropped in each iteration, 0 to 1. It is positive only near pinned nodes, where
    /// a rigid contact would fling the free nodes away.
    pub softness: f32,
    /// Fraction of the stopping impulse that one iteration applies; 1 without softness.
    pub relaxation: f32,
    /// Accumulated normal impulse, N s; at least 0.
    impulse: f32,
    /// Accumulated friction impulse, N s.
    friction_impulse: Vec3,
    /// The impulse that the tool's load already includes, N s.
    pub counted_impulse: Vec3,
    /// For a rounded tool: the ends of its segment at the end of the contact, as far as this feature touches it, and
    /// its radius.
    pub rounded: Option<([Vec3; 2], f32)>,
}

saved! { Constraint {
    feature, weights, nodes, count, starts, shares, inv_mass_weights, normal, target_velocity, surface_velocity,
    arm, depth, friction, tool, dynamic_index, tip, effective_mass, tangent_mass, softness, relaxation, impulse,
    friction_impulse, counted_impulse, rounded,
} }

impl Constraint {
    /// Creates a contact without impulse. `mobility` and `held` are the inverse masses and held axes of the nodes.
    /// `recoil` is the velocity change of the tool per impulse, 1/kg: along the normal, and the largest along any
    /// direction. Returns `None` if neither side can move along the normal.
    pub fn new(
        (feature, weights): (Feature, [f32; 3]),
        feature_nodes: &FeatureNodes,
        starts: [Vec3; MAX_FEATURE_NODES],
        normal: Vec3,
        (mobility, held): (&Mobility, [BVec3; MAX_FEATURE_NODES]),
        [recoil, most_recoil]: [f32; 2],
    ) -> Option<Self> {
        let shares = feature_nodes.shares(weights);
        let mut nodes = [0; MAX_FEATURE_NODES];
        let mut inv_mass_weights = [Vec3::ZERO; MAX_FEATURE_NODES];
        // Inverse masses along the normal, and along a direction in which all nodes are free.
        let (mut normal_inv_mass, mut free_inv_mass, mut leverage) = (0.0, 0.0, 0.0_f32);
        for (index, (&node, share)) in feature_nodes.nodes().iter().zip(shares).enumerate() {
            nodes[index] = node;
            let inv_mass = mobility.inverse_mass(node as usize) * share;
            inv_mass_weights[index] = Vec3::select(held[index], Vec3::ZERO, Vec3::splat(inv_mass));
            let normal_part = if held[index].any() {
                Vec3::select(held[index], Vec3::ZERO, normal).length_squared()
            } else {
                1.0
            };
            normal_inv_mass += inv_mass * normal_part * share;
            free_inv_mass += inv_mass * share;
            leverage = leverage.max(inv_mass / LEVERAGE);
        }
        let (normal_inv_mass, free_inv_mass) = (normal_inv_mass + recoil, free_inv_mass + most_recoil);
        let inverse_mass = leverage.max(normal_inv_mass);
        // The impulse fades to 0 as the normal turns toward axes along which nodes are held.
        let fading = (normal_inv_mass / leverage.min(free_inv_mass)).min(1.0);
        (normal_inv_mass > 0.0).then(|| Self {
            feature,
            weights,
            nodes,
            count: feature_nodes.nodes().len(),
            starts,
            shares,
            inv_mass_weights,
            normal,
            target_velocity: 0.0,
            surface_velocity: Vec3::ZERO,
            arm: Vec3::ZERO,
            depth: 0.0,
            friction: 0.0,
            tool: 0,
            dynamic_index: u32::MAX,
            tip: 0,
            effective_mass: fading / inverse_mass,
            tangent_mass: 1.0 / leverage.max(free_inv_mass),
            softness: 1.0 - normal_inv_mass / inverse_mass,
            relaxation: fading * normal_inv_mass / inverse_mass,
            impulse: 0.0,
            friction_impulse: Vec3::ZERO,
            counted_impulse: Vec3::ZERO,
            rounded: None,
        })
    }

    /// The nodes that move the feature.
    pub fn nodes(&self) -> &[u32] {
        &self.nodes[..self.count]
    }

    /// Lets the nodes approach the tool's surface by at most `gap` within `duration` seconds. Penetrating nodes may not
    /// go deeper.
    pub fn allow_gap(&mut self, gap: f32, duration: f32) {
        self.depth = -gap;
        self.target_velocity = self.surface_velocity.dot(self.normal) - gap.max(0.0) / duration;
    }

    /// The gap function against the tool after `duration` seconds, for any node positions.
    pub fn gap_surface(&self, duration: f32) -> GapSurface {
        if let Some((ends, radius)) = self.rounded {
            return GapSurface::Rounded {
                ends: ends.map(|end| end.as_dvec3()),
                radius: f64::from(radius),
            };
        }
        let starts = self.starts.iter().zip(self.shares).take(self.count);
        let point: DVec3 = starts.map(|(start, share)| start.as_dvec3() * f64::from(share)).sum();
        let normal = self.normal.as_dvec3();
        GapSurface::Flat {
            weights: self.weights.map(f64::from),
            normal,
            level: point.dot(normal) + f64::from(self.target_velocity * duration + self.depth.max(0.0)),
        }
    }

    /// Returns the contact after an equation has been solved with it. The nodes have these velocities and received
    /// these normal and friction impulses, N s. The remaining gap `open`, m, may still close within `duration` seconds.
    pub fn solved(
        &self,
        gap: &Gap,
        (impulse, friction_impulse): (f32, Vec3),
        (open, duration): (f32, f32),
        velocities: &Vectors,
        (feature_nodes, mobility, held): (&FeatureNodes, &Mobility, [BVec3; MAX_FEATURE_NODES]),
    ) -> Self {
        let (weights, normal) = (gap.weights.map(|weight| weight as f32), gap.normal.as_vec3());
        let weighted_feature = (self.feature, weights);
        let created = Self::new(
            weighted_feature,
            feature_nodes,
            self.starts,
            normal,
            (mobility, held),
            [0.0; 2],
        );
        let mut solved = Self {
            surface_velocity: self.surface_velocity,
            arm: self.arm,
            depth: self.depth,
            friction: self.friction,
            tool: self.tool,
            tip: self.tip,
            rounded: self.rounded,
            ..created.unwrap_or(*self)
        };
        if let Some((_, radius)) = self.rounded {
            solved.arm += (solved.normal - self.normal) * radius;
        }
        solved.impulse = impulse;
        solved.friction_impulse = friction_impulse;
        solved.softness = 0.0;
        let velocity = solved.velocity(velocities).dot(solved.normal);
        solved.target_velocity = velocity - open.max(0.0) / duration;
        solved
    }

    /// The solver row of this contact. `index_of` maps a node to the index of its velocity.
    pub fn row(&self, index_of: impl Fn(u32) -> u32, dynamic_tools: &[SolverTool]) -> ContactRow {
        let mut indices = [0; MAX_FEATURE_NODES];
        for (index, &node) in indices.iter_mut().zip(self.nodes()) {
            *index = index_of(node);
        }
        let tool = dynamic_tools.get(self.dynamic_index as usize);
        ContactRow {
            dynamic_index: self.dynamic_index,
            arm: tool.map_or(Vec3A::ZERO, |tool| Vec3A::from(self.arm) - tool.center),
            is_backed: false,
            indices,
            shares: self.shares,
            inv_mass_weights: self.inv_mass_weights.map(Vec3A::from),
            normal: self.normal.into(),
            surface_velocity: self.surface_velocity.into(),
            target_velocity: self.target_velocity,
            friction: self.friction,
            effective_mass: self.effective_mass,
            tangent_mass: self.tangent_mass,
            softness: self.softness,
            impulse: self.impulse,
            friction_impulse: self.friction_impulse.into(),
        }
    }

    /// Stores the impulses that the solver found.
    pub fn store_impulse(&mut self, row: &ContactRow) {
        self.impulse = row.impulse;
        self.friction_impulse = row.friction_impulse.into();
    }

    /// Total impulse on the tissue, N s.
    pub fn total_impulse(&self) -> Vec3 {
        self.normal * self.impulse + self.friction_impulse
    }

    /// Moves a dynamic tool by its part of `displacement`, m.
    pub fn push_tool_out(&self, tool: &mut SolverTool, displacement: f32) {
        tool.push_out(-self.normal * (displacement * self.effective_mass));
    }

    /// Moves the nodes out of the tool by `displacement`, m, without changing their velocity.
    pub fn push_out(&self, positions: &mut Vectors, displacement: f32) {
        let push = self.normal * (displacement * self.effective_mass);
        for (&node, inv_mass) in self.nodes().iter().zip(self.inv_mass_weights) {
            let node = node as usize;
            let position = positions.get(node) + push * inv_mass;
            positions.set(node, position);
        }
    }

    /// Distance that the nodes still have to move to end the slice outside the tool, or less deep inside it, m.
    pub fn missing_distance(&self, positions: &Vectors, duration: f32) -> f32 {
        let nodes = self.nodes().iter().zip(self.starts).zip(self.shares);
        let displacement: Vec3 = nodes
            .map(|((&node, start), share)| (positions.get(node as usize) - start) * share)
            .sum();
        self.target_velocity * duration + depth_correction(duration) * self.depth.max(0.0)
            - displacement.dot(self.normal)
    }

    fn velocity(&self, velocities: &Vectors) -> Vec3 {
        self.nodes()
            .iter()
            .zip(self.shares)
            .map(|(&node, share)| velocities.get(node as usize) * share)
            .sum()
    }
}
