//! Nodes held along single axes: symmetry planes, rails and sliding supports, with every solver and storage.

use crate::support::bodies::{FREE, Parts, Random, Scene, largest_difference};
use crate::support::motion::Mode;
use crate::support::scene::{SOLVERS, STORAGES};
use glam::{BVec3, DVec3, Quat, Vec3};
use sinew::mesh::Mesh;
use sinew::{
    BodyDefinition, Error, Material, Model, Pose, RestStateDefinition, Shape, Solver, Storage, ToolDefinition, Values,
    World, WorldDefinition,
};

const X: [bool; 3] = [true, false, false];
const Y: [bool; 3] = [false, true, false];
const Z: [bool; 3] = [false, false, true];
const YZ: [bool; 3] = [false, true, true];

const HANGING: WorldDefinition = WorldDefinition {
    gravity: Vec3::new(0.0, -9.81, 0.0),
    ..FREE
};

const REST: RestStateDefinition = RestStateDefinition {
    tolerance: 0.0,
    iterations: 0,
};

/// Returns every solver with every storage; equations are solved accurately.
fn solvers_and_storages() -> impl Iterator<Item = (Solver, Storage)> {
    SOLVERS
        .into_iter()
        .flat_map(|solver| STORAGES.map(|storage| (solver, storage)))
}

fn scene(parts: &Parts, world: WorldDefinition, (solver, storage): (Solver, Storage)) -> Scene {
    Scene::with(parts, world, |definition| BodyDefinition {
        solver,
        storage,
        mass_scaling: 0.0,
        accuracy: if solver == Solver::Implicit { 1e-5 } else { 0.0 },
        ..definition
    })
}

fn hold(scene: &mut Scene, node: u32, axes: [bool; 3]) {
    scene.body_mut().pin_axes(node, axes).expect("a node");
}

fn force(scene: &Scene, node: u32) -> DVec3 {
    scene.body().pin_force(node).expect("a pin").as_dvec3()
}

fn settle(scene: &mut Scene) {
    scene.world.rest_state(scene.id, &REST).expect("a state of rest");
}

/// Two nodes 0.1 m apart along `direction`, of which the first is pinned: 0.5 kg on a spring of 50 N/m, at rest.
fn bead(direction: Vec3) -> Parts {
    let mut parts = Parts::nodes(vec![Vec3::ZERO, direction], 0.5);
    parts.masses[0] = 0.0;
    parts.join(0, 1, 50.0);
    parts
}

/// Leapfrog and the formula of order 2 have exact solutions; the pin carries all forces across the rail.
#[test]
fn a_bead_on_a_rail_is_an_oscillator() {
    let world = WorldDefinition {
        gravity: Vec3::new(0.0, -9.81, 3.0),
        substeps: 1,
        ..FREE
    };
    let (h, stretch) = (0.01_f32, 0.05);
    let mut parts = bead(Vec3::X * 0.15);
    parts.rest_lengths[0] = 0.1;
    for which in solvers_and_storages() {
        let mut scene = scene(&parts, world, which);
        hold(&mut scene, 1, YZ);
        let mut mode = Mode::new(10.0, 0.0, stretch, 0.0);
        let turn = (1.0 - 0.5 * (10.0 * f64::from(h)).powi(2)).acos();
        for step in 1..=200 {
            scene.step(h);
            mode.step(2, f64::from(h));
            let expected = if which.0 == Solver::Verlet {
                stretch * (turn * f64::from(step)).cos()
            } else {
                mode.now[0]
            };
            let position = scene.positions()[1];
            let error = (position.x - 0.1 - expected).abs() / stretch;
            assert!(error < 1e-5, "{which:?}, step {step}: {error:.2e}");
            assert_eq!([position.y, position.z], [0.0; 2], "{which:?}");
            let velocity = scene.velocities()[1];
            assert_eq!([velocity.y, velocity.z], [0.0; 2], "{which:?}");
            let weight = DVec3::new(0.0, 0.5 * 9.81, -0.5 * 3.0);
            assert!(
                force(&scene, 1).distance(weight) < 1e-6,
                "{which:?}: {}",
                force(&scene, 1)
            );
        }
    }
}

/// A spring at an angle: the pin also balances its force across the rail, averaged over the step.
#[test]
fn a_bead_pulled_at_an_angle_moves_along_its_rail() {
    let mut parts = bead(Vec3::new(0.2, 0.1, 0.0));
    parts.rest_lengths[0] = 0.12;
    let world = WorldDefinition { substeps: 1, ..HANGING };
    // The spring force on the bead (N).
    let pull = |x: f64| {
        let length = x.hypot(0.1);
        -50.0 * (1.0 - 0.12_f32 as f64 / length) * DVec3::new(x, 0.1, 0.0)
    };
    for which in solvers_and_storages() {
        let h = if which.0 == Solver::Verlet { 1e-3_f32 } else { 2.5e-4 };
        let mut scene = scene(&parts, world, which);
        hold(&mut scene, 1, YZ);
        let (mut x, mut v) = (f64::from(0.2_f32), 0.0);
        let fine = f64::from(h) / 64.0;
        for step in 0..(0.8 / h) as usize {
            let mut mean = DVec3::ZERO;
            scene.step(h);
            for _ in 0..64 {
                v += 0.5 * fine * pull(x).x / 0.5;
                x += fine * v;
                v += 0.5 * fine * pull(x).x / 0.5;
                mean += pull(x) / 64.0;
            }
            let error = (scene.positions()[1].x - x).abs();
            // Second order in the step; the reference's own error is 4e-7.
            assert!(error < 2e-4, "{which:?}, step {step}: {error:.2e}");
            let held = force(&scene, 1);
            let expected = 0.5 * 9.81 - mean.y;
            assert!(
                (held.y - expected).abs() < 0.03,
                "{which:?}, step {step}: {held}, {expected}"
            );
            assert_eq!([held.x, held.z], [0.0; 2]);
        }
    }
}

#[test]
fn a_pendulum_held_in_its_plane_stays_there() {
    let parts = bead(Vec3::new(0.06, -0.08, 0.0));
    let world = WorldDefinition { substeps: 8, ..HANGING };
    for which in solvers_and_storages() {
        let mut plane = scene(&parts, world, which);
        let mut held = scene(&parts, world, which);
        hold(&mut held, 1, Z);
        let speeds = [Vec3::ZERO, Vec3::new(0.4, 0.3, 0.0)];
        plane.body_mut().set_velocities(&speeds).expect("velocities");
        let speeds = speeds.map(|speed| speed + 0.7 * Vec3::Z);
        held.body_mut().set_velocities(&speeds).expect("velocities");
        assert_eq!(held.velocities()[1].z, 0.0);
        for _ in 0..100 {
            plane.step(0.008);
            held.step(0.008);
            assert_eq!(held.positions()[1].z, 0.0, "{which:?}");
            let error = largest_difference(&plane.positions(), &held.positions());
            let allowed = if which.0 == Solver::Implicit { 1e-6 } else { 0.0 };
            assert!(error <= allowed, "{which:?}: {error:.2e}");
        }
    }
}

/// Returns a block about the origin, its octant with x, y and z above 0, and the whole block's node for each node of
/// the octant.
fn symmetric(cells: usize) -> (Parts, Parts, Vec<usize>) {
    let spacing = 0.01;
    let mut whole = Parts::block([2 * cells; 3], spacing, 1e-3, 20.0);
    let centre = Vec3::splat(cells as f32 * spacing);
    whole.positions.iter_mut().for_each(|position| *position -= centre);
    let octant = Parts::block([cells; 3], spacing, 1e-3, 20.0);
    let nearest = |place: &Vec3| {
        let distances = whole.positions.iter().map(|other| other.distance(*place));
        let mut nearest = (f32::INFINITY, 0);
        for (node, distance) in distances.enumerate() {
            if distance < nearest.0 {
                nearest = (distance, node);
            }
        }
        assert!(nearest.0 < 1e-3 * spacing);
        nearest.1
    };
    let nodes = octant.positions.iter().map(nearest).collect();
    (whole, octant, nodes)
}

/// Returns which planes through the origin contain a node.
fn planes(position: Vec3) -> [bool; 3] {
    position.to_array().map(|coordinate| coordinate.abs() < 1e-6)
}

/// Puts both in a world without gravity, with the symmetry planes of the octant held.
fn symmetric_scenes([whole, octant]: [&Parts; 2], which: (Solver, Storage)) -> [Scene; 2] {
    let [whole, mut part] = [whole, octant].map(|parts| scene(parts, FREE, which));
    for (node, position) in (0..).zip(&octant.positions) {
        if planes(*position) != [false; 3] {
            hold(&mut part, node, planes(*position));
        }
    }
    [whole, part]
}

/// Pulls a block apart along x with 40 N per kg at its ends.
fn pull(scene: &mut Scene, parts: &Parts) {
    let reach = parts.positions.iter().map(|position| position.x).fold(0.0, f32::max);
    for (node, (position, &mass)) in (0..).zip(parts.positions.iter().zip(&parts.masses)) {
        if position.x.abs() > 0.999 * reach {
            let force = Vec3::X * position.x.signum() * 40.0 * mass;
            scene.body_mut().apply_force(node, force).expect("a node");
        }
    }
}

#[test]
fn an_octant_with_symmetry_planes_moves_as_the_whole() {
    for solver in SOLVERS {
        for storage in [Storage::Packed, Storage::DynamicBulk] {
            let (block, octant, nodes) = symmetric(3);
            let [mut whole, mut part] = symmetric_scenes([&block, &octant], (solver, storage));
            let mut moved = 0.0_f64;
            for _ in 0..40 {
                pull(&mut whole, &block);
                pull(&mut part, &octant);
                whole.step(0.002);
                part.step(0.002);
                let all = whole.positions();
                let same: Vec<DVec3> = nodes.iter().map(|&node| all[node]).collect();
                let error = largest_difference(&part.positions(), &same);
                assert!(error < 1e-6, "{solver:?}, {storage:?}: {error:.2e} m");
                let start: Vec<DVec3> = octant.positions.iter().map(|position| position.as_dvec3()).collect();
                moved = moved.max(largest_difference(&part.positions(), &start));
            }
            assert!(moved > 2e-3, "{moved}");
        }
    }
}

/// At rest the plane balances the applied forces.
#[test]
fn symmetry_planes_balance_the_applied_forces() {
    for which in solvers_and_storages() {
        let (block, octant, nodes) = symmetric(2);
        let [mut whole, mut part] = symmetric_scenes([&block, &octant], which);
        pull(&mut whole, &block);
        pull(&mut part, &octant);
        settle(&mut whole);
        settle(&mut part);
        let all = whole.positions();
        let same: Vec<DVec3> = nodes.iter().map(|&node| all[node]).collect();
        let error = largest_difference(&part.positions(), &same);
        assert!(error < 1e-7, "{which:?}: {error:.2e} m");
        let stretched = part.positions().iter().map(|position| position.x).fold(0.0, f64::max) - 0.02;
        assert!(stretched > 1e-4, "{stretched}");
        let mut held = DVec3::ZERO;
        for (node, position) in (0..).zip(&octant.positions) {
            let [x, y, z] = planes(*position);
            if x | y | z {
                let force = force(&part, node);
                let free = DVec3::select(BVec3::new(x, y, z), DVec3::ZERO, force);
                assert_eq!(free, DVec3::ZERO, "{which:?}: node {node}");
                held += force;
            }
        }
        let pulled: f64 = (octant.positions.iter().zip(&octant.masses))
            .filter(|(position, _)| position.x > 0.015)
            .map(|(_, &mass)| 40.0 * f64::from(mass))
            .sum();
        // A block that is pulled along x has no net force on the planes across it.
        assert!(
            held.distance(-pulled * DVec3::X) < 1e-5 * pulled,
            "{which:?}: {held}, {pulled}"
        );
    }
}

#[test]
fn a_driven_axis_reaches_its_target_and_free_axes_keep_moving() {
    let parts = Parts::nodes(vec![Vec3::new(1.0, 2.0, 3.0), Vec3::ZERO], 0.5);
    let falling = WorldDefinition {
        gravity: Vec3::new(2.0, -9.81, 0.0),
        ..FREE
    };
    let cut = WorldDefinition { substeps: 5, ..falling };
    let careful = WorldDefinition {
        tolerance: 1e-4,
        ..falling
    };
    for which in solvers_and_storages() {
        for world in [falling, cut, careful] {
            let mut scene = scene(&parts, world, which);
            hold(&mut scene, 0, Y);
            let steps = 5;
            for step in 1..=steps {
                let target = 2.0 + 0.03 * step as f32;
                let body = scene.body_mut();
                body.move_pin(0, Vec3::new(-50.0, target, f32::MAX)).expect("a pin");
                scene.step(0.01);
                let (position, velocity) = (scene.positions()[0], scene.velocities()[0]);
                assert_eq!(position.y, f64::from(target), "{which:?}");
                assert!((velocity.y - 3.0).abs() < 1e-4, "{which:?}: {velocity}");
                assert_eq!(position.z, 3.0, "{which:?}");
                assert!((velocity.x - 0.02 * step as f64).abs() < 1e-6, "{which:?}: {velocity}");
                // A driven axis has no kinetic energy of its own.
                let kinetic = scene.body().energy(world.gravity).kinetic;
                let other = scene.velocities()[1].length_squared();
                let expected = 0.25 * (velocity.x.powi(2) + other);
                assert!(
                    (kinetic / expected - 1.0).abs() < 1e-6,
                    "{which:?}: {kinetic}, {expected}"
                );
                assert!((force(&scene, 0).y - 0.5 * 9.81).abs() < 1e-6, "{which:?}");
            }
            let falls = scene.positions();
            let error = (falls[0].x - 1.0 - falls[1].x).abs();
            assert!(error < 2e-7, "{which:?}: {error:.2e}");
            scene.step(0.01);
            let (position, velocity) = (scene.positions()[0], scene.velocities()[0]);
            assert_eq!(
                (position.y, velocity.y),
                (f64::from(2.0 + 0.03 * steps as f32), 0.0),
                "{which:?}"
            );
        }
    }
}

/// Implicit equations with a node that is driven into a body: its prescribed motion belongs to the equations.
#[test]
fn a_driven_axis_moves_its_springs() {
    let (mass, stiffness) = (0.5, 50.0);
    for which in solvers_and_storages() {
        // Along x the driven node is the end of a spring; the other end is a mass that follows by the solver's own
        // formula.
        let mut parts = Parts::nodes(vec![Vec3::ZERO, Vec3::X * 0.1], mass);
        parts.join(0, 1, stiffness);
        let mut led = scene(&parts, WorldDefinition { substeps: 1, ..FREE }, which);
        hold(&mut led, 0, X);
        hold(&mut led, 1, YZ);
        let mut pinned = scene(&parts, WorldDefinition { substeps: 1, ..FREE }, which);
        hold(&mut pinned, 0, [true; 3]);
        for step in 0..100 {
            let target = Vec3::X * 0.02 * (0.3 * step as f32).sin();
            for scene in [&mut led, &mut pinned] {
                scene.body_mut().move_pin(0, target).expect("a pin");
                scene.step(0.02);
            }
            let error = largest_difference(&led.positions(), &pinned.positions());
            assert!(error < 1e-6, "{which:?}, step {step}: {error:.2e}");
            let error = (force(&led, 0) - force(&pinned, 0)).length();
            assert!(error < 1e-4, "{which:?}, step {step}: {error:.2e}");
        }
    }
}

/// Holds a sheet of tissue on sliding supports, with rails at two sides.
fn on_supports(parts: &Parts, scene: &mut Scene) -> Vec<u32> {
    let mut held = Vec::new();
    for (node, position) in (0..).zip(&parts.positions) {
        let axes = [position.x < 1e-6, position.y < 1e-6, position.z < 1e-6];
        if axes != [false; 3] {
            hold(scene, node, axes);
            held.push(node);
        }
    }
    held
}

#[test]
fn supports_carry_the_weight() {
    let parts = Parts::block([3, 4, 2], 0.01, 1e-3, 50.0);
    let weight = 9.81 * parts.masses.iter().map(|&mass| f64::from(mass)).sum::<f64>();
    for which in solvers_and_storages() {
        let mut scene = scene(&parts, HANGING, which);
        let held = on_supports(&parts, &mut scene);
        let all = |scene: &Scene| held.iter().map(|&node| force(scene, node)).sum::<DVec3>();
        settle(&mut scene);
        let error = all(&scene).distance(weight * DVec3::Y);
        assert!(error < 1e-5 * weight, "{which:?}: {error:.2e} of {weight} N");
        let sag = scene.positions()[4 * 4].y;
        assert!(sag < 0.04 - 1e-5, "{sag}");
        // It stays there.
        let positions = scene.positions();
        for _ in 0..10 {
            scene.step(0.005);
            let error = all(&scene).distance(weight * DVec3::Y);
            assert!(error < 1e-3 * weight, "{which:?}: {error:.2e} of {weight} N");
        }
        let error = largest_difference(&positions, &scene.positions());
        assert!(error < 1e-7, "{which:?}: {error:.2e}");
    }
}

/// On a slope a spring balances the force along the slope, and the rail the force across it.
#[test]
fn a_bead_rests_on_its_slope() {
    let slope = 0.6_f64;
    let gravity = DVec3::new(9.81 * slope.sin(), -9.81 * slope.cos(), 0.0);
    let world = WorldDefinition {
        gravity: gravity.as_vec3(),
        ..FREE
    };
    let parts = bead(Vec3::X * 0.1);
    for which in solvers_and_storages() {
        let mut bead = scene(&parts, world, which);
        hold(&mut bead, 1, Y);
        settle(&mut bead);
        let expected = DVec3::X * (f64::from(0.1_f32) + 0.5 * gravity.x / 50.0);
        assert!(
            bead.positions()[1].distance(expected) < 1e-7,
            "{which:?}: {}",
            bead.positions()[1]
        );
        assert!(
            force(&bead, 1).distance(DVec3::Y * -0.5 * gravity.y) < 1e-6,
            "{which:?}"
        );
    }
    // Nothing holds a bead without a spring along the slope; on a level plane it rests.
    let loose = Parts::nodes(vec![Vec3::ZERO], 0.5);
    let mut sliding = scene(&loose, world, (Solver::Verlet, Storage::Packed));
    hold(&mut sliding, 0, Y);
    let before = sliding.world.state_hash();
    let refused = sliding.world.rest_state(sliding.id, &REST);
    assert!(matches!(refused, Err(Error::InvalidArgument(_))), "{refused:?}");
    assert_eq!(sliding.world.state_hash(), before);
    let mut level = scene(&loose, HANGING, (Solver::Verlet, Storage::Packed));
    hold(&mut level, 0, Y);
    settle(&mut level);
    assert!((force(&level, 0).y - 0.5 * 9.81).abs() < 1e-6);
}

#[test]
fn all_axes_are_bitwise_a_pin() {
    let parts = Parts::block([2; 3], 0.02, 1e-3, 30.0);
    for which in solvers_and_storages() {
        let mut scenes = [(); 3].map(|()| scene(&parts, HANGING, which));
        let [pinned, whole, changed] = &mut scenes;
        pinned.body_mut().pin(0).expect("a node");
        hold(whole, 0, [true; 3]);
        hold(changed, 0, X);
        hold(changed, 0, [true, true, false]);
        changed.body_mut().pin(0).expect("a node");
        for step in 0..8 {
            for scene in &mut scenes {
                let target = Vec3::splat(1e-3 * step as f32);
                scene.body_mut().move_pin(0, target).expect("a pin");
                // Holding it again at the same axes changes nothing.
                hold(scene, 0, [true; 3]);
                scene.step(0.004);
            }
            let [pinned, others @ ..] = &scenes;
            for other in others {
                assert_eq!(
                    other.world.state_hash(),
                    pinned.world.state_hash(),
                    "{which:?}, step {step}"
                );
                assert_eq!(
                    other.body().pin_force(0),
                    pinned.body().pin_force(0),
                    "{which:?}, step {step}"
                );
            }
        }
        let [pinned, whole, _] = &mut scenes;
        pinned.body_mut().unpin(0).expect("a node");
        hold(whole, 0, [false; 3]);
        for scene in [&mut *pinned, whole] {
            scene.step(0.004);
            assert!(scene.body().pin_force(0).is_err());
        }
        assert_eq!(scenes[0].world.state_hash(), scenes[1].world.state_hash(), "{which:?}");
    }
}

/// A free node keeps its velocity along released axes, and stops along held axes.
#[test]
fn axes_can_change_during_the_run() {
    let parts = Parts::nodes(vec![Vec3::ZERO, Vec3::ONE], 0.5);
    let pull = Vec3::new(1.0, 1.0, 0.0);
    for which in solvers_and_storages() {
        let mut scene = Scene::with(&parts, FREE, |definition| BodyDefinition {
            solver: which.0,
            storage: which.1,
            order: u32::from(which.0 != Solver::Verlet),
            ..definition
        });
        let speeds = [Vec3::new(1.0, 2.0, 3.0), Vec3::ZERO];
        scene.body_mut().set_velocities(&speeds).expect("velocities");
        let near = |scene: &Scene, position: [f64; 3], velocity: [f64; 3]| {
            let error = scene.positions()[0].distance(position.into());
            assert!(error < 1e-6, "{which:?}: at {}, not {position:?}", scene.positions()[0]);
            let error = scene.velocities()[0].distance(velocity.into());
            assert!(error < 1e-5, "{which:?}: {}, not {velocity:?}", scene.velocities()[0]);
        };
        scene.step(0.1);
        hold(&mut scene, 0, Y);
        near(&scene, [0.1, 0.2, 0.3], [1.0, 0.0, 3.0]);
        scene.step(0.1);
        near(&scene, [0.2, 0.2, 0.6], [1.0, 0.0, 3.0]);
        // Driven along y, then released there and held along z; x is unaffected.
        scene.body_mut().move_pin(0, Vec3::Y * 0.5).expect("a pin");
        scene.step(0.1);
        hold(&mut scene, 0, Z);
        near(&scene, [0.3, 0.5, 0.9], [1.0, 3.0, 0.0]);
        scene.step(0.1);
        near(&scene, [0.4, 0.8, 0.9], [1.0, 3.0, 0.0]);
        // A change discards the target position, and forces along the axes that are now held.
        scene.body_mut().move_pin(0, Vec3::splat(9.0)).expect("a pin");
        scene.body_mut().apply_force(0, pull).expect("a node");
        hold(&mut scene, 0, YZ);
        scene.step(0.1);
        let positions = scene.positions()[0];
        assert!(
            (positions.y - 0.8).abs() < 1e-6 && (positions.z - 0.9).abs() < 1e-6,
            "{which:?}: {positions}"
        );
        let gained = scene.velocities()[0].x - 1.0;
        assert!((gained - 0.2).abs() < 1e-5, "{which:?}: {gained}");
        scene.body_mut().unpin(0).expect("a node");
        let before = scene.positions()[0];
        scene.step(0.1);
        assert!(
            scene.positions()[0].distance(before + DVec3::X * 0.12) < 1e-6,
            "{which:?}"
        );
    }
}

/// Half of the nodes of a body are held along arbitrary axes, with both kinds of damping, forces, gravity, and a ball
/// that moves through all of it.
fn thrown(which: (Solver, Storage), world: WorldDefinition) -> (Scene, Vec<[bool; 3]>) {
    let mut random = Random::new(7);
    let mut parts = Parts::block([4; 3], 0.01, 1e-3, 30.0);
    for position in &mut parts.positions {
        *position += 1e-3 * random.vector();
    }
    parts.spring_damping = 1e-3;
    parts.node_dampings.fill(2e-3);
    parts.masses[7] = 0.0;
    let mut scene = scene(&parts, world, which);
    let axes: Vec<[bool; 3]> = (0..parts.positions.len())
        .map(|node| match node {
            7 => [true; 3],
            _ if random.below(2) == 0 => [false; 3],
            _ => [(); 3].map(|()| random.below(2) == 0),
        })
        .collect();
    for (node, &axes) in (0..).zip(&axes) {
        hold(&mut scene, node, axes);
    }
    let speeds: Vec<Vec3> = parts.positions.iter().map(|_| 0.1 * random.vector()).collect();
    scene.body_mut().set_velocities(&speeds).expect("velocities");
    (scene, axes)
}

#[test]
fn held_axes_never_move() {
    held_axes_never_move_of(HANGING);
}

#[test]
#[ignore = "long"]
fn held_axes_never_move_in_steps_to_a_tolerance() {
    held_axes_never_move_of(WorldDefinition {
        tolerance: 1e-4,
        max_substeps: 64,
        ..HANGING
    });
}

fn held_axes_never_move_of(world: WorldDefinition) {
    for which in solvers_and_storages() {
        let (mut scene, axes) = thrown(which, world);
        let start = scene.positions();
        let ball = ToolDefinition {
            friction: 0.5,
            pose: Pose {
                position: Vec3::new(0.02, 0.055, 0.018),
                orientation: Quat::IDENTITY,
            },
            ..ToolDefinition::new(Shape::Sphere { radius: 0.01 })
        };
        let ball = scene.world.create_tool(&ball).expect("a tool");
        let mut random = Random::new(8);
        for step in 0..12 {
            for node in 0..axes.len() as u32 {
                let force = 1e-3 * random.vector();
                scene.body_mut().apply_force(node, force).expect("a node");
            }
            let depth = 0.055 - 1e-3 * step as f32;
            let place = Vec3::new(0.02, depth, 0.018);
            scene.world.set_pose(ball, place, None).expect("a pose");
            if scene.world.step(0.002).is_err() {
                // Contact has no order of convergence.
                assert!(world.tolerance > 0.0);
                break;
            }
            let (positions, velocities) = (scene.positions(), scene.velocities());
            let mut fastest = 0.0_f64;
            for (node, &axes) in axes.iter().enumerate() {
                let axes = BVec3::from(axes);
                let moved = DVec3::select(axes, positions[node] - start[node], DVec3::ZERO);
                let speed = DVec3::select(axes, velocities[node], DVec3::ZERO);
                assert_eq!(
                    (moved, speed),
                    (DVec3::ZERO, DVec3::ZERO),
                    "{which:?}, step {step}: node {node}"
                );
                fastest = fastest.max(velocities[node].length());
            }
            // The ball moves at 0.5 m/s; each of the contacts at a node gives it at most four times that speed.
            assert!(fastest < 3.0, "{which:?}, step {step}: {fastest} m/s");
        }
    }
}

/// A ball arrives sideways: its impulse along the free axis becomes momentum, its impulse along the held axis goes to
/// the pin.
#[test]
fn a_tool_moves_free_axes_only() {
    for solver in SOLVERS {
        for (axes, aside) in [(Y, 0.006), (Y, 0.009), (Z, 0.006), (YZ, 0.008)] {
            let parts = Parts::nodes(vec![Vec3::ZERO, Vec3::splat(9.0)], 0.5);
            let mut scene = scene(&parts, FREE, (solver, Storage::Packed));
            hold(&mut scene, 0, axes);
            let start = Vec3::new(-0.012, aside, 0.0);
            let ball = ToolDefinition {
                pose: Pose {
                    position: start,
                    orientation: Quat::IDENTITY,
                },
                ..ToolDefinition::new(Shape::Sphere { radius: 0.01 })
            };
            let ball = scene.world.create_tool(&ball).expect("a tool");
            let (mut momentum, dt) = (0.0, 1e-3);
            for step in 1..=20 {
                let place = start + Vec3::X * 5e-4 * step as f32;
                scene.world.set_pose(ball, place, None).expect("a pose");
                scene.step(dt);
                let (wrench, _) = scene.world.wrench(ball).expect("a tool");
                let wrench = wrench.as_dvec3();
                momentum -= wrench.x * f64::from(dt);
                let error = (0.5 * scene.velocities()[0].x - momentum).abs();
                assert!(
                    error < 1e-6,
                    "{solver:?}, {axes:?}, {aside}, step {step}: {error:.2e} N s"
                );
                let held = DVec3::select(BVec3::from(axes), wrench, DVec3::ZERO);
                let error = force(&scene, 0).distance(held);
                assert!(
                    error <= 1e-5 * wrench.length(),
                    "{solver:?}, {axes:?}, step {step}: {error:.2e} N"
                );
                if axes[1] {
                    assert_eq!(scene.positions()[0].y, 0.0);
                }
                assert!(scene.velocities()[0].length() < 4.0 * 0.5, "{}", scene.velocities()[0]);
            }
            assert!(
                scene.velocities()[0].x > 0.2,
                "{solver:?}, {axes:?}: {}",
                scene.velocities()[0]
            );
        }
    }
}

/// A ball rubs past a driven node: friction moves it at most as fast as the ball, and the prescribed motion reaches its
/// target. A released axis keeps the driven velocity.
#[test]
fn a_tool_rubs_a_driven_node() {
    for solver in SOLVERS {
        for substeps in [1, 3] {
            let parts = Parts::nodes(vec![Vec3::ZERO, Vec3::splat(9.0)], 0.5);
            let world = WorldDefinition { substeps, ..FREE };
            let mut scene = scene(&parts, world, (solver, Storage::Packed));
            hold(&mut scene, 0, Y);
            let start = Vec3::new(-0.008, 0.0083, -0.0044);
            let ball = ToolDefinition {
                friction: 5.0,
                pose: Pose {
                    position: start,
                    orientation: Quat::IDENTITY,
                },
                ..ToolDefinition::new(Shape::Sphere { radius: 0.01 })
            };
            let ball = scene.world.create_tool(&ball).expect("a tool");
            let mut rubbed = 0.0_f64;
            for step in 1..=16 {
                let place = start + Vec3::new(2e-4, 0.0, 3e-4) * step as f32;
                scene.world.set_pose(ball, place, None).expect("a pose");
                let target = 1.7e-5 * step as f32;
                scene.body_mut().move_pin(0, Vec3::Y * target).expect("a pin");
                scene.step(1e-3);
                assert_eq!(scene.positions()[0].y, f64::from(target), "{solver:?}, step {step}");
                rubbed = rubbed.max(scene.velocities()[0].z);
                assert!(rubbed < 0.33, "{solver:?}, step {step}: {rubbed} m/s");
            }
            assert!(rubbed > 0.2, "{solver:?}: {rubbed} m/s");
            scene.world.destroy_tool(ball).expect("a tool");
            scene.body_mut().unpin(0).expect("a node");
            let led = scene.velocities()[0].y;
            scene.step(1e-3);
            assert!((scene.velocities()[0].y - led).abs() < 1e-7, "{solver:?}: {led}");
        }
    }
}

/// Springs are added and removed between open steps: held axes are unaffected, and free axes follow the reference.
#[test]
fn cuts_keep_held_axes() {
    let parts = bead(Vec3::new(0.2, 0.1, 0.0));
    for which in solvers_and_storages() {
        let mut scene = scene(&parts, HANGING, which);
        hold(&mut scene, 1, Y);
        scene.run(0.005, 4);
        let (velocity, held) = (scene.velocities()[1], force(&scene, 1));
        let body = scene.body_mut();
        body.remove_spring(0, 1).expect("a spring");
        let same = |scene: &Scene| {
            let error = scene.velocities()[1].distance(velocity);
            assert!(error < 1e-6, "{which:?}: {error:.2e} m/s");
            let error = force(scene, 1).distance(held);
            assert!(error < 1e-5 && force(scene, 1).x == 0.0, "{which:?}: {error:.2e} N");
        };
        same(&scene);
        scene.body_mut().add_spring(0, 1, 70.0, Some(0.1)).expect("a spring");
        same(&scene);
        scene.step(0.005);
        let (position, velocity) = (scene.positions()[1], scene.velocities()[1]);
        assert_eq!((position.y, velocity.y), (f64::from(0.1_f32), 0.0), "{which:?}");
    }
}

/// A tool that moves straight against held axes enters the tissue, as at a pinned node, with almost no force, also
/// slightly beside the node.
#[test]
fn a_tool_enters_where_all_axes_are_held() {
    for solver in SOLVERS {
        for aside in [0.0, 1e-9, 1e-6] {
            let parts = Parts::nodes(vec![Vec3::ZERO, Vec3::splat(9.0)], 0.5);
            let mut scene = scene(&parts, FREE, (solver, Storage::Packed));
            hold(&mut scene, 0, Y);
            let start = Vec3::new(aside, 0.0101, 0.0);
            let ball = ToolDefinition {
                friction: 0.3,
                pose: Pose {
                    position: start,
                    orientation: Quat::IDENTITY,
                },
                ..ToolDefinition::new(Shape::Sphere { radius: 0.01 })
            };
            let ball = scene.world.create_tool(&ball).expect("a tool");
            for step in 1..=20 {
                let place = start - Vec3::Y * 3e-4 * step as f32;
                scene.world.set_pose(ball, place, None).expect("a pose");
                scene.step(1e-3);
                let speed = scene.velocities()[0].length();
                assert!(speed < 1e-3, "{solver:?}, {aside}, step {step}: {speed} m/s");
                assert_eq!(scene.positions()[0].y, 0.0);
            }
        }
    }
}

/// A body sliding on a plane keeps its momentum along the plane and its spin about the normal.
#[test]
fn a_sliding_body_keeps_its_momentum() {
    let parts = Parts::block([3; 3], 0.01, 1e-3, 30.0);
    let total: f64 = parts.masses.iter().map(|&mass| f64::from(mass)).sum();
    for which in solvers_and_storages() {
        let world = WorldDefinition {
            gravity: Vec3::NEG_Y,
            ..FREE
        };
        // This holds for any accuracy of the solver.
        let mut scene = Scene::with(&parts, world, |definition| BodyDefinition {
            solver: which.0,
            storage: which.1,
            accuracy: if which.0 == Solver::Implicit { 0.3 } else { 0.0 },
            ..definition
        });
        for (node, position) in (0..).zip(&parts.positions) {
            if position.y == 0.0 {
                hold(&mut scene, node, Y);
            }
        }
        let mut random = Random::new(9);
        let spin = Vec3::Y * 5.0;
        let speed = |position: &Vec3| Vec3::X * 0.3 + spin.cross(*position) + 0.05 * random.vector();
        let speeds: Vec<Vec3> = parts.positions.iter().map(speed).collect();
        scene.body_mut().set_velocities(&speeds).expect("velocities");
        let sums = |scene: &Scene| {
            let nodes = scene.positions().into_iter().zip(scene.velocities()).zip(&parts.masses);
            nodes.fold(
                (DVec3::ZERO, DVec3::ZERO),
                |(momentum, spin), ((position, velocity), &mass)| {
                    let own = velocity * f64::from(mass);
                    (momentum + own, spin + position.cross(own))
                },
            )
        };
        let (momentum, before) = sums(&scene);
        for _ in 0..50 {
            scene.step(0.002);
        }
        let (now, after) = sums(&scene);
        let error = (now - momentum).with_y(0.0).length() / (0.3 * total);
        assert!(error < 1e-5, "{which:?}: {error:.2e}");
        // Euler and the formula of order 2 damp a spin; leapfrog keeps it.
        if which.0 == Solver::Verlet {
            let error = (after.y / before.y - 1.0).abs();
            assert!(error < 1e-4, "{which:?}: {error:.2e}");
        }
    }
}

/// Tetrahedra of each law, anchor springs and bending: held axes do not move, supports carry all forces except those of
/// anchor springs, and a step of IMPLICIT agrees with NEWTON.
#[test]
fn elements_and_terms_respect_held_axes() {
    let mesh = Mesh::block([0.08; 3], [5; 3]).expect("a block");
    for (poisson_ratio, bending) in [(0.3, 0.0), (0.45, 0.0), (0.3, 1e-3)] {
        let definition = BodyDefinition {
            positions: &mesh.positions,
            tetrahedra: &mesh.tetrahedra,
            triangles: &mesh.triangles,
            bending_stiffness: bending,
            material: Some(Material {
                model: Model::Tetrahedra,
                young_modulus: 5000.0,
                poisson_ratio,
                density: 1000.0,
                ..Material::default()
            }),
            ..BodyDefinition::default()
        };
        let mut ends = Vec::new();
        for solver in SOLVERS {
            let mut world = World::new(HANGING).expect("a world");
            let id = world
                .create_body(&BodyDefinition {
                    solver,
                    accuracy: if solver == Solver::Implicit { 1e-4 } else { 0.0 },
                    ..definition
                })
                .expect("a body");
            let mut scene = Scene { world, id };
            let low = |coordinate: f32| coordinate < -0.0399;
            let mut held = Vec::new();
            for (node, position) in (0..).zip(&mesh.positions) {
                let axes = position.to_array().map(low);
                if axes != [false; 3] {
                    hold(&mut scene, node, axes);
                    held.push((node, BVec3::from(axes)));
                }
            }
            let start = scene.positions();
            scene.run(0.004, 5);
            if solver == Solver::Implicit {
                assert!(scene.body().solver_report().has_converged);
            }
            ends.push(scene.positions());
            settle(&mut scene);
            let mut sum = DVec3::ZERO;
            for &(node, axes) in &held {
                sum += force(&scene, node);
                let position = scene.positions()[node as usize];
                let moved = DVec3::select(axes, position - start[node as usize], DVec3::ZERO);
                assert_eq!(moved, DVec3::ZERO, "{solver:?}");
            }
            let weight = 9.81 * 1000.0 * f64::from(0.08_f32).powi(3);
            let error = sum.distance(weight * DVec3::Y);
            assert!(error < 1e-4 * weight, "{solver:?}, {poisson_ratio}: {sum}, {weight} N");
        }
        let moved = largest_difference(
            &ends[2],
            &mesh.positions.iter().map(|p| p.as_dvec3()).collect::<Vec<_>>(),
        );
        let error = largest_difference(&ends[1], &ends[2]);
        assert!(error < 1e-3 * moved, "{poisson_ratio}: {error:.2e} of {moved:.2e} m");
    }
}

/// The preconditioner includes held axes: an octant with its planes takes no more products than the whole.
#[test]
fn symmetry_planes_need_no_more_products() {
    let world = WorldDefinition { substeps: 1, ..HANGING };
    let (whole, octant, _) = symmetric(7);
    let solve = |parts: &Parts, planes_held: bool| {
        let mut scene = scene(parts, world, (Solver::Implicit, Storage::Packed));
        for (node, position) in (0..).zip(&parts.positions) {
            if planes_held && planes(*position) != [false; 3] {
                hold(&mut scene, node, planes(*position));
            } else if !planes_held && position.y.abs() < 1e-6 {
                scene.body_mut().pin(node).expect("a node");
            }
        }
        scene.run(1.0 / 60.0, 3);
        let report = scene.body().solver_report();
        assert!(report.has_converged);
        report.iterations
    };
    let (products, of_pinned) = (solve(&octant, true), solve(&whole, false));
    assert!(
        20 * products <= 19 * of_pinned,
        "{products} products, {of_pinned} of the whole"
    );
}

#[test]
fn invalid_axes_are_refused() {
    let mut parts = Parts::chain(3, Vec3::X * 0.1, 0.01, 50.0);
    parts.masses[0] = 0.0;
    for which in solvers_and_storages() {
        let mut scene = scene(&parts, HANGING, which);
        scene.step(1e-3);
        let before = scene.world.state_hash();
        let body = scene.body_mut();
        for (node, axes, name) in [(3, X, "node"), (0, X, "node 0"), (0, [false; 3], "node 0")] {
            let refused = body.pin_axes(node, axes);
            let Err(Error::InvalidArgument(message)) = refused else {
                panic!("{refused:?}");
            };
            assert!(message.contains(name), "{message}");
        }
        body.pin_axes(0, [true; 3]).expect("it is held so already");
        assert_eq!(scene.world.state_hash(), before, "{which:?}");
        hold(&mut scene, 1, X);
        assert_ne!(scene.world.state_hash(), before, "{which:?}");
        // Where nothing moves only the axes differ.
        let [x, y] = [X, Y].map(|axes| {
            let mut scene = self::scene(&parts, HANGING, which);
            hold(&mut scene, 1, axes);
            scene.world.state_hash()
        });
        assert_ne!(x, y, "{which:?}");
    }
}

/// A step that is refused or ends in infinity leaves held axes and their targets unchanged.
#[test]
fn a_refused_step_changes_nothing() {
    let mut parts = Parts::chain(3, Vec3::X * 0.1, 0.01, 1e6);
    parts.rest_lengths.fill(0.09);
    let few = WorldDefinition {
        max_substeps: 1,
        ..HANGING
    };
    let mut scenes = [(); 2].map(|()| scene(&parts, few, (Solver::Verlet, Storage::Packed)));
    for scene in &mut scenes {
        hold(scene, 1, Y);
        scene.step(1e-5);
        scene.body_mut().move_pin(1, Vec3::Y * 1e-4).expect("a pin");
    }
    let before = scenes[0].world.state_hash();
    assert!(matches!(scenes[0].world.step(0.1), Err(Error::Unstable { .. })));
    assert_eq!(scenes[0].world.state_hash(), before);
    for scene in &mut scenes {
        scene.run(1e-5, 3);
    }
    assert_eq!(scenes[0].world.state_hash(), scenes[1].world.state_hash());
    assert_eq!(scenes[0].positions()[1].y, f64::from(1e-4_f32));
}

/// A sheet large enough for all threads and for the pipeline. Its borders slide on rails and some nodes are driven.
fn sheet_on_rails(world: WorldDefinition, solver: Solver, side: u32) -> Scene {
    let mesh = Mesh::cloth([1.0; 2], [side; 2]).expect("a cloth");
    let mut world = World::new(world).expect("a world");
    let id = world
        .create_body(&BodyDefinition {
            positions: &mesh.positions,
            triangles: &mesh.triangles,
            masses: Values::Uniform(1e-4),
            stiffnesses: Values::Uniform(20.0),
            solver,
            ..BodyDefinition::default()
        })
        .expect("a body");
    let mut scene = Scene { world, id };
    let mut random = Random::new(10);
    for (node, position) in (0..).zip(&mesh.positions) {
        let axes = [
            position.x.abs() > 0.499,
            random.below(300) == 0,
            position.z.abs() > 0.499,
        ];
        hold(&mut scene, node, axes);
        if axes[1] && !axes[0] {
            let target = *position + 1e-3 * random.vector();
            scene.body_mut().move_pin(node, target).expect("a pin");
        }
    }
    let speeds: Vec<Vec3> = mesh.positions.iter().map(|_| 0.05 * random.vector()).collect();
    scene.body_mut().set_velocities(&speeds).expect("velocities");
    scene
}

#[test]
fn any_number_of_threads_is_bitwise_identical() {
    for (solver, substeps, side) in [(Solver::Verlet, 12, 179), (Solver::Implicit, 1, 95)] {
        let hashes = [1, 2].map(|threads| {
            let world = WorldDefinition {
                thread_count: threads,
                substeps,
                ..HANGING
            };
            let mut scene = sheet_on_rails(world, solver, side);
            scene.run(0.006, 2);
            scene.world.state_hash()
        });
        assert_eq!(hashes[0], hashes[1], "{solver:?}");
    }
}

/// A step of several substeps goes through the pipeline; the same number of single-substep steps does not.
#[test]
fn the_pipeline_agrees_with_single_substeps() {
    const H: f32 = 1.0 / 4096.0;
    let scene = |thread_count: u32, substeps: u32| {
        let world = WorldDefinition {
            thread_count,
            substeps,
            ..FREE
        };
        sheet_on_rails(world, Solver::Verlet, 179)
    };
    let (mut together, mut one_by_one) = (scene(2, 16), scene(1, 1));
    for scene in [&mut together, &mut one_by_one] {
        // Nothing is driven: a target is reached once per step.
        let count = scene.body().node_count() as u32;
        for node in 0..count {
            if let Ok(force) = scene.body().pin_force(node) {
                assert_eq!(force, Vec3::ZERO);
                let position = scene.body().positions()[node as usize];
                scene.body_mut().move_pin(node, position).expect("a pin");
            }
        }
    }
    together.step(16.0 * H);
    one_by_one.run(H, 16);
    assert_eq!(largest_difference(&together.positions(), &one_by_one.positions()), 0.0);
    assert_eq!(
        largest_difference(&together.velocities(), &one_by_one.velocities()),
        0.0
    );
}
