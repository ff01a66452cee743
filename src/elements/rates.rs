//! What elements allow an explicit solver: a bound on the squares of frequencies, that goes with how they are deformed.
//!
//! With u_a the ways of an element's corners, g_a the gradients of their functions and H = sum u_a g_a^T, the energy at rest is a form of
//! (tr H)² and of |sym H|², which is at most |H|². With parts p_a = |g_a| / sum |g_b| Cauchy's inequality gives
//! `(tr H)² <= sum |g_a|² |u_a|² / p_a` and `|H|² <= gamma sum |g_a|² |u_a|² / p_a`, gamma the largest eigenvalue of `sum p_a n_a n_a^T`, n_a the
//! direction of g_a: a third in an even tetrahedron, 1 in one that is flat. So a node carries `V c |g_a| sum |g_b|` of each element,
//! `c = lambda + 2 mu gamma`. Where an element is deformed by R U, its form is that of the ways `U R^T u_a`, and with the cofactors of U for what
//! keeps volume: `TetrahedronGroups::forces` has what c becomes of that, and of stress. What a node and its springs carry over its mass bounds the squares
//! of frequencies. No pinned corner goes any way: it is left out.
//!
//! Springs grow no stiffer with that, so a part P of their bound is the same for all elements: with E of a node's elements and S of its springs,
//! `S + s E` is at most `P + s max(E, E + S - P)` where the elements are s times as stiff, s at least 1. P is such that this is exact at rest.

use glam::{DMat3, DVec3};

use super::{Deformed, Elements, Law, Rest};
use crate::def::Carried;
use crate::soa::{Masses, Rates, Vectors};
use crate::springs::{Springs, rates_anywhere};

/// The least that shear counts for: a third of the sum of three eigenvalues, which is 1.
pub(crate) const LEAST_SHEAR: f32 = 1.0 / 3.0;

/// What each corner of a tetrahedron at rest carries, N/m, where those that are not free go no way.
pub(super) fn carried(law: Law, rest: &Rest, free: [bool; 4]) -> [f64; 4] {
    let gradients = rest.gradients();
    let sizes = gradients.map(DVec3::length);
    let all: f64 = sizes
        .iter()
        .zip(free)
        .filter(|(_, free)| *free)
        .map(|(size, _)| size)
        .sum();
    let (mut diagonal, mut across) = (DVec3::ZERO, DVec3::ZERO);
    for ((gradient, size), free) in gradients.iter().zip(sizes).zip(free) {
        if free {
            let part = *gradient / (size * all);
            diagonal += part * *gradient;
            across += part * DVec3::new(gradient.y, gradient.z, gradient.x);
        }
    }
    // Eigenvalues are no further from their mean than twice this.
    let deviation = diagonal - f64::from(LEAST_SHEAR);
    let spread = ((deviation.length_squared() + 2.0 * across.length_squared()) / 6.0).sqrt();
    let shear = (f64::from(LEAST_SHEAR) + 2.0 * spread).min(1.0);
    let stiffest = f64::from(law.stiffest(shear as f32));
    sizes.map(|size| rest.volume * stiffest * size * all)
}

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
        self.add_carried(masses, |node, more| carried[node] += more as f32);
        let of_springs = |node| rates_anywhere(node, springs, masses).unwrap_or(Rates::ZERO);
        let (mut of_elements, mut of_both, mut stiffest) = (0.0_f32, 0.0_f32, 0.0_f32);
        self.most_damped = 0.0;
        for (node, carried) in carried.iter_mut().enumerate() {
            let of_springs = of_springs(node);
            self.most_damped = self.most_damped.max(of_springs.most_damped);
            stiffest = stiffest.max(of_springs.stiffest);
            *carried *= masses.inverse(node);
            of_elements = of_elements.max(*carried);
            of_both = of_both.max(*carried + of_springs.stiffest);
        }
        self.of_springs = of_both - of_elements;
        if stiffest > self.of_springs {
            for (node, carried) in carried.iter_mut().enumerate() {
                *carried += self.beyond_all(of_springs(node));
            }
        }
        self.parts.iter_mut().for_each(|part| part.set_rates(&carried));
        self.carried = carried;
        self.rates_known = true;
        false
    }

    /// Adds what the nodes that are free carry at rest.
    pub fn add_to(&self, masses: &Masses, all: &mut [Carried]) {
        let viscosity = self.memory.as_ref().map(|memory| memory.viscosity);
        self.add_carried(masses, |node, more| {
            all[node].add(more as f32, viscosity.unwrap_or_default());
        });
    }

    /// What a node carries at rest, with springs as far as they are stiffer than what all nodes are taken to have, given its inverse mass, where
    /// bounds at rest are known.
    pub fn carried_at_rest(&self, node: usize, inverse_mass: f32) -> Carried {
        let mut carried = Carried::default();
        if inverse_mass > 0.0 {
            let viscosity = self.memory.as_ref().map(|memory| memory.viscosity);
            carried.add(self.carried[node] / inverse_mass, viscosity.unwrap_or_default());
        }
        carried
    }

    /// Shows the nodes of each tetrahedron, and how many times as stiff it is as at rest with nodes at `positions`, at most: with what
    /// [`Self::carried_at_rest`] of a node, that gives the bound of [`Self::rates`].
    pub fn stiffenings(&self, positions: &Vectors, see: &mut dyn FnMut([u32; 4], f64)) {
        let law = self.stiffened();
        let of_rings = &self.forces.pressures.of_nodes;
        self.visit_loaded(&mut |corners, rest, load| {
            let [a, b, c, d] = corners.map(|node| positions.get(node as usize).as_dvec3());
            let deformed = Deformed::new(law, rest, DMat3::from_cols(b - a, c - a, d - a)).loaded(load);
            let pressure = if law.rings {
                0.25 * corners
                    .map(|node| f64::from(of_rings[node as usize]))
                    .iter()
                    .sum::<f64>()
            } else {
                deformed.pressure()
            };
            see(corners, deformed.stiffening(law, pressure));
        });
    }

    /// The tetrahedron that bounds substeps with nodes at `positions`, its node of the highest frequency first, and the bound, s, where
    /// bounds at rest are known; `None`: there is none with a free node.
    pub fn tightest(&self, masses: &Masses, positions: &Vectors) -> Option<([u32; 4], f32)> {
        let mut tightest = None;
        let mut shortest = f32::INFINITY;
        self.stiffenings(positions, &mut |corners, stiffening| {
            for node in corners {
                let inverse_mass = masses.inverse(node as usize);
                let carried = self.carried_at_rest(node as usize, inverse_mass);
                let limit = Rates {
                    stiffest: self.of_springs + 2.0 * stiffening as f32 * carried.stiffness * inverse_mass,
                    most_damped: 2.0 * carried.damping * inverse_mass,
                }
                .limit();
                if limit < shortest {
                    (tightest, shortest) = (Some(node), limit);
                }
            }
        });
        let node = tightest?;
        // Of those about the node the one that it carries most of.
        let (mut found, mut most) = ([node; 4], -1.0);
        self.visit(&mut |corners, rest| {
            if let Some(place) = corners.iter().position(|&corner| corner == node) {
                let free = corners.map(|node| masses.inverse(node as usize) > 0.0);
                let carried = carried(self.law, rest, free)[place];
                if carried > most {
                    (found, most) = (corners, carried);
                    found.swap(0, place);
                }
            }
        });
        Some((found, shortest))
    }

    fn add_carried(&self, masses: &Masses, mut add: impl FnMut(usize, f64)) {
        self.visit(&mut |corners, rest| {
            let free = corners.map(|node| masses.inverse(node as usize) > 0.0);
            for (node, more) in corners.into_iter().zip(carried(self.law, rest, free)) {
                add(node as usize, more);
            }
        });
    }

    /// Masses, pins or springs have changed.
    pub fn forget_rates(&mut self) {
        self.rates_known = false;
    }

    /// What springs of a node have beyond what all nodes are taken to have, 1/s².
    pub(super) fn beyond_all(&self, of_springs: Rates) -> f32 {
        (of_springs.stiffest - self.of_springs).max(0.0)
    }

    /// What bounds frequencies with the nodes at the current state, where `is_settled`, or where forces were last worked out.
    pub fn rates(&self, is_settled: bool) -> Rates {
        let rates = Rates {
            stiffest: self.of_springs + if is_settled { self.settled } else { self.highest },
            most_damped: self.most_damped,
        };
        self.memory
            .as_ref()
            .map_or(rates, |memory| memory.viscosity.rates(rates))
    }
}
