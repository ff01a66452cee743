//! Verlet as Halic et al. print it (section 3): positions only, `x + (x - x_previous) d + a h²`.
//!
//! Forces and the step take one pass over memory. Springs are stored at both of their nodes, and a vector processes as
//! many nodes as it has lanes.

use glam::DVec3;

use crate::bisection;
use crate::contender::{Contender, Setup, State, record, vector};
use crate::rows::Rows;
use crate::scene::Scene;
use crate::simd::{self, Kernel, Proof, Record, Vector};

pub struct Paper {
    ranks: Vec<u32>,
    rows: Rows,
    start: Vec<Record>,
    positions: Vec<Record>,
    previous: Vec<Record>,
    /// h² over the mass, for each lane; 0 is pinned.
    push: Vec<f32>,
    /// h² for each lane; 0 is pinned.
    fall: Vec<f32>,
    gravity: [f32; 3],
    /// The factor of velocities per step.
    damping: f32,
    steps: u32,
    /// Duration of a step [s].
    step: f64,
}

impl Paper {
    pub fn new(scene: &Scene, setup: Setup) -> Self {
        let order = bisection::order(scene);
        let ranks = bisection::ranks(&order);
        let rows = Rows::new(scene, &ranks, 1.0);
        let square = (setup.step() * setup.step()) as f32;
        let mass = |rank: u32| scene.masses[order[rank as usize] as usize];
        let if_free = |rank: u32, value: f32| if mass(rank) > 0.0 { value } else { 0.0 };
        let mut start: Vec<Record> = (order.iter())
            .map(|&node| record(scene.positions[node as usize], 0.0))
            .collect();
        start.push(Record::default());
        let mut paper = Self {
            push: rows.per_lane(|rank| if_free(rank, square / mass(rank))),
            fall: rows.per_lane(|rank| if_free(rank, square)),
            ranks,
            rows,
            positions: start.clone(),
            previous: start.clone(),
            start,
            gravity: scene.gravity.to_array(),
            damping: (-f64::from(scene.damping_rate) * setup.step()).exp() as f32,
            steps: setup.steps,
            step: setup.step(),
        };
        paper.restart();
        paper
    }

    fn step(&mut self) {
        simd::run(Step(self));
        std::mem::swap(&mut self.positions, &mut self.previous);
    }
}

impl Contender for Paper {
    fn restart(&mut self) {
        // Starting at rest means equal distances one step before and after the start: x - x_previous = -a h² / 2.
        self.positions.clone_from(&self.start);
        self.previous.clone_from(&self.start);
        self.step();
        for (next, start) in self.positions.iter_mut().zip(&self.start) {
            *next = start.zip(*next, |start, next| start + 0.5 * (next - start));
        }
        std::mem::swap(&mut self.positions, &mut self.previous);
    }

    fn advance(&mut self) -> Result<(), String> {
        for _ in 0..self.steps {
            self.step();
        }
        Ok(())
    }

    fn read(&mut self) -> State {
        let saved = [self.positions.clone(), self.previous.clone()];
        self.step();
        let velocity = |rank: u32| {
            let displacement: DVec3 = vector(&self.positions[rank as usize]) - vector(&saved[1][rank as usize]);
            displacement / (2.0 * self.step)
        };
        let state = State {
            positions: (self.ranks.iter())
                .map(|&rank| vector(&saved[0][rank as usize]))
                .collect(),
            velocities: self.ranks.iter().map(|&rank| velocity(rank)).collect(),
        };
        [self.positions, self.previous] = saved;
        state
    }
}

/// Overwrites the previous positions with the next ones.
struct Step<'a>(&'a mut Paper);

impl Kernel for Step<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Vector>(self, proof: Proof<V>) {
        let paper = self.0;
        let damping = V::splat(proof, paper.damping);
        let gravity = paper.gravity.map(|component| V::splat(proof, component));
        for block in 0..paper.rows.block_count() {
            let at = block * V::COUNT;
            let [x, y, z, beside] = V::load_records(proof, &paper.positions, &paper.rows.nodes, at, 0);
            let previous = V::load_records(proof, &paper.previous, &paper.rows.nodes, at, 0);
            let forces = paper.rows.forces(proof, block, &paper.positions, [x, y, z]);
            let push = V::load(proof, &paper.push[at..]);
            let fall = V::load(proof, &paper.fall[at..]);
            let position = [x, y, z];
            let next = |axis: usize| {
                let displacement = (position[axis] - previous[axis]) * damping;
                position[axis] + forces[axis].mul_add(push, gravity[axis].mul_add(fall, displacement))
            };
            let next = [next(0), next(1), next(2), beside];
            V::store_records(next, &mut paper.previous, &paper.rows.nodes, at, 0);
        }
    }
}
