//! Broad-phase candidates are reused across substeps. Results do not depend on when they are rebuilt.

use std::ops::Range;

use crate::support::solid::cuboid;
use crate::support::tissue::*;
use glam::{Quat, Vec3};
use sinew::{BodyDefinition, Detection, Error, Pose, Shape, Solver, ToolDefinition, Values, World, WorldDefinition};

const DOWN: Vec3 = Vec3::new(0.0, -9.81, 0.0);

fn bits(world: &World, id: sinew::BodyId) -> Vec<[u32; 3]> {
    let body = body(world, id);
    let all = body.positions().iter().chain(body.velocities());
    all.map(|vector| vector.to_array().map(f32::to_bits)).collect()
}

#[test]
fn a_far_tool_leaves_results_bitwise_identical() {
    for far in [None, Some(Shape::Sphere { radius: 0.1 }), Some(Shape::Plane)] {
        let run = |far: Option<Shape>| {
            let mut world = world(DOWN);
            let cloth = Tissue::VISCOUS.put(&mut world, &square(0.2, 10));
            pin_all(&mut world, cloth, &[0, 5, 77]);
            if let Some(shape) = far {
                tool(&mut world, shape, 0.5, Vec3::Y * -50.0, Quat::IDENTITY);
            }
            for _ in 0..100 {
                world.step(0.004).expect("a step");
            }
            bits(&world, cloth)
        };
        assert!(run(far) == run(None), "{far:?}");
    }
}

/// Runs a cloth on a plane with a ball that wanders over it. `more` distant tools force additional rebuilds of the
/// candidate list.
fn wander(extra: u32) -> Vec<Vec<[u32; 3]>> {
    let mut world = world_of(DOWN, 8);
    let cloth = Tissue::VISCOUS.put(&mut world, &moved(square(0.2, 12), Vec3::Y * 0.003));
    tool(&mut world, Shape::Plane, 0.3, Vec3::ZERO, Quat::IDENTITY);
    let ball = tool(
        &mut world,
        Shape::Sphere { radius: 0.01 },
        0.3,
        Vec3::Y * 0.05,
        Quat::IDENTITY,
    );
    let far: Vec<_> = (0..extra)
        .map(|position| sphere(&mut world, 0.01, Vec3::new(30.0 + position as f32, 40.0, 0.0)))
        .collect();
    let mut random = Random::new(8);
    let mut states = Vec::new();
    for step in 0..150 {
        // The ball moves in and out of the cloth and the plane, and sometimes starts inside.
        let position = Vec3::new(
            random.between(-0.1, 0.1),
            random.between(0.0, 0.04),
            random.between(-0.1, 0.1),
        );
        world.set_pose(ball, position, None).expect("a pose");
        for &tool in &far {
            // The tool leaves its zone every step, so the candidate list is rebuilt every step.
            let position = world.pose(tool).expect("a tool").position;
            world
                .set_pose(tool, position + Vec3::X * if step % 2 == 0 { 1.0 } else { -1.0 }, None)
                .expect("a pose");
        }
        world.step(0.01).expect("a step");
        states.push(bits(&world, cloth));
    }
    states
}

#[test]
fn rebuilding_the_candidate_list_leaves_results_bitwise_identical() {
    let (few, many) = (wander(0), wander(1));
    let first = few.iter().zip(&many).position(|(few, many)| few != many);
    assert_eq!(first, None, "the first step that differs");
}

#[test]
fn a_tool_inside_a_body_is_detected_however_far_it_pushes() {
    // Deep inside: nodes that are pushed out of one tool can enter another tool that was far away.
    let run = |extra: bool| {
        let mut world = world_of(Vec3::ZERO, 40);
        let mesh = sinew::mesh::Mesh::block([0.1, 0.1, 0.1], [6, 6, 6]).expect("a block");
        let block = Tissue::VISCOUS.put(&mut world, &mesh);
        for (position, radius) in [(Vec3::ZERO, 0.045), (Vec3::new(0.066, 0.01, 0.0), 0.012)] {
            sphere(&mut world, radius, position);
        }
        let far = extra.then(|| sphere(&mut world, 0.01, Vec3::X * 40.0));
        let mut states = Vec::new();
        for step in 0..60 {
            if let Some(far) = far {
                world
                    .set_pose(far, Vec3::X * (40.0 + (step % 2) as f32), None)
                    .expect("a pose");
            }
            world.step(0.01).expect("a step");
            states.push(bits(&world, block));
        }
        states
    };
    let (without_extra, extra) = (run(false), run(true));
    let first = without_extra
        .iter()
        .zip(&extra)
        .position(|(without_extra, extra)| without_extra != extra);
    assert_eq!(first, None, "the first step that differs");
}

#[test]
fn a_step_with_a_tolerance_equals_a_step_with_its_number_of_substeps() {
    check_a_step_with_a_tolerance_equals_a_step_with_its_number_of_substeps(0..15);
}

#[test]
#[ignore = "long"]
fn a_step_with_a_tolerance_equals_a_step_with_its_number_of_substeps_in_other_shots() {
    check_a_step_with_a_tolerance_equals_a_step_with_its_number_of_substeps(15..60);
}

fn check_a_step_with_a_tolerance_equals_a_step_with_its_number_of_substeps(shots: Range<u32>) {
    // Bullets fly past and against a needle. Coarse steps end beyond the needle; the accepted step must detect it.
    let mut random = Random::new(6);
    let mut hits = 0;
    for shot in 0..shots.end {
        let start = Vec3::new(
            random.between(-0.05, 0.05),
            random.between(0.02, 0.15),
            random.between(-0.004, 0.004),
        );
        let velocity = Vec3::new(random.between(-3.0, 3.0), -10.0, random.between(-0.3, 0.3));
        if !shots.contains(&shot) {
            continue;
        }
        let run = |substeps: u32, tolerance: f32| {
            let mut world = World::new(WorldDefinition {
                gravity: DOWN,
                substeps,
                max_substeps: 1 << 15,
                tolerance,
                ..Default::default()
            })
            .expect("a world");
            let lying = Quat::from_rotation_z(1.3);
            let shape = Shape::Capsule {
                radius: 0.005,
                half_length: 0.2,
            };
            let needle = tool(&mut world, shape, 0.2, Vec3::ZERO, lying);
            let node = world
                .create_body(&BodyDefinition {
                    positions: &[start],
                    masses: Values::Uniform(0.001),
                    ..Default::default()
                })
                .expect("a body");
            world
                .body_mut(node)
                .expect("a body")
                .set_velocities(&[velocity])
                .expect("velocities");
            let report = world.step(1.0 / 30.0);
            let force = world.wrench(needle).expect("a tool").0;
            (report, bits(&world, node), force)
        };
        let (report, moved, force) = run(0, 2e-6);
        let Ok(report) = report else {
            assert!(matches!(report, Err(Error::Unstable { .. })));
            continue;
        };
        hits += u32::from(force != Vec3::ZERO);
        let (_, exactly, same) = run(report.substeps, 0.0);
        assert_eq!(
            moved, exactly,
            "shot {shot}, {} substeps: {force}, {same}",
            report.substeps
        );
    }
    assert!(hits > shots.len() as u32 / 12, "only {hits} shots hit the needle");
}

#[test]
fn a_refused_step_leaves_no_trace() {
    // The same motion with and without a refused step before each step.
    let run = |refused: bool| {
        let mut world = World::new(WorldDefinition {
            gravity: DOWN,
            max_substeps: 64,
            ..Default::default()
        })
        .expect("a world");
        Tissue::VISCOUS.put(&mut world, &moved(square(0.2, 10), Vec3::Y * 0.01));
        let ball = tool(
            &mut world,
            Shape::Sphere { radius: 0.02 },
            0.3,
            Vec3::Y * -0.02,
            Quat::IDENTITY,
        );
        let mut states = Vec::new();
        for step in 0..60 {
            let position = Vec3::new(0.002 * step as f32, -0.02 + 0.0005 * step as f32, 0.0);
            world.set_pose(ball, position, None).expect("a pose");
            if refused {
                let before = world.state_hash();
                assert!(matches!(world.step(10.0), Err(Error::Unstable { .. })));
                assert_eq!(world.state_hash(), before);
            }
            world.step(0.005).expect("a step");
            assert_eq!(world.pose(ball).expect("a tool").position, position);
            states.push(world.state_hash());
        }
        states
    };
    assert!(run(false) == run(true));
}

/// Creates a cloth in the plane y = 0 whose border is pinned.
fn drum(world: &mut World, solver: Solver) -> sinew::BodyId {
    let calm = Tissue {
        mass: 0.02,
        stiffness: 30.0,
        drag: 20.0,
        spring_damping: 0.01,
    };
    let cloth = calm.put_for(solver, world, &square(0.2, 10));
    pin_all(world, cloth, &rim(10));
    cloth
}

const SOLVERS: [Solver; 2] = [Solver::Verlet, Solver::Implicit];

#[test]
fn a_tool_in_a_reused_slot_is_detected() {
    let cube = |world: &mut World, detection: Detection, half: f32| {
        let (positions, triangles) = cuboid(Vec3::splat(-half), Vec3::splat(half));
        let shape = Shape::Mesh {
            positions: &positions,
            triangles: &triangles,
        };
        world
            .create_tool(&ToolDefinition {
                detection,
                resolution: if detection == Detection::Exact { 0.0 } else { 2e-3 },
                pose: Pose {
                    position: Vec3::Y * 0.045,
                    ..Pose::IDENTITY
                },
                ..ToolDefinition::new(shape)
            })
            .expect("a cube")
    };
    for detection in [Detection::Exact, Detection::DistanceField, Detection::ImageSpace] {
        for solver in SOLVERS {
            // The large cube reaches into the cloth. It reuses the slot of a destroyed small cube, or gets its own
            // slot.
            let run = |exchanged: bool| {
                let mut world = world(Vec3::ZERO);
                let cloth = drum(&mut world, solver);
                let small = exchanged.then(|| cube(&mut world, detection, 0.004));
                sphere(&mut world, 0.01, Vec3::Y * 5.0);
                for _ in 0..3 {
                    world.step(1e-3).expect("a step");
                }
                if let Some(small) = small {
                    world.destroy_tool(small).expect("a tool");
                }
                let large = cube(&mut world, detection, 0.05);
                let mut largest = Vec3::ZERO;
                for _ in 0..30 {
                    world.step(1e-3).expect("a step");
                    largest = largest.max(world.wrench(large).expect("a tool").0);
                }
                (largest, bits(&world, cloth))
            };
            let (exchanged, without_extra) = (run(true), run(false));
            assert!(
                without_extra.0.y > 1e-3,
                "{detection:?}, {solver:?}: {} N",
                without_extra.0
            );
            assert!(
                exchanged == without_extra,
                "{detection:?}, {solver:?}: {} N for {} N",
                exchanged.0,
                without_extra.0
            );
        }
    }
}

#[test]
fn a_tool_that_collides_with_nothing_leaves_results_bitwise_identical() {
    let (positions, triangles) = cuboid(Vec3::splat(-0.01), Vec3::splat(0.01));
    let mesh = Shape::Mesh {
        positions: &positions,
        triangles: &triangles,
    };
    for solver in SOLVERS {
        for presses in [false, true] {
            let run = |ghost: Option<Shape>| {
                let mut world = world(DOWN);
                let cloth = drum(&mut world, solver);
                let ball = presses.then(|| sphere(&mut world, 0.01, Vec3::new(0.03, 0.013, 0.01)));
                let ghost = ghost.map(|shape| {
                    let mut definition = ToolDefinition::new(shape);
                    definition.filter.mask = 0;
                    definition.pose.position = Vec3::Y * 0.03;
                    world.create_tool(&definition).expect("a tool")
                });
                let mut states = Vec::new();
                for step in 0..10 {
                    if let Some(ball) = ball {
                        let position = Vec3::new(0.03, 0.013 - 5e-4 * step as f32, 0.01);
                        world.set_pose(ball, position, None).expect("a pose");
                    }
                    if let Some(ghost) = ghost {
                        let position = Vec3::Y * (0.03 - 0.006 * step as f32);
                        world.set_pose(ghost, position, None).expect("a pose");
                    }
                    let report = world.step(1.0 / 60.0).expect("a step");
                    let force = ball.map(|ball| world.wrench(ball).expect("a tool").0);
                    states.push((report.substeps, force, bits(&world, cloth)));
                }
                states
            };
            let without = run(None);
            for shape in [Shape::Sphere { radius: 0.01 }, Shape::Plane, mesh] {
                let with = run(Some(shape));
                for (step, (with, without)) in with.iter().zip(&without).enumerate() {
                    assert_eq!(
                        with.0, without.0,
                        "{solver:?}, {shape:?}, {presses}: substeps of step {step}"
                    );
                    assert!(with == without, "{solver:?}, {shape:?}, {presses}: step {step}");
                }
            }
        }
    }
}
