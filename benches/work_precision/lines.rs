//! The measured settings of each solver. A line of a diagram is a solver with its points from coarse to fine.

use sinew::Solver;

use crate::contender::{Method, Setup};
use crate::scene::SPAN;

/// A solver with a sweep over its step.
pub struct Line {
    pub name: String,
    /// The name under which only the best of several lines counts.
    pub family: &'static str,
    pub setups: Vec<Setup>,
}

/// Multiples of the number of steps that stability requires.
const FINER: [f64; 4] = [1.0, 1.5, 2.0, 4.0];
/// World steps per span, of 1/64 s to 0.1 ms each.
const WORLD_STEPS: [u32; 3] = [2, 32, 312];
/// Fractions of the mass that may be added, in frames of 1/64 s; the default is 1e-3.
const ADDED: [f32; 7] = [1e-1, 3e-2, 1e-2, 3e-3, 1e-3, 3e-4, 1e-4];
/// Steps per span for unconditionally stable solvers, 1/64 s to 0.49 ms.
const STEPS: [u32; 6] = [2, 4, 8, 16, 32, 64];
/// The same for the reference solver.
const REFERENCE_STEPS: [u32; 3] = [2, 8, 32];
/// Accuracies of IMPLICIT's equation solves: the default and a loose one.
const ACCURACIES: [f32; 2] = [0.01, 0.1];
/// Substeps per frame of 1/64 s.
const XPBD_SUBSTEPS: [u32; 6] = [8, 16, 32, 64, 128, 512];
const PROJECTIVE_STEPS: [u32; 5] = [1, 4, 8, 32, 128];
const PROJECTIVE_ITERATIONS: [u32; 3] = [1, 10, 30];

/// All lines for a scene whose longest stable leapfrog step is `stable_step` [s].
pub fn lines(stable_step: f64, threads: u32) -> Vec<Line> {
    let mut lines = verlet(stable_step, threads);
    lines.extend(implicit(threads));
    lines.extend(baselines(stable_step, threads));
    lines
}

fn line(name: impl Into<String>, family: &'static str, setups: impl IntoIterator<Item = Setup>) -> Line {
    Line {
        name: name.into(),
        family,
        setups: setups.into_iter().collect(),
    }
}

/// Number of steps per span: `finer` times as many as stability requires.
fn needed(finer: f64, stable_step: f64) -> u32 {
    (finer * SPAN / stable_step).ceil() as u32
}

fn verlet(stable_step: f64, threads: u32) -> Vec<Line> {
    let setup = |steps| Setup::new(Method::Sinew(Solver::Verlet), steps, SPAN, threads);
    let fixed = FINER.map(|finer| Setup {
        substeps: needed(finer, stable_step).div_ceil(2),
        ..setup(2)
    });
    let added = ADDED.map(|mass_scaling| Setup {
        mass_scaling,
        ..setup(2)
    });
    vec![
        line("VERLET, substeps fixed", "VERLET, no mass added", fixed),
        line(
            "VERLET, substeps chosen",
            "VERLET, no mass added",
            WORLD_STEPS.map(setup),
        ),
        line("VERLET, mass scaling", "VERLET, mass scaling", added),
    ]
}

fn implicit(threads: u32) -> Vec<Line> {
    let setup = |solver, order, accuracy| {
        move |steps| Setup {
            order,
            accuracy,
            ..Setup::new(Method::Sinew(solver), steps, SPAN, threads)
        }
    };
    let mut lines: Vec<Line> = ACCURACIES
        .iter()
        .map(|&accuracy| {
            let name = format!("IMPLICIT, accuracy {accuracy}");
            line(name, "IMPLICIT", STEPS.map(setup(Solver::Implicit, 2, accuracy)))
        })
        .collect();
    let euler = STEPS.map(setup(Solver::Implicit, 1, ACCURACIES[0]));
    lines.push(line("IMPLICIT, Euler", "IMPLICIT, Euler", euler));
    let newton = REFERENCE_STEPS.map(setup(Solver::Newton, 2, 0.0));
    lines.push(line("NEWTON", "NEWTON", newton));
    lines
}

fn baselines(stable_step: f64, threads: u32) -> Vec<Line> {
    let paper = FINER.map(|finer| Setup::new(Method::Paper, needed(finer, stable_step), SPAN, threads));
    let xpbd = XPBD_SUBSTEPS.map(|substeps| Setup::new(Method::Xpbd, 2 * substeps, SPAN, threads));
    let mut lines = vec![
        line("Verlet as printed", "Verlet as printed", paper),
        line("XPBD, substeps", "XPBD", xpbd),
    ];
    lines.extend(PROJECTIVE_ITERATIONS.map(|iterations| {
        let projective = PROJECTIVE_STEPS.map(|steps| Setup {
            iterations,
            ..Setup::new(Method::Projective, steps, SPAN, threads)
        });
        let name = format!("Projective, {iterations} iterations");
        line(name, "Projective Dynamics", projective)
    }));
    lines
}
