//! The plain loops of a step over the nodes of a tile.

use glam::Vec3;

use super::gradient::{add_products, total};
use crate::simd::Loops;
use crate::soa::TileForces;
use crate::solver::subnormal::{or_zero, still_or};

/// `factor` times the one added to the other.
pub(super) struct Add<'a> {
    pub factor: f32,
    pub from: [&'a [f32]; 3],
    pub to: [&'a mut [f32]; 3],
}

impl Loops for Add<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        for (to, from) in self.to.into_iter().zip(self.from) {
            for (to, from) in to.iter_mut().zip(from) {
                *to += self.factor * from;
            }
        }
    }
}

/// Where the nodes are with these pushes.
pub(super) struct Place<'a, 'b> {
    pub carried: f32,
    pub time: f32,
    pub positions: [&'a [f32]; 3],
    pub velocities: [&'a [f32]; 3],
    pub ways: [&'a [f32]; 3],
    pub pushes: [&'a [f32]; 3],
    pub remainders: [&'a [f32]; 3],
    pub next: &'b mut [&'a mut [f32]; 3],
}

impl Loops for Place<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        for (axis, next) in self.next.iter_mut().enumerate() {
            let count = next.len();
            let (positions, velocities) = (&self.positions[axis][..count], &self.velocities[axis][..count]);
            let (ways, pushes) = (&self.ways[axis][..count], &self.pushes[axis][..count]);
            let remainders = &self.remainders[axis][..count];
            for place in 0..count {
                let way = self.carried * ways[place] + self.time * velocities[place] + pushes[place];
                next[place] = or_zero(positions[place] + (way + remainders[place]));
            }
        }
    }
}

/// What these positions lack of where the nodes are with these pushes, m.
pub(super) struct Lack<'a, 'b> {
    pub carried: f32,
    pub time: f32,
    pub positions: [&'a [f32]; 3],
    pub velocities: [&'a [f32]; 3],
    pub ways: [&'a [f32]; 3],
    pub pushes: [&'a [f32]; 3],
    pub remainders: [&'a [f32]; 3],
    pub next: [&'a [f32]; 3],
    pub lacks: &'b mut [&'a mut [f32]; 3],
}

impl Loops for Lack<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        for (axis, lacks) in self.lacks.iter_mut().enumerate() {
            let count = lacks.len();
            let (positions, velocities) = (&self.positions[axis][..count], &self.velocities[axis][..count]);
            let (ways, pushes) = (&self.ways[axis][..count], &self.pushes[axis][..count]);
            let (remainders, next) = (&self.remainders[axis][..count], &self.next[axis][..count]);
            for place in 0..count {
                let way = self.carried * ways[place] + self.time * velocities[place] + pushes[place];
                lacks[place] = (way + remainders[place]) - (next[place] - positions[place]);
            }
        }
    }
}

/// Adds to residuals what the matrix without inertia makes of ways.
pub(super) struct Refine<'a, 'b> {
    pub inertia: &'a [f32],
    pub ways: [&'a [f32]; 3],
    pub products: [&'a [f32]; 3],
    pub residuals: &'b mut [&'a mut [f32]; 3],
}

impl Loops for Refine<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let count = self.inertia.len();
        for (axis, residuals) in self.residuals.iter_mut().enumerate() {
            let (ways, products) = (&self.ways[axis][..count], &self.products[axis][..count]);
            let residuals = &mut residuals[..count];
            for place in 0..count {
                residuals[place] += self.inertia[place] * ways[place] - products[place];
            }
        }
    }
}

/// The velocities with these pushes.
pub(super) struct Predict<'a, 'b> {
    pub time: f32,
    pub velocities: [&'a [f32]; 3],
    pub pushes: [&'a [f32]; 3],
    pub predicted: &'b mut [&'a mut [f32]; 3],
}

impl Loops for Predict<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let per_time = 1.0 / self.time;
        for (axis, predicted) in self.predicted.iter_mut().enumerate() {
            for ((predicted, velocity), push) in predicted.iter_mut().zip(self.velocities[axis]).zip(self.pushes[axis])
            {
                *predicted = velocity + push * per_time;
            }
        }
    }
}

/// What the equation lacks at each node, N.
pub(super) struct Residual<'a, 'b> {
    pub gravity: Vec3,
    pub forces: &'a TileForces,
    pub applied: Option<[&'a [f32]; 3]>,
    pub masses: &'a [f32],
    /// Of damping, 1/s.
    pub rates: Option<&'a [f32]>,
    pub inertia: &'a [f32],
    pub velocities: [&'a [f32]; 3],
    pub pushes: [&'a [f32]; 3],
    pub residuals: &'b mut [&'a mut [f32]; 3],
}

impl Loops for Residual<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let count = self.masses.len();
        let inertia = &self.inertia[..count];
        for (axis, residuals) in self.residuals.iter_mut().enumerate() {
            let residuals = &mut residuals[..count];
            let (forces, pushes) = (&self.forces.axes()[axis][..count], &self.pushes[axis][..count]);
            let gravity = self.gravity[axis];
            for place in 0..count {
                residuals[place] = forces[place] + self.masses[place] * gravity - inertia[place] * pushes[place];
            }
            if let Some(applied) = self.applied {
                for (residual, applied) in residuals.iter_mut().zip(applied[axis]) {
                    *residual += applied;
                }
            }
            if let Some(rates) = self.rates {
                let velocities = &self.velocities[axis][..count];
                for place in 0..count {
                    residuals[place] -= rates[place] * self.masses[place] * velocities[place];
                }
            }
        }
    }
}

/// The product of residuals and corrections, J.
pub(super) struct Slope<'a> {
    pub residuals: [&'a [f32]; 3],
    pub corrections: [&'a [f32]; 3],
}

impl Loops for Slope<'_> {
    type Output = f64;

    #[inline(always)]
    fn run(self) -> f64 {
        let mut sums = [0.0; 16];
        for (residuals, corrections) in self.residuals.into_iter().zip(self.corrections) {
            add_products(&mut sums, residuals, corrections);
        }
        total(sums)
    }
}

/// Ways, velocities and gains at the end of a step.
pub(super) struct Finish<'a, 'b> {
    pub carried: f32,
    pub time: f32,
    pub pushes: [&'a [f32]; 3],
    /// Those at the step's start, where they are still there: what is added to them is rounded once, then, not twice.
    pub before: Option<[&'a [f32]; 3]>,
    pub velocities: &'b mut [&'a mut [f32]; 3],
    pub ways: &'b mut [&'a mut [f32]; 3],
    pub gains: &'b mut [&'a mut [f32]; 3],
}

impl Loops for Finish<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let per_time = 1.0 / self.time;
        for axis in 0..3 {
            let pushes = self.pushes[axis];
            let count = pushes.len();
            let velocities = &mut self.velocities[axis][..count];
            let (ways, gains) = (&mut self.ways[axis][..count], &mut self.gains[axis][..count]);
            for place in 0..count {
                ways[place] = self.carried * ways[place] + self.time * velocities[place] + pushes[place];
                let given = pushes[place] * per_time;
                velocities[place] = still_or(velocities[place] + given);
                gains[place] = self.carried * gains[place] + given;
            }
            if let Some(before) = self.before {
                for ((velocity, before), gain) in velocities.iter_mut().zip(before[axis]).zip(&*gains) {
                    *velocity = still_or(before + gain);
                }
            }
        }
    }
}

/// What positions lack at the end of ways that began at `starts`, with what they lacked there.
pub(super) struct Remain<'a, 'b> {
    pub ways: [&'b [f32]; 3],
    pub starts: [&'a [f32]; 3],
    pub ends: [&'a [f32]; 3],
    pub remainders: &'b mut [&'a mut [f32]; 3],
}

impl Loops for Remain<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        for (axis, remainders) in self.remainders.iter_mut().enumerate() {
            let count = remainders.len();
            let (ways, starts) = (&self.ways[axis][..count], &self.starts[axis][..count]);
            let ends = &self.ends[axis][..count];
            for place in 0..count {
                let lacking = (ways[place] + remainders[place]) - (ends[place] - starts[place]);
                // What was put to 0 because it was next to nothing stays there.
                remainders[place] = if ends[place] == 0.0 { 0.0 } else { lacking };
            }
        }
    }
}
