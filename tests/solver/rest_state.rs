//! Static equilibria: against formulas, against the end of damped motion, and refused cases.

use crate::support::bodies::{FREE, Parts, Random, Scene, largest_difference};
use crate::support::euler::uneven_block;
use crate::support::scene::{SOLVERS, STORAGES};
use glam::{DVec3, Vec3};
use sinew::{BodyDefinition, Error, RestStateDefinition, RestStateReport, Solver, Storage, WorldDefinition};

const HANGING: WorldDefinition = WorldDefinition {
    gravity: Vec3::new(0.0, -9.81, 0.0),
    ..FREE
};

const DEFAULT: RestStateDefinition = RestStateDefinition {
    tolerance: 0.0,
    iterations: 0,
};

fn settle(scene: &mut Scene) -> RestStateReport {
    scene.world.rest_state(scene.id, &DEFAULT).expect("a state of rest")
}

/// A chain that hangs from its first node.
fn hanging_chain(count: usize) -> Parts {
    let mut parts = Parts::chain(count + 1, Vec3::Y * -0.1, 0.01, 50.0);
    parts.masses[0] = 0.0;
    parts
}

#[test]
fn a_chain_has_the_same_sag_for_every_solver_and_storage() {
    let count = 100;
    let parts = hanging_chain(count);
    let extension = 0.01 * 9.81 / 50.0 * (count * (count + 1)) as f64 / 2.0;
    for solver in SOLVERS {
        for storage in STORAGES {
            let mut scene = Scene::with(&parts, HANGING, |definition| BodyDefinition {
                solver,
                storage,
                ..definition
            });
            let report = settle(&mut scene);
            let tip = -scene.positions()[count].y - 0.1 * count as f64;
            let error = (tip / extension - 1.0).abs();
            assert!(error < 1e-6, "{solver:?}, {storage:?}: {error:.2e}, {report:?}");
            assert!(report.error <= 1e-6 * (10.0 + extension), "{report:?}");
            assert!(scene.velocities().iter().all(|&velocity| velocity == DVec3::ZERO));
            // The pin carries everything.
            let held = scene.body().pin_force(0).expect("a pin");
            let weight = 0.01 * 9.81 * count as f32;
            assert!(
                (held.y / weight - 1.0).abs() < 1e-5 && held.x.abs() < 1e-5 * weight,
                "{held}"
            );
        }
    }
}

/// Nodes between two pins at equal height: all links have the same horizontal force, and their vertical forces differ
/// by one weight (the discrete catenary).
#[test]
fn a_chain_between_two_pins_is_a_catenary() {
    let (count, mass, stiffness) = (41_usize, 0.01, 400.0_f32);
    let mut parts = Parts::chain(count, Vec3::X * 0.025, mass, stiffness);
    parts.rest_lengths.fill(0.03);
    parts.masses[0] = 0.0;
    parts.masses[count - 1] = 0.0;
    let weight = f64::from(mass) * f64::from(HANGING.gravity.y);
    let links = count - 1;
    let rest = f64::from(0.03_f32);
    // The vectors of all links for a horizontal force.
    let chain = |pull: f64| -> Vec<DVec3> {
        let up = |link: usize| -weight * ((links as f64 - 1.0) / 2.0 - link as f64);
        let vector = |link: usize| {
            // The force of a link on the neighbor of its lower-numbered node points along the link.
            let force = DVec3::new(pull, -up(link), 0.0);
            force.normalize() * (rest + force.length() / f64::from(stiffness))
        };
        (0..links).map(vector).collect()
    };
    let span = f64::from(parts.positions[count - 1].x) - f64::from(parts.positions[0].x);
    let (mut low, mut high) = (0.0, 100.0);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        let reach: f64 = chain(middle).iter().map(|vector| vector.x).sum();
        if reach < span { low = middle } else { high = middle }
    }
    let mut expected = vec![DVec3::ZERO];
    for vector in chain(low) {
        expected.push(expected[expected.len() - 1] + vector);
    }
    let mut scene = Scene::new(&parts, HANGING);
    let report = settle(&mut scene);
    let error = largest_difference(&scene.positions(), &expected);
    assert!(error < 1e-6 * rest * links as f64, "{error:.2e}, {report:?}");
}

#[test]
fn it_is_where_damped_motion_ends() {
    it_is_where_damped_motion_ends_of(1.0);
}

#[test]
#[ignore = "long"]
fn it_is_where_damped_motion_ends_at_a_contrast() {
    it_is_where_damped_motion_ends_of(1e3);
}

fn it_is_where_damped_motion_ends_of(contrast: f32) {
    let mut parts = uneven_block(contrast);
    parts.node_dampings.fill(0.05);
    for storage in STORAGES {
        let mut moved = with_storage(storage, &parts);
        moved.run(1.0 / 60.0, 600);
        let mut found = with_storage(storage, &parts);
        let report = settle(&mut found);
        let error = largest_difference(&moved.positions(), &found.positions()) / parts.size();
        assert!(error < 1e-5, "{storage:?}, 1 : {contrast}: {error:.2e}, {report:?}");
        assert!(report.energy_after < report.energy_before);
        // It stays there.
        let before = found.positions();
        found.run(1.0 / 60.0, 10);
        let deviation = largest_difference(&before, &found.positions()) / parts.size();
        assert!(deviation < 1e-6, "{storage:?}: {deviation:.2e}");
    }
}

fn with_storage(storage: Storage, parts: &Parts) -> Scene {
    Scene::with(parts, HANGING, |definition| BodyDefinition { storage, ..definition })
}

#[test]
fn bad_starts_lose_energy_until_forces_balance() {
    let parts = uneven_block(1.0);
    let mut random = Random::new(3);
    let size = parts.size() as f32;
    let scattered = parts.positions.iter().map(|_| random.vector() * size).collect();
    let stretched = parts.positions.iter().map(|&p| p * 5.0).collect();
    let inverted = parts.positions.iter().map(|&p| p * Vec3::new(1.0, 1.0, -1.0)).collect();
    let flat = parts.positions.iter().map(|&p| p * Vec3::new(1.0, 0.0, 1.0)).collect();
    let point = vec![Vec3::ONE * 0.01; parts.positions.len()];
    for (name, positions) in [
        ("scattered", scattered),
        ("stretched", stretched),
        ("inverted", inverted),
        ("flat", flat),
        ("a point", point),
    ] {
        let mut scene = Scene::new(&parts, HANGING);
        scene.body_mut().set_positions(&positions).expect("positions");
        let before = scene.energy();
        let report = settle(&mut scene);
        let after = scene.energy();
        assert!(
            after < before && report.energy_after < report.energy_before,
            "{name}: {report:?}"
        );
        assert!(
            (report.energy_before / before - 1.0).abs() < 1e-4,
            "{name}: {before} J, {report:?}"
        );
        // The force error of twenty springs of 20 N/m when positions are rounded to 1e-8 m.
        assert!(report.residual < 4e-6, "{name}: {report:?}");
        let left = forces_left(&scene, &parts);
        assert!(left < 1e-5, "{name}: {left:.2e} N, {report:?}");
    }
}

/// Returns the largest force on a free node (N), in `f64` at the reported positions.
fn forces_left(scene: &Scene, parts: &Parts) -> f64 {
    let mut reference = parts.reference(HANGING.gravity);
    reference.positions = scene.positions();
    let forces = reference.forces().into_iter().zip(&reference.masses);
    forces
        .filter(|(_, mass)| **mass > 0.0)
        .map(|(force, mass)| (force + reference.gravity * *mass).length())
        .fold(0.0, f64::max)
}

/// A compressed row of three nodes: the straight shape is an unstable equilibrium, the bent shape is the minimum.
#[test]
fn an_unstable_equilibrium_is_left() {
    let mut parts = Parts::chain(3, Vec3::X * 0.1, 0.01, 50.0);
    parts.rest_lengths.fill(0.125);
    parts.masses[0] = 0.0;
    parts.masses[2] = 0.0;
    let mut scene = Scene::new(&parts, FREE);
    let report = settle(&mut scene);
    let middle = scene.positions()[1];
    let bent = (f64::from(0.125_f32).powi(2) - 0.01).sqrt();
    let aside = (middle - DVec3::X * middle.x).length();
    assert!((aside / bent - 1.0).abs() < 1e-5, "{middle}, {report:?}");
}

#[test]
fn constant_forces_count_and_stay_pending() {
    let mut scene = Scene::new(&hanging_chain(4), FREE);
    scene.body_mut().apply_force(4, Vec3::Y * -2.0).expect("a force");
    settle(&mut scene);
    // Four springs of 50 N/m.
    assert!((scene.positions()[4].y + 0.4 + 4.0 * 2.0 / 50.0).abs() < 1e-6);
    let before = scene.positions();
    scene.step(0.01);
    assert!(largest_difference(&before, &scene.positions()) < 1e-7);
    scene.step(0.01);
    assert!(largest_difference(&before, &scene.positions()) > 1e-3);
}

#[test]
fn a_body_without_pins_rests_without_forces() {
    let mut parts = Parts::block([3, 3, 3], 0.05, 0.01, 20.0);
    let expected = parts.clone();
    for (node, position) in parts.positions.iter_mut().enumerate() {
        position.x += 0.01 * (node as f32).sin();
    }
    let mut scene = Scene::new(&parts, FREE);
    let report = settle(&mut scene);
    assert!(report.energy_after < 1e-12, "{report:?}");
    for (&[a, b], &length) in expected.springs.iter().zip(&expected.rest_lengths) {
        let x = scene.positions();
        let error = x[a as usize].distance(x[b as usize]) / f64::from(length) - 1.0;
        assert!(error.abs() < 1e-6, "{error:.2e}");
    }
}

#[test]
fn a_missing_equilibrium_is_refused_and_changes_nothing() {
    let cut = |parts: &mut Parts| parts.stiffnesses[50] = 0.0;
    let mut torn = hanging_chain(100);
    cut(&mut torn);
    let free = Parts::block([2, 2, 2], 0.05, 0.01, 20.0);
    for (parts, message) in [(torn, "node 51"), (free, "node 0")] {
        for solver in SOLVERS {
            let mut scene = Scene::with(&parts, HANGING, |definition| BodyDefinition { solver, ..definition });
            scene.step(0.01);
            let (hash, before) = (scene.world.state_hash(), scene.positions());
            match scene.world.rest_state(scene.id, &DEFAULT) {
                Err(Error::InvalidArgument(said)) => assert!(said.contains(message), "{said}"),
                other => panic!("{other:?}"),
            }
            assert_eq!(scene.world.state_hash(), hash);
            assert_eq!(scene.positions(), before);
        }
    }
    let mut scene = Scene::new(&hanging_chain(100), HANGING);
    scene.step(0.01);
    let hash = scene.world.state_hash();
    let few = RestStateDefinition {
        iterations: 3,
        ..DEFAULT
    };
    let refused = scene.world.rest_state(scene.id, &few);
    assert!(matches!(refused, Err(Error::NotConverged(_))), "{refused:?}");
    for tolerance in [-1.0, f32::NAN, f32::INFINITY] {
        let bad = RestStateDefinition { tolerance, ..DEFAULT };
        match scene.world.rest_state(scene.id, &bad) {
            Err(Error::InvalidArgument(said)) => assert!(said.contains("tolerance"), "{said}"),
            other => panic!("{other:?}"),
        }
    }
    assert_eq!(scene.world.state_hash(), hash);
}

#[test]
fn removed_springs_hold_nothing() {
    for storage in STORAGES {
        let mut scene = Scene::with(&hanging_chain(6), HANGING, |definition| BodyDefinition {
            storage,
            solver: Solver::Newton,
            springs_per_node: 4,
            ..definition
        });
        settle(&mut scene);
        scene.body_mut().remove_spring(2, 3).expect("a spring");
        assert!(scene.world.rest_state(scene.id, &DEFAULT).is_err());
        scene.body_mut().add_spring(0, 6, 25.0, Some(0.1)).expect("room");
        settle(&mut scene);
        // Four nodes hang from the pin, the last of them first.
        let weight = 0.01 * 9.81;
        let last = 0.1 + 4.0 * weight / 25.0;
        assert!((scene.positions()[6].y + last).abs() < 1e-6);
        let lowest = last + 0.3 + (1.0 + 2.0 + 3.0) * weight / 50.0;
        assert!((scene.positions()[3].y + lowest).abs() < 1e-6);
    }
}

/// A body whose nodes all lie at one point, on a spring of zero length, has no length scale of its own.
#[test]
fn a_bob_hangs_from_the_pin_at_its_start() {
    for gravity in [Vec3::Y * -9.81, Vec3::new(1.0, -9.0, 0.3), Vec3::ZERO] {
        let mut parts = Parts::nodes(vec![Vec3::ZERO; 2], 0.1);
        parts.masses[0] = 0.0;
        parts.join(0, 1, 50.0);
        let mut scene = Scene::new(&parts, WorldDefinition { gravity, ..FREE });
        settle(&mut scene);
        let error = scene.positions()[1].distance(gravity.as_dvec3() * (0.1 / 50.0));
        assert!(error <= 1e-8 * f64::from(gravity.length()), "{gravity}: {error} m");
    }
}
