//! One contact: a node, edge or face that a tool does not let pass.

use glam::{BVec3, DVec3, Vec3, Vec3A};

use super::driven::YieldingTool;
use super::features::Feature;
use super::gauge::{Gauge, Meets};
use super::impulses::{LEVERAGE, pushed_out};
use super::press::Press;
use super::supports::{MOST, Supports};
use crate::codec::saved;
use crate::nodes::Mobility;
use crate::soa::Vectors;

/// A contact over one slice of a substep.
///
/// The weighted velocity of its nodes along the normal is at least `least_speed`: so much that at the end of the slice
/// they are clear of the tool. Across the normal Coulomb friction holds them to the tool's surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Constraint {
    pub feature: Feature,
    /// Weights of the feature's corners, 1 in sum.
    pub weights: [f32; 3],
    /// The nodes that move the feature.
    nodes: [u32; MOST],
    count: usize,
    /// Where they are when the contact begins.
    pub starts: [Vec3; MOST],
    /// What of the contact's impulse each of them receives, 1 in sum.
    pub shares: [f32; MOST],
    /// How much each node's velocity changes along each axis for an impulse at the contact, 1/kg.
    answers: [Vec3; MOST],
    /// Away from the tool, of unit length.
    pub normal: Vec3,
    least_speed: f32,
    /// The tool's surface at the contact, m/s.
    pub surface_velocity: Vec3,
    /// From the tool's position to the contact, m.
    pub arm: Vec3,
    /// How deep the nodes were inside at the start, m; not above 0 where they were outside.
    pub depth: f32,
    pub friction: f32,
    /// The tool's place among those near the body.
    pub tool: usize,
    /// Its place among the dynamic tools of the step; [`u32::MAX`]: the tool is led.
    pub yielding: u32,
    /// Which end of a capsule a face meets, since it may meet both; 0 of all else.
    pub tip: u8,
    /// The mass that an impulse at the contact moves, kg; less where its nodes are held along axes near the normal.
    effective_mass: f32,
    /// The least that it moves along any direction.
    free_mass: f32,
    /// How far the contact gives way, 0 to 1: 0 but near pinned nodes, where it would fling away the free ones.
    pub give: f32,
    /// What part of the impulse that would stop the contact it gives at a time: 1 where it does not give way.
    pub firmness: f32,
    /// What it has given so far, N s, at least 0.
    impulse: f32,
    /// What friction has given so far, N s.
    friction_impulse: Vec3,
    /// What of that its tool's load has, N s.
    pub counted: Vec3,
    /// For a rounded tool: the ends of the segment within it when the contact ends, as far as this feature meets it, and its radius.
    pub rounded: Option<([Vec3; 2], f32)>,
}

saved! { Constraint {
    feature, weights, nodes, count, starts, shares, answers, normal, least_speed, surface_velocity, arm, depth,
    friction, tool, yielding, tip, effective_mass, free_mass, give, firmness, impulse, friction_impulse, counted,
    rounded,
} }

impl Constraint {
    /// A contact that has given nothing yet, of a feature that these nodes move, which are held along these axes but have a mobility, with a
    /// tool that becomes so much faster for an impulse, along the normal and along any direction at most, 1/kg. `None`: neither can move
    /// along the normal.
    pub fn new(
        (feature, weights): (Feature, [f32; 3]),
        supports: &Supports,
        starts: [Vec3; MOST],
        normal: Vec3,
        (mobility, held): (&Mobility, [BVec3; MOST]),
        [recoil, most_recoil]: [f32; 2],
    ) -> Option<Self> {
        let shares = supports.shares(weights);
        let mut nodes = [0; MOST];
        let mut answers = [Vec3::ZERO; MOST];
        // Along the normal, and along a direction in which all nodes are free.
        let (mut rigid, mut free, mut leverage) = (0.0, 0.0, 0.0_f32);
        for (place, (&node, share)) in supports.nodes().iter().zip(shares).enumerate() {
            nodes[place] = node;
            let answer = mobility.of(node as usize) * share;
            answers[place] = Vec3::select(held[place], Vec3::ZERO, Vec3::splat(answer));
            let along = if held[place].any() {
                Vec3::select(held[place], Vec3::ZERO, normal).length_squared()
            } else {
                1.0
            };
            rigid += answer * along * share;
            free += answer * share;
            leverage = leverage.max(answer / LEVERAGE);
        }
        let (rigid, free) = (rigid + recoil, free + most_recoil);
        let inverse_mass = leverage.max(rigid);
        // The nearer the normal is to axes that nodes are held along, the less is given, down to nothing.
        let fading = (rigid / leverage.min(free)).min(1.0);
        (rigid > 0.0).then(|| Self {
            feature,
            weights,
            nodes,
            count: supports.nodes().len(),
            starts,
            shares,
            answers,
            normal,
            least_speed: 0.0,
            surface_velocity: Vec3::ZERO,
            arm: Vec3::ZERO,
            depth: 0.0,
            friction: 0.0,
            tool: 0,
            yielding: u32::MAX,
            tip: 0,
            effective_mass: fading / inverse_mass,
            free_mass: 1.0 / leverage.max(free),
            give: 1.0 - rigid / inverse_mass,
            firmness: fading * rigid / inverse_mass,
            impulse: 0.0,
            friction_impulse: Vec3::ZERO,
            counted: Vec3::ZERO,
            rounded: None,
        })
    }

    /// The nodes that move the feature.
    pub fn nodes(&self) -> &[u32] {
        &self.nodes[..self.count]
    }

    /// Lets the nodes come closer to the tool's surface by `gap` within `duration` seconds, and no further; where they
    /// are inside, not deeper.
    pub fn allow_gap(&mut self, gap: f32, duration: f32) {
        self.depth = -gap;
        self.least_speed = self.surface_velocity.dot(self.normal) - gap.max(0.0) / duration;
    }

    /// How its feature meets the tool after `duration` seconds, wherever its nodes are then.
    pub fn gauge(&self, duration: f32) -> Gauge {
        if let Some((ends, radius)) = self.rounded {
            return Gauge::Rounded {
                ends: ends.map(|end| end.as_dvec3()),
                radius: f64::from(radius),
            };
        }
        let starts = self.starts.iter().zip(self.shares).take(self.count);
        let matter: DVec3 = starts.map(|(start, share)| start.as_dvec3() * f64::from(share)).sum();
        let normal = self.normal.as_dvec3();
        Gauge::Flat {
            weights: self.weights.map(f64::from),
            normal,
            level: matter.dot(normal) + f64::from(self.least_speed * duration + self.depth.max(0.0)),
        }
    }

    /// The same contact after an equation has been solved with it: its nodes meet the tool thus, with these velocities, and have
    /// received an impulse along the normal and one of friction, N s. What is left open, m, may still be closed within `duration` seconds.
    pub fn after(
        &self,
        meets: &Meets,
        (impulse, friction_impulse): (f32, Vec3),
        (open, duration): (f32, f32),
        velocities: &Vectors,
        (supports, mobility, held): (&Supports, &Mobility, [BVec3; MOST]),
    ) -> Self {
        let (weights, normal) = (meets.weights.map(|weight| weight as f32), meets.normal.as_vec3());
        let met = (self.feature, weights);
        let found = Self::new(met, supports, self.starts, normal, (mobility, held), [0.0; 2]);
        let mut after = Self {
            surface_velocity: self.surface_velocity,
            arm: self.arm,
            depth: self.depth,
            friction: self.friction,
            tool: self.tool,
            tip: self.tip,
            rounded: self.rounded,
            ..found.unwrap_or(*self)
        };
        if let Some((_, radius)) = self.rounded {
            after.arm += (after.normal - self.normal) * radius;
        }
        after.impulse = impulse;
        after.friction_impulse = friction_impulse;
        after.give = 0.0;
        let velocity = after.velocity(velocities).dot(after.normal);
        after.least_speed = velocity - open.max(0.0) / duration;
        after
    }

    /// What it asks of the velocities at these places of its nodes.
    pub fn press(&self, place_of: impl Fn(u32) -> u32, yielding: &[YieldingTool]) -> Press {
        let mut places = [0; MOST];
        for (place, &node) in places.iter_mut().zip(self.nodes()) {
            *place = place_of(node);
        }
        let tool = yielding.get(self.yielding as usize);
        Press {
            yielding: self.yielding,
            arm: tool.map_or(Vec3A::ZERO, |tool| Vec3A::from(self.arm) - tool.center),
            is_backed: false,
            places,
            shares: self.shares,
            answers: self.answers.map(Vec3A::from),
            normal: self.normal.into(),
            surface_velocity: self.surface_velocity.into(),
            least_speed: self.least_speed,
            friction: self.friction,
            effective_mass: self.effective_mass,
            free_mass: self.free_mass,
            give: self.give,
            impulse: self.impulse,
            friction_impulse: self.friction_impulse.into(),
        }
    }

    /// Takes over what it gave.
    pub fn take(&mut self, press: &Press) {
        self.impulse = press.impulse;
        self.friction_impulse = press.friction_impulse.into();
    }

    /// What the tissue received, N s.
    pub fn given(&self) -> Vec3 {
        self.normal * self.impulse + self.friction_impulse
    }

    /// The part of such a way out, m, that a dynamic tool goes.
    pub fn push_back(&self, tool: &mut YieldingTool, way: f32) {
        tool.push_out(-self.normal * (way * self.effective_mass));
    }

    /// Moves the nodes out of the tool by so much, m, without giving them speed.
    pub fn push_out(&self, positions: &mut Vectors, way: f32) {
        let push = self.normal * (way * self.effective_mass);
        for (&node, answer) in self.nodes().iter().zip(self.answers) {
            let node = node as usize;
            let position = positions.get(node) + push * answer;
            positions.set(node, position);
        }
    }

    /// How much further its nodes are to go to end the slice of `duration` seconds outside of the tool, or less deep within it, m.
    pub fn lacks(&self, positions: &Vectors, duration: f32) -> f32 {
        let nodes = self.nodes().iter().zip(self.starts).zip(self.shares);
        let way: Vec3 = nodes
            .map(|((&node, start), share)| (positions.get(node as usize) - start) * share)
            .sum();
        self.least_speed * duration + pushed_out(duration) * self.depth.max(0.0) - way.dot(self.normal)
    }

    fn velocity(&self, velocities: &Vectors) -> Vec3 {
        self.nodes()
            .iter()
            .zip(self.shares)
            .map(|(&node, share)| velocities.get(node as usize) * share)
            .sum()
    }
}
