//! The stable substep of elements under an explicit solver: a bound on squared angular frequencies that follows the
//! deformation.
//!
//! Let u_a be the displacements of an element's corners, g_a the gradients of their shape functions, and H = sum u_a
//! g_a^T. The energy at rest is a quadratic form of (tr H)² and |sym H|², which is at most |H|². With p_a = |g_a| /
//! sum |g_b|, Cauchy's inequality gives `(tr H)² <= sum |g_a|² |u_a|² / p_a` and `|H|² <= gamma sum |g_a|² |u_a|² /
//! p_a`. Here gamma is the largest eigenvalue of `sum p_a n_a n_a^T`, and n_a is the direction of g_a; gamma is 1/3
//! for a regular tetrahedron and 1 for a flat one. So each element adds the stiffness `V c |g_a| sum |g_b|` to a node,
//! with `c = lambda + 2 mu gamma`.
//!
//! An element with the deformation R U has the same quadratic form, in `U R^T u_a` instead of `u_a`, and in the
//! cofactors of U in the volume term. `TetrahedronGroups::forces` computes c for it, with the stress. The stiffness of
//! a node's elements and springs over its mass bounds the squared frequencies. Pinned corners have no displacement and
//! are left out.
//!
//! Elements stiffen together, and springs do not, so their bounds are kept apart: all elements share a part P of the
//! springs' bound. Let E be the bound
//! of a node's elements and S that of its springs, with the elements s >= 1 times as stiff as at rest. Then `S + s E`
//! is at most `P + s max(E, E + S - P)`. P is chosen such that this is exact at rest.

use glam::{DMat3, DVec3};

use super::{DeformedTet, ElasticLaw, Elements, RestTet};
use crate::def::NodalStiffness;
use crate::soa::{FrequencyBound, NodalMasses, Vectors};
use crate::springs::{Springs, spring_rates};

/// The lower bound on gamma: a third of the eigenvalues' sum, which is 1.
pub(crate) const LEAST_SHEAR: f32 = 1.0 / 3.0;

/// The stiffness that a tetrahedron at rest adds to each corner, N/m. Corners that are not free have no displacement.
pub(super) fn corner_stiffness(law: ElasticLaw, rest: &RestTet, free: [bool; 4]) -> [f64; 4] {
    let gradients = rest.gradients();
    let sizes = gradients.map(DVec3::length);
    let total: f64 = sizes
        .iter()
        .zip(free)
        .filter(|(_, free)| *free)
        .map(|(size, _)| size)
        .sum();
    let (mut diagonal, mut off_diagonal) = (DVec3::ZERO, DVec3::ZERO);
    for ((gradient, size), free) in gradients.iter().zip(sizes).zip(free) {
        if free {
            let fraction = *gradient / (size * total);
            diagonal += fraction * *gradient;
            off_diagonal += fraction * DVec3::new(gradient.y, gradient.z, gradient.x);
        }
    }
    // Eigenvalues differ from their mean by at most twice this.
    let deviation = diagonal - f64::from(LEAST_SHEAR);
    let spread = ((deviation.length_squared() + 2.0 * off_diagonal.length_squared()) / 6.0).sqrt();
    let shear = (f64::from(LEAST_SHEAR) + 2.0 * spread).min(1.0);
    let stiffness = f64::from(law.rest_stiffness_bound(shear as f32));
    sizes.map(|size| rest.volume * stiffness * size * total)
}

impl Elements {
    /// Sums the stiffness of the elements at each node at rest.
    pub(super) fn find_stiffnesses(&mut self) {
        let mut stiffnesses = std::mem::take(&mut self.stiffnesses);
        let p_wave_modulus = f64::from(self.law.p_wave_modulus());
        self.visit(&mut |corners, rest| {
            for (node, gradient) in corners.into_iter().zip(rest.gradients()) {
                stiffnesses[node as usize] += (rest.volume * p_wave_modulus * gradient.length_squared()) as f32;
            }
        });
        self.stiffnesses = stiffnesses;
    }

    /// Computes the bounds at rest for these masses and springs. Returns true if they were already known.
    pub fn find_rates(&mut self, springs: &dyn Springs, masses: &NodalMasses) -> bool {
        if self.rates_known {
            return true;
        }
        let mut node_rates = std::mem::take(&mut self.node_rates);
        node_rates.fill(0.0);
        self.add_stiffnesses(masses, |node, stiffness| node_rates[node] += stiffness as f32);
        let spring_rates = |node| spring_rates(node, springs, masses).unwrap_or(FrequencyBound::ZERO);
        let (mut max_element_rate, mut max_rate, mut max_spring_rate) = (0.0_f32, 0.0_f32, 0.0_f32);
        self.damping_rate = 0.0;
        for (node, node_rate) in node_rates.iter_mut().enumerate() {
            let spring_rates = spring_rates(node);
            self.damping_rate = self.damping_rate.max(spring_rates.damping_rate);
            max_spring_rate = max_spring_rate.max(spring_rates.omega_sq);
            *node_rate *= masses.inverse(node);
            max_element_rate = max_element_rate.max(*node_rate);
            max_rate = max_rate.max(*node_rate + spring_rates.omega_sq);
        }
        self.spring_rate = max_rate - max_element_rate;
        if max_spring_rate > self.spring_rate {
            for (node, node_rate) in node_rates.iter_mut().enumerate() {
                *node_rate += self.rate_beyond_shared(spring_rates(node));
            }
        }
        self.max_rest_rate = node_rates.iter().fold(0.0, |highest: f32, &rate| highest.max(rate));
        self.parts.iter_mut().for_each(|part| part.set_rates(&node_rates));
        self.node_rates = node_rates;
        self.rates_known = true;
        false
    }

    /// Adds the stiffness and damping of the elements at each free node at rest.
    pub fn add_to(&self, masses: &NodalMasses, all: &mut [NodalStiffness]) {
        let viscosity = self.history.as_ref().map(|history| history.viscosity);
        self.add_stiffnesses(masses, |node, stiffness| {
            all[node].add(stiffness as f32, viscosity.unwrap_or_default());
        });
    }

    /// The stiffness and damping at a node at rest, for its inverse mass. Includes springs as far as they are stiffer
    /// than the shared part. The bounds at rest must be known.
    pub fn nodal_stiffness_at_rest(&self, node: usize, inverse_mass: f32) -> NodalStiffness {
        let mut carried = NodalStiffness::default();
        if inverse_mass > 0.0 {
            let viscosity = self.history.as_ref().map(|history| history.viscosity);
            carried.add(self.node_rates[node] / inverse_mass, viscosity.unwrap_or_default());
        }
        carried
    }

    /// Calls `f` with the nodes of each tetrahedron and an upper bound on its stiffness relative to rest, with nodes
    /// at `positions`. With [`Self::nodal_stiffness_at_rest`] this gives the bound of [`Self::rates`].
    pub fn relative_stiffnesses(&self, positions: &Vectors, f: &mut dyn FnMut([u32; 4], f64)) {
        let law = self.stiffened();
        let nodal_pressures = &self.forces.pressures.at_nodes;
        self.visit_with_extra_stress(&mut |corners, rest, extra| {
            let [a, b, c, d] = corners.map(|node| positions.get(node as usize).as_dvec3());
            let deformed = DeformedTet::new(law, rest, DMat3::from_cols(b - a, c - a, d - a)).with_extra_stress(extra);
            let pressure = if law.nodal_pressure {
                0.25 * corners
                    .map(|node| f64::from(nodal_pressures[node as usize]))
                    .iter()
                    .sum::<f64>()
            } else {
                deformed.pressure()
            };
            f(corners, deformed.stiffening(law, pressure));
        });
    }

    /// The tetrahedron that limits the substep at `positions`, with its limiting node first, and the limit, s. `None`
    /// if no node is free. The bounds at rest must be known.
    pub fn limiting_element(&self, masses: &NodalMasses, positions: &Vectors) -> Option<([u32; 4], f32)> {
        let mut limiting_node = None;
        let mut shortest = f32::INFINITY;
        self.relative_stiffnesses(positions, &mut |corners, relative_stiffness| {
            for node in corners {
                let inverse_mass = masses.inverse(node as usize);
                let carried = self.nodal_stiffness_at_rest(node as usize, inverse_mass);
                let limit = FrequencyBound {
                    omega_sq: self.spring_rate + 2.0 * relative_stiffness as f32 * carried.stiffness * inverse_mass,
                    damping_rate: 2.0 * carried.damping * inverse_mass,
                }
                .limit();
                if limit < shortest {
                    (limiting_node, shortest) = (Some(node), limit);
                }
            }
        });
        let node = limiting_node?;
        // The element at the node with the largest stiffness there.
        let (mut element, mut largest) = ([node; 4], -1.0);
        self.visit(&mut |corners, rest| {
            if let Some(corner_index) = corners.iter().position(|&corner| corner == node) {
                let free = corners.map(|node| masses.inverse(node as usize) > 0.0);
                let stiffness = corner_stiffness(self.law, rest, free)[corner_index];
                if stiffness > largest {
                    (element, largest) = (corners, stiffness);
                    element.swap(0, corner_index);
                }
            }
        });
        Some((element, shortest))
    }

    fn add_stiffnesses(&self, masses: &NodalMasses, mut add: impl FnMut(usize, f64)) {
        self.visit(&mut |corners, rest| {
            let free = corners.map(|node| masses.inverse(node as usize) > 0.0);
            for (node, stiffness) in corners.into_iter().zip(corner_stiffness(self.law, rest, free)) {
                add(node as usize, stiffness);
            }
        });
    }

    /// Invalidates the bounds at rest, after a change of masses, pins or springs.
    pub fn forget_rates(&mut self) {
        self.rates_known = false;
        self.forget_deformed_rates();
    }

    /// The bound of a node's springs above the shared part, 1/s².
    pub(super) fn rate_beyond_shared(&self, spring_rates: FrequencyBound) -> f32 {
        (spring_rates.omega_sq - self.spring_rate).max(0.0)
    }

    /// The rate bounds at the current state, if `is_settled`, or at the last computed forces.
    pub fn rates(&self, is_settled: bool) -> FrequencyBound {
        let rates = FrequencyBound {
            omega_sq: self.spring_rate
                + if is_settled {
                    self.committed_rate_bound
                } else {
                    self.rate_bound
                },
            damping_rate: self.damping_rate,
        };
        self.history
            .as_ref()
            .map_or(rates, |history| history.viscosity.rates(rates))
    }
}
