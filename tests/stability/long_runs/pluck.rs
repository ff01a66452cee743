//! The frequency of the first mode.
//!
//! A body hangs in equilibrium. Sideways forces proportional to the masses deflect it by a small fraction of its
//! length, and then release it. The deflected shape is nearly that of the first mode. So the sum over the nodes of mass
//! times displacement times this shape is nearly a pure oscillation, and the times of its zeros give the frequency.
//!
//! The true frequency comes from NEWTON, which solves its equations in `f64`, with short steps. The discretization
//! error of its formula is known and is removed: for a mode of frequency `omega`, BDF2 has
//! `(3/2 - i omega h) z² - 2 z + 1/2 = 0`, and its phase advances by `arg z` in a step. An IMPLICIT or NEWTON row is
//! compared with `arg z / h`, the frequency of its own formula at its step: the difference is the error of the solver.
//! A VERLET row is compared with the true frequency: `2/h asin(h omega / 2)` differs from it by `(h omega)²/24`, less
//! than 1e-4 in substeps that are stable for the highest mode.

use std::f64::consts::TAU;
use std::sync::Mutex;

use glam::{DVec3, Vec3};
use sinew::{Error, Solver};

use super::activity::Activity;
use super::figures::Figures;
use super::rest::{Known, once};
use super::scene::Scene;
use super::subject::Subject;
use super::table::Row;

/// The deflection, as a fraction of the length of the body.
const AMPLITUDE: f64 = 2e-4;

/// The number of periods measured.
const PERIODS: usize = 3;

/// Steps of the reference in a period.
const STEPS: f64 = 60.0;

/// Longer than these periods of any body, s.
const LONGEST: f64 = 30.0;

/// A body that was deflected and released.
struct Plucked {
    scene: Scene,
    /// Positions in equilibrium, m.
    rest: Vec<Vec3>,
    /// Mass times deflection of each node, kg m.
    shape: Vec<DVec3>,
}

impl Plucked {
    fn new(subject: &Subject, solver: Solver) -> Result<Self, Error> {
        static DEFLECTED: Known<Vec<Vec3>> = Mutex::new(None);
        let mut scene = Activity::Plucked.begin(subject, solver)?;
        let rest = scene.body().positions().to_vec();
        let deflected = once(&DEFLECTED, &subject.matter.to_string(), || deflect(subject, &rest))?;
        scene.body_mut().set_positions(&deflected).expect("positions");
        let deflections = deflected
            .iter()
            .zip(&rest)
            .map(|(&deflected, &rest)| difference(deflected, rest));
        let shape = deflections
            .zip(&subject.masses)
            .map(|(deflection, &mass)| deflection * f64::from(mass));
        Ok(Self {
            shape: shape.collect(),
            scene,
            rest,
        })
    }

    fn signal(&self) -> f64 {
        let positions = self.scene.body().positions().iter();
        let displacements = positions.zip(&self.rest).map(|(&p, &rest)| difference(p, rest));
        displacements
            .zip(&self.shape)
            .map(|(displacement, shape)| displacement.dot(*shape))
            .sum()
    }

    /// Measures the frequency with this step, 1/s. `None` after a fault, which the figures report.
    fn frequency(&mut self, step: f32, figures: &mut Figures) -> Option<f64> {
        let mut before = self.signal();
        let mut zeros = Vec::new();
        while zeros.len() < 2 * PERIODS + 1 && figures.time < LONGEST {
            let time = figures.time;
            if !self.scene.step(step, figures) {
                return None;
            }
            let now = self.signal();
            if (now > 0.0) != (before > 0.0) {
                zeros.push(time + f64::from(step) * before / (before - now));
            }
            before = now;
        }
        if zeros.len() < 2 * PERIODS + 1 {
            figures.faults.push(format!("{} zeros in {LONGEST} s", zeros.len()));
            return None;
        }
        Some(PERIODS as f64 / (zeros[2 * PERIODS] - zeros[0]))
    }
}

fn difference(to: Vec3, from: Vec3) -> DVec3 {
    to.as_dvec3() - from.as_dvec3()
}

/// The positions of the deflected body, m.
fn deflect(subject: &Subject, rest: &[Vec3]) -> Result<Vec<Vec3>, Error> {
    let mut scene = Activity::Plucked.begin(subject, Solver::Verlet)?;
    // Small deflections are proportional to the forces: the first deflection gives the right force.
    let mut share = 1e-3;
    for _ in 0..2 {
        rest_under_sideways_load(&mut scene, subject, share)?;
        let deflected = scene.body().positions();
        let farthest = deflected
            .iter()
            .zip(rest)
            .map(|(&a, &b)| difference(a, b).length())
            .fold(0.0, f64::max);
        share *= AMPLITUDE * f64::from(subject.length) / farthest;
    }
    Ok(scene.body().positions().to_vec())
}

/// Moves the body to equilibrium under a fraction of its weight applied sideways.
fn rest_under_sideways_load(scene: &mut Scene, subject: &Subject, share: f64) -> Result<(), Error> {
    let forces = subject
        .masses
        .iter()
        .map(|&mass| 9.81 * mass * share as f32 * subject.across());
    let nodes = (0..).zip(forces).filter(|(node, _)| !subject.ends[0].contains(node));
    let (nodes, mut forces): (Vec<u32>, Vec<_>) = nodes.unzip();
    scene.body_mut().apply_forces(&nodes, &forces).expect("forces");
    scene.rest()?;
    // The applied forces are still pending.
    forces.iter_mut().for_each(|force| *force = -*force);
    scene.body_mut().apply_forces(&nodes, &forces).expect("forces");
    Ok(())
}

/// The relative frequency error of BDF2.
fn frequency_error(h_omega: f64) -> f64 {
    // z = (2 + sqrt(4 - 2 (3/2 - i h omega))) / (2 (3/2 - i h omega)), the root near 1.
    let (re, im) = (1.0, 2.0 * h_omega);
    let size = f64::hypot(re, im);
    let root = [((size + re) / 2.0).sqrt(), ((size - re) / 2.0).sqrt()];
    let angle = root[1].atan2(2.0 + root[0]) - (-h_omega).atan2(1.5);
    angle / h_omega - 1.0
}

/// The true frequency of a body's first mode, 1/s.
fn reference(subject: &Subject) -> Result<f64, Error> {
    static KNOWN: Known<f64> = Mutex::new(None);
    let find = |solver, step: f64| -> Result<f64, Error> {
        let mut figures = Figures::default();
        let found = Plucked::new(subject, solver)?.frequency(step as f32, &mut figures);
        found.ok_or_else(|| Error::NotConverged(format!("no reference: {}", figures.faults.join("; "))))
    };
    once(&KNOWN, &subject.matter.to_string(), || {
        let rough = find(Solver::Verlet, 1.0 / 240.0)?;
        let step = 1.0 / (STEPS * rough);
        Ok(find(Solver::Newton, step)? / (1.0 + frequency_error(TAU / STEPS)))
    })
}

pub fn ring(row: &Row, subject: &Subject) -> Result<Figures, Error> {
    let mut figures = Figures::default();
    let truth = reference(subject)?;
    let mut plucked = Plucked::new(subject, row.solver)?;
    let Some(found) = plucked.frequency(row.step, &mut figures) else {
        return Ok(figures);
    };
    let substep = f64::from(row.step) / f64::from(figures.substeps.max(1));
    let formula = match row.solver {
        Solver::Verlet => truth,
        _ => truth * (1.0 + frequency_error(TAU * truth * substep)),
    };
    figures.frequency = Some([found / formula - 1.0, found / truth - 1.0]);
    Ok(figures)
}
