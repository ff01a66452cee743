//! Springs and regions changed during a run: the body behaves as if created that way, no cached value is stale, energy
//! changes by the energy added, and refused changes have no effect.

use crate::support::bodies::{FREE, Parts, Random, Scene, largest_difference};
use crate::support::scene::{SOLVERS, STORAGES};
use glam::{DVec3, Vec3};
use sinew::mesh::Mesh;
use sinew::{Body, Error, Solver, SpringLaw, Storage, Values};

/// An organ of springs that all differ slightly, or are all equal.
fn organ(spacing: f32, is_even: bool, random: &mut Random) -> Parts {
    let mesh = Mesh::organ(0.1, spacing).expect("an organ");
    let mut parts = Parts::nodes(mesh.positions.clone(), 1e-3);
    for [a, b] in mesh.edges().expect("its edges") {
        let more = if is_even { 0.0 } else { 4.0 * random.signed() };
        parts.join(a as usize, b as usize, 5.0 + more);
    }
    parts
}

/// A block of a lattice: two types of springs, in runs.
fn lattice() -> Parts {
    Parts::block([9, 9, 9], 0.01, 1e-3, 20.0)
}

fn scene(parts: &Parts, storage: Storage, solver: Solver) -> Scene {
    Scene::with(parts, FREE, |definition| sinew::BodyDefinition {
        storage,
        solver,
        mass_scaling: 0.0,
        ..definition
    })
}

fn velocities(parts: &Parts, random: &mut Random) -> Vec<Vec3> {
    parts.positions.iter().map(|_| 0.05 * random.vector()).collect()
}

/// Changes every `stride`-th spring; returns their pairs and new values.
fn change_springs(parts: &mut Parts, stride: usize, random: &mut Random) -> (Vec<[u32; 2]>, Vec<f32>, Vec<f32>) {
    let (mut pairs, mut stiffnesses, mut lengths) = (Vec::new(), Vec::new(), Vec::new());
    for index in (0..parts.springs.len()).step_by(stride) {
        parts.stiffnesses[index] *= 1.5 + random.signed();
        parts.rest_lengths[index] *= 1.0 + 0.05 * random.signed();
        let [a, b] = parts.springs[index];
        pairs.push(if index % 2 == 0 { [a, b] } else { [b, a] });
        stiffnesses.push(parts.stiffnesses[index]);
        lengths.push(parts.rest_lengths[index]);
    }
    (pairs, stiffnesses, lengths)
}

/// Returns the largest displacement of a node since `parts`.
fn largest_displacement(parts: &Parts, positions: &[DVec3]) -> f64 {
    let start: Vec<DVec3> = parts.positions.iter().map(|p| p.as_dvec3()).collect();
    largest_difference(positions, &start)
}

#[test]
fn a_body_with_changed_springs_moves_as_one_created_that_way() {
    let mut random = Random::new(3);
    for (parts, strides) in [
        (organ(0.012, false, &mut random), [1, 7, 150]),
        (organ(0.012, true, &mut random), [1, 7, 150]),
        (lattice(), [1, 7, 150]),
    ] {
        let start = velocities(&parts, &mut random);
        for stride in strides {
            let mut new = parts.clone();
            let (pairs, stiffnesses, lengths) = change_springs(&mut new, stride, &mut random);
            for storage in STORAGES {
                for solver in [Solver::Verlet, Solver::Implicit] {
                    let (dt, steps) = match solver {
                        Solver::Verlet => (5e-4, 40),
                        _ => (5e-3, 4),
                    };
                    let mut made = scene(&new, storage, solver);
                    let mut set = scene(&parts, storage, solver);
                    let body = set.body_mut();
                    body.set_springs(&pairs, Some(Values::Each(&stiffnesses)), None)
                        .expect("springs");
                    body.set_springs(&pairs, None, Some(Values::Each(&lengths)))
                        .expect("springs");
                    let springs = body.springs(&pairs).expect("springs");
                    for (spring, (&stiffness, &length)) in springs.iter().zip(stiffnesses.iter().zip(&lengths)) {
                        assert_eq!((spring.stiffness, spring.rest_length), (stiffness, length));
                    }
                    assert_eq!(body.storage_report().spring_count, parts.springs.len());
                    for scene in [&mut made, &mut set] {
                        scene.body_mut().set_velocities(&start).expect("velocities");
                        scene.run(dt, steps);
                    }
                    let displacement = largest_displacement(&parts, &made.positions());
                    let error = largest_difference(&made.positions(), &set.positions());
                    let allowed = if solver == Solver::Verlet { 1e-5 } else { 1e-3 };
                    assert!(
                        error < allowed * displacement,
                        "{storage:?} {solver:?} {stride}: {error} of {displacement} m"
                    );
                }
            }
        }
    }
}

#[test]
fn springs_changed_in_motion_follow_a_reference_in_f64() {
    const H: f32 = 5e-4;
    let mut random = Random::new(5);
    let parts = lattice();
    let start = velocities(&parts, &mut random);
    for storage in STORAGES {
        let mut reference = parts.reference(Vec3::ZERO);
        reference.velocities = start.iter().map(|v| v.as_dvec3()).collect();
        let mut scene = scene(&parts, storage, Solver::Verlet);
        scene.body_mut().set_velocities(&start).expect("velocities");
        for edit in 0..60 {
            let count = if edit % 10 == 9 { 700 } else { 1 + random.below(40) };
            let mut pairs = Vec::new();
            let (mut stiffnesses, mut lengths) = (Vec::new(), Vec::new());
            for _ in 0..count {
                let index = random.below(parts.springs.len());
                // A pair may occur twice: the last value counts.
                pairs.push(parts.springs[index]);
                stiffnesses.push(parts.stiffnesses[index] * (1.0 + 0.5 * random.signed()));
                lengths.push(parts.rest_lengths[index] * (1.0 + 0.05 * random.signed()));
                reference.springs[index].1 = f64::from(stiffnesses[stiffnesses.len() - 1]);
                reference.springs[index].2 = f64::from(lengths[lengths.len() - 1]);
            }
            let body = scene.body_mut();
            body.set_springs(&pairs, Some(Values::Each(&stiffnesses)), Some(Values::Each(&lengths)))
                .expect("springs");
            assert_eq!(scene.step(H).substeps, 1);
            reference.step(f64::from(H));
        }
        let displacement = largest_displacement(&parts, &reference.positions);
        let error = largest_difference(&scene.positions(), &reference.positions);
        assert!(error < 1e-4 * displacement, "{storage:?}: {error} of {displacement} m");
        let fastest = reference.velocities.iter().map(|v| v.length()).fold(0.0, f64::max);
        let error = largest_difference(&scene.velocities(), &reference.velocities);
        assert!(error < 1e-4 * fastest, "{storage:?}: {error} of {fastest} m/s");
    }
}

/// Returns the elastic energy of the body's springs at its positions, in `f64`.
fn elastic(body: &Body) -> f64 {
    let pairs = body.spring_pairs().expect("springs");
    let springs = body.springs(&pairs).expect("springs");
    let at = |node: u32| body.positions()[node as usize].as_dvec3();
    let energies = pairs.iter().zip(&springs).map(|(&[a, b], spring)| {
        let stretch = at(a).distance(at(b)) - f64::from(spring.rest_length);
        0.5 * f64::from(spring.stiffness) * stretch * stretch
    });
    energies.sum()
}

#[test]
fn the_energy_changes_by_the_spring_energy_and_then_stays() {
    let mut random = Random::new(7);
    let parts = organ(0.012, false, &mut random);
    let start = velocities(&parts, &mut random);
    for storage in STORAGES {
        for solver in SOLVERS {
            let mut scene = scene(&parts, storage, solver);
            scene.body_mut().set_velocities(&start).expect("velocities");
            let dt = 1e-3;
            scene.run(dt, 10);
            let before = scene.body().energy(Vec3::ZERO);
            let held = elastic(scene.body());
            let (pairs, stiffnesses, lengths) = change_springs(&mut parts.clone(), 3, &mut random);
            scene
                .body_mut()
                .set_springs(&pairs, Some(Values::Each(&stiffnesses)), Some(Values::Each(&lengths)))
                .expect("springs");
            let after = scene.body().energy(Vec3::ZERO);
            let put_in = elastic(scene.body()) - held;
            assert!(put_in.abs() > 0.01 * before.kinetic, "{put_in} J is nothing");
            let kept = (after.kinetic - before.kinetic).abs();
            assert!(
                kept < 1e-5 * before.kinetic,
                "{storage:?} {solver:?}: {kept} J gained or lost"
            );
            let error = (after.elastic - before.elastic - put_in).abs();
            assert!(
                error < 1e-3 * put_in.abs(),
                "{storage:?} {solver:?}: {error} of {put_in} J"
            );
            scene.run(dt, 10);
            let then = scene.energy();
            let sum = after.kinetic + after.elastic;
            // IMPLICIT loses energy, VERLET's oscillates about a mean; neither gains.
            assert!(then < 1.02 * sum, "{storage:?} {solver:?}: {then} of {sum} J");
            if solver == Solver::Verlet {
                assert!(then > 0.98 * sum, "{storage:?} {solver:?}: {then} of {sum} J");
            }
        }
    }
}

#[test]
fn stiffening_springs_a_hundredfold_in_motion_is_stable() {
    let mut random = Random::new(11);
    for (parts, few) in [
        (organ(0.012, false, &mut random), 3),
        (lattice(), 40),
        (lattice(), 3000),
    ] {
        let start = velocities(&parts, &mut random);
        for storage in STORAGES {
            for solver in SOLVERS {
                for mass_scaling in [0.0, 1e-3] {
                    let is_one_of_many = storage != Storage::Packed || mass_scaling > 0.0;
                    if solver != Solver::Verlet && is_one_of_many || solver == Solver::Newton && few > 100 {
                        continue;
                    }
                    let mut scene = Scene::with(&parts, FREE, |definition| sinew::BodyDefinition {
                        storage,
                        solver,
                        mass_scaling,
                        ..definition
                    });
                    scene.body_mut().set_velocities(&start).expect("velocities");
                    let dt = 1.0 / 240.0;
                    scene.run(dt, 3);
                    let substeps = scene.step(dt).substeps;
                    let pairs = &parts.springs[..few.min(parts.springs.len())];
                    let stiff = scene.body().springs(pairs).expect("springs");
                    let stiff: Vec<f32> = stiff.iter().map(|spring| 100.0 * spring.stiffness).collect();
                    let body = scene.body_mut();
                    body.set_springs(pairs, Some(Values::Each(&stiff)), None)
                        .expect("springs");
                    let energy = scene.energy();
                    for _ in 0..24 {
                        let report = scene.step(dt);
                        if solver == Solver::Verlet && mass_scaling == 0.0 {
                            assert!(report.substeps > 2 * substeps, "{} {substeps}", report.substeps);
                        }
                        let now = scene.energy();
                        assert!(now < 1.1 * energy, "{storage:?} {solver:?} {few}: {now} of {energy} J");
                    }
                    // With their original stiffness they allow the original substeps.
                    let soft: Vec<f32> = stiff.iter().map(|stiffness| stiffness / 100.0).collect();
                    let body = scene.body_mut();
                    body.set_springs(pairs, Some(Values::Each(&soft)), None)
                        .expect("springs");
                    let again = scene.step(dt).substeps;
                    assert!(
                        again <= substeps + 1,
                        "{storage:?} {solver:?} {few}: {again}, not {substeps}"
                    );
                }
            }
        }
    }
}

#[test]
fn springs_of_zero_stiffness_and_length_are_valid() {
    let mut random = Random::new(13);
    let parts = organ(0.0125, true, &mut random);
    for storage in STORAGES {
        for law in [
            SpringLaw::Linear,
            SpringLaw::Exponential {
                steepness: 5.0,
                limit: 0.2,
            },
        ] {
            let make = |parts: &Parts| {
                Scene::with(parts, FREE, |definition| sinew::BodyDefinition {
                    storage,
                    spring_law: law,
                    ..definition
                })
            };
            let mut scene = make(&parts);
            let (pairs, count) = (&parts.springs, parts.springs.len());
            let body = scene.body_mut();
            body.set_springs(pairs, Some(Values::Uniform(0.0)), Some(Values::Uniform(0.0)))
                .expect("springs");
            body.set_velocities(&vec![Vec3::X; parts.positions.len()])
                .expect("velocities");
            assert_eq!(body.energy(Vec3::ZERO).elastic, 0.0);
            scene.run(1e-2, 5);
            assert_eq!(scene.body().storage_report().spring_count, count);
            for (now, then) in scene.positions().iter().zip(&parts.positions) {
                assert!((now.x - f64::from(then.x) - 0.05).abs() < 1e-6, "no spring pulls");
            }
            // They get their original values again, including the stiffening law.
            let body = scene.body_mut();
            body.set_positions(&parts.positions).expect("positions");
            body.set_velocities(&vec![Vec3::ZERO; parts.positions.len()])
                .expect("velocities");
            let lengths: Vec<f32> = parts.rest_lengths.iter().map(|length| 0.9 * length).collect();
            body.set_springs(
                pairs,
                Some(Values::Each(&parts.stiffnesses)),
                Some(Values::Each(&lengths)),
            )
            .expect("springs");
            let mut short = parts.clone();
            short.rest_lengths = lengths;
            let mut made = make(&short);
            let [a, b] = [scene.energy(), made.energy()];
            assert!((a - b).abs() < 1e-6 * b, "{storage:?} {law:?}: {a} of {b} J");
            scene.run(1e-3, 5);
            made.run(1e-3, 5);
            let error = largest_difference(&scene.positions(), &made.positions());
            assert!(
                error < 1e-5 * largest_displacement(&parts, &made.positions()),
                "{storage:?} {law:?}: {error} m"
            );
        }
    }
}

#[test]
fn refused_changes_have_no_effect() {
    let mut random = Random::new(17);
    let parts = organ(0.0125, false, &mut random);
    for storage in STORAGES {
        for solver in SOLVERS {
            let mut scene = scene(&parts, storage, solver);
            scene
                .body_mut()
                .set_velocities(&velocities(&parts, &mut random))
                .expect("velocities");
            scene.run(1e-3, 3);
            let hash = scene.world.state_hash();
            let count = parts.positions.len() as u32;
            let good = [parts.springs[0], parts.springs[1]];
            let one = Some(Values::Uniform(1.0));
            let stranger = (1..count)
                .find(|&other| !parts.springs.contains(&[0, other]))
                .expect("a stranger");
            for (pairs, stiffnesses, lengths, name) in [
                ([good[0], [0, 0]], one, None, "pairs[1]"),
                ([good[0], [0, count]], one, None, "pairs[1]"),
                ([good[0], [0, stranger]], one, None, "pairs[1]"),
                (good, Some(Values::Each(&[1.0, -1.0])), None, "stiffnesses[1]"),
                (good, Some(Values::Each(&[1.0, f32::NAN])), None, "stiffnesses[1]"),
                (good, Some(Values::Each(&[1.0])), None, "stiffnesses"),
                (good, Some(Values::Uniform(f32::INFINITY)), None, "stiffness"),
                (good, one, Some(Values::Each(&[0.1, -0.1])), "rest_lengths[1]"),
                (good, one, Some(Values::Uniform(f32::NAN)), "rest_length"),
            ] {
                let refused = scene.body_mut().set_springs(&pairs, stiffnesses, lengths);
                match refused {
                    Err(Error::InvalidArgument(message)) => assert!(message.contains(name), "{message}"),
                    other => panic!("{name}: {other:?}"),
                }
                assert_eq!(scene.world.state_hash(), hash, "{name}");
            }
            assert!(scene.body().springs(&[[0, stranger]]).is_err());
            let none = scene.body_mut().set_springs(&[], one, None);
            assert!(none.is_ok() && scene.world.state_hash() == hash);
        }
    }
}

#[test]
fn added_mass_agrees_with_that_of_replaced_springs() {
    let mut parts = lattice();
    let indices = [7, 500, 900];
    for index in indices {
        parts.stiffnesses[index] *= 300.0;
    }
    let make = || {
        Scene::with(&parts, FREE, |definition| sinew::BodyDefinition {
            mass_scaling: 0.1,
            ..definition
        })
    };
    let (mut set, mut again) = (make(), make());
    let dt = 1e-2;
    set.step(dt);
    again.step(dt);
    let before = set.body().solver_report().added_mass;
    let pairs = indices.map(|index| parts.springs[index]);
    let stiffnesses = indices.map(|index| 1.5 * parts.stiffnesses[index]);
    let body = set.body_mut();
    body.set_springs(&pairs, Some(Values::Each(&stiffnesses)), None)
        .expect("springs");
    for (index, stiffness) in indices.into_iter().zip(stiffnesses) {
        let ([a, b], length) = (parts.springs[index], parts.rest_lengths[index]);
        let body = again.body_mut();
        body.remove_spring(a, b).expect("a spring");
        body.add_spring(a, b, stiffness, Some(length)).expect("room");
    }
    let [ours, theirs] = [&mut set, &mut again].map(|scene| {
        let substeps = scene.step(dt).substeps;
        (substeps, scene.body().solver_report().added_mass)
    });
    assert!(
        (theirs.1 - before).abs() > 0.01 * before && before > 0.0,
        "{before} {theirs:?}"
    );
    assert_eq!(ours.0, theirs.0);
    assert!((ours.1 - theirs.1).abs() < 1e-5 * theirs.1, "{ours:?} {theirs:?}");
}

#[test]
fn terms_and_elements_account_for_stiffer_springs() {
    let mesh = Mesh::block([0.06, 0.04, 0.04], [6, 4, 4]).expect("a block");
    let mut random = Random::new(19);
    let velocities: Vec<Vec3> = mesh.positions.iter().map(|_| 0.1 * random.vector()).collect();
    // The law makes springs up to 400 times as stiff as their stored stiffness.
    let steep = SpringLaw::Exponential {
        steepness: 30.0,
        limit: 0.2,
    };
    for (spring_law, volume_stiffness) in [(steep, 0.0), (SpringLaw::Linear, 1000.0), (steep, 1000.0)] {
        let mut world = sinew::World::new(FREE).expect("a world");
        let id = world.create_body(&sinew::BodyDefinition {
            masses: Values::Uniform(1e-4),
            stiffnesses: Values::Uniform(4.0),
            spring_law,
            volume_stiffness,
            solver: Solver::Verlet,
            ..sinew::BodyDefinition::of(&mesh)
        });
        let mut scene = Scene {
            id: id.expect("a body"),
            world,
        };
        scene.body_mut().set_velocities(&velocities).expect("velocities");
        let before = scene.step(1e-3).stable_substep;
        let pairs = scene.body().spring_pairs().expect("springs");
        let body = scene.body_mut();
        body.set_springs(&pairs, Some(Values::Uniform(400.0)), None)
            .expect("springs");
        let energy = scene.energy();
        for _ in 0..5 {
            let now = scene.step(1e-3).stable_substep;
            assert!(
                4.0 * now < before,
                "{spring_law:?} {volume_stiffness}: {now} s, before {before} s"
            );
            let now = scene.energy();
            assert!(
                now < 1.05 * energy,
                "{spring_law:?} {volume_stiffness}: {now} of {energy} J"
            );
        }
    }
}
