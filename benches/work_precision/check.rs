//! Checks the convergence of the baselines: fine steps are close to the reference, and closer than coarse ones.

use crate::contender::{Method, Setup};
use crate::exact::Exact;
use crate::motion::{Effort, measure};
use crate::reference::Reference;
use crate::report::Report;
use crate::scene::{SPAN, Scene};

/// The largest allowed error at fine steps.
const CLOSE: f64 = 0.02;

/// Checks the baselines and returns the first failure.
pub fn run(report: &Report, scene: &Scene, reference: &Reference) -> Result<(), String> {
    let exact = Exact::new(scene);
    let effort = Effort {
        runs: 0,
        ..Effort::QUICK
    };
    let stable = (2.0 * SPAN / reference.stable_step).ceil() as u32;
    let setup = |method, steps, iterations| Setup {
        iterations,
        ..Setup::new(method, steps, SPAN, 1)
    };
    let baselines = [
        ("Verlet as printed", None, setup(Method::Paper, stable, 0)),
        ("XPBD", Some(setup(Method::Xpbd, 128, 0)), setup(Method::Xpbd, 1024, 0)),
        (
            "Projective",
            Some(setup(Method::Projective, 4, 10)),
            setup(Method::Projective, 32, 10),
        ),
    ];
    for (name, coarse, fine) in baselines {
        let error = |setup| {
            measure(scene, &exact, reference, setup, effort)?
                .outcome
                .map(|measured| measured.error)
                .map_err(|why| why.to_string())
        };
        let fine = error(fine)?;
        let coarse = coarse.map_or(Ok(f64::INFINITY), error)?;
        report.progress(&format!("{}: {name}: error {coarse:.1e}, then {fine:.1e}", scene.name));
        if !(fine < CLOSE && fine < 0.25 * coarse) {
            return Err(format!("{} on {}: an error of {fine} is left", name, scene.name));
        }
    }
    Ok(())
}
