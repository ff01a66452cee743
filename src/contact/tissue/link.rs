//! One contact of tissue with tissue.

use glam::{BVec3, Vec3};

use super::skin::Skin;
use crate::body::Body;
use crate::contact::impulses::LEVERAGE;

/// A node, edge or face of a body, and a point of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Side {
    /// Which body, by its place in the world.
    pub body: usize,
    /// Of nodes that it does not have the weight is 0.
    pub nodes: [u32; 3],
    pub weights: [f32; 3],
}

/// A contact over one step: the first side stays clear of the second.
#[derive(Clone, Copy, Debug)]
pub(super) struct Link {
    pub sides: [Side; 2],
    /// From the second side to the first.
    pub normal: Vec3,
    /// The mean velocity of the first side against the second along the normal is at least this, m/s.
    pub least_speed: f32,
    /// How much closer than they may be they were when the step began, m.
    pub depth: f32,
    pub friction: f32,
    /// How much faster each node of each side becomes for an impulse, 1/kg.
    answers: [[Vec3; 3]; 2],
    mass: f32,
    /// What it has given so far, N s.
    impulse: f32,
    friction_impulse: Vec3,
}

impl Side {
    /// Whose it is, whatever point of it.
    pub fn key(&self) -> (usize, [u32; 3]) {
        (self.body, self.nodes)
    }

    pub fn used(&self) -> impl Iterator<Item = (usize, f32)> {
        let pairs = self.nodes.into_iter().zip(self.weights);
        pairs
            .filter(|(_, weight)| *weight > 0.0)
            .map(|(node, weight)| (node as usize, weight))
    }

    /// The point's part of what nodes have.
    pub fn weighted(&self, vector_of: impl Fn(usize) -> Vec3) -> Vec3 {
        self.used().map(|(node, weight)| vector_of(node) * weight).sum()
    }
}

impl Link {
    /// A contact that has given nothing yet; `None` where neither side can move.
    pub fn new(sides: [Side; 2], normal: Vec3, bodies: [&Body; 2]) -> Option<Self> {
        let mut answers = [[Vec3::ZERO; 3]; 2];
        let (mut whole, mut leverage) = (0.0, 0.0_f32);
        for (side, (body, answers)) in sides.iter().zip(bodies.into_iter().zip(&mut answers)) {
            for (answer, (&node, weight)) in answers.iter_mut().zip(side.nodes.iter().zip(side.weights)) {
                let mobility = body.inverse_masses[node as usize] * weight;
                let held: BVec3 = body.pins.partial_axes_of(node);
                *answer = Vec3::select(held, Vec3::ZERO, Vec3::splat(mobility));
                whole += weight * (*answer * normal).dot(normal);
                leverage = leverage.max(mobility / LEVERAGE);
            }
        }
        (whole > 0.0).then(|| Self {
            sides,
            normal,
            least_speed: 0.0,
            depth: 0.0,
            friction: 0.0,
            answers,
            mass: 1.0 / whole.max(leverage),
            impulse: 0.0,
            friction_impulse: Vec3::ZERO,
        })
    }

    /// Lets the sides come closer by `gap` within `duration` seconds, and no further; where that is below 0, not closer.
    pub fn allow_gap(&mut self, gap: f32, duration: f32) {
        self.depth = -gap;
        self.least_speed = -gap.max(0.0) / duration;
    }

    /// Gives what is missing, or takes back what was too much: how much faster the sides move against each other for it, m/s.
    pub fn solve(&mut self, skins: &mut [Option<Skin>]) -> f32 {
        let velocity = self.velocity(skins);
        let impulse = (self.impulse + (self.least_speed - velocity.dot(self.normal)) * self.mass).max(0.0);
        let mut given = self.normal * (impulse - self.impulse);
        self.impulse = impulse;
        let slip = velocity.reject_from_normalized(self.normal);
        let wanted = self.friction_impulse - slip * self.mass;
        let friction = wanted.clamp_length_max(self.friction * impulse);
        given += friction - self.friction_impulse;
        self.friction_impulse = friction;
        if given != Vec3::ZERO {
            self.give(given, skins);
        }
        given.length() / self.mass
    }

    fn give(&self, impulse: Vec3, skins: &mut [Option<Skin>]) {
        for (side, (answers, sign)) in self.sides.iter().zip(self.answers.iter().zip([1.0, -1.0])) {
            if let Some(skin) = &mut skins[side.body] {
                for (&node, answer) in side.nodes.iter().zip(answers) {
                    if *answer != Vec3::ZERO {
                        let mean = skin.velocities.get(node as usize) + impulse * *answer * sign;
                        skin.velocities.set(node as usize, mean);
                    }
                }
            }
        }
    }

    /// The ways, m, by which nodes of the sides come apart by `part` of how much too close they began.
    pub fn parting(&self, part: f32) -> impl Iterator<Item = (usize, usize, Vec3)> + '_ {
        let push = self.normal * (self.depth.max(0.0) * part * self.mass);
        (0..2).flat_map(move |side| {
            let sign = [1.0, -1.0][side];
            let Side { body, nodes, .. } = self.sides[side];
            (0..3).map(move |corner| (body, nodes[corner] as usize, push * self.answers[side][corner] * sign))
        })
    }

    /// What the first side received, N s.
    pub fn given(&self) -> Vec3 {
        self.normal * self.impulse + self.friction_impulse
    }

    /// Of the first side against the second, m/s.
    fn velocity(&self, skins: &[Option<Skin>]) -> Vec3 {
        let [first, second] = self.sides.map(|side| match &skins[side.body] {
            Some(skin) => side.weighted(|node| skin.velocities.get(node)),
            None => Vec3::ZERO,
        });
        first - second
    }
}
