//! NEWTON against the exact solutions of its formulas, dense solutions in `f64`, and rest shapes.

use crate::support::bodies::{FREE, Parts, Scene, largest_difference};
use crate::support::euler::{euler_step, uneven_block};
use crate::support::motion::two_masses;
use crate::support::scene::STORAGES;
use glam::{DVec3, Vec3};
use sinew::{BodyDefinition, Solver, Storage, WorldDefinition};

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

const OMEGA_SQUARED: f64 = 100.0 / 0.75;

/// The stretch of the spring after each step, by the formula of this order in `f64`. The first step has order 1.
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
            let mut scene = newton(&two_masses().0, FREE, order, Storage::Packed);
            for (step, expected) in discrete(order, f64::from(h), steps).into_iter().enumerate() {
                scene.step(h);
                assert!(scene.body().solver_report().has_converged);
                let x = scene.positions();
                let error = (x[0].distance(x[1]) - 0.1 - expected).abs() / 0.05;
                // Relative to the stretch; positions are read as `f32`, which rounds 0.15 to 7e-9.
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
                assert!(report.has_converged, "{report:?}");
                let error = largest_difference(&scene.positions(), &expected);
                // Positions are rounded to 8e-9 m along each axis, and rest lengths in one run of PACKED differ by
                // 1.2e-8 m.
                let allowed = 1e-6 * moved + 3e-8;
                assert!(
                    error < allowed,
                    "{storage:?}, 1 : {contrast}, {h} s: {error:.2e} of {moved:.2e} m, {report:?}"
                );
            }
        }
    }
}

/// A chain of forty nodes hangs from a pin: the weight of all nodes below a spring stretches it.
#[test]
fn a_chain_has_the_same_sag_for_every_step_and_storage() {
    let (count, mass, stiffness) = (40, 0.01, 50.0);
    let mut parts = Parts::chain(count + 1, Vec3::Y * -0.1, mass, stiffness);
    parts.masses[0] = 0.0;
    parts.node_dampings.fill(0.5);
    let pull = f64::from(mass) * 9.81 / f64::from(stiffness);
    let extension = pull * (count * (count + 1)) as f64 / 2.0;
    for (index, storage) in STORAGES.into_iter().enumerate() {
        for (order, h, steps) in [(1, 1.0_f32, 400), (2, 0.1, 4000), (2, 1.0 / 60.0, 20_000)] {
            // Every storage solves the same equation: the long run is made once.
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

#[test]
fn spring_changes_take_effect_without_allocation_in_a_step() {
    spring_changes_take_effect_without_allocation_in_a_step_of(&[Storage::FastLink]);
}

#[test]
#[ignore = "long"]
fn spring_changes_take_effect_without_allocation_in_a_step_in_other_storages() {
    spring_changes_take_effect_without_allocation_in_a_step_of(&[
        Storage::Packed,
        Storage::Efficient,
        Storage::DynamicBulk,
    ]);
}

fn spring_changes_take_effect_without_allocation_in_a_step_of(storages: &[Storage]) {
    for &storage in storages {
        let mut parts = uneven_block(1.0);
        parts.node_dampings.fill(0.05);
        let with = |parts: &Parts| {
            Scene::with(parts, HANGING, |definition| BodyDefinition {
                solver: Solver::Newton,
                storage,
                springs_per_node: 40,
                ..definition
            })
        };
        let mut changed = with(&parts);
        changed.run(1.0 / 60.0, 30);
        changed
            .body_mut()
            .remove_spring(parts.springs[7][0], parts.springs[7][1])
            .expect("a spring");
        for [a, b] in [[0, 40], [3, 50]] {
            changed.body_mut().add_spring(a, b, 30.0, Some(0.1)).expect("room");
        }
        changed.run(1.0 / 60.0, 600);
        parts.springs.remove(7);
        parts.stiffnesses.remove(7);
        parts.rest_lengths.remove(7);
        for pair in [[0, 40], [3, 50]] {
            parts.springs.push(pair);
            parts.stiffnesses.push(30.0);
            parts.rest_lengths.push(0.1);
        }
        let mut made = with(&parts);
        made.run(1.0 / 60.0, 630);
        let difference = largest_difference(&changed.positions(), &made.positions()) / parts.size();
        assert!(difference < 1e-6, "{storage:?}: {difference:.2e}");
    }
}

/// NEWTON keeps the rounding error of `f32` positions: steps of 10 us move nodes by less than half a unit in the last
/// place.
#[test]
fn slow_motion_is_not_lost_in_short_steps() {
    let parts = Parts::nodes(vec![Vec3::X * 0.9], 1.0);
    let mut scene = newton(&parts, FREE, 2, Storage::Packed);
    let velocity = 1e-4_f32;
    scene
        .body_mut()
        .set_velocities(&[Vec3::X * velocity])
        .expect("a velocity");
    let start = scene.positions()[0].x;
    scene.run(1e-5, 10_000);
    let displacement = scene.positions()[0].x - start;
    // A unit in the last place of 0.9 is 6e-8.
    assert!((displacement - 1e-5).abs() < 4e-8, "{displacement:e}");
}

#[test]
fn any_number_of_threads_and_a_rollback_give_the_same_state() {
    any_number_of_threads_and_a_rollback_give_the_same_state_of(3);
}

#[test]
#[ignore = "long"]
fn two_threads_and_a_rollback_give_the_same_state() {
    any_number_of_threads_and_a_rollback_give_the_same_state_of(2);
}

fn any_number_of_threads_and_a_rollback_give_the_same_state_of(thread_count: u32) {
    let parts = Parts::block([20, 20, 18], 0.01, 1e-4, 20.0);
    let run = |thread_count: u32| {
        let mut scene = newton(
            &parts,
            WorldDefinition {
                thread_count,
                ..HANGING
            },
            2,
            Storage::Packed,
        );
        scene.body_mut().pin(0).expect("a node");
        scene.step(2e-3);
        // A displacement with more energy than `f32` can represent: rolled back.
        let before = scene.positions();
        scene.body_mut().move_pin(0, Vec3::X * 1e30).expect("a pin");
        assert_eq!(scene.world.step(2e-3).expect("a step").bodies_restored, 1);
        assert_eq!(scene.positions(), before);
        scene.step(2e-3);
        scene.world.state_hash()
    };
    assert!(parts.positions.len() >= 8192, "large enough for several threads");
    assert_eq!(run(1), run(thread_count));
}

#[test]
fn damping_along_springs_dissipates_the_right_energy() {
    let (mut parts, _) = two_masses();
    parts.spring_damping = 2.0;
    let (h, steps) = (1e-4_f64, 1000);
    let mut scene = newton(&parts, FREE, 2, Storage::Packed);
    scene.run(h as f32, steps);
    // m q'' + c q' + k q = 0 with the reduced mass.
    let (decay, t) = (2.0 / 0.75 / 2.0, h * steps as f64);
    let omega = (OMEGA_SQUARED - decay * decay).sqrt();
    let exact = 0.05 * (-decay * t).exp() * ((omega * t).cos() + decay / omega * (omega * t).sin());
    let x = scene.positions();
    let error = (x[0].distance(x[1]) - 0.1 - exact).abs() / 0.05;
    assert!(error < 1e-4, "{error:.2e}");
    // A rotated and stretched mesh, where directions change within a step.
    let mut parts = uneven_block(1.0);
    parts.spring_damping = 0.05;
    let mut scene = newton(&parts, HANGING, 2, Storage::Packed);
    for _ in 0..60 {
        scene.step(1.0 / 60.0);
        let report = scene.body().solver_report();
        assert!(report.has_converged, "{report:?}");
    }
}
