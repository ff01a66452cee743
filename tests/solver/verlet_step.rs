//! The step as a contract: the tolerance is kept, a refused step changes nothing, a body that would overflow is rolled
//! back, and springs can be added and removed in motion.

use crate::support::bodies::{FREE, Parts, Random, Scene, largest_difference};
use glam::{DVec3, Vec3};
use sinew::{Error, WorldDefinition};

const GRAVITY: Vec3 = Vec3::new(1.0, -9.0, 2.0);

/// A deformed block, held at one side.
fn swinging(seed: u64) -> Parts {
    let mut parts = Parts::block([3, 2, 2], 0.05, 0.01, 40.0);
    let mut random = Random::new(seed);
    for (position, mass) in parts.positions.iter_mut().zip(&mut parts.masses) {
        if position.x == 0.0 {
            *mass = 0.0;
        }
        *position += 0.01 * random.vector();
    }
    parts
}

/// The block falls in steps to this tolerance (m).
fn in_steps_to(tolerance: f32, parts: &Parts) -> Scene {
    let definition = WorldDefinition {
        gravity: GRAVITY,
        tolerance,
        ..FREE
    };
    Scene::new(parts, definition)
}

#[test]
fn a_step_keeps_its_tolerance() {
    a_step_keeps_its_tolerance_of(0.02);
}

#[test]
#[ignore = "long"]
fn a_step_keeps_its_tolerance_without_damping() {
    a_step_keeps_its_tolerance_of(0.0);
}

fn a_step_keeps_its_tolerance_of(damping: f32) {
    let mut parts = swinging(21);
    parts.node_dampings.fill(damping);
    for tolerance in [1e-3_f32, 1e-4, 1e-5] {
        for h in [1e-3_f32, 1.0 / 60.0, 0.05] {
            let mut scene = in_steps_to(tolerance, &parts);
            for step in 0..4 {
                let mut reference = parts.reference(GRAVITY);
                reference.positions = scene.positions();
                reference.velocities = scene.velocities();
                let force = Vec3::new(0.1, 0.1 * step as f32, -0.2);
                let loaded = parts.positions.len() - 1;
                reference.applied[loaded] = force.as_dvec3();
                scene.body_mut().apply_force(loaded as u32, force).expect("a force");
                let report = scene.step(h);
                let substeps = 100 * report.substeps as usize;
                reference.run(f64::from(h) / substeps as f64, substeps);
                let error = largest_difference(&scene.positions(), &reference.positions);
                let named = format!("tolerance {tolerance}, h {h}, step {step}: {error:e}, {report:?}");
                assert!(error <= f64::from(tolerance), "{named}");
                // Plus rounding, of 1e-8 m per substep.
                let rounding = 1e-8 * f64::from(report.substeps).sqrt() + 1e-8;
                assert!(error <= f64::from(report.error_estimate) + rounding, "{named}");
                assert!(report.error_estimate <= tolerance, "{named}");
            }
        }
    }
}

#[test]
fn a_finer_tolerance_takes_more_substeps() {
    let parts = swinging(22);
    let substeps = [0.0, 1e-3, 1e-5].map(|tolerance| {
        let mut scene = in_steps_to(tolerance, &parts);
        let report = scene.step(0.02);
        assert_eq!(report.error_estimate == 0.0, tolerance == 0.0);
        report.substeps
    });
    assert!(substeps[0] < substeps[1] && substeps[1] < substeps[2], "{substeps:?}");
}

/// Returns everything that a caller can observe of a scene.
fn observable_state(scene: &Scene) -> (u64, Vec<DVec3>, Vec<DVec3>, Vec3, f64) {
    (
        scene.world.state_hash(),
        scene.positions(),
        scene.velocities(),
        scene.body().pin_force(0).expect("a pin"),
        scene.energy(),
    )
}

#[test]
fn a_refused_step_changes_nothing_and_keeps_pending_changes() {
    // Refused because stability needs too many substeps, because of the tolerance, and because substeps are fixed.
    let definitions = [
        WorldDefinition {
            gravity: GRAVITY,
            max_substeps: 20,
            ..FREE
        },
        WorldDefinition {
            gravity: GRAVITY,
            max_substeps: 20,
            tolerance: 1e-5,
            ..FREE
        },
        WorldDefinition {
            gravity: GRAVITY,
            substeps: 2,
            ..FREE
        },
    ];
    for spring_damping in [0.0, 0.02] {
        for definition in definitions {
            let mut parts = swinging(23);
            parts.spring_damping = spring_damping;
            let prepare = || {
                let mut scene = Scene::new(&parts, definition);
                scene.run(1e-3, 20);
                let last = parts.positions.len() as u32 - 1;
                let target = parts.positions[0] + Vec3::new(0.01, 0.02, 0.03);
                scene
                    .body_mut()
                    .apply_force(last, Vec3::new(1.0, 2.0, 3.0))
                    .expect("a force");
                scene.body_mut().move_pin(0, target).expect("a pin");
                scene
            };
            let (mut refused, mut plain) = (prepare(), prepare());
            let before = observable_state(&refused);
            for _ in 0..2 {
                match refused.world.step(1.0) {
                    Err(Error::Unstable { report, .. }) => {
                        assert!(report.stable_substep > 0.0 && report.stable_substep < 0.5, "{report:?}");
                    }
                    other => panic!("{other:?}"),
                }
                assert_eq!(observable_state(&refused), before);
            }
            for _ in 0..3 {
                assert_eq!(refused.step(1e-3), plain.step(1e-3));
                assert_eq!(observable_state(&refused), observable_state(&plain));
            }
            let target = parts.positions[0] + Vec3::new(0.01, 0.02, 0.03);
            assert_eq!(refused.body().positions()[0], target);
        }
    }
}

#[test]
fn one_unstable_body_holds_back_the_world() {
    let mut scene = Scene::new(
        &swinging(24),
        WorldDefinition {
            gravity: GRAVITY,
            max_substeps: 50,
            ..FREE
        },
    );
    let mut stiff = swinging(25);
    stiff.stiffnesses.fill(1e8);
    let stiff = scene.world.create_body(&stiff.definition()).expect("a body");
    scene.body_mut().apply_force(20, Vec3::X).expect("a force");
    let before = scene.world.state_hash();
    assert!(matches!(scene.world.step(0.01), Err(Error::Unstable { .. })));
    assert_eq!(scene.world.state_hash(), before);
    scene.world.destroy_body(stiff).expect("the body");
    let mut alone = Scene::new(
        &swinging(24),
        WorldDefinition {
            gravity: GRAVITY,
            max_substeps: 50,
            ..FREE
        },
    );
    alone.body_mut().apply_force(20, Vec3::X).expect("a force");
    scene.step(0.01);
    alone.step(0.01);
    assert_eq!(scene.positions(), alone.positions());
}

#[test]
fn an_overflowing_body_is_rolled_back_and_the_others_step() {
    let definition = WorldDefinition {
        gravity: GRAVITY,
        ..FREE
    };
    let mut scene = Scene::new(&swinging(26), definition);
    let mut alone = Scene::new(&swinging(26), definition);
    let light = Parts::chain(3, Vec3::X, 1e-6, 1e-4);
    let blown = scene.world.create_body(&light.definition()).expect("a body");
    let step = |scene: &mut Scene| scene.world.step(0.01).expect("a step");
    step(&mut scene);
    alone.step(0.01);
    let before = {
        let body = scene.world.body(blown).expect("the body");
        (body.positions().to_vec(), body.velocities().to_vec())
    };
    let body = scene.world.body_mut(blown).expect("the body");
    body.apply_force(1, Vec3::new(f32::MAX, 0.0, 0.0)).expect("a force");
    assert_eq!(step(&mut scene).bodies_restored, 1);
    alone.step(0.01);
    let body = scene.world.body(blown).expect("the body");
    assert_eq!((body.positions().to_vec(), body.velocities().to_vec()), before);
    assert_eq!(scene.positions(), alone.positions());

    // The force is spent: the next step moves the body as if the failed step had not been taken.
    let mut fresh = Scene::new(&light, definition);
    fresh.step(0.01);
    for _ in 0..10 {
        assert_eq!(step(&mut scene).bodies_restored, 0);
        alone.step(0.01);
        fresh.step(0.01);
    }
    assert_eq!(
        scene.world.body(blown).expect("the body").positions(),
        fresh.body().positions()
    );
    assert_eq!(scene.positions(), alone.positions());
}

/// Adds or removes a spring in the library and in the expected pairs; the result is true if it was removed.
fn edit(scene: &mut Scene, pairs: &mut Vec<[u32; 2]>, random: &mut Random) -> Option<([u32; 2], bool)> {
    let count = scene.body().node_count();
    if random.below(2) == 0 && pairs.len() > 60 {
        let [a, b] = pairs.swap_remove(random.below(pairs.len()));
        let [a, b] = if random.below(2) == 0 { [a, b] } else { [b, a] };
        scene.body_mut().remove_spring(a, b).expect("a spring");
        assert!(scene.body_mut().remove_spring(b, a).is_err());
        return Some(([a.min(b), a.max(b)], true));
    }
    let (a, b) = (random.below(count) as u32, random.below(count) as u32);
    let pair = [a.min(b), a.max(b)];
    let added = scene.body_mut().add_spring(a, b, 20.0, None);
    if a == b || pairs.contains(&pair) {
        assert!(added.is_err(), "{pair:?}");
        return None;
    }
    added.expect("a spring");
    pairs.push(pair);
    Some((pair, false))
}

fn sorted(mut pairs: Vec<[u32; 2]>) -> Vec<[u32; 2]> {
    pairs.sort_unstable();
    pairs
}

#[test]
fn spring_changes_follow_the_equations() {
    let parts = swinging(27);
    let mut scene = Scene::new(
        &parts,
        WorldDefinition {
            gravity: GRAVITY,
            ..FREE
        },
    );
    let mut reference = parts.reference(GRAVITY);
    let mut pairs = parts.springs.clone();
    let mut random = Random::new(28);
    let h = 5e-4_f32;
    let (mut added, mut removed) = (0, 0);
    for event in 0..300 {
        match edit(&mut scene, &mut pairs, &mut random) {
            Some((pair, true)) => {
                let position = reference
                    .springs
                    .iter()
                    .position(|spring| spring.0 == pair)
                    .expect("a spring");
                reference.springs.remove(position);
                removed += 1;
            }
            Some((pair, false)) => {
                let [a, b] = pair.map(|node| reference.positions[node as usize]);
                reference.springs.push((pair, 20.0, a.distance(b)));
                added += 1;
            }
            None => {}
        }
        assert_eq!(
            sorted(scene.body().spring_pairs().expect("pairs")),
            sorted(pairs.clone())
        );
        assert_eq!(scene.body().storage_report().spring_count, pairs.len());
        assert_eq!(scene.step(h).substeps, 1);
        reference.step(f64::from(h));
        let error = largest_difference(&scene.positions(), &reference.positions) / parts.size();
        assert!(error < 2e-6, "event {event}: {error:e}");
    }
    assert!(added > 100 && removed > 100, "{added} added, {removed} removed");
}

#[test]
fn an_edited_body_moves_as_a_new_one() {
    let parts = swinging(29);
    let mut scene = Scene::new(
        &parts,
        WorldDefinition {
            gravity: GRAVITY,
            ..FREE
        },
    );
    let mut random = Random::new(30);
    let mut pairs = parts.springs.clone();
    // Rest lengths and stiffnesses are set again, so that both bodies have bitwise identical values.
    let mut springs: std::collections::BTreeMap<[u32; 2], (f32, f32)> = parts
        .springs
        .iter()
        .zip(parts.stiffnesses.iter().zip(&parts.rest_lengths))
        .map(|(pair, (&k, &l))| (*pair, (k, l)))
        .collect();
    for _ in 0..300 {
        if let Some((pair, removed)) = edit(&mut scene, &mut pairs, &mut random) {
            springs.remove(&pair);
            if !removed {
                scene.body_mut().remove_spring(pair[0], pair[1]).expect("a spring");
                scene
                    .body_mut()
                    .add_spring(pair[1], pair[0], 15.0, Some(0.06))
                    .expect("a spring");
                springs.insert(pair, (15.0, 0.06));
            }
        }
        scene.step(1e-3);
    }
    let mut fresh = parts.clone();
    fresh.positions = scene.body().positions().to_vec();
    fresh.springs = springs.keys().copied().collect();
    (fresh.stiffnesses, fresh.rest_lengths) = springs.values().copied().unzip();
    let mut fresh = Scene::new(
        &fresh,
        WorldDefinition {
            gravity: GRAVITY,
            ..FREE
        },
    );
    let velocities = scene.body().velocities().to_vec();
    fresh.body_mut().set_velocities(&velocities).expect("velocities");
    for _ in 0..20 {
        let (edited, made) = (scene.step(1e-3), fresh.step(1e-3));
        assert_eq!(edited.substeps, made.substeps);
        assert!(
            (edited.stable_substep / made.stable_substep - 1.0).abs() < 0.2,
            "{edited:?} {made:?}"
        );
        let error = largest_difference(&scene.positions(), &fresh.positions()) / parts.size();
        assert!(error < 1e-6, "{error:e}");
    }
}

#[test]
fn springs_removed_in_motion_keep_momentum() {
    for damping in [0.0, 0.02] {
        let mut parts = Parts::block([3, 2, 2], 0.05, 0.01, 40.0);
        parts.spring_damping = damping;
        let mut random = Random::new(31);
        let velocities: Vec<Vec3> = parts.positions.iter().map(|_| 0.5 * random.vector()).collect();
        let mut scene = Scene::new(&parts, FREE);
        scene.body_mut().set_velocities(&velocities).expect("velocities");
        let momentum = |scene: &Scene| {
            let states = scene.positions().into_iter().zip(scene.velocities()).zip(&parts.masses);
            states.fold((DVec3::ZERO, DVec3::ZERO), |(linear, angular), ((x, v), &mass)| {
                let p = v * f64::from(mass);
                (linear + p, angular + x.cross(p))
            })
        };
        let start = momentum(&scene);
        let scale: f64 = velocities
            .iter()
            .zip(&parts.masses)
            .map(|(v, m)| f64::from(v.length() * m))
            .sum();
        let mut left = parts.springs.clone();
        while !left.is_empty() {
            let [a, b] = left.swap_remove(random.below(left.len()));
            scene.body_mut().remove_spring(a, b).expect("a spring");
            assert_eq!(scene.body().storage_report().spring_count, left.len());
            scene.run(1e-3, 2);
            let now = momentum(&scene);
            let linear = now.0.distance(start.0) / scale;
            let angular = now.1.distance(start.1) / (scale * parts.size());
            assert!(
                linear < 1e-6 && angular < 1e-6,
                "{} left: {linear:e}, {angular:e}",
                left.len()
            );
        }
        // Without springs there are no forces any more.
        let last = scene.velocities();
        assert_eq!(scene.step(1e-3).stable_substep, f32::INFINITY);
        assert_eq!(scene.velocities(), last);
    }
}
