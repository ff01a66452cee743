//! The tolerance of a step: the position error that a step adds stays below it, for an organ, a cloth and a chain. Each
//! step is compared with the true motion in `f64` from the same state.

use crate::support::bodies::{FREE, Parts, Scene, largest_difference};
use crate::support::organ::{cloth, gravity, organ};
use crate::support::scene::SOLVERS;
use glam::Vec3;
use sinew::{BodyDefinition, Error, Solver, WorldDefinition};

/// A horizontal chain, held at one end.
fn level_chain() -> Parts {
    let mut parts = Parts::chain(24, Vec3::X * 0.02, 2e-3, 40.0);
    parts.masses[0] = 0.0;
    parts
}

/// Returns the largest error that a step of a motion from rest adds, relative to the tolerance.
fn largest_error(name: &str, parts: &Parts, solver: Solver, tolerance: f32, h: f32, steps: usize) -> f64 {
    let world = WorldDefinition {
        gravity: gravity(1.0),
        tolerance,
        ..FREE
    };
    let mut scene = Scene::with(parts, world, |definition| BodyDefinition { solver, ..definition });
    let mut largest = 0.0_f64;
    for step in 0..steps {
        let mut reference = parts.reference(gravity(1.0));
        reference.positions = scene.positions();
        reference.velocities = scene.velocities();
        let report = scene.step(h);
        // Leapfrog, in steps of at most 50 us and a tenth of the steps taken.
        let fine = (10 * report.substeps as usize).max((h / 5e-5) as usize);
        reference.run(f64::from(h) / fine as f64, fine);
        let error = largest_difference(&scene.positions(), &reference.positions);
        let named = format!("{name}, {solver:?}, tolerance {tolerance}, {h} s, step {step}: {report:?}");
        assert!(report.error_estimate <= tolerance, "{named}");
        largest = largest.max(error / f64::from(tolerance));
    }
    largest
}

#[test]
fn a_step_adds_no_more_than_its_tolerance() {
    for (name, parts) in [
        ("organ", organ(0.2, 0.025, 5000.0)),
        ("cloth", cloth(0.3, 12, 0.05, 40.0)),
        ("chain", level_chain()),
    ] {
        for tolerance in [1e-3_f32, 1e-4, 1e-5] {
            for (h, steps) in [(1e-3, 60), (1.0 / 60.0, 12)] {
                // Solved equations cost more than explicit steps: fewer of them.
                let implicit = (tolerance > 5e-5).then_some((Solver::Implicit, steps / 4));
                for (solver, steps) in [(Solver::Verlet, steps)].into_iter().chain(implicit) {
                    let error = largest_error(name, &parts, solver, tolerance, h, steps);
                    assert!(
                        error <= 1.0,
                        "{name}, {solver:?}, {tolerance} m, {h} s: {error:.2} of the tolerance"
                    );
                }
            }
        }
    }
}

/// A body held at its side, with a tolerance that eight substeps do not meet.
#[test]
fn a_tolerance_that_cannot_be_met_changes_nothing() {
    let world = WorldDefinition {
        gravity: gravity(1.0),
        tolerance: 1e-5,
        max_substeps: 8,
        ..FREE
    };
    for solver in SOLVERS {
        let mut scene = Scene::with(&cloth(0.3, 3, 0.05, 40.0), world, |definition| BodyDefinition {
            solver,
            ..definition
        });
        let before = scene.world.state_hash();
        assert!(
            matches!(scene.world.step(0.1), Err(Error::Unstable { .. })),
            "{solver:?}"
        );
        assert_eq!(scene.world.state_hash(), before, "{solver:?}");
    }
}

#[test]
fn fixed_substeps_ignore_the_tolerance() {
    for solver in SOLVERS {
        let run = |tolerance: f32| {
            let world = WorldDefinition {
                gravity: gravity(1.0),
                substeps: 4,
                tolerance,
                ..FREE
            };
            let parts = organ(0.2, 0.025, 5000.0);
            let mut scene = Scene::with(&parts, world, |definition| BodyDefinition { solver, ..definition });
            scene.run(2e-3, 10);
            scene.positions()
        };
        assert_eq!(run(0.0), run(0.1), "{solver:?}");
    }
}
