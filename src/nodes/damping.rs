//! Damping of nodes against the world, integrated exactly: `m v' = f - gamma v` (Halic et al., section 3).
//!
//! For a constant force over the time t, `v(t) = v e^-s + f t/m (1 - e^-s)/s` with s = gamma t / m. Unlike the paper's
//! factor per step, this yields the same decay and the same terminal velocity at every step length.

use crate::base::{Result, memory};
use crate::codec::saved;
use crate::soa::{TILE, per_node};

/// Factors of node damping for half a substep. Only bodies with node damping have them.
#[derive(Debug)]
pub(crate) struct NodeDamping {
    /// gamma / m of each node, 1/s; 0 if the mass is 0.
    rates: Vec<f32>,
    /// `1 - e^-s` over half a substep. Storing the loss keeps the digits of small values.
    pub loss: Vec<f32>,
    /// `t (1 - e^-s)/s` over half a substep, s.
    pub gain: Vec<f32>,
    /// Substep of the factors, s.
    substep: f32,
}

saved! { NodeDamping { rates, loss, gain, substep } }

per_node! { NodeDamping { rates, loss, gain } }

impl NodeDamping {
    pub fn new(rates: Vec<f32>) -> Result<Self> {
        Ok(Self {
            loss: memory::filled(0.0, rates.len())?,
            gain: memory::filled(0.0, rates.len())?,
            rates,
            substep: 0.0,
        })
    }

    /// Copies the damping of `source` to `node`.
    pub fn copy(&mut self, source: usize, node: usize) {
        for values in [&mut self.rates, &mut self.loss, &mut self.gain] {
            values[node] = values[source];
        }
    }

    pub fn rates(&self) -> &[f32] {
        &self.rates
    }

    /// Sets the rate of a node, 1/s. The factors must be prepared again after a change.
    pub fn set_rate(&mut self, node: usize, rate: f32) {
        if self.rates[node] != rate {
            self.rates[node] = rate;
            self.substep = f32::NAN;
        }
    }

    /// Updates the factors to half of `substep`.
    pub fn prepare(&mut self, substep: f32) {
        if substep == self.substep {
            return;
        }
        let half = 0.5 * f64::from(substep);
        let mut last = (f32::NAN, 0.0, 0.0);
        for ((&rate, loss), gain) in self.rates.iter().zip(&mut self.loss).zip(&mut self.gain) {
            // Rates are mostly few, and equal for neighboring nodes.
            if rate != last.0 {
                let s = f64::from(rate) * half;
                let lost = -libm::expm1(-s);
                let weight = if s > 0.0 { lost / s } else { 1.0 };
                last = (rate, lost as f32, (half * weight) as f32);
            }
            (*loss, *gain) = (last.1, last.2);
        }
        self.substep = substep;
    }
}

/// Response of nodes to impulses within a kick.
#[derive(Clone, Copy)]
pub(crate) struct Mobility<'a> {
    pub inverse_masses: &'a [f32],
    pub damping: Option<&'a NodeDamping>,
    /// Substep of the kick, s.
    pub substep: f32,
    /// True for a half kick.
    pub half: bool,
    /// True for each sleeping tile. Its nodes do not move.
    pub asleep: Option<&'a [bool]>,
}

impl Mobility<'_> {
    /// Velocity change per impulse, 1/kg; 0 for a pinned node. The force of the impulse acts over the whole kick, so it
    /// is damped like any force.
    #[inline]
    pub fn inverse_mass(&self, node: usize) -> f32 {
        if self.asleep.is_some_and(|asleep| asleep[node / TILE]) {
            return 0.0;
        }
        let inverse_mass = self.inverse_masses[node];
        let Some(NodeDamping { loss, gain, .. }) = self.damping else {
            return inverse_mass;
        };
        let duration = if self.half {
            gain[node] * 2.0
        } else {
            gain[node] * (2.0 - loss[node])
        };
        inverse_mass * (duration / self.substep)
    }
}
