//! What a body may have: the energy that was put into it, and the momentum it began with.
//!
//! **Energy.** A body that begins with the energy `E0` can turn into motion what it has above its state of rest, `E0 - E_rest`, and the work
//! `W` that is done on it: the sum over steps of the mean force of led pins times their displacement, of applied forces times that of
//! their nodes, and of the force of a tool times its own. `E0 - E_rest + W` is the energy put in. Nothing but work raises `E`, so that
//! `E <= E0 + W` whatever dampers take; how far E is above that, over the energy put in, may be a thousandth. IMPLICIT and NEWTON have
//! positions and velocities of the same time, and their E is compared as it is.
//!
//! VERLET keeps another energy. A kick of half a substep h, a drift and half a kick again take v to `v' = v + h/2 (a + a')` and x to
//! `x' = x + h (v + h/2 a)`. So the kinetic energy changes by
//!
//! `m/2 (v' - v).(v' + v) = (F + F')/2 . (x' - x) + h²/8 (F'² - F²)/m`.
//!
//! The first part is the trapezoidal rule for the work of the forces, which is exact where they are linear. So leapfrog keeps
//! `E - h²/8 Q` of a linear body, Q being the sum of `F²/m` over free nodes: its shadow energy. E itself oscillates above that by as much as
//! the part `(h omega / 2)²` of the elastic energy, since `F²/m <= omega² 2 U`. This is no fault. No guess of omega is made to allow for
//! it: Q is measured by a very short step of a copy of the body, and `E - h²/8 Q <= E0 + W` is what is asked for.
//!
//! It is asked for from when nothing presses the body any more: the copy has neither the pins nor the forces nor the tool. What was gained
//! before is there still.
//!
//! **Momentum.** Nothing acts on a free body from outside: its momentum stays within 1e-5 of the sum of the nodes' own, and its angular
//! momentum about the centre of mass within 2e-3. What mass scaling adds is inertia that the masses do not show: where it comes or goes,
//! their momentum may change by twice that of the mass added, at the speed of the fastest node.

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
    /// Where nothing acts from outside.
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

    /// Takes in the work done in a step, J.
    pub fn add_work(&mut self, work: f64, figures: &mut Figures) {
        self.allowed += work;
        figures.put_in += work;
    }

    /// Looks at the body at the end of a step that was taken in substeps of this length, s.
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

    /// h²/8 Q, J.
    fn oscillation(&mut self, body: &Body, masses: &[f32], substep: f64) -> f64 {
        let short = (substep / 16.0) as f32;
        let before = body.velocities();
        let copy = self.copy.body_mut();
        copy.set_positions(body.positions()).expect("positions");
        copy.set_velocities(before).expect("velocities");
        if self.copy.world.step(short).is_err() {
            // What has blown up has no substep that is short enough.
            return 0.0;
        }
        let after = self.copy.body().velocities();
        let change = |after: Vec3, before: Vec3| after.as_dvec3() - before.as_dvec3();
        let nodes = masses.iter().zip(after.iter().zip(before));
        let squares = nodes.map(|(&mass, (&after, &before))| f64::from(mass) * change(after, before).length_squared());
        (substep / f64::from(short)).powi(2) / 8.0 * squares.sum::<f64>()
    }
}

/// Of a body about its centre of mass.
struct Momenta {
    sum: DVec3,
    /// The sum of the sizes of the nodes' momenta.
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
