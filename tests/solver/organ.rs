//! A soft organ of uneven tetrahedra against its motion and its rest shape in `f64`: second-order accurate, close to
//! the true motion, and the same rest shape with every solver.

use crate::support::bodies::{FREE, Parts, Scene, largest_difference};
use crate::support::organ::{gravity, organ, rms};
use crate::support::statics::damp;
use glam::DVec3;
use sinew::{BodyDefinition, RestStateDefinition, Solver, Storage, WorldDefinition};

/// Under a fraction of Earth's gravity; each step of VERLET is one substep.
fn scene(parts: &Parts, pull: f32, solver: Solver, storage: Storage, substeps: u32) -> Scene {
    let world = WorldDefinition {
        gravity: gravity(pull),
        substeps,
        ..FREE
    };
    Scene::with(parts, world, |definition| BodyDefinition {
        solver,
        storage,
        ..definition
    })
}

/// Returns the positions after `duration` seconds in `f64`, in steps of 20 to 50 us, and the RMS displacement.
fn true_motion(parts: &Parts, pull: f32, duration: f64, steps: usize) -> (Vec<DVec3>, f64) {
    let mut reference = parts.reference(gravity(pull));
    let start = reference.positions.clone();
    reference.run(duration / steps as f64, steps);
    let displacement = rms(&reference.positions, &start);
    (reference.positions, displacement)
}

/// In 0.1 s under a tenth of Earth's gravity it moves by 4 mm.
#[test]
fn errors_fall_with_the_square_of_the_step() {
    let parts = organ(0.2, 0.02, 3000.0);
    let duration = 0.1;
    let (expected, displacement) = true_motion(&parts, 0.1, duration, 5000);
    for (solver, storage, finest) in [
        (Solver::Verlet, Storage::Packed, 100),
        (Solver::Verlet, Storage::DynamicBulk, 100),
        (Solver::Implicit, Storage::Packed, 200),
        (Solver::Implicit, Storage::FastLink, 200),
        (Solver::Newton, Storage::Packed, 100),
    ] {
        let substeps = u32::from(solver == Solver::Verlet);
        let [coarse, fine] = [finest / 2, finest].map(|steps| {
            let mut scene = scene(&parts, 0.1, solver, storage, substeps);
            scene.run((duration / steps as f64) as f32, steps);
            rms(&scene.positions(), &expected) / displacement
        });
        let ratio = coarse / fine;
        // Not far above 4 either: that would mean that the coarse step is not resolved.
        assert!(
            (3.3..4.7).contains(&ratio),
            "{solver:?}, {storage:?}: {coarse:.2e} to {fine:.2e}, {ratio:.2}"
        );
    }
}

/// In 0.25 s under Earth's gravity it falls by 13 cm, until it hangs by its side.
#[test]
fn half_a_millisecond_follows_the_true_motion() {
    let parts = organ(0.2, 0.02, 10_000.0);
    let (expected, displacement) = true_motion(&parts, 1.0, 0.25, 5000);
    for solver in [Solver::Verlet, Solver::Implicit, Solver::Newton] {
        let mut scene = scene(&parts, 1.0, solver, Storage::Packed, 0);
        scene.run(5e-4, 500);
        let error = rms(&scene.positions(), &expected) / displacement;
        // The requested accuracy is 0.1; the implicit formula has an error of 8e-4, VERLET of 1e-4.
        let allowed = if solver == Solver::Verlet { 1e-3 } else { 3e-3 };
        assert!(error < allowed, "{solver:?}: {error:.2e}");
    }
}

#[test]
fn the_rest_shape_is_the_same_for_every_solver() {
    let mut parts = organ(0.2, 0.02, 10_000.0);
    damp(&mut parts, 10.0);
    let start: Vec<DVec3> = parts.positions.iter().map(|p| p.as_dvec3()).collect();
    let mut found = scene(&parts, 0.2, Solver::Implicit, Storage::Packed, 0);
    let report = found.world.rest_state(found.id, &RestStateDefinition::default());
    report.expect("a state of rest");
    let sag = largest_difference(&found.positions(), &start);
    for (solver, storage, seconds) in [
        (Solver::Verlet, Storage::Packed, 6),
        (Solver::Verlet, Storage::Efficient, 6),
        (Solver::Implicit, Storage::Packed, 6),
        (Solver::Implicit, Storage::Packed, 20),
        (Solver::Implicit, Storage::DynamicBulk, 6),
        (Solver::Newton, Storage::Packed, 4),
    ] {
        let mut moved = scene(&parts, 0.2, solver, storage, 0);
        moved.run(1.0 / 60.0, 60 * seconds);
        let error = largest_difference(&moved.positions(), &found.positions()) / sag;
        assert!(
            error < 1e-5,
            "{solver:?}, {storage:?}, {seconds} s: {error:.2e} of {sag:.2e} m"
        );
    }
}
