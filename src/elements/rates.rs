//! What elements allow an explicit solver: a bound on the squares of frequencies, that goes with how they are deformed.
//!
//! The matrix of an element with the blocks K_ab is positive semidefinite but for what pressure takes, so with any parts p_a that add
//! up to 1 it is at most K_aa / p_a at each corner, and with parts by the gradients g_a of the corners' functions a node carries at most
//! `V c |g_a| sum |g_b|` of each element, c the largest stiffness of the law: lambda + 2 mu at rest, and what `Groups::forces` has for any
//! deformation. What a node and its springs carry over its mass bounds the squares of frequencies.

use glam::DVec3;

use super::Elements;
use crate::solver::{Masses, Rates};
use crate::springs::Springs;

impl Elements {
    /// Adds up how stiff the elements at each node are at rest.
    pub(super) fn find_stiffnesses(&mut self) {
        let mut stiffnesses = std::mem::take(&mut self.stiffnesses);
        let whole = f64::from(self.law.whole());
        self.visit(&mut |corners, rest| {
            for (node, gradient) in corners.into_iter().zip(rest.gradients()) {
                stiffnesses[node as usize] += (rest.volume * whole * gradient.length_squared()) as f32;
            }
        });
        self.stiffnesses = stiffnesses;
    }

    /// Makes the bounds at rest those of these masses and springs: whether they were before.
    pub fn find_rates(&mut self, springs: &dyn Springs, masses: &Masses) -> bool {
        if self.rates_known {
            return true;
        }
        let mut carried = std::mem::take(&mut self.carried);
        carried.fill(0.0);
        let whole = f64::from(self.law.whole());
        self.visit(&mut |corners, rest| {
            let free = corners.map(|node| if masses.inverse(node as usize) > 0.0 { 1.0 } else { 0.0 });
            let sizes = rest.gradients().map(DVec3::length);
            let all: f64 = sizes.iter().zip(free).map(|(size, free)| size * free).sum();
            for (node, size) in corners.into_iter().zip(sizes) {
                carried[node as usize] += (rest.volume * whole * size * all) as f32;
            }
        });
        self.most_damped = 0.0;
        for (node, carried) in carried.iter_mut().enumerate() {
            let of_springs = Rates::anywhere(node, springs, masses).unwrap_or(Rates::ZERO);
            self.most_damped = self.most_damped.max(of_springs.most_damped);
            *carried = *carried * masses.inverse(node) + of_springs.stiffest;
        }
        self.parts.iter_mut().for_each(|part| part.set_rates(&carried));
        self.carried = carried;
        self.rates_known = true;
        false
    }

    /// Masses, pins or springs have changed.
    pub fn forget_rates(&mut self) {
        self.rates_known = false;
    }

    /// What bounds frequencies with the nodes where forces were last worked out.
    pub fn rates(&self) -> Rates {
        self.rates_of(self.highest)
    }

    /// The same with the nodes at the current state.
    pub fn settled_rates(&self) -> Rates {
        self.rates_of(self.settled)
    }

    fn rates_of(&self, stiffest: f32) -> Rates {
        let most_damped = self.most_damped;
        let rates = Rates { stiffest, most_damped };
        self.memory
            .as_ref()
            .map_or(rates, |memory| memory.viscosity.rates(rates))
    }
}
