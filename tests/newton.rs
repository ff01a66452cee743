//! NEWTON against the exact solutions of its formulas, dense solutions in `f64`, and rest shapes.

mod support;

use glam::{DVec3, Vec3};
use sinew::{BodyDefinition, Solver, Storage, WorldDefinition};
use support::bodies::{FREE, Parts, Scene, largest_difference};
use support::euler::{euler_step, uneven_block};

const STORAGES: [Storage; 4] = [
    Storage::Packed,
    Storage::Efficient,
    Storage::FastLink,
    Storage::DynamicBulk,
];

const HANGING: WorldDefinition = WorldDefinition {
    gravity: Vec3::new(0.0, -9.81, 0.0),
    ..FREE
};

fn newton(parts: &Parts, world: WorldDefinition, order: u32, storage: Storage) -> Scene {
    Scene::with(parts, world, |definition| BodyDefinition {
        solver: Solver::Newton,
        order,
        storage,
        ..definition
    })
}

/// 1 and 3 kg, a spring of 100 N/m, 0.1 m long, stretched by 0.05 m.
fn two_masses() -> Parts {
    let mut parts = Parts::nodes(vec![Vec3::ZERO, Vec3::X * 0.15], 1.0);
    parts.join(0, 1, 100.0);
    parts.masses[1] = 3.0;
    parts.rest_lengths[0] = 0.1;
    parts
}

const OMEGA_SQUARED: f64 = 100.0 / 0.75;

/// How far the spring is stretched after each step, by the formula of this order in `f64`, begun with order 1.
fn discrete(order: u32, h: f64, steps: usize) -> Vec<f64> {
    let (mut now, mut last) = ([0.05, 0.0], [0.05, 0.0]);
    let mut stretches = Vec::new();
    for step in 0..steps {
        let (t, c) = if order == 2 && step > 0 {
            (2.0 * h / 3.0, 1.0 / 3.0)
        } else {
            (h, 0.0)
        };
        let [q, v] = [0, 1].map(|i| now[i] + c * (now[i] - last[i]));
        let next = (q + t * v) / (1.0 + t * t * OMEGA_SQUARED);
        last = now;
        now = [next, v - t * OMEGA_SQUARED * next];
        stretches.push(next);
    }
    stretches
}

#[test]
fn two_masses_follow_the_discrete_solution() {
    for order in [1, 2] {
        for h in [1e-5_f32, 1e-3, 1e-2, 0.1, 1.0] {
            let steps = 50;
            let mut scene = newton(&two_masses(), FREE, order, Storage::Packed);
            for (step, expected) in discrete(order, f64::from(h), steps).into_iter().enumerate() {
                scene.step(h);
                assert!(scene.body().solver_report().converged);
                let x = scene.positions();
                let error = (x[0].distance(x[1]) - 0.1 - expected).abs() / 0.05;
                // Of the stretch; positions are read as f32, which rounds 0.15 to 7e-9.
                assert!(error < 1e-6, "order {order}, {h} s, step {step}: {error:.2e}");
            }
        }
    }
}

#[test]
fn a_step_is_the_true_implicit_step_at_every_contrast() {
    for contrast in [1.0, 1e3, 1e6] {
        let parts = uneven_block(contrast);
        let start: Vec<DVec3> = parts.positions.iter().map(|p| p.as_dvec3()).collect();
        for h in [1e-3_f32, 1.0 / 60.0] {
            let expected = euler_step(&parts, HANGING.gravity.as_dvec3(), f64::from(h));
            let moved = largest_difference(&expected, &start);
            for storage in STORAGES {
                let mut scene = newton(&parts, HANGING, 1, storage);
                scene.step(h);
                let report = scene.body().solver_report();
                assert!(report.converged, "{report:?}");
                let error = largest_difference(&scene.positions(), &expected);
                // Positions are rounded to 8e-9 m along each axis, and PACKED has rest lengths in one that differ by 1.2e-8 m.
                let allowed = 1e-6 * moved + 3e-8;
                assert!(
                    error < allowed,
                    "{storage:?}, 1 : {contrast}, {h} s: {error:.2e} of {moved:.2e} m, {report:?}"
                );
            }
        }
    }
}

/// A chain of forty that hangs from a pin: each spring is stretched by the weight of all that is below it.
#[test]
fn a_chain_hangs_as_far_at_every_step_in_every_storage() {
    let (count, mass, stiffness) = (40, 0.01, 50.0);
    let mut parts = Parts::chain(count + 1, Vec3::Y * -0.1, mass, stiffness);
    parts.masses[0] = 0.0;
    parts.node_dampings.fill(0.5);
    let pull = f64::from(mass) * 9.81 / f64::from(stiffness);
    let extension = pull * (count * (count + 1)) as f64 / 2.0;
    for (index, storage) in STORAGES.into_iter().enumerate() {
        for (order, h, steps) in [(1, 1.0_f32, 400), (2, 0.1, 4000), (2, 1.0 / 60.0, 20_000)] {
            // Every storage solves the same equation: the long run once.
            if steps > 10_000 && index > 0 {
                continue;
            }
            let mut scene = newton(&parts, HANGING, order, storage);
            scene.run(h, steps);
            let tip = -scene.positions()[count].y - 0.1 * count as f64;
            let error = (tip / extension - 1.0).abs();
            assert!(error < 1e-6, "{storage:?}, order {order}, {h} s: {error:.2e}");
        }
    }
}
