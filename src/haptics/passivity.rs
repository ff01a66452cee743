//! Passivity control: the coupling returns no more energy than the user supplied.
//!
//! The energy dissipated by the coupling is the hand's work on the device, less the tool's work on the tissue, less the
//! energy stored in the spring. If it falls below 0, delays have generated energy, and a damper dissipates it
//! (Hannaford, Ryu 2002, with two ports).

use super::definition::{Coupling, expanded};
use super::six::{self, Vector6};

/// Dissipated energy is credited up to the energy that the spring stores at this extension, m.
const CREDIT_EXTENSION: f64 = 2e-5;

/// The time in which generated energy is dissipated, s. A shorter time would be felt as a knock.
const DISSIPATION_TIME: f64 = 0.02;

/// The time constant of the energy balance, s.
const MEMORY_TIME: f64 = 0.2;

/// The largest damping, relative to the critical damping of the device.
const MAX_DAMPING: f64 = 2.0;

#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct PassivityObserver {
    /// The work of the hand, and of the proxy on the tissue, J.
    by_hand: f64,
    pub by_proxy: f64,
    /// The part of the balance that is no longer counted, J.
    forgotten: f64,
    /// The energy dissipated by the coupling, J; below 0 it has generated energy.
    pub dissipated: f64,
    /// The work of the hand, and of the tool on the tissue, when the tool was last free, J.
    free: [f64; 2],
    /// The net work of the hand since then, plus the energy that the tissue has given, J.
    supplied: f64,
    /// The largest value of `supplied`.
    max_supplied: f64,
}

impl PassivityObserver {
    /// Adds the hand's work over a displacement against a wrench.
    pub fn hand_moved(&mut self, felt: &Vector6, displacement: &Vector6) {
        self.by_hand -= six::dot(felt, displacement);
    }

    /// Adds the proxy's work over a displacement against the mean of two wrenches.
    pub fn proxy_moved(&mut self, on_proxy: [&Vector6; 2], displacement: &Vector6) {
        self.by_proxy -= 0.5 * (six::dot(on_proxy[0], displacement) + six::dot(on_proxy[1], displacement));
    }

    /// Updates the energy balance. `work` is the tool's work on the tissue up to the last local model, and `sent_work`
    /// the proxy's until then.
    pub fn balance(&mut self, (work, sent_work): (f64, f64), on_proxy: &Vector6, coupling: &Coupling, dt: f64) {
        let on_tissue = work + self.by_proxy - sent_work;
        let stiffness = expanded(coupling.stiffness);
        let stored: f64 = on_proxy
            .iter()
            .zip(stiffness)
            .map(|(wrench, spring)| 0.5 * wrench * wrench / spring)
            .sum();
        let dissipated = self.by_hand - on_tissue - stored - self.forgotten;
        let reserve = 0.5 * coupling.stiffness[0] * CREDIT_EXTENSION * CREDIT_EXTENSION;
        // The tissue dissipates an excess itself.
        let part = (dt / MEMORY_TIME).min(1.0);
        let spent = dissipated.min(0.0) * part;
        self.forgotten += (dissipated - reserve).max(0.0) + spent;
        self.dissipated = dissipated.min(reserve) - spent;
        self.update_supplied(work, *on_proxy == six::ZERO, part);
    }

    /// Updates the energy supplied by the hand. It is reset while the tool is free, and decays by `part`.
    fn update_supplied(&mut self, work: f64, is_free: bool, part: f64) {
        if is_free {
            self.free = [self.by_hand, work];
            self.max_supplied = 0.0;
        }
        self.supplied = self.by_hand - self.free[0] + (self.free[1] - work).max(0.0);
        self.free[0] += self.supplied.min(0.0) * part;
        self.max_supplied = self.max_supplied.max(self.supplied);
        self.max_supplied += (self.supplied - self.max_supplied) * part;
    }

    /// Resets the balance.
    pub fn reset(&mut self) {
        self.forgotten += self.dissipated;
        self.dissipated = 0.0;
    }

    /// The damping, N s/m, that dissipates generated energy at this velocity of the device. `pushed` is the wrench on
    /// the device, and `releasable` the elastic energy behind it, J. The part of its work that was never supplied is
    /// withheld. `delay` is the delay of the local model, s.
    pub fn damping(
        &self,
        velocity: &Vector6,
        pushed: &Vector6,
        releasable: f64,
        delay: f64,
        coupling: &Coupling,
        dt: f64,
    ) -> f64 {
        let square = six::dot(velocity, velocity);
        let power = six::dot(pushed, velocity);
        if square == 0.0 || (self.dissipated >= 0.0 && power <= 0.0) {
            return 0.0;
        }
        let generated = (-self.dissipated).max(0.0);
        let unpaid = match power > 0.0 {
            true => {
                power
                    * (generated / releasable)
                        .max(self.unsupplied_share(power, releasable, delay))
                        .clamp(0.0, 1.0)
            }
            false => 0.0,
        };
        ((generated / DISSIPATION_TIME.max(dt) + unpaid) / square).min(MAX_DAMPING * coupling.critical)
    }

    /// The fraction of the releasable energy that was never supplied, by the hand's own balance. It counts if the
    /// energy would be released within the delay.
    fn unsupplied_share(&self, power: f64, releasable: f64, delay: f64) -> f64 {
        let soon = (power * delay / releasable).min(1.0);
        // A hand that has supplied nothing is moved by the tissue.
        let paying = match self.supplied < 0.0 {
            true => self.max_supplied / (self.max_supplied - self.supplied),
            false => 1.0,
        };
        soon * soon * paying * (1.0 - self.supplied / releasable)
    }
}
