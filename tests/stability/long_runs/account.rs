//! The balance of energy and momentum of a body.
//!
//! **Energy.** `E` is the kinetic, elastic and gravitational energy of the body together, with the nodal masses: what
//! mass scaling adds is no energy of the body, and only takes some of it for a while. It begins with `E0`, and its
//! static equilibrium has `E_rest`. The work `W` is a sum over the steps: the mean force of a moved pin times the pin's
//! displacement, an applied force times the displacement of its node, and the force of a tool times the tool's
//! displacement. The energy put in is `E0 - E_rest + W`: this much can become motion. Only work raises `E`, and damping
//! lowers it, so `E <= E0 + W`. The excess `E - E0 - W`, a mean over one simulated second, may be a thousandth of the
//! energy put in. Checks begin when the body is released.
//!
//! The mean allows for the one thing that leapfrog does to `E` without a fault. VERLET follows exactly the motion of
//! another energy. A mode of frequency `omega` in substeps `h`, with `z = h omega`, kinetic energy `K` and elastic
//! energy `U`, conserves
//!
//! `S = c (K + (1 - z²/4) U)`, `c = 2 asin(z/2) / (z sqrt(1 - z²/4))`.
//!
//! So `K + U` oscillates between `S / c` and `S / (c (1 - z²/4))`. `K` and `(1 - z²/4) U` have the same mean, and the
//! mean of `K + U` is `S (1 - z²/8) / (c (1 - z²/4))`, about `(1 - z²/24) S`. It is below `S` for every `z` up to 1.67,
//! and substeps of 0.8 of the limit have `z <= 1.6`. When nonlinear forces move energy from slow modes to fast ones,
//! the sum of `S` stays and the mean of `E` falls a little. The body begins with energy in slow modes alone, where `S`
//! is `E`. So the mean of `E` stays below `E0 + W` with VERLET too. A second is long for modes whose `z` is not small:
//! their periods are a few substeps.
//!
//! **Momentum.** No external force acts on a free body. Its momentum may change by 1e-5 of the sum of the magnitudes of
//! the nodal momenta, and by 1e-10 of it in a substep more: rounding was seen to add 6e-11, of which ten minutes have
//! up to a million. Its angular momentum about the center of mass may change by 2e-3. Mass scaling adds inertia that
//! the nodal masses do not contain. Their momentum may change by twice the momentum that the added mass has at the
//! speed of the fastest node.

use glam::DVec3;
use sinew::{Body, Error};

use super::activity::Activity;
use super::figures::Figures;
use super::rest::energy_at_rest;
use super::scene::Scene;
use super::subject::Subject;

/// Checks in a simulated second, at most.
pub const CHECKS: usize = 60;

pub struct Account {
    /// E0 + W, J.
    allowed: f64,
    /// The sum of the excess over the checks of this second, J, and their number.
    sum: f64,
    count: usize,
    /// The initial momenta of a free body.
    momenta: Option<Momenta>,
}

impl Account {
    pub fn new(activity: Activity, subject: &Subject, scene: &Scene) -> Result<(Self, Figures), Error> {
        let is_free = activity == Activity::Spinning;
        let allowed = scene.energy();
        let rest = energy_at_rest(subject, scene.world.gravity(), is_free)?;
        let account = Self {
            allowed,
            sum: 0.0,
            count: 0,
            momenta: is_free.then(|| Momenta::of(scene.body(), &subject.masses)),
        };
        Ok((account, Figures::of(allowed - rest)))
    }

    /// Adds the work of a step (J).
    pub fn add_work(&mut self, work: f64, figures: &mut Figures) {
        self.allowed += work;
        figures.put_in += work;
    }

    /// Checks the body; `per_second` is the number of checks in a simulated second.
    pub fn check(&mut self, scene: &Scene, masses: &[f32], per_second: usize, figures: &mut Figures) {
        self.sum += scene.energy() - self.allowed;
        self.count += 1;
        if self.count == per_second {
            figures.record_energy(self.sum / self.count as f64 / figures.put_in);
            (self.sum, self.count) = (0.0, 0);
        }
        if let Some(first) = &self.momenta {
            let now = Momenta::of(scene.body(), masses);
            let added = 2.0 * scene.body().solver_report().added_mass * now.fastest;
            figures.record_momentum(((now.sum - first.sum).length() - added).max(0.0) / first.size);
            figures.record_angular_momentum((now.angular - first.angular).length() / first.angular.length());
        }
    }
}

/// Momentum, and angular momentum about the center of mass.
struct Momenta {
    sum: DVec3,
    /// The sum of the magnitudes of the nodal momenta.
    size: f64,
    angular: DVec3,
    /// The speed of the fastest node, m/s.
    fastest: f64,
}

impl Momenta {
    fn of(body: &Body, masses: &[f32]) -> Self {
        let masses = || masses.iter().map(|&mass| f64::from(mass));
        let weighed = body.positions().iter().zip(masses());
        let centre = weighed.map(|(p, mass)| p.as_dvec3() * mass).sum::<DVec3>() / masses().sum::<f64>();
        let mut momenta = Self {
            sum: DVec3::ZERO,
            size: 0.0,
            angular: DVec3::ZERO,
            fastest: 0.0,
        };
        for ((p, v), mass) in body.positions().iter().zip(body.velocities()).zip(masses()) {
            let momentum = v.as_dvec3() * mass;
            momenta.sum += momentum;
            momenta.size += momentum.length();
            momenta.fastest = momenta.fastest.max(v.as_dvec3().length());
            momenta.angular += (p.as_dvec3() - centre).cross(momentum);
        }
        momenta
    }
}
