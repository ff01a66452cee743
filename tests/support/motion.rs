//! Motions with closed-form solutions, and exact solutions of the implicit formulas, in `f64`.

use std::f64::consts::TAU;

use glam::{DVec3, Vec3};

use super::bodies::{Parts, Scene};

pub const REST: f32 = 0.1;
pub const STRETCH: f64 = 0.05;

/// Returns two masses, 1 and 3 kg, joined by a stretched spring, and their reduced mass (kg).
pub fn two_masses() -> (Parts, f64) {
    let mut parts = Parts::nodes(vec![Vec3::ZERO, Vec3::X * (REST + STRETCH as f32)], 1.0);
    parts.join(0, 1, 100.0);
    parts.masses[1] = 3.0;
    parts.rest_lengths[0] = REST;
    (parts, 0.75)
}

/// sqrt(k (1/m1 + 1/m2)).
pub fn omega() -> f64 {
    (100.0_f64 / 0.75).sqrt()
}

/// Returns the elongation of the spring and its rate.
pub fn stretch(scene: &Scene) -> (f64, f64) {
    let (x, v) = (scene.positions(), scene.velocities());
    (x[1].x - x[0].x - f64::from(REST), v[1].x - v[0].x)
}

/// A mode of a linear body, `q'' + rate q' + omega² q = push`, stepped by the implicit formulas. The first step is of
/// order 1.
#[derive(Clone, Copy, Debug)]
pub struct Mode {
    pub omega_squared: f64,
    /// 1/s
    pub rate: f64,
    pub push: f64,
    pub now: [f64; 2],
    pub last: Option<[f64; 2]>,
}

impl Mode {
    /// Creates a mode with the displacement `q` and the velocity `v`.
    pub fn new(omega: f64, rate: f64, q: f64, v: f64) -> Self {
        Self {
            omega_squared: omega * omega,
            rate,
            push: 0.0,
            now: [q, v],
            last: None,
        }
    }

    pub fn step(&mut self, order: u32, h: f64) {
        let (t, c, last) = match self.last {
            Some(last) if order == 2 => (2.0 * h / 3.0, 1.0 / 3.0, last),
            _ => (h, 0.0, self.now),
        };
        // q1 = q + t v1, v1 = v + t (push - rate v1 - omega² q1).
        let [q, v] = [0, 1].map(|i| self.now[i] + c * (self.now[i] - last[i]));
        self.last = Some(self.now);
        let velocity =
            (v + t * (self.push - self.omega_squared * q)) / (1.0 + t * self.rate + t * t * self.omega_squared);
        self.now = [q + t * velocity, velocity];
    }

    pub fn run(&mut self, order: u32, h: f64, steps: usize) {
        for _ in 0..steps {
            self.step(order, h);
        }
    }
}

/// Returns `angle` plus the whole turns that bring it nearest to `expected`.
pub fn unwrapped(angle: f64, expected: f64) -> f64 {
    angle + TAU * ((expected - angle) / TAU).round()
}

/// Returns half the distance between neighboring `f32` values at `value`.
pub fn rounding(value: f64) -> f64 {
    let value = (value as f32).abs();
    f64::from(value.next_up() - value) / 2.0
}

/// Returns a chain along x with fixed ends and `free` nodes between them.
pub fn fixed_chain(free: usize, spacing: f32, mass: f32, stiffness: f32) -> Parts {
    let mut parts = Parts::chain(free + 2, Vec3::X * spacing, mass, stiffness);
    parts.masses[0] = 0.0;
    parts.masses[free + 1] = 0.0;
    parts.rest_lengths.fill(spacing);
    parts
}

/// Waves of 20 nodes' length that travel along a chain.
pub struct Waves {
    pub parts: Parts,
    spacing: f64,
    /// Radians per node.
    wave_number: f64,
    /// sqrt(k/m), 1/s.
    rate: f64,
}

impl Waves {
    pub fn new(free: usize) -> Self {
        let (spacing, mass, stiffness) = (0.01_f32, 0.01_f32, 100.0_f32);
        Self {
            parts: fixed_chain(free, spacing, mass, stiffness),
            spacing: f64::from(spacing),
            wave_number: TAU / 20.0,
            rate: (f64::from(stiffness) / f64::from(mass)).sqrt(),
        }
    }

    fn omega(&self) -> f64 {
        2.0 * self.rate * (self.wave_number / 2.0).sin()
    }

    pub fn start(&self, scene: &mut Scene) {
        let mut positions = self.parts.positions.clone();
        let mut velocities = vec![Vec3::ZERO; positions.len()];
        for i in 1..positions.len() - 1 {
            let phase = self.wave_number * i as f64;
            positions[i].x = (f64::from(positions[i].x) + self.spacing * phase.cos()) as f32;
            velocities[i].x = (self.spacing * self.omega() * phase.sin()) as f32;
        }
        scene.body_mut().set_positions(&positions).expect("positions");
        scene.body_mut().set_velocities(&velocities).expect("velocities");
    }

    /// Returns the wave speed after `t` seconds, measured at the middle `count` nodes, and the expected speed with
    /// dispersion.
    pub fn speed(&self, scene: &Scene, t: f64, count: usize) -> (f64, f64) {
        let (mut cosine, mut sine) = (0.0, 0.0);
        let first = (self.parts.positions.len() - count) / 2;
        for (i, x) in scene.positions().iter().enumerate().skip(first).take(count) {
            let displacement = x.x - self.spacing * i as f64;
            cosine += displacement * (self.wave_number * i as f64).cos();
            sine += displacement * (self.wave_number * i as f64).sin();
        }
        let travelled = unwrapped(sine.atan2(cosine), self.omega() * t);
        let half = self.wave_number / 2.0;
        let long_waves = self.spacing * self.rate;
        (
            travelled / t / self.wave_number * self.spacing,
            long_waves * half.sin() / half,
        )
    }
}

/// A kilogram at the end of a stiff spring of 1 m.
pub struct Pendulum {
    pub parts: Parts,
    pub gravity: f32,
    stiffness: f64,
    start: f64,
}

impl Pendulum {
    pub fn from_150_degrees() -> Self {
        let (gravity, stiffness) = (9.81_f32, 1e5_f32);
        let start = 150.0_f64.to_radians();
        let compressed = 1.0 + f64::from(gravity) * start.cos() / f64::from(stiffness);
        let bob = DVec3::new(start.sin(), -start.cos(), 0.0) * compressed;
        let mut parts = Parts::nodes(vec![Vec3::ZERO, bob.as_vec3()], 1.0);
        parts.masses[0] = 0.0;
        parts.join(0, 1, stiffness);
        parts.rest_lengths[0] = 1.0;
        Self {
            parts,
            gravity,
            stiffness: f64::from(stiffness),
            start,
        }
    }

    /// Returns 2 pi sqrt(L/g) / AGM(1, cos(theta0/2)), corrected for the elongation of the spring.
    pub fn period(&self) -> f64 {
        let mean = arithmetic_geometric_mean(1.0, (self.start / 2.0).cos());
        let gravity = f64::from(self.gravity);
        TAU / gravity.sqrt() / mean * (1.0 + 1.98 * gravity / self.stiffness)
    }
}

/// Returns the mean period of an oscillation about zero over three periods, from samples at intervals of `h`.
pub fn period_of(h: f64, mut sample: impl FnMut() -> f64) -> f64 {
    let mut crossings = Vec::new();
    let (mut before, mut t) = (sample(), h);
    while crossings.len() < 7 {
        let now = sample();
        if before * now < 0.0 {
            crossings.push(t + h * before / (before - now));
        }
        (before, t) = (now, t + h);
    }
    (crossings[6] - crossings[0]) / 3.0
}

fn arithmetic_geometric_mean(a: f64, b: f64) -> f64 {
    (0..20).fold((a, b), |(a, b), _| ((a + b) / 2.0, (a * b).sqrt())).0
}
