//! Vectorizable loops of a step over the nodes of a tile.

use glam::Vec3;

use super::conjugate_gradient::{add_products, total};
use crate::simd::Loops;
use crate::soa::TileForces;
use crate::solver::flush_denormals::{flush_coordinate, flush_velocity};

/// Adds `factor * from` to `to`.
pub(super) struct AddScaled<'a> {
    pub factor: f32,
    pub from: [&'a [f32]; 3],
    pub to: [&'a mut [f32]; 3],
}

impl Loops for AddScaled<'_> {
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

/// Computes x + y + s, the positions with these force displacements.
pub(super) struct PredictPositions<'a, 'b> {
    pub carried: f32,
    pub time: f32,
    pub positions: [&'a [f32]; 3],
    pub velocities: [&'a [f32]; 3],
    pub displacements: [&'a [f32]; 3],
    pub force_displacements: [&'a [f32]; 3],
    pub remainders: [&'a [f32]; 3],
    pub next: &'b mut [&'a mut [f32]; 3],
}

impl Loops for PredictPositions<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        for (axis, next) in self.next.iter_mut().enumerate() {
            let count = next.len();
            let (positions, velocities) = (&self.positions[axis][..count], &self.velocities[axis][..count]);
            let (displacements, force_displacements) = (
                &self.displacements[axis][..count],
                &self.force_displacements[axis][..count],
            );
            let remainders = &self.remainders[axis][..count];
            for node in 0..count {
                let displacement =
                    self.carried * displacements[node] + self.time * velocities[node] + force_displacements[node];
                next[node] = flush_coordinate(positions[node] + (displacement + remainders[node]));
            }
        }
    }
}

/// Computes the exact minus the stored positions with these force displacements, m.
pub(super) struct PositionDefect<'a, 'b> {
    pub carried: f32,
    pub time: f32,
    pub positions: [&'a [f32]; 3],
    pub velocities: [&'a [f32]; 3],
    pub displacements: [&'a [f32]; 3],
    pub force_displacements: [&'a [f32]; 3],
    pub remainders: [&'a [f32]; 3],
    pub next: [&'a [f32]; 3],
    pub defects: &'b mut [&'a mut [f32]; 3],
}

impl Loops for PositionDefect<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        for (axis, defects) in self.defects.iter_mut().enumerate() {
            let count = defects.len();
            let (positions, velocities) = (&self.positions[axis][..count], &self.velocities[axis][..count]);
            let (displacements, force_displacements) = (
                &self.displacements[axis][..count],
                &self.force_displacements[axis][..count],
            );
            let (remainders, next) = (&self.remainders[axis][..count], &self.next[axis][..count]);
            for node in 0..count {
                let displacement =
                    self.carried * displacements[node] + self.time * velocities[node] + force_displacements[node];
                defects[node] = (displacement + remainders[node]) - (next[node] - positions[node]);
            }
        }
    }
}

/// Adds the stiffness matrix times displacements to residuals.
pub(super) struct CorrectResidual<'a, 'b> {
    pub inertia: &'a [f32],
    pub displacements: [&'a [f32]; 3],
    pub products: [&'a [f32]; 3],
    pub residuals: &'b mut [&'a mut [f32]; 3],
}

impl Loops for CorrectResidual<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let count = self.inertia.len();
        for (axis, residuals) in self.residuals.iter_mut().enumerate() {
            let (displacements, products) = (&self.displacements[axis][..count], &self.products[axis][..count]);
            let residuals = &mut residuals[..count];
            for node in 0..count {
                residuals[node] += self.inertia[node] * displacements[node] - products[node];
            }
        }
    }
}

/// Computes the velocities with these force displacements.
pub(super) struct PredictVelocities<'a, 'b> {
    pub time: f32,
    pub velocities: [&'a [f32]; 3],
    pub force_displacements: [&'a [f32]; 3],
    pub predicted: &'b mut [&'a mut [f32]; 3],
}

impl Loops for PredictVelocities<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let per_time = 1.0 / self.time;
        for (axis, predicted) in self.predicted.iter_mut().enumerate() {
            for ((predicted, velocity), push) in predicted
                .iter_mut()
                .zip(self.velocities[axis])
                .zip(self.force_displacements[axis])
            {
                *predicted = velocity + push * per_time;
            }
        }
    }
}

/// Computes the residual force at each node, N.
pub(super) struct Residual<'a, 'b> {
    pub gravity: Vec3,
    pub forces: &'a TileForces,
    pub applied: Option<[&'a [f32]; 3]>,
    pub masses: &'a [f32],
    /// Damping rates, 1/s.
    pub rates: Option<&'a [f32]>,
    pub inertia: &'a [f32],
    pub velocities: [&'a [f32]; 3],
    pub force_displacements: [&'a [f32]; 3],
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
            let (forces, force_displacements) = (
                &self.forces.axes()[axis][..count],
                &self.force_displacements[axis][..count],
            );
            let gravity = self.gravity[axis];
            for node in 0..count {
                residuals[node] =
                    forces[node] + self.masses[node] * gravity - inertia[node] * force_displacements[node];
            }
            if let Some(applied) = self.applied {
                for (residual, applied) in residuals.iter_mut().zip(applied[axis]) {
                    *residual += applied;
                }
            }
            if let Some(rates) = self.rates {
                let velocities = &self.velocities[axis][..count];
                for node in 0..count {
                    residuals[node] -= rates[node] * self.masses[node] * velocities[node];
                }
            }
        }
    }
}

/// Computes the product of residuals and corrections, J.
pub(super) struct ResidualSlope<'a> {
    pub residuals: [&'a [f32]; 3],
    pub corrections: [&'a [f32]; 3],
}

impl Loops for ResidualSlope<'_> {
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

/// Computes displacements, velocities and velocity changes at the end of a step.
pub(super) struct FinishMotion<'a, 'b> {
    pub carried: f32,
    pub time: f32,
    pub force_displacements: [&'a [f32]; 3],
    /// Velocities at the start of the step, if still available. Adding the change to them rounds once instead of twice.
    pub before: Option<[&'a [f32]; 3]>,
    pub velocities: &'b mut [&'a mut [f32]; 3],
    pub displacements: &'b mut [&'a mut [f32]; 3],
    pub velocity_changes: &'b mut [&'a mut [f32]; 3],
}

impl Loops for FinishMotion<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let per_time = 1.0 / self.time;
        for axis in 0..3 {
            let force_displacements = self.force_displacements[axis];
            let count = force_displacements.len();
            let velocities = &mut self.velocities[axis][..count];
            let (displacements, velocity_changes) = (
                &mut self.displacements[axis][..count],
                &mut self.velocity_changes[axis][..count],
            );
            for node in 0..count {
                displacements[node] =
                    self.carried * displacements[node] + self.time * velocities[node] + force_displacements[node];
                let velocity_change = force_displacements[node] * per_time;
                velocities[node] = flush_velocity(velocities[node] + velocity_change);
                velocity_changes[node] = self.carried * velocity_changes[node] + velocity_change;
            }
            if let Some(before) = self.before {
                for ((velocity, before), change) in velocities.iter_mut().zip(before[axis]).zip(&*velocity_changes) {
                    *velocity = flush_velocity(before + change);
                }
            }
        }
    }
}

/// Updates rounding remainders after displacements from `starts` to `ends`.
pub(super) struct UpdateRemainders<'a, 'b> {
    pub displacements: [&'b [f32]; 3],
    pub starts: [&'a [f32]; 3],
    pub ends: [&'a [f32]; 3],
    pub remainders: &'b mut [&'a mut [f32]; 3],
}

impl Loops for UpdateRemainders<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        for (axis, remainders) in self.remainders.iter_mut().enumerate() {
            let count = remainders.len();
            let (displacements, starts) = (&self.displacements[axis][..count], &self.starts[axis][..count]);
            let ends = &self.ends[axis][..count];
            for node in 0..count {
                let remainder = (displacements[node] + remainders[node]) - (ends[node] - starts[node]);
                // Flushed denormal positions stay at 0.
                remainders[node] = if ends[node] == 0.0 { 0.0 } else { remainder };
            }
        }
    }
}
