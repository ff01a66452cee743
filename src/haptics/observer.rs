//! Keeps the loop of hand and tissue passive: what the coupling gives away it must have been given.
//!
//! The hand's work on the device, less the tool's on the tissue, less what the spring between them stores, is what the coupling has lost. Where that
//! falls below 0 it has made energy, by what sampling and hand-over are late, and a damper takes it back (Hannaford, Ryu 2002, at two ports).

use super::definition::{Coupling, spread};
use super::six::{self, Vector6};

/// What was lost may be had back up to what the spring stores when it is drawn out so far, m.
const UNFELT: f64 = 2e-5;

/// What was made is taken back within so long, s: at once it would be felt as a knock.
const TAKEN_BACK: f64 = 0.02;

/// What was made is remembered for so long, s.
const REMEMBERED: f64 = 0.2;

/// The damper is at most so many times what damps the device critically: a coupling without a damper needs it most.
const MOST: f64 = 2.0;

#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Observer {
    /// Done by the hand, J, and by the proxy on what it felt.
    by_hand: f64,
    pub by_proxy: f64,
    /// What of the balance is forgotten, J.
    forgotten: f64,
    /// What the coupling has lost, J; below 0 it has made so much.
    pub lost: f64,
    /// What the hand, and the tool on the tissue, had done when the tool touched nothing last, J.
    free: [f64; 2],
    /// What the hand has done since then and not had back, and what tissue has given by itself, J.
    paid: f64,
    /// The most of that.
    most_paid: f64,
}

impl Observer {
    /// The hand has moved by this way against what it felt.
    pub fn hand_moved(&mut self, felt: &Vector6, way: &Vector6) {
        self.by_hand -= six::dot(felt, way);
    }

    /// The proxy has moved by this way against the mean of these.
    pub fn proxy_moved(&mut self, held: [&Vector6; 2], way: &Vector6) {
        self.by_proxy -= 0.5 * (six::dot(held[0], way) + six::dot(held[1], way));
    }

    /// Balances what is known: the work on the tissue until the model was made, by the world's account and by the proxy's.
    pub fn balance(&mut self, (work, sent_work): (f64, f64), held: &Vector6, coupling: &Coupling, dt: f64) {
        let on_tissue = work + self.by_proxy - sent_work;
        let stiffness = spread(coupling.stiffness);
        let stored: f64 = held
            .iter()
            .zip(stiffness)
            .map(|(wrench, spring)| 0.5 * wrench * wrench / spring)
            .sum();
        let lost = self.by_hand - on_tissue - stored - self.forgotten;
        let reserve = 0.5 * coupling.stiffness[0] * UNFELT * UNFELT;
        // Tissue spends by itself what it was given too much.
        let part = (dt / REMEMBERED).min(1.0);
        let spent = lost.min(0.0) * part;
        self.forgotten += (lost - reserve).max(0.0) + spent;
        self.lost = lost.min(reserve) - spent;
        self.pay(work, *held == six::ZERO, part);
    }

    /// Knows what the hand has paid, by the hand's own account: forgets it where the tool touches nothing, and this part of it with time.
    fn pay(&mut self, work: f64, is_free: bool, part: f64) {
        if is_free {
            self.free = [self.by_hand, work];
            self.most_paid = 0.0;
        }
        self.paid = self.by_hand - self.free[0] + (self.free[1] - work).max(0.0);
        self.free[0] += self.paid.min(0.0) * part;
        self.most_paid = self.most_paid.max(self.paid);
        self.most_paid += (self.paid - self.most_paid) * part;
    }

    /// Forgets what was made or lost.
    pub fn forget(&mut self) {
        self.forgotten += self.lost;
        self.lost = 0.0;
    }

    /// The damper, N s/m, that takes back what was made of a device at this velocity. Where the device is pushed by this wrench, and by what can give
    /// back so much as it lets go, J, it is given that part of its work less that was never paid for. The world tells what was so late, s.
    pub fn damping(
        &self,
        velocity: &Vector6,
        pushed: &Vector6,
        gives: f64,
        late: f64,
        coupling: &Coupling,
        dt: f64,
    ) -> f64 {
        let square = six::dot(velocity, velocity);
        let power = six::dot(pushed, velocity);
        if square == 0.0 || (self.lost >= 0.0 && power <= 0.0) {
            return 0.0;
        }
        let made = (-self.lost).max(0.0);
        let unpaid = match power > 0.0 {
            true => power * (made / gives).max(self.early(power, gives, late)).clamp(0.0, 1.0),
            false => 0.0,
        };
        ((made / TAKEN_BACK.max(dt) + unpaid) / square).min(MOST * coupling.critical)
    }

    /// What part of that was never paid for as far as the hand knows by itself: asked where all would be given before the world tells.
    fn early(&self, power: f64, gives: f64, late: f64) -> f64 {
        let soon = (power * late / gives).min(1.0);
        // A hand that has paid nothing is carried by the tissue.
        let paying = match self.paid < 0.0 {
            true => self.most_paid / (self.most_paid - self.paid),
            false => 1.0,
        };
        soon * soon * paying * (1.0 - self.paid / gives)
    }
}
