//! Which settings of which solvers are measured: a line of a diagram is a solver with its points from coarse to fine.

use sinew::Solver;

use crate::contender::{Method, Setup};
use crate::scene::SPAN;

/// A solver, swept over its step.
pub struct Line {
    pub name: String,
    /// What it is listed under where only the best of its lines counts.
    pub family: &'static str,
    pub setups: Vec<Setup>,
}

/// Multiples of the steps that stability needs.
const FINER: [f64; 6] = [1.0, 1.5, 2.0, 4.0, 8.0, 16.0];
/// World steps of a span, 1/64 s each to 0.1 ms.
const WORLD_STEPS: [u32; 5] = [2, 8, 32, 128, 312];
/// Steps of a span for what is stable at any step, 1/32 s to 0.12 ms.
const STEPS: [u32; 9] = [1, 2, 4, 8, 16, 32, 64, 128, 256];
/// Substeps of a frame, 1/64 s.
const XPBD_SUBSTEPS: [u32; 8] = [4, 8, 16, 32, 64, 128, 256, 512];
const PROJECTIVE_STEPS: [u32; 8] = [1, 2, 4, 8, 16, 32, 64, 128];
const PROJECTIVE_ITERATIONS: [u32; 4] = [1, 3, 10, 30];

/// All lines for a scene in which leapfrog stands steps of `stable_step`, s.
pub fn lines(stable_step: f64, threads: u32) -> Vec<Line> {
    let setup = |method: Method, steps: u32| Setup {
        method,
        steps,
        substeps: 0,
        iterations: 0,
        span: SPAN,
        threads,
    };
    let needed = |finer: f64| (finer * SPAN / stable_step).ceil() as u32;
    let line = |name: &str, family: &'static str, setups: Vec<Setup>| Line {
        name: name.to_owned(),
        family,
        setups,
    };
    let sinew = |solver, steps: &[u32]| steps.iter().map(|&steps| setup(Method::Sinew(solver), steps)).collect();
    let fixed = |finer: f64| Setup {
        substeps: needed(finer).div_ceil(2),
        ..setup(Method::Sinew(Solver::Verlet), 2)
    };
    let paper = |finer: f64| setup(Method::Paper, needed(finer));
    let mut lines = vec![
        line("VERLET, substeps fixed", "VERLET", FINER.map(fixed).to_vec()),
        line("VERLET, substeps chosen", "VERLET", sinew(Solver::Verlet, &WORLD_STEPS)),
        line("IMPLICIT", "IMPLICIT", sinew(Solver::Implicit, &STEPS)),
        line("NEWTON", "NEWTON", sinew(Solver::Newton, &STEPS)),
        line("Verlet as printed", "Verlet as printed", FINER.map(paper).to_vec()),
        line(
            "XPBD, substeps",
            "XPBD",
            XPBD_SUBSTEPS.map(|substeps| setup(Method::Xpbd, 2 * substeps)).to_vec(),
        ),
    ];
    for iterations in PROJECTIVE_ITERATIONS {
        let projective = |steps| Setup {
            iterations,
            ..setup(Method::Projective, steps)
        };
        lines.push(line(
            &format!("Projective, {iterations} iterations"),
            "Projective Dynamics",
            PROJECTIVE_STEPS.map(projective).to_vec(),
        ));
    }
    lines
}
