//! What contacts ask of velocities, solved one after another: sequential impulses (Catto 2005), which is projected Gauss-Seidel.
//!
//! A sweep reads and writes nothing but what is here, side by side: the velocities are those of the contacts' nodes alone.

use glam::{Vec3, Vec3A};

use super::constraint::Constraint;
use super::driven::YieldingTool;
use super::impulses::{Effort, Sweep, relax};
use super::supports::MOST;
use crate::base::{Result, memory};
use crate::codec::saved;
use crate::soa::Vectors;

/// One contact as its impulse is found.
#[derive(Clone, Copy, Debug)]
pub(super) struct Press {
    /// Its tool's place among the dynamic ones; [`u32::MAX`]: the tool is led.
    pub yielding: u32,
    /// From the centre of mass of a dynamic tool, m.
    pub arm: Vec3A,
    /// Whether another tool holds one of its nodes against it.
    pub is_backed: bool,
    /// Where the velocities of its nodes are; of fewer than [`MOST`] the rest has no share.
    pub places: [u32; MOST],
    pub shares: [f32; MOST],
    /// How much each velocity changes for an impulse, 1/kg.
    pub answers: [Vec3A; MOST],
    pub normal: Vec3A,
    /// m/s
    pub surface_velocity: Vec3A,
    /// m/s
    pub least_speed: f32,
    pub friction: f32,
    /// kg
    pub effective_mass: f32,
    /// kg
    pub free_mass: f32,
    pub give: f32,
    /// What it has given so far, N s, at least 0, and what friction has.
    pub impulse: f32,
    pub friction_impulse: Vec3A,
}

saved! { Press {
    yielding, arm, is_backed, places, shares, answers, normal, surface_velocity, least_speed, friction, effective_mass,
    free_mass, give, impulse, friction_impulse,
} }

impl Press {
    /// Gives what is missing, or takes back what was too much: how much faster the contact moves for it, m/s.
    #[inline]
    fn solve(&mut self, velocities: &mut [Vec3A], yielding: &mut [YieldingTool]) -> f32 {
        let places = self.places.map(|place| place as usize);
        let mut velocity = velocities[places[0]] * self.shares[0];
        for index in 1..MOST {
            velocity += velocities[places[index]] * self.shares[index];
        }
        let mut tool = yielding.get_mut(self.yielding as usize);
        if let Some(tool) = &tool {
            velocity -= tool.gained(self.arm);
        }
        let missing = self.least_speed - velocity.dot(self.normal);
        let impulse = (self.impulse * (1.0 - self.give) + missing * self.effective_mass).max(0.0);
        let change = impulse - self.impulse;
        self.impulse = impulse;
        let is_idle = impulse == 0.0 && self.friction_impulse == Vec3A::ZERO;
        if change == 0.0 && (self.friction == 0.0 || is_idle) {
            return 0.0;
        }
        let mut given = self.normal * change;
        if self.friction > 0.0 {
            let slip = (velocity - self.surface_velocity).reject_from_normalized(self.normal);
            let wanted = self.friction_impulse - slip * self.free_mass;
            let friction = wanted.clamp_length_max(self.friction * impulse);
            given += friction - self.friction_impulse;
            self.friction_impulse = friction;
        }
        for index in 0..MOST {
            velocities[places[index]] += given * self.answers[index];
        }
        if let Some(tool) = &mut tool {
            tool.recoil(self.arm, given);
        }
        given.length() / self.free_mass
    }

    /// The same for nodes that are held from behind: what goes against that is taken there.
    fn solve_backed(&mut self, velocities: &mut [Vec3A], yielding: &mut [YieldingTool], backs: &mut [Back]) -> f32 {
        let places = self.places.map(|place| place as usize);
        let before = places.map(|place| velocities[place]);
        let change = self.solve(velocities, yielding);
        for index in (0..MOST).filter(|&index| self.shares[index] > 0.0) {
            let back = &mut backs[places[index]];
            let answer = self.answers[index].max_element();
            if back.normal == Vec3A::ZERO || answer == 0.0 {
                continue;
            }
            let along = (velocities[places[index]] - before[index]).dot(back.normal);
            velocities[places[index]] -= back.normal * along;
            back.taken -= along * self.shares[index] / answer;
        }
        change
    }

    /// Whether it is one of a led tool and a single node, to which it gives something.
    fn is_back(&self) -> bool {
        self.yielding == u32::MAX && self.shares[0] == 1.0 && self.impulse > 0.0 && self.give == 0.0
    }

    /// Whether it has given anything.
    fn presses(&self) -> bool {
        self.impulse > 0.0
    }
}

/// A node is held between two tools where their normals look against each other by this cosine or more.
const HELD_BETWEEN: f32 = 0.1;

/// The contacts of a slice while they are solved.
#[derive(Debug, Default)]
pub(super) struct Presses {
    presses: Vec<Press>,
    /// The nodes of all of them, in order, and their velocities.
    nodes: Vec<u32>,
    velocities: Vec<Vec3A>,
    /// Dynamic tools; empty where there are none.
    pub yielding: Vec<YieldingTool>,
    /// What holds each node against a dynamic tool.
    backs: Vec<Back>,
}

saved! { Presses { presses, nodes, velocities } leaves { yielding: Vec::new(), backs: Vec::new() } }

/// A tool that is led and presses a node: it takes what a dynamic tool gives the node against it.
#[derive(Clone, Copy, Debug)]
struct Back {
    /// Away from that tool; 0 where there is none.
    normal: Vec3A,
    /// What it has taken that its contact has not yet, N s.
    taken: f32,
    /// What its contact has given, N s.
    impulse: f32,
}

impl Presses {
    /// Makes room for so many contacts of a body of so many nodes.
    pub fn reserve(&mut self, contacts: usize) -> Result<()> {
        memory::reserve(&mut self.presses, contacts)?;
        memory::reserve(&mut self.nodes, MOST * contacts)?;
        memory::reserve(&mut self.velocities, MOST * contacts)?;
        let is_used = self.yielding.capacity() > 0;
        memory::reserve(&mut self.backs, if is_used { MOST * contacts } else { 0 })
    }

    /// Makes room for so many dynamic tools beside.
    pub fn reserve_yielding(&mut self, count: usize, contacts: usize) -> Result<()> {
        memory::reserve(&mut self.yielding, count)?;
        memory::reserve(&mut self.backs, if count > 0 { MOST * contacts } else { 0 })
    }

    /// Lists the nodes of these contacts.
    pub fn list_nodes(&mut self, constraints: &[Constraint]) {
        self.nodes.clear();
        for constraint in constraints {
            self.nodes.extend_from_slice(constraint.nodes());
        }
        memory::sort_once(&mut self.nodes);
    }

    /// Whether a node is listed.
    pub fn has(&self, node: u32) -> bool {
        self.nodes.binary_search(&node).is_ok()
    }

    /// Gives the impulses of these contacts, for which there is room, in so many sweeps at most: the most that one of the first sweep
    /// changed, m/s.
    pub fn solve(&mut self, constraints: &mut [Constraint], velocities: &mut Vectors, sweeps: u32) -> f32 {
        self.list_nodes(constraints);
        let Self { presses, nodes, .. } = self;
        let place = |node: u32| nodes.binary_search(&node).unwrap_or_default() as u32;
        presses.clear();
        presses.extend(
            constraints
                .iter()
                .map(|constraint| constraint.press(place, &self.yielding)),
        );

        self.read(|node| velocities.get(node).into());
        let effort = Effort::of(sweeps);
        let first = relax(effort, None, |sweep| self.sweep_own(sweep));
        if !self.yielding.is_empty() && self.find_backs() {
            relax(effort, Some(first), |sweep| self.sweep_backed(sweep));
        }
        for (&node, &velocity) in self.nodes.iter().zip(&self.velocities) {
            velocities.set(node as usize, velocity.into());
        }
        self.hand_over(constraints);
        first
    }

    /// One sweep over the contacts that [`Presses::solve`] has gathered, on velocities that something else has changed since: the most that one
    /// of them changed, m/s.
    pub fn sweep(&mut self, velocities: &mut [Vec3A], sweep: Sweep) -> f32 {
        self.read(|node| velocities[node]);
        let largest = self.sweep_own(sweep);
        for (&node, &velocity) in self.nodes.iter().zip(&self.velocities) {
            velocities[node as usize] = velocity;
        }
        largest
    }

    /// Hands over what contacts gave.
    pub fn hand_over(&self, constraints: &mut [Constraint]) {
        for (constraint, press) in constraints.iter_mut().zip(&self.presses) {
            constraint.take(press);
        }
    }

    fn read(&mut self, velocity_of: impl Fn(usize) -> Vec3A) {
        self.velocities.clear();
        self.velocities
            .extend(self.nodes.iter().map(|&node| velocity_of(node as usize)));
    }

    /// Finds the nodes that are held between a tool that is led and a dynamic one, and has the contacts of the dynamic one know: whether there
    /// are any. However heavy that is and however light the nodes, it is stopped then; contact by contact it would take as many sweeps as it
    /// is heavier.
    fn find_backs(&mut self) -> bool {
        let none = Back {
            normal: Vec3A::ZERO,
            taken: 0.0,
            impulse: 0.0,
        };
        self.backs.clear();
        self.backs.resize(self.nodes.len(), none);
        for press in self.presses.iter().filter(|press| press.is_back()) {
            let back = &mut self.backs[press.places[0] as usize];
            if press.impulse > back.impulse {
                (back.normal, back.impulse) = (press.normal, press.impulse);
            }
        }
        let mut any = false;
        for press in &mut self.presses {
            let Some(tool) = self.yielding.get(press.yielding as usize) else {
                continue;
            };
            let places = press.places.map(|place| place as usize);
            let is_held = |index: usize| self.backs[places[index]].normal.dot(press.normal) < -HELD_BETWEEN;
            if !(0..MOST).any(is_held) {
                continue;
            }
            any = true;
            let nodes = (0..MOST).map(|index| {
                let answer = press.normal * press.answers[index];
                let normal = self.backs[places[index]].normal;
                press.shares[index] * press.normal.dot(answer - normal * answer.dot(normal))
            });
            press.is_backed = true;
            press.effective_mass = 1.0 / (nodes.sum::<f32>() + tool.answer(press.arm, press.normal));
            press.give = 0.0;
        }
        any
    }

    /// One sweep in which contacts of dynamic tools act through nodes on what is behind those.
    fn sweep_backed(&mut self, sweep: Sweep) -> f32 {
        let mut largest = 0.0_f32;
        for press in &mut self.presses {
            if press.is_back() {
                let back = &mut self.backs[press.places[0] as usize];
                if back.normal == press.normal {
                    press.impulse += std::mem::take(&mut back.taken);
                }
            }
            if sweep == Sweep::All || press.presses() {
                let change = if press.is_backed {
                    press.solve_backed(&mut self.velocities, &mut self.yielding, &mut self.backs)
                } else {
                    press.solve(&mut self.velocities, &mut self.yielding)
                };
                largest = largest.max(change);
            }
        }
        largest
    }

    fn sweep_own(&mut self, sweep: Sweep) -> f32 {
        let mut largest = 0.0_f32;
        for press in &mut self.presses {
            if sweep == Sweep::All || press.presses() {
                largest = largest.max(press.solve(&mut self.velocities, &mut self.yielding));
            }
        }
        largest
    }
}

/// Gives the impulse of one contact as if there were no others.
pub(super) fn solve_alone(constraint: &mut Constraint, velocities: &mut Vectors, yielding: &mut [YieldingTool]) {
    let mut own = [Vec3A::ZERO; MOST];
    for (velocity, &node) in own.iter_mut().zip(constraint.nodes()) {
        *velocity = velocities.get(node as usize).into();
    }
    let place = |node: u32| {
        constraint
            .nodes()
            .iter()
            .position(|&known| known == node)
            .unwrap_or_default() as u32
    };
    let mut press = constraint.press(place, yielding);
    press.solve(&mut own, yielding);
    constraint.take(&press);
    for (velocity, &node) in own.iter().zip(constraint.nodes()) {
        velocities.set(node as usize, Vec3::from(*velocity));
    }
}
