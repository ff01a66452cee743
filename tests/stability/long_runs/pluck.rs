//! The frequency of a body's first mode.
//!
//! A body hangs at rest, is drawn aside by forces in proportion to the masses, a thousandth of its length, and let go of. The shape that
//! it has then is nearly that of its first mode, so that the sum over its nodes of mass times displacement times this shape is nearly a
//! pure oscillation; its zeros are counted over some periods.
//!
//! The true frequency comes from NEWTON, whose equations are solved in `f64`, in steps so short that its formula's own error is small, and
//! that error is taken out. For a mode of frequency omega the second backward difference formula has
//! `(3/2 - i omega h) z² - 2 z + 1/2 = 0`, and turns by `arg z` in a step. So a solver that solves its equations well has the frequency
//! `arg z / h`; VERLET's, `2/h asin(h omega / 2)`, cannot be told from the true one here.

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

/// Of its length, how far a body is drawn aside.
const AMPLITUDE: f64 = 2e-4;

/// The periods that are counted.
const PERIODS: usize = 3;

/// The reference's steps in a period.
const STEPS: f64 = 60.0;

/// Longer than any body takes, s.
const LONGEST: f64 = 30.0;

/// A body that has been let go of.
struct Plucked {
    scene: Scene,
    /// Its shape at rest, and mass times how far each node was drawn from it.
    rest: Vec<Vec3>,
    shape: Vec<DVec3>,
}

impl Plucked {
    fn new(subject: &Subject, solver: Solver) -> Result<Self, Error> {
        static DRAWN: Known<Vec<Vec3>> = Mutex::new(None);
        let mut scene = Activity::Plucked.begin(subject, solver)?;
        let rest = scene.body().positions().to_vec();
        let drawn = once(&DRAWN, &subject.matter.to_string(), || draw(subject, &rest))?;
        scene.body_mut().set_positions(&drawn).expect("positions");
        let ways = drawn.iter().zip(&rest).map(|(&drawn, &rest)| way(drawn, rest));
        let shape = ways.zip(&subject.masses).map(|(way, &mass)| way * f64::from(mass));
        Ok(Self {
            shape: shape.collect(),
            scene,
            rest,
        })
    }

    fn signal(&self) -> f64 {
        let positions = self.scene.body().positions().iter();
        let ways = positions.zip(&self.rest).map(|(&p, &rest)| way(p, rest));
        ways.zip(&self.shape).map(|(way, shape)| way.dot(*shape)).sum()
    }

    /// Its frequency in steps of this length, 1/s; `None` where something went wrong, which the figures say.
    fn frequency(&mut self, step: f32, figures: &mut Figures) -> Option<f64> {
        let mut before = self.signal();
        let mut zeros = Vec::new();
        while zeros.len() < 2 * PERIODS + 1 && figures.time < LONGEST {
            let time = figures.time;
            self.scene.step(step, figures)?;
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

fn way(to: Vec3, from: Vec3) -> DVec3 {
    to.as_dvec3() - from.as_dvec3()
}

/// Where a body rests that is drawn aside as far as it shall be.
fn draw(subject: &Subject, rest: &[Vec3]) -> Result<Vec<Vec3>, Error> {
    let mut scene = Activity::Plucked.begin(subject, Solver::Verlet)?;
    // The displacement is in proportion to forces that are small: what the first do says how large they should be.
    let mut share = 1e-3;
    for _ in 0..2 {
        rest_under(&mut scene, subject, share)?;
        let drawn = scene.body().positions();
        let farthest = drawn
            .iter()
            .zip(rest)
            .map(|(&a, &b)| way(a, b).length())
            .fold(0.0, f64::max);
        share *= AMPLITUDE * f64::from(subject.length) / farthest;
    }
    Ok(scene.body().positions().to_vec())
}

/// Puts a body where it rests under such a part of its weight, sideways.
fn rest_under(scene: &mut Scene, subject: &Subject, share: f64) -> Result<(), Error> {
    let forces = subject
        .masses
        .iter()
        .map(|&mass| 9.81 * mass * share as f32 * subject.across());
    let nodes = (0..).zip(forces).filter(|(node, _)| !subject.ends[0].contains(node));
    let (nodes, mut forces): (Vec<u32>, Vec<_>) = nodes.unzip();
    scene.body_mut().apply_forces(&nodes, &forces).expect("forces");
    scene.rest()?;
    // What was applied is pending.
    forces.iter_mut().for_each(|force| *force = -*force);
    scene.body_mut().apply_forces(&nodes, &forces).expect("forces");
    Ok(())
}

/// The part by which the second backward difference formula is slower in steps of `h omega`.
fn slowness(h_omega: f64) -> f64 {
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
        Ok(find(Solver::Newton, step)? / (1.0 + slowness(TAU / STEPS)))
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
        _ => truth * (1.0 + slowness(TAU * truth * substep)),
    };
    figures.frequency = Some([found / formula - 1.0, found / truth - 1.0]);
    Ok(figures)
}
