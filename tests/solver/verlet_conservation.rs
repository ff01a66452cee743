//! Quantities that VERLET conserves: energy over a million steps, momentum, and the motion itself when the whole scene
//! is rotated or translated.

use crate::support::bodies::{FREE, Parts, Random, Scene, largest_difference};
use crate::support::organ::of_elements;
use glam::{DVec3, Quat, Vec3};
use sinew::mesh::Mesh;
use sinew::{BodyDefinition, Material, Model, Solver, Viscosity, World, WorldDefinition};

const STEPS: usize = 1_000_000;
const WINDOW: usize = 20_000;

/// Returns the mean energy of the first and the last window of a million steps, and the spread of the first.
fn energy_over_a_million_steps(scene: &mut Scene, h: f32) -> (f64, f64, f64) {
    let window = |scene: &mut Scene| {
        let (mut sum, mut low, mut high) = (0.0, f64::INFINITY, f64::NEG_INFINITY);
        for _ in 0..WINDOW {
            scene.step(h);
            let energy = scene.energy();
            (sum, low, high) = (sum + energy, low.min(energy), high.max(energy));
        }
        (sum / WINDOW as f64, high - low)
    };
    let (first, spread) = window(scene);
    scene.run(h, STEPS - 2 * WINDOW);
    let (last, _) = window(scene);
    (first, last, spread)
}

#[test]
fn two_masses_keep_their_energy() {
    two_masses_keep_their_energy_of(1);
}

#[test]
#[ignore = "long"]
fn two_masses_keep_their_energy_in_the_mean() {
    two_masses_keep_their_energy_of(4);
}

/// Rounding makes the energy walk at random, by about 7e-5 in a million steps. The target of 1e-4 is for the drift
/// behind the walk, the mean of several starts; each start stays within the walk.
fn two_masses_keep_their_energy_of(starts: u32) {
    let omega = 200.0_f64.sqrt();
    let x = 0.2;
    let mut random = Random::new(4);
    let mut mean = 0.0;
    for start in 0..starts {
        let offset = Vec3::new(0.1, 0.05, -0.1) + 0.02 * random.vector();
        let mut parts = Parts::nodes(vec![Vec3::ZERO, offset], 1.0);
        parts.join(0, 1, 100.0);
        parts.rest_lengths[0] = 0.1;
        let mut scene = Scene::new(&parts, FREE);
        let given = scene.energy();
        let (first, last, spread) = energy_over_a_million_steps(&mut scene, (x / omega) as f32);
        let drift = last / first - 1.0;
        mean += drift / f64::from(starts);
        assert!(drift.abs() < 3e-4, "start {start}: drift {drift:e}");
        let expected = x * x / 4.0;
        assert!(
            (spread / given / expected - 1.0).abs() < 0.02,
            "{} for {expected}",
            spread / given
        );
    }
    assert!(starts < 4 || mean.abs() < 1e-4, "mean drift {mean:e}");
}

/// The modes of a block exchange energy, and each contributes (h omega)²/8 less or more than its own. At h omega = 0.5
/// the mean of a window moves by 1e-4 in `f64` too. Rounding adds a random walk of 2e-4 in a million steps. So the
/// limit here is 1e-3, for every seed.
#[test]
fn a_block_keeps_its_energy() {
    let mut parts = Parts::block([1, 1, 1], 0.1, 0.8, 400.0);
    let mut random = Random::new(1);
    for position in &mut parts.positions {
        *position += 0.01 * random.vector();
    }
    let mut scene = Scene::new(&parts, FREE);
    let (first, last, _) = energy_over_a_million_steps(&mut scene, 2e-3);
    assert!((last / first - 1.0).abs() < 1e-3, "drift {:e}", last / first - 1.0);
}

fn momenta(scene: &Scene, masses: &[f32]) -> (DVec3, DVec3) {
    let mut sums = (DVec3::ZERO, DVec3::ZERO);
    for ((position, velocity), &mass) in scene.positions().into_iter().zip(scene.velocities()).zip(masses) {
        let momentum = velocity * f64::from(mass);
        sums.0 += momentum;
        sums.1 += position.cross(momentum);
    }
    sums
}

#[test]
fn momentum_is_kept() {
    for damping in [0.0, 0.05] {
        let mut random = Random::new(2);
        let mut parts = Parts::block([3, 2, 2], 0.05, 0.01, 40.0);
        parts.spring_damping = damping;
        for mass in &mut parts.masses {
            *mass *= 2.0 + random.signed();
        }
        let velocities: Vec<Vec3> = parts.positions.iter().map(|_| 0.3 * random.vector()).collect();
        let mut scene = Scene::new(&parts, FREE);
        scene.body_mut().set_velocities(&velocities).expect("velocities");
        let (linear, angular) = momenta(&scene, &parts.masses);
        let (mut linear_scale, mut angular_scale) = (0.0, 0.0);
        for ((position, velocity), &mass) in parts.positions.iter().zip(&velocities).zip(&parts.masses) {
            let momentum = f64::from(mass * velocity.length());
            linear_scale += momentum;
            angular_scale += momentum * f64::from(position.length());
        }
        for _ in 0..10 {
            scene.run(1e-3, 200);
            let (linear_now, angular_now) = momenta(&scene, &parts.masses);
            let linear_error = linear_now.distance(linear) / linear_scale;
            let angular_error = angular_now.distance(angular) / angular_scale;
            assert!(linear_error < 1e-6, "damping {damping}: linear {linear_error:e}");
            assert!(angular_error < 1e-6, "damping {damping}: angular {angular_error:e}");
        }
    }
}

/// A deformed block that swings under gravity, held at one side.
fn swinging() -> Parts {
    let mut parts = Parts::block([3, 2, 2], 0.05, 0.01, 40.0);
    let mut random = Random::new(3);
    for (position, mass) in parts.positions.iter_mut().zip(&mut parts.masses) {
        if position.x == 0.0 {
            *mass = 0.0;
        }
        *position += 0.005 * random.vector();
    }
    parts
}

#[test]
fn the_motion_rotates_and_translates_with_the_scene() {
    let gravity = Vec3::new(1.0, -9.0, 2.0);
    let parts = swinging();
    // Half a swing; rounding errors grow from 5e-8 after one step with the square root of the number of steps.
    let steps = 60;
    let h = 2e-3;
    let mut still = Scene::new(&parts, WorldDefinition { gravity, ..FREE });
    still.run(h, steps);
    let axis = Vec3::new(1.0, 2.0, -2.0) / 3.0;
    for degrees in [0.0_f32, 10.0, 90.0, 180.0] {
        for offset in [Vec3::ZERO, Vec3::new(0.25, -0.5, 0.125)] {
            let rotation = Quat::from_axis_angle(axis, degrees.to_radians());
            let turned = WorldDefinition {
                gravity: (rotation.as_dquat() * gravity.as_dvec3()).as_vec3(),
                ..FREE
            };
            let mut scene = Scene::new(&parts.moved(rotation, offset), turned);
            scene.run(h, steps);
            let expected: Vec<DVec3> = still
                .positions()
                .into_iter()
                .map(|p| rotation.as_dquat() * p + offset.as_dvec3())
                .collect();
            let error = largest_difference(&scene.positions(), &expected) / parts.size();
            assert!(error < 1e-6, "{degrees} degrees, moved {offset}: {error:e}");
        }
    }
}

#[test]
fn the_motion_follows_the_discrete_equations() {
    let gravity = Vec3::new(1.0, -9.0, 2.0);
    let mut parts = swinging();
    for (damping, mass) in parts.node_dampings.iter_mut().zip(&parts.masses) {
        *damping = 0.5 * mass;
    }
    // One long step with whole kicks inside agrees with as many short ones.
    for substeps in [1, 5] {
        let definition = WorldDefinition {
            gravity,
            substeps,
            ..FREE
        };
        let mut scene = Scene::new(&parts, definition);
        let mut reference = parts.reference(gravity);
        let force = DVec3::new(0.05, 0.1, -0.1);
        let loaded = parts.positions.len() - 1;
        reference.applied[loaded] = force;
        let dt = 2e-3 * substeps as f32;
        for _ in 0..100 / substeps {
            let body = scene.body_mut();
            body.apply_force(loaded as u32, force.as_vec3()).expect("a force");
            assert_eq!(scene.step(dt).substeps, substeps);
            reference.run(f64::from(dt) / f64::from(substeps), substeps as usize);
            let error = largest_difference(&scene.positions(), &reference.positions) / parts.size();
            assert!(error < 1e-6, "{substeps} substeps: {error:e}");
        }
    }
}

/// A cube of viscous elements spins freely, in substeps so short that coordinate rounding is a large part of each
/// displacement.
#[test]
fn a_viscous_body_keeps_its_angular_momentum() {
    const SPIN: f32 = 5.0;
    let mesh = Mesh::block([1.5; 3], [2; 3]).expect("a block");
    let mut world = World::new(WorldDefinition {
        max_substeps: 100_000,
        ..FREE
    })
    .expect("a world");
    let body = world.create_body(&BodyDefinition {
        viscosity: Viscosity {
            retardation_time: 2.6e-4,
            relaxation_time: 0.0,
        },
        solver: Solver::Verlet,
        ..of_elements(&mesh, [3e6, 0.4, 0.5])
    });
    let body = body.expect("a body");
    let velocities: Vec<Vec3> = mesh
        .positions
        .iter()
        .map(|position| Vec3::Y.cross(*position) * SPIN)
        .collect();
    world
        .body_mut(body)
        .expect("the body")
        .set_velocities(&velocities)
        .expect("velocities");
    let momentum = |world: &World| -> DVec3 {
        let body = world.body(body).expect("the body");
        let positions = body.positions().iter().zip(body.velocities()).enumerate();
        positions
            .map(|(node, (position, velocity))| {
                let mass = f64::from(body.node_mass(node as u32).expect("a node"));
                position.as_dvec3().cross(velocity.as_dvec3()) * mass
            })
            .sum()
    };
    let start = momentum(&world);
    let mut substeps = 0;
    for _ in 0..20 {
        substeps += world.step(1.0 / 60.0).expect("a step").substeps;
    }
    assert!(substeps > 20_000, "{substeps} substeps");
    let lost = (momentum(&world) - start).length() / start.length();
    // Rounding coordinates again in each substep would lose about 5e-4.
    assert!(lost < 2e-6, "{lost:e}");
}

/// Returns the maximum energy of 600 steps relative to the initial energy, and the substeps of each step after the
/// first second. The block of at least eight nodes is held by one face and released 10 % longer.
fn stretched(cells: u32, young_modulus: f32, substeps: u32) -> (f64, Vec<u32>) {
    let mut world = World::new(WorldDefinition { substeps, ..FREE }).expect("a world");
    let mesh = Mesh::block([0.1; 3], [cells; 3]).expect("a mesh");
    let id = world.create_body(&BodyDefinition {
        material: Some(Material {
            model: Model::Tetrahedra,
            young_modulus,
            poisson_ratio: 0.3,
            density: 1000.0,
            ..Material::default()
        }),
        ..BodyDefinition::of(&mesh)
    });
    let id = id.expect("a body");
    let body = world.body_mut(id).expect("a body");
    let longer: Vec<Vec3> = mesh
        .positions
        .iter()
        .map(|position| Vec3::new(-0.05 + 1.1 * (position.x + 0.05), position.y, position.z))
        .collect();
    for (node, position) in (0..).zip(&mesh.positions) {
        if position.x < -0.04 {
            body.pin(node).expect("a pin");
        }
    }
    body.set_positions(&longer).expect("positions");
    let energy = |world: &World| {
        let energy = world.body(id).expect("a body").energy(Vec3::ZERO);
        energy.kinetic + energy.elastic
    };
    let start = energy(&world);
    let (mut most, mut counts) = (start, Vec::new());
    for step in 0..600 {
        let report = world.step(1.0 / 60.0).expect("a step");
        if step >= 60 {
            counts.push(report.substeps);
        }
        most = most.max(energy(&world));
    }
    counts.sort_unstable();
    counts.dedup();
    (most / start - 1.0, counts)
}

/// Substeps that follow the stiffness change in phase with the oscillation and feed it energy. With alternating two and
/// three substeps this block gained half of its energy in 1.5 s.
#[test]
fn automatic_substeps_add_no_more_energy_than_fixed_ones() {
    for (cells, young_modulus) in [(1, 1e4), (1, 3e3), (2, 2e4), (3, 1e5)] {
        let (chosen, counts) = stretched(cells, young_modulus, 0);
        let (fixed, _) = stretched(cells, young_modulus, counts[0]);
        let what = format!("{cells} cells, {young_modulus} Pa: {counts:?} substeps");
        assert!(counts.len() <= 2, "{what}");
        assert!(
            chosen < 2.0 * fixed.max(0.0) + 5e-3,
            "{what}: {chosen:+.4}, fixed {fixed:+.4}"
        );
    }
}
