//! What contacts ask of velocities, solved one after another: sequential impulses (Catto 2005), which is projected Gauss-Seidel.
//!
//! A sweep reads and writes nothing but what is here, side by side: the velocities are those of the contacts' nodes alone.

use glam::{Vec3, Vec3A};

use super::constraint::Constraint;
use super::impulses::{Effort, Sweep, relax};
use super::supports::MOST;
use crate::base::{Result, memory};
use crate::codec::saved;
use crate::soa::Vectors;

/// One contact as its impulse is found.
#[derive(Clone, Copy, Debug)]
pub(super) struct Press {
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

saved!(Press {
    places,
    shares,
    answers,
    normal,
    surface_velocity,
    least_speed,
    friction,
    effective_mass,
    free_mass,
    give,
    impulse,
    friction_impulse
});

impl Press {
    /// Gives what is missing, or takes back what was too much: how much faster the contact moves for it, m/s.
    #[inline]
    fn solve(&mut self, velocities: &mut [Vec3A]) -> f32 {
        let places = self.places.map(|place| place as usize);
        let mut velocity = velocities[places[0]] * self.shares[0];
        for index in 1..MOST {
            velocity += velocities[places[index]] * self.shares[index];
        }
        let missing = self.least_speed - velocity.dot(self.normal);
        let impulse = (self.impulse * (1.0 - self.give) + missing * self.effective_mass).max(0.0);
        let change = impulse - self.impulse;
        self.impulse = impulse;
        if change == 0.0 && self.friction == 0.0 {
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
        given.length() / self.free_mass
    }

    /// Whether it has given anything.
    fn presses(&self) -> bool {
        self.impulse > 0.0
    }
}

/// The contacts of a slice while they are solved.
#[derive(Debug, Default)]
pub(super) struct Presses {
    presses: Vec<Press>,
    /// The nodes of all of them, in order, and their velocities.
    nodes: Vec<u32>,
    velocities: Vec<Vec3A>,
}

saved!(Presses {
    presses,
    nodes,
    velocities
});

impl Presses {
    /// Makes room for so many contacts of a body of so many nodes.
    pub fn reserve(&mut self, contacts: usize) -> Result<()> {
        memory::reserve(&mut self.presses, contacts)?;
        memory::reserve(&mut self.nodes, MOST * contacts)?;
        memory::reserve(&mut self.velocities, MOST * contacts)
    }

    /// Gives the impulses of these contacts, for which there is room, in so many sweeps at most: the most that one of the first sweep
    /// changed, m/s.
    pub fn solve(&mut self, constraints: &mut [Constraint], velocities: &mut Vectors, sweeps: u32) -> f32 {
        let Self { presses, nodes, .. } = self;
        nodes.clear();
        for constraint in &*constraints {
            nodes.extend_from_slice(constraint.nodes());
        }
        nodes.sort_unstable();
        nodes.dedup();
        let place = |node: u32| nodes.binary_search(&node).unwrap_or_default() as u32;
        presses.clear();
        presses.extend(constraints.iter().map(|constraint| constraint.press(place)));

        self.read(velocities);
        let first = relax(Effort::of(sweeps), None, |sweep| self.sweep_own(sweep));
        self.write(velocities);
        self.hand_over(constraints);
        first
    }

    /// One sweep over the contacts that [`Presses::solve`] has gathered, on velocities that something else has changed since: the most that one
    /// of them changed, m/s.
    pub fn sweep(&mut self, velocities: &mut Vectors, sweep: Sweep) -> f32 {
        self.read(velocities);
        let largest = self.sweep_own(sweep);
        self.write(velocities);
        largest
    }

    /// Hands over what contacts gave.
    pub fn hand_over(&self, constraints: &mut [Constraint]) {
        for (constraint, press) in constraints.iter_mut().zip(&self.presses) {
            constraint.take(press);
        }
    }

    fn read(&mut self, velocities: &Vectors) {
        self.velocities.clear();
        let of_nodes = self
            .nodes
            .iter()
            .map(|&node| Vec3A::from(velocities.get(node as usize)));
        self.velocities.extend(of_nodes);
    }

    fn write(&self, velocities: &mut Vectors) {
        for (&node, &velocity) in self.nodes.iter().zip(&self.velocities) {
            velocities.set(node as usize, velocity.into());
        }
    }

    fn sweep_own(&mut self, sweep: Sweep) -> f32 {
        let mut largest = 0.0_f32;
        for press in &mut self.presses {
            if sweep == Sweep::All || press.presses() {
                largest = largest.max(press.solve(&mut self.velocities));
            }
        }
        largest
    }
}

/// Gives the impulse of one contact as if there were no others.
pub(super) fn solve_alone(constraint: &mut Constraint, velocities: &mut Vectors) {
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
    let mut press = constraint.press(place);
    press.solve(&mut own);
    constraint.take(&press);
    for (velocity, &node) in own.iter().zip(constraint.nodes()) {
        velocities.set(node as usize, Vec3::from(*velocity));
    }
}
