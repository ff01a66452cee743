//! One contact of tissue with tissue.

use glam::{BVec3, Vec3, Vec3A};

use super::skin::Skin;
use crate::codec::saved;
use crate::contact::impulses::LEVERAGE;
use crate::contact::supports::MOST;
use crate::solver::System;

/// A node, edge or face of a body, and a point of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ContactSide {
    /// Which body, by its place in the world.
    pub body: usize,
    /// Of nodes that it does not have the weight is 0.
    pub nodes: [u32; 3],
    pub weights: [f32; 3],
}

saved! { ContactSide { body, nodes, weights } }

/// Which sides a contact is between, whatever points of them.
pub(super) type Key = [(usize, [u32; 3]); 2];

/// The part of how much too close its sides began that a contact moves them apart by in a substep, at most: with more, what rests on a tip trembles.
const MOVED_OUT: f32 = 0.05;

/// A contact over one step: the first side stays clear of the second.
#[derive(Clone, Copy, Debug)]
pub(super) struct Link {
    pub sides: [ContactSide; 2],
    /// From the second side to the first.
    pub normal: Vec3,
    /// The mean velocity of the first side against the second along the normal is at least this, m/s.
    pub least_speed: f32,
    /// How much closer than they may be they were when the step began, m.
    pub depth: f32,
    /// Whether they were one until a cut parted them.
    pub is_parted: bool,
    /// Whether they only come near: another takes its place where there is no room for both.
    pub is_ahead: bool,
    pub friction: f32,
    /// The nodes that move each side, so many of them. They are the side's own but where it is bound to others.
    movers: [[Mover; MOST]; 2],
    counts: [u32; 2],
    mass: f32,
    /// What it has given so far, N s.
    impulse: f32,
    friction_impulse: Vec3,
    /// How much of it was recalled, N s.
    recalled: f32,
    /// The same of what moves its sides apart without giving them speed, kg m.
    push: f32,
}

saved! { Link {
    sides, normal, least_speed, depth, is_parted, is_ahead, friction, movers, counts, mass, impulse, friction_impulse, recalled, push,
} }

/// A node that moves a side of a contact.
#[derive(Clone, Copy, Debug, Default)]
struct Mover {
    node: u32,
    /// Its part of the side.
    part: f32,
    /// How much faster it becomes for an impulse on the side, 1/kg.
    answer: Vec3A,
}

saved! { Mover { node, part, answer } }

impl ContactSide {
    /// A node of a body.
    pub fn of_node(body: usize, node: u32) -> Self {
        Self {
            body,
            nodes: [node; 3],
            weights: [1.0, 0.0, 0.0],
        }
    }

    /// The point of an edge of a body that is this part of the way along it.
    pub fn of_edge(body: usize, [from, to]: [u32; 2], along: f32) -> Self {
        Self {
            body,
            nodes: [from, to, to],
            weights: [1.0 - along, along, 0.0],
        }
    }

    /// Whose it is, whatever point of it.
    pub fn key(&self) -> (usize, [u32; 3]) {
        (self.body, self.nodes)
    }

    /// The nodes that move it, with their parts: its own, or what those are bound to.
    fn movers(&self, body: &System) -> [(u32, f32); MOST] {
        let mut movers = [(0, 0.0); MOST];
        let own = self.nodes.into_iter().zip(self.weights);
        let Some(bindings) = &body.bindings else {
            movers.iter_mut().zip(own).for_each(|(mover, own)| *mover = own);
            return movers;
        };
        let mut count = 0;
        for (node, weight) in own.filter(|(_, weight)| *weight > 0.0) {
            for (node, part) in bindings.parts(node) {
                let known = movers[..count].iter().position(|mover| mover.0 == node);
                // A triangle lies in one cell. No impulse is lost in any case.
                let place = known.unwrap_or(count.min(MOST - 1));
                count = count.max(place + 1);
                movers[place] = (node, movers[place].1 + weight * part);
            }
        }
        movers
    }

    /// The point's part of what nodes have.
    pub fn weighted(&self, vector_of: impl Fn(u32) -> Vec3) -> Vec3 {
        let used = self
            .nodes
            .into_iter()
            .zip(self.weights)
            .filter(|(_, weight)| *weight > 0.0);
        used.map(|(node, weight)| vector_of(node) * weight).sum()
    }
}

impl Link {
    /// A contact that has given nothing yet; `None` where neither side can move.
    pub fn new(sides: [ContactSide; 2], normal: Vec3, bodies: [&System; 2]) -> Option<Self> {
        let (mut whole, mut leverage) = (0.0, 0.0_f32);
        let (mut movers, mut counts) = ([[Mover::default(); MOST]; 2], [0; 2]);
        for side in 0..2 {
            let body = bodies[side];
            let with_part = sides[side].movers(body).into_iter().filter(|(_, part)| *part > 0.0);
            for (mover, (node, part)) in movers[side].iter_mut().zip(with_part) {
                let mobility = body.inverse_masses[node as usize] * part;
                let held: BVec3 = body.pins.partial_axes_of(node);
                let answer = Vec3::select(held, Vec3::ZERO, Vec3::splat(mobility));
                *mover = Mover {
                    node,
                    part,
                    answer: answer.into(),
                };
                whole += part * (answer * normal).dot(normal);
                leverage = leverage.max(mobility / LEVERAGE);
                counts[side] += 1;
            }
        }
        (whole > 0.0).then(|| Self {
            sides,
            normal,
            least_speed: 0.0,
            depth: 0.0,
            is_parted: false,
            is_ahead: false,
            friction: 0.0,
            movers,
            counts,
            mass: 1.0 / whole.max(leverage),
            impulse: 0.0,
            friction_impulse: Vec3::ZERO,
            recalled: 0.0,
            push: 0.0,
        })
    }

    /// Lets the sides come closer by `gap` within `duration` seconds, and no further; where that is below 0, not closer.
    pub fn allow_gap(&mut self, gap: f32, duration: f32) {
        self.depth = -gap;
        self.least_speed = self.least_speed_found(duration);
    }

    /// The least speed that its gap asks for, m/s.
    pub fn least_speed_found(&self, duration: f32) -> f32 {
        self.depth.min(0.0) / duration
    }

    /// Has the sides go faster apart by what brings them nearer beside their way along the normal, m.
    pub fn turn(&mut self, nearer: f32, duration: f32) {
        self.least_speed = self.least_speed_found(duration) + nearer.max(0.0) / duration;
    }

    /// Whether it has given anything.
    pub fn presses(&self) -> bool {
        self.impulse > 0.0
    }

    /// Gives what is missing, or takes back what was too much: how much faster the sides move against each other for it, m/s.
    pub fn solve(&mut self, skins: &mut [Option<Skin>]) -> f32 {
        let velocity = self.velocity(skins);
        let impulse = (self.impulse + (self.least_speed - velocity.dot(self.normal)) * self.mass).max(0.0);
        if impulse == 0.0 && self.impulse == 0.0 {
            return 0.0;
        }
        let mut given = self.normal * (impulse - self.impulse);
        self.impulse = impulse;
        let slip = velocity.reject_from_normalized(self.normal);
        let wanted = self.friction_impulse - slip * self.mass;
        let friction = wanted.clamp_length_max(self.friction * impulse);
        given += friction - self.friction_impulse;
        self.friction_impulse = friction;
        if given != Vec3::ZERO {
            self.give(given, skins, |skin| &mut skin.velocities);
        }
        given.length() / self.mass
    }

    /// Adds what its nodes get for an impulse to their values.
    #[inline]
    fn give(&self, impulse: Vec3, skins: &mut [Option<Skin>], values: impl Fn(&mut Skin) -> &mut Vec<Vec3A>) {
        let impulse = Vec3A::from(impulse);
        for (index, impulse) in [impulse, -impulse].into_iter().enumerate() {
            if let Some(skin) = &mut skins[self.sides[index].body] {
                let values = values(skin);
                for mover in self.movers_of(index) {
                    values[mover.node as usize] += impulse * mover.answer;
                }
            }
        }
    }

    /// Moves its sides apart where they began too close, by `most` at most, m, in a substep of `duration` seconds, or no closer than they may come
    /// otherwise: [`Skin::expected`] has how far each node has been moved.
    ///
    /// Sides that a cut has parted begin too close: they go no further than they were kept from going, so that nothing parts them where nothing
    /// presses.
    pub fn part(&mut self, most: f32, duration: f32, skins: &mut [Option<Skin>]) {
        let moved = self.against(skins, |skin| &skin.expected).dot(self.normal);
        let way = if self.depth > 0.0 {
            most.min(MOVED_OUT * self.depth)
        } else if moved < 0.0 {
            let speed = self.velocity(skins).dot(self.normal);
            (self.least_speed - speed).min(0.0) * duration
        } else {
            return;
        };
        let mut push = (self.push + (way - moved) * self.mass).max(0.0);
        if self.depth > 0.0 {
            push = push.min(way * self.mass);
        }
        if self.is_parted {
            push = push.min(self.impulse * duration);
        }
        let more = self.normal * (push - self.push);
        self.push = push;
        self.give(more, skins, |skin| &mut skin.expected);
    }

    /// The nodes that move a side, with their parts of it.
    pub fn movers(&self, side: usize) -> impl Iterator<Item = (u32, f32)> + '_ {
        self.movers_of(side).iter().map(|mover| (mover.node, mover.part))
    }

    fn movers_of(&self, side: usize) -> &[Mover] {
        &self.movers[side][..self.counts[side] as usize]
    }

    /// What the first side received, N s.
    pub fn given(&self) -> Vec3 {
        self.normal * self.impulse + self.friction_impulse
    }

    /// Of the first side against the second, m/s.
    #[inline]
    fn velocity(&self, skins: &[Option<Skin>]) -> Vec3 {
        self.against(skins, |skin| &skin.velocities)
    }

    /// What the first side has more of these values than the second.
    #[inline]
    fn against(&self, skins: &[Option<Skin>], values: impl Fn(&Skin) -> &[Vec3A]) -> Vec3 {
        let [first, second] = [0, 1].map(|side| {
            skins[self.sides[side].body].as_ref().map_or(Vec3A::ZERO, |skin| {
                let (values, movers) = (values(skin), self.movers_of(side).iter());
                movers.map(|mover| values[mover.node as usize] * mover.part).sum()
            })
        });
        (first - second).into()
    }

    /// The nodes that move both sides, with the places of their bodies.
    pub fn all_movers(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        (0..2).flat_map(move |side| {
            self.movers(side)
                .map(move |(node, _)| (self.sides[side].body, node as usize))
        })
    }

    /// Which sides it is between, whatever points of them.
    pub fn key(&self) -> Key {
        self.sides.map(|side| side.key())
    }

    /// Takes it to give what it gave before; [`give_again`](super::warm_start::give_again) has nodes receive it.
    pub fn recall(&mut self, impulse: f32, friction: Vec3) {
        self.impulse = impulse;
        let friction = friction.reject_from_normalized(self.normal);
        self.friction_impulse = friction.clamp_length_max(self.friction * impulse);
    }

    /// What it gives along its normal and across it, N s.
    pub fn impulses(&self) -> (f32, Vec3) {
        (self.impulse, self.friction_impulse)
    }

    /// The work of what it gives, J, at the velocity that its sides have now; of that, what keeps them from coming closer than they may.
    pub fn work(&self, skins: &[Option<Skin>]) -> [f32; 2] {
        let given = self.given();
        [given.dot(self.velocity(skins)), self.impulse * self.least_speed]
    }

    /// Has nodes receive so many times what it gives.
    pub fn give_share(&self, share: f32, skins: &mut [Option<Skin>]) {
        self.give(self.given() * share, skins, |skin| &mut skin.velocities);
    }

    /// What it gives along its normal beyond what it recalled, as a part of all that.
    pub fn fresh_share(&self) -> f32 {
        ((self.impulse - self.recalled) / self.impulse).clamp(-1.0, 1.0)
    }

    /// Takes it to have recalled so many times what it did.
    pub fn scale(&mut self, share: f32) {
        self.impulse *= share;
        self.recalled = self.impulse;
        self.friction_impulse *= share;
    }

    /// How fast what it gives makes its sides alone, m/s.
    pub fn speed(&self) -> f32 {
        self.given().length() / self.mass
    }
}
