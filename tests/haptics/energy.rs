//! A hand in the haptic loop gains no energy.

use super::bench::*;
use glam::{DVec3, dvec3};
use sinew::Solver;

/// The energy of a spring of 1000 N/m stretched by 0.06 mm (J).
const TOLERANCE: f64 = 2e-6;

/// A mass on a spring. Its motion under a force that is constant during a tick is exact.
struct Hand {
    /// kg.
    mass: f64,
    /// The stiffness (N/m) and the rest position.
    stiffness: f64,
    home: DVec3,
    position: DVec3,
    velocity: DVec3,
}

impl Hand {
    fn tick(&mut self, force: DVec3, dt: f64) {
        if self.stiffness == 0.0 {
            let acceleration = force / self.mass;
            self.position += self.velocity * dt + 0.5 * acceleration * dt * dt;
            self.velocity += acceleration * dt;
            return;
        }
        let omega = (self.stiffness / self.mass).sqrt();
        let rest = self.home + force / self.stiffness;
        let (sine, cosine) = (omega * dt).sin_cos();
        let offset = self.position - rest;
        self.position = rest + offset * cosine + self.velocity * (sine / omega);
        self.velocity = self.velocity * cosine - offset * (omega * sine);
    }

    fn energy(&self) -> f64 {
        0.5 * self.mass * self.velocity.length_squared()
            + 0.5 * self.stiffness * (self.position - self.home).length_squared()
    }
}

/// Runs a hand that strikes the tissue. Returns the hand's initial and largest energy, and the final energy of hand and
/// tissue (J).
fn strike(bench: &mut Bench, mut hand: Hand, ticks: u32) -> [f64; 3] {
    let first = hand.energy();
    let mut largest = 0.0_f64;
    for _ in 0..ticks {
        let record = bench.tick(hand.position, hand.velocity);
        hand.tick(record.tick.force.as_dvec3(), f64::from(TICK));
        largest = largest.max(hand.energy());
    }
    [first, largest, hand.energy() + bench.energy()]
}

#[test]
fn a_hand_that_strikes_tissue_gains_no_energy() {
    check_a_hand_that_strikes_tissue_gains_no_energy(is_short);
}

#[test]
#[ignore = "long"]
fn a_hand_that_strikes_tissue_gains_no_energy_in_the_other_cases() {
    check_a_hand_that_strikes_tissue_gains_no_energy(|solver, stiffness, speed| !is_short(solver, stiffness, speed));
}

/// Selects the short cases. IMPLICIT is slow.
fn is_short(solver: Solver, stiffness: f64, speed: f64) -> bool {
    solver == Solver::Verlet || (stiffness, speed) == (200.0, 0.2)
}

fn check_a_hand_that_strikes_tissue_gains_no_energy(is_selected: fn(Solver, f64, f64) -> bool) {
    for (solver, every) in [(Solver::Verlet, 1), (Solver::Verlet, 16), (Solver::Implicit, 1)] {
        for (mass, stiffness) in [(0.05, 0.0), (0.3, 0.0), (0.1, 200.0), (0.1, 3000.0)] {
            for speed in [0.05, 0.2] {
                if !is_selected(solver, stiffness, speed) {
                    continue;
                }
                let mut bench = Bench::new(solver, every);
                let hand = Hand {
                    mass,
                    stiffness,
                    home: dvec3(0.0, f64::from(RADIUS) - 1e-3, 0.0),
                    position: dvec3(0.0, f64::from(RADIUS) + 5e-4, 0.0),
                    velocity: dvec3(0.0, -speed, 0.0),
                };
                let [first, largest, remaining] = strike(&mut bench, hand, 700);
                let case = format!("{solver:?}, a step for {every} ticks, {mass} kg, {stiffness} N/m, {speed} m/s");
                assert!(largest <= first + TOLERANCE, "{case}: {largest} J of {first} J");
                assert!(remaining < 0.9 * first, "{case}: {remaining} J are left of {first} J");
            }
        }
    }
}
