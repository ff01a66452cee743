//! IMPLICIT against the exact solutions of its own formulas, order of convergence, falls, rest shapes, and its reports.

use crate::support::bodies::{FREE, Parts, Random, Scene, largest_difference};
use crate::support::euler::{euler_step, uneven_block};
use crate::support::motion::two_masses;
use crate::support::scene::STORAGES;
use glam::{DVec3, Vec3};
use sinew::{BodyDefinition, Error, Solver, Storage, World, WorldDefinition};

fn implicit(parts: &Parts, world: WorldDefinition, order: u32, accuracy: f32) -> Scene {
    Scene::with(parts, world, |definition| BodyDefinition {
        solver: Solver::Implicit,
        order,
        accuracy,
        ..definition
    })
}

const OMEGA_SQUARED: f64 = 100.0 / 0.75;

/// The stretch of the spring after each step, by the formula of this order in `f64`. The first step has order 1.
fn discrete(order: u32, h: f64, steps: usize) -> Vec<f64> {
    let (mut q, mut v) = (0.05, 0.0);
    let (mut last_q, mut last_v) = (q, v);
    let mut stretches = Vec::new();
    for step in 0..steps {
        let (t, c) = if order == 2 && step > 0 {
            (2.0 * h / 3.0, 1.0 / 3.0)
        } else {
            (h, 0.0)
        };
        // q1 = a + t v1, v1 = b - t w² q1.
        let (a, b) = (q + c * (q - last_q), v + c * (v - last_v));
        let next = (a + t * b) / (1.0 + t * t * OMEGA_SQUARED);
        (last_q, last_v) = (q, v);
        v = b - t * OMEGA_SQUARED * next;
        q = next;
        stretches.push(q);
    }
    stretches
}

fn stretch(scene: &Scene) -> f64 {
    let x = scene.positions();
    x[0].distance(x[1]) - 0.1
}

#[test]
fn two_masses_follow_the_discrete_solution() {
    for order in [1, 2] {
        for h in [1e-4_f32, 1e-3, 1e-2, 0.1, 1.0] {
            let mut scene = implicit(&two_masses().0, FREE, order, 1e-6);
            for (step, expected) in discrete(order, f64::from(h), 100).into_iter().enumerate() {
                scene.step(h);
                let error = (stretch(&scene) - expected).abs() / 0.05;
                assert!(error < 1e-5, "order {order}, {h} s, step {step}: {error:.2e}");
            }
        }
    }
}

/// The error of the stretch after one second, relative to the amplitude.
fn error_after_a_second(order: u32, steps: usize) -> f64 {
    let mut scene = implicit(&two_masses().0, FREE, order, 1e-6);
    scene.run((1.0 / steps as f64) as f32, steps);
    let exact = 0.05 * OMEGA_SQUARED.sqrt().cos();
    (stretch(&scene) - exact).abs() / 0.05
}

#[test]
fn each_order_of_convergence_is_reached() {
    for (order, steps) in [(1, 4000), (2, 1000)] {
        let ratio = error_after_a_second(order, steps) / error_after_a_second(order, 2 * steps);
        let expected = f64::from(1 << order);
        assert!((ratio / expected - 1.0).abs() < 0.05, "order {order}: {ratio:.3}");
    }
}

#[test]
fn bodies_fall_alike_far_from_the_origin() {
    bodies_fall_alike_far_from_the_origin_of(&[10.0]);
}

#[test]
#[ignore = "long"]
fn bodies_fall_alike_nearer_to_the_origin() {
    bodies_fall_alike_far_from_the_origin_of(&[0.0, 1.0]);
}

fn bodies_fall_alike_far_from_the_origin_of(offsets: &[f32]) {
    for &offset in offsets {
        for (order, h, allowed) in [(1, 1e-4, 2e-4), (2, 1e-4, 3e-5), (2, 1e-2, 1e-3)] {
            let mut parts = Parts::block([2, 2, 2], 0.05, 0.01, 100.0);
            for position in &mut parts.positions {
                *position += Vec3::X * offset;
            }
            let world = WorldDefinition {
                gravity: Vec3::Y * -9.81,
                ..FREE
            };
            let mut scene = implicit(&parts, world, order, 0.0);
            let steps = (1.0 / h) as usize;
            let start = scene.positions();
            scene.run(h as f32, steps);
            let fall = 0.5 * 9.81 * (steps as f64 * h).powi(2);
            for (before, after) in start.iter().zip(scene.positions()) {
                let error = ((before.y - after.y) / fall - 1.0).abs();
                assert!(error < allowed, "{offset} m, order {order}, {h} s: {error:.2e}");
            }
            for velocity in scene.velocities() {
                let error = (velocity.y / (-9.81 * steps as f64 * h) - 1.0).abs();
                assert!(error < 1e-4, "{offset} m, order {order}, {h} s: velocity {error:.2e}");
            }
        }
    }
}

#[test]
fn nodes_reach_their_terminal_velocity_at_every_step() {
    let mut parts = Parts::nodes(vec![Vec3::ZERO], 0.5);
    parts.node_dampings[0] = 2.0;
    let world = WorldDefinition {
        gravity: Vec3::Y * -9.81,
        ..FREE
    };
    for order in [1, 2] {
        for h in [1e-3_f32, 1.0 / 60.0, 0.1, 1.0] {
            let mut scene = implicit(&parts, world, order, 0.0);
            scene.run(h, (6.0 / h) as usize + 20);
            let error = (scene.velocities()[0].y / (-9.81 * 0.5 / 2.0) - 1.0).abs();
            // Rounding loses a part of the small velocity that a step with little damping adds: about 1e-7 of the
            // velocity.
            let allowed = f64::max(1e-5, 3.6e-7 / (f64::from(h) * 2.0 / 0.5));
            assert!(error < allowed, "order {order}, {h} s: {error:.2e}");
        }
    }
}

/// A chain of forty nodes hangs from a pin: the weight of all nodes below a spring stretches it.
#[test]
fn a_chain_has_the_same_sag_for_every_step_and_storage() {
    a_chain_has_the_same_sag_for_every_step_and_storage_of(|storage, h| storage == Storage::Packed || h > 0.5);
}

#[test]
#[ignore = "long"]
fn a_chain_has_the_same_sag_for_every_step_and_storage_in_the_other_cases() {
    a_chain_has_the_same_sag_for_every_step_and_storage_of(|storage, h| storage != Storage::Packed && h < 0.5);
}

fn a_chain_has_the_same_sag_for_every_step_and_storage_of(is_selected: fn(Storage, f32) -> bool) {
    let (count, mass, stiffness) = (40, 0.01, 50.0);
    let mut parts = Parts::chain(count + 1, Vec3::Y * -0.1, mass, stiffness);
    parts.masses[0] = 0.0;
    parts.node_dampings.fill(0.5);
    let world = WorldDefinition {
        gravity: Vec3::Y * -9.81,
        ..FREE
    };
    let pull = f64::from(mass) * 9.81 / f64::from(stiffness);
    let extension = pull * (count * (count + 1)) as f64 / 2.0;
    for storage in STORAGES {
        for (order, h, steps) in [(1, 1.0_f32, 400), (2, 0.1, 4000), (2, 1.0 / 60.0, 20_000)] {
            if !is_selected(storage, h) {
                continue;
            }
            let mut scene = Scene::with(&parts, world, |definition| BodyDefinition {
                solver: Solver::Implicit,
                order,
                storage,
                ..definition
            });
            scene.run(h, steps);
            let tip = -scene.positions()[count].y - 0.1 * count as f64;
            let error = (tip / extension - 1.0).abs();
            assert!(error < 2e-5, "{storage:?}, order {order}, {h} s: {error:.2e}");
        }
    }
}

#[test]
fn a_step_is_the_true_implicit_step_at_every_contrast() {
    let gravity = Vec3::new(0.0, -9.81, 0.0);
    let world = WorldDefinition { gravity, ..FREE };
    for contrast in [1.0, 1e3, 1e6] {
        let parts = uneven_block(contrast);
        let start: Vec<DVec3> = parts.positions.iter().map(|p| p.as_dvec3()).collect();
        for h in [1e-3_f32, 1.0 / 60.0] {
            let expected = euler_step(&parts, gravity.as_dvec3(), f64::from(h));
            let moved = largest_difference(&expected, &start);
            for storage in STORAGES {
                let mut scene = Scene::with(&parts, world, |definition| BodyDefinition {
                    solver: Solver::Implicit,
                    order: 1,
                    accuracy: 1e-3,
                    iterations: 20_000,
                    storage,
                    ..definition
                });
                scene.step(h);
                let error = largest_difference(&scene.positions(), &expected) / moved;
                // Positions are rounded to 1e-8 m.
                let allowed = 1e-2 + 3e-8 / moved;
                assert!(
                    error < allowed,
                    "{storage:?}, 1 : {contrast}, {h} s: {error:.2e} of {moved:.2e} m"
                );
            }
        }
    }
}

#[test]
fn the_budget_is_kept_and_the_residual_reported() {
    let world = WorldDefinition {
        gravity: Vec3::Y * -9.81,
        ..FREE
    };
    let parts = uneven_block(1e3);
    let mut errors = Vec::new();
    for iterations in [5, 50, 5000] {
        let mut scene = Scene::with(&parts, world, |definition| BodyDefinition {
            solver: Solver::Implicit,
            order: 1,
            iterations,
            ..definition
        });
        let report = scene.step(1.0 / 60.0);
        let solved = scene.body().solver_report();
        assert!(solved.iterations <= iterations * report.substeps, "{solved:?}");
        assert!(scene.is_finite() && solved.error.is_finite());
        // A sufficient budget solves the equation; otherwise the report says that it is not solved.
        assert!(solved.has_converged || iterations < 5000, "{solved:?}");
        assert!(!solved.has_converged || iterations > 5, "{solved:?}");
        errors.push(solved.error);
    }
    assert!(errors[2] < 0.1 * errors[0], "{errors:?}");
}

#[test]
fn a_topology_change_takes_effect() {
    let world = WorldDefinition {
        gravity: Vec3::Y * -9.81,
        ..FREE
    };
    for storage in STORAGES {
        let mut parts = uneven_block(1.0);
        parts.node_dampings.fill(0.05);
        let mut changed = Scene::with(&parts, world, |definition| BodyDefinition {
            solver: Solver::Implicit,
            storage,
            ..definition
        });
        changed.run(1.0 / 60.0, 30);
        let removed: Vec<[u32; 2]> = parts.springs.iter().copied().step_by(9).collect();
        for &[a, b] in &removed {
            changed.body_mut().remove_spring(a, b).expect("a spring");
        }
        changed.body_mut().add_spring(0, 40, 30.0, Some(0.1)).expect("room");
        changed.run(1.0 / 60.0, 900);
        // A body created with this topology.
        let kept = |index: usize| !removed.contains(&parts.springs[index]);
        let mut other = parts.clone();
        let all = 0..parts.springs.len();
        other.springs = all.clone().filter(|&i| kept(i)).map(|i| parts.springs[i]).collect();
        other.stiffnesses = all.clone().filter(|&i| kept(i)).map(|i| parts.stiffnesses[i]).collect();
        other.rest_lengths = all.filter(|&i| kept(i)).map(|i| parts.rest_lengths[i]).collect();
        other.springs.push([0, 40]);
        other.stiffnesses.push(30.0);
        other.rest_lengths.push(0.1);
        let mut made = Scene::with(&other, world, |definition| BodyDefinition {
            solver: Solver::Implicit,
            storage,
            ..definition
        });
        made.run(1.0 / 60.0, 930);
        let difference = largest_difference(&changed.positions(), &made.positions()) / parts.size();
        assert!(difference < 1e-4, "{storage:?}: {difference:.2e}");
    }
}

#[test]
fn settings_out_of_range_are_refused() {
    let (parts, _) = two_masses();
    let mut world = World::new(FREE).expect("a world");
    let plain = BodyDefinition {
        solver: Solver::Implicit,
        ..parts.definition()
    };
    for (name, definition) in [
        ("order", BodyDefinition { order: 3, ..plain }),
        ("accuracy", BodyDefinition { accuracy: 2.0, ..plain }),
        (
            "accuracy",
            BodyDefinition {
                accuracy: f32::NAN,
                ..plain
            },
        ),
        (
            "accuracy",
            BodyDefinition {
                accuracy: -0.1,
                ..plain
            },
        ),
        (
            "iterations",
            BodyDefinition {
                iterations: 2_000_000,
                ..plain
            },
        ),
    ] {
        match world.create_body(&definition) {
            Err(Error::InvalidArgument(message)) => assert!(message.contains(name), "{message}"),
            other => panic!("{name}: {other:?}"),
        }
    }
}

/// A node on a stiff spring is pushed aside. Where IMPLICIT reports a solved equation, a full correction in `f64`, by
/// the matrix without the transverse stiffness of compressed springs, is a small part of the displacement.
#[test]
fn a_reported_solution_is_a_solution() {
    let mut solved = 0;
    for h in [1e-2_f32, 1.0 / 60.0, 0.1, 0.7] {
        for (stiffness, mass) in [
            (10.0_f32, 1e-3_f32),
            (100.0, 1e-2),
            (1e3, 1e-3),
            (1e4, 1e-4),
            (1e5, 1e-2),
        ] {
            for push in [0.1_f32, 1.0, 10.0] {
                let mut parts = Parts::chain(2, Vec3::X * 0.1, mass, stiffness);
                parts.masses[0] = 0.0;
                let mut scene = implicit(&parts, FREE, 1, 0.0);
                let force = Vec3::new(0.0, push, 0.1 * push);
                scene.body_mut().apply_force(1, force).expect("a force");
                let report = scene.step(h);
                let solver_report = scene.body().solver_report();
                // A step that was repeated in substeps solves another equation.
                if !solver_report.has_converged || report.substeps > 1 {
                    continue;
                }
                solved += 1;
                let position = scene.positions()[1];
                let displacement = position - DVec3::X * f64::from(parts.positions[1].x);
                let (length, along) = (position.length(), position.normalize());
                let (k, rest) = (f64::from(stiffness), f64::from(parts.rest_lengths[0]));
                let inertia = f64::from(mass) / f64::from(h).powi(2);
                let residual = force.as_dvec3() - along * (k * (length - rest)) - displacement * inertia;
                let stretched = residual.dot(along);
                let sideways = inertia + (k * (1.0 - rest / length)).max(0.0);
                let correction = along * (stretched / (inertia + k)) + (residual - along * stretched) / sideways;
                // Positions are rounded to 4e-9 m, which is a force on the spring.
                let part = (correction.length() - 1e-7).max(0.0) / displacement.length();
                assert!(
                    part < 0.03,
                    "{stiffness} N/m, {mass} kg, {push} N, {h} s: {part:.2e}, {solver_report:?}"
                );
            }
        }
    }
    assert!(solved >= 50, "{solved} of 60");
}

/// For any forces, velocities, positions or masses, a step ends in finite numbers or rolls the body back bitwise.
#[test]
fn a_step_to_infinity_is_rolled_back() {
    let world = WorldDefinition {
        gravity: Vec3::Y * -9.81,
        ..FREE
    };
    let mut restored = [0; 2];
    for (restored, solver) in restored.iter_mut().zip([Solver::Implicit, Solver::Newton]) {
        for steps in [0, 1, 3] {
            for (what, size) in [
                ("force", 1e30_f32),
                ("force", 3e38),
                ("velocity", 1e25),
                ("velocity", 3e38),
                ("place", 1e25),
                ("gravity", 3e38),
                ("pin", 1e25),
                ("pin", 3e38),
            ] {
                let mut parts = Parts::chain(3, Vec3::X * 0.1, 1e-2, 10.0);
                parts.masses[0] = 0.0;
                let mut scene = Scene::with(&parts, world, |definition| BodyDefinition { solver, ..definition });
                scene.body_mut().pin(1).expect("a pin");
                scene.run(1.0 / 60.0, steps);
                let (far, still) = (Vec3::X * size, Vec3::ZERO);
                match what {
                    "force" => scene.body_mut().apply_force(2, far),
                    "velocity" => scene.body_mut().set_velocities(&[still, still, far]),
                    "place" => scene.body_mut().set_positions(&[still, Vec3::X, far]),
                    "gravity" => scene.world.set_gravity(far),
                    _ => scene.body_mut().move_pin(1, far),
                }
                .expect("in range");
                let state = |scene: &Scene| (scene.positions(), scene.velocities());
                let before = state(&scene);
                let report = scene.world.step(1.0 / 60.0).expect("a step");
                let named = format!("{solver:?}, {what} {size:e} after {steps} steps: {report:?}");
                assert!(scene.is_finite(), "{named}");
                if report.bodies_restored == 1 {
                    *restored += 1;
                    assert_eq!(state(&scene), before, "{named}");
                } else {
                    // Nothing else is refused: the body goes on under such forces and at such speeds.
                    let led = scene.positions()[if what == "pin" { 1 } else { 2 }].length();
                    assert!(what == "place" || led > 1e20, "{named}: {led}");
                }
            }
        }
    }
    // A pin this fast has more energy than `f32` can represent.
    assert!(restored.iter().all(|&count| count >= 6), "{restored:?}");
}

/// A refused step, here caused by a VERLET body in the same world, changes neither later steps nor reports.
#[test]
fn a_refused_step_leaves_no_trace() {
    for seed in 0..10 {
        let make = || {
            let mut random = Random::new(seed);
            let parts = Parts::block([3, 2, 2], 0.05, 0.01, 1.0 + 30.0 * (seed % 5) as f32);
            let velocities: Vec<Vec3> = parts
                .positions
                .iter()
                .map(|p| *p * 4.0 + 0.5 * random.vector())
                .collect();
            let mut scene = implicit(&parts, FREE, 2, 1e-6);
            let other = Parts::block([1, 1, 1], 0.05, 0.01, 100.0);
            scene.world.create_body(&other.definition()).expect("a body");
            scene.body_mut().set_velocities(&velocities).expect("velocities");
            scene.run(0.01, 20);
            scene
        };
        let (mut plain, mut refused) = (make(), make());
        let report = refused.body().solver_report();
        assert!(matches!(refused.world.step(1e4), Err(Error::Unstable { .. })));
        assert_eq!(refused.body().solver_report(), report);
        for step in 0..30 {
            plain.step(0.01);
            refused.step(0.01);
            assert_eq!(
                plain.world.state_hash(),
                refused.world.state_hash(),
                "seed {seed}, step {step}"
            );
        }
    }
}
