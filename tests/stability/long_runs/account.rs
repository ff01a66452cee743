//! The balance of energy and momentum of a body.
//!
//! **Energy.** `E` is the kinetic, elastic and gravitational energy of the body together. It begins with `E0`, and its static equilibrium has
//! `E_rest`. The work `W` is a sum over the steps: the mean force of a moved pin times the pin's displacement, an applied force times the
//! displacement of its node, and the force of a tool times the tool's displacement. The energy put in is `E0 - E_rest + W`: this much can
//! become motion. Only work raises `E`, and damping lowers it, so `E <= E0 + W`. The excess `E - E0 - W` may be a thousandth of the energy
//! put in. IMPLICIT and NEWTON report positions and velocities of the same time, so `E` is compared directly.
//!
//! VERLET conserves another energy. A substep `h` is half a kick, a drift and half a kick: `v' = v + h/2 (a + a')` and
//! `x' = x + h (v + h/2 a)`. The kinetic energy of a node then changes by
//!
//! `m/2 (v' - v).(v' + v) = (F + F')/2 . (x' - x) + h²/8 (F'² - F²)/m`.
//!
//! The first term is the trapezoidal rule for the work of the forces. It is exact for linear forces, so leapfrog conserves the shadow energy
//! `E - h²/8 Q` of a linear body exactly, with `Q` the sum of `F²/m` over the free nodes. `Q` is at most `2 omega² U`, with `U` the elastic
//! energy above equilibrium and `omega` the highest frequency. So `E` itself oscillates by up to `(h omega / 2)² U`, and this is no fault:
//! it gives the bound `E0 / (1 - (h omega / 2)²)` for `E`. That bound is loose, since most of the energy is in slow modes, and `omega` is not
//! known exactly. The check therefore measures `Q` by a very short step of a copy of the body, and demands `E - h²/8 Q <= E0 + W`.
//!
//! The check begins when the body is released: the copy has no led pins, applied forces or tool. Energy gained before that is still there.
//!
//! **Momentum.** No external force acts on a free body. Its momentum may change by 1e-5 of the sum of the magnitudes of the nodal momenta, its
//! angular momentum about the centre of mass by 2e-3. Mass scaling adds inertia that the nodal masses do not contain. Their momentum may
//! change by twice the momentum that the added mass has at the speed of the fastest node.

use glam::{DVec3, Vec3};
use sinew::{Body, Error, Solver};

use super::activity::Activity;
use super::figures::Figures;
use super::rest::rest_shape;
use super::scene::Scene;
use super::subject::Subject;

pub struct Account {
    /// The same body with VERLET.
    copy: Scene,
    is_verlet: bool,
    /// E0 + W, J.
    allowed: f64,
    /// The initial momenta of a free body.
    momenta: Option<Momenta>,
}

impl Account {
    pub fn new(activity: Activity, subject: &Subject, solver: Solver, scene: &Scene) -> Result<(Self, Figures), Error> {
        let gravity = scene.world.gravity();
        let is_free = activity == Activity::Spinning;
        let mut copy = Scene::new(&subject.definition(Solver::Verlet), gravity);
        if !is_free {
            copy.pin(&subject.ends[0]);
        }
        let rest = rest_shape(subject, gravity, is_free)?;
        copy.body_mut().set_positions(&rest).expect("positions");
        let allowed = scene.energy();
        let figures = Figures::of(allowed - copy.energy());
        let account = Self {
            is_verlet: solver == Solver::Verlet,
            allowed,
            momenta: is_free.then(|| Momenta::of(scene.body(), &subject.masses)),
            copy,
        };
        Ok((account, figures))
    }

    /// Adds the work of a step, J.
    pub fn add_work(&mut self, work: f64, figures: &mut Figures) {
        self.allowed += work;
        figures.put_in += work;
    }

    /// Checks the body after a step of substeps of this length, s.
    pub fn check(&mut self, scene: &Scene, masses: &[f32], substep: f64, figures: &mut Figures) {
        let mut excess = scene.energy() - self.allowed;
        if self.is_verlet && excess > 0.0 {
            excess -= self.oscillation(scene.body(), masses, substep);
        }
        figures.see_energy(excess / figures.put_in);
        if let Some(first) = &self.momenta {
            let now = Momenta::of(scene.body(), masses);
            let added = 2.0 * scene.body().solver_report().added_mass * now.fastest;
            figures.see_momentum(((now.sum - first.sum).length() - added).max(0.0) / first.size);
            figures.see_angular_momentum((now.angular - first.angular).length() / first.angular.length());
        }
    }

    /// Measures h²/8 Q, J.
    fn oscillation(&mut self, body: &Body, masses: &[f32], substep: f64) -> f64 {
        let short = (substep / 16.0) as f32;
        let before = body.velocities();
        let copy = self.copy.body_mut();
        copy.set_positions(body.positions()).expect("positions");
        copy.set_velocities(before).expect("velocities");
        if self.copy.world.step(short).is_err() {
            // The body has blown up: no substep is short enough.
            return 0.0;
        }
        let after = self.copy.body().velocities();
        let change = |after: Vec3, before: Vec3| after.as_dvec3() - before.as_dvec3();
        let nodes = masses.iter().zip(after.iter().zip(before));
        let squares = nodes.map(|(&mass, (&after, &before))| f64::from(mass) * change(after, before).length_squared());
        (substep / f64::from(short)).powi(2) / 8.0 * squares.sum::<f64>()
    }
}

/// Momentum, and angular momentum about the centre of mass.
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
