//! Bodies that rest on planes or slide down them.

use crate::support::organ::of_elements;
use crate::support::tissue::*;
use glam::{DVec3, Quat, Vec3};
use sinew::mesh::Mesh;
use sinew::{BodyContact, BodyDefinition, BodyId, Shape, Values, World, WorldDefinition};

const GRAVITY: f32 = 9.81;
const DOWN: Vec3 = Vec3::new(0.0, -GRAVITY, 0.0);

/// Returns the mean force on a tool over `count` steps.
fn mean_force(world: &mut World, tool: sinew::ToolId, dt: f32, count: u32) -> DVec3 {
    let mut sum = DVec3::ZERO;
    for _ in 0..count {
        world.step(dt).expect("a step");
        sum += world.wrench(tool).expect("a tool").0.as_dvec3();
    }
    sum / f64::from(count)
}

#[test]
fn a_plane_carries_the_weight_of_a_cloth() {
    for dt in [0.001, 1.0 / 60.0, 1.0 / 30.0] {
        for (drag, friction) in [(0.0, 0.0), (2.0, 0.5), (20.0, 0.0), (100.0, 0.5)] {
            {
                let tissue = Tissue {
                    drag,
                    ..Tissue::VISCOUS
                };
                let mut world = world(DOWN);
                let plane = tool(&mut world, Shape::Plane, friction, Vec3::ZERO, Quat::IDENTITY);
                let cloth = tissue.put(&mut world, &moved(square(0.2, 10), Vec3::Y * 0.001));
                let settling = (2.0 / dt) as u32;
                for _ in 0..settling {
                    world.step(dt).expect("a step");
                }
                let (force, torque) = world.wrench(plane).expect("a tool");
                let weight = tissue.mass * GRAVITY;
                let case = format!("dt {dt}, drag {drag}, friction {friction}: {force} of {weight}");
                assert!((force + Vec3::Y * weight).length() < 0.01 * weight, "{case}");
                // The plane's position is below the middle of the cloth.
                assert!(torque.length() < 0.01 * weight * 0.1, "{case}: torque {torque}");
                assert!(kinetic(&world, cloth) < 1e-12, "{case}: J {}", kinetic(&world, cloth));
                let deepest = penetration_of(&world, cloth, Shape::Plane, plane);
                assert!(deepest < 1e-6, "{case}: {deepest} m deep");
                // Neither the force of a single step nor the position of a node jitters.
                let before = body(&world, cloth).positions().to_vec();
                for _ in 0..20 {
                    world.step(dt).expect("a step");
                    let now = world.wrench(plane).expect("a tool").0;
                    assert!((now - force).length() < 1e-4 * weight, "{case}: then {now}");
                }
                for (before, after) in before.iter().zip(body(&world, cloth).positions()) {
                    assert!(before.distance(*after) < 1e-6, "{case}: {before} to {after}");
                }
            }
        }
    }
}

#[test]
fn a_plane_carries_the_weight_of_a_block() {
    check_a_plane_carries_the_weight_of_a_block(&[(1.0 / 60.0, 0.4)]);
}

#[test]
#[ignore = "long"]
fn a_plane_carries_the_weight_of_a_block_in_the_other_cases() {
    check_a_plane_carries_the_weight_of_a_block(&[(0.002, 0.0), (1.0 / 30.0, 1.0)]);
}

fn check_a_plane_carries_the_weight_of_a_block(cases: &[(f32, f32)]) {
    let tissue = Tissue {
        mass: 0.5,
        stiffness: 400.0,
        drag: 10.0,
        spring_damping: 0.5,
    };
    for &(dt, friction) in cases {
        let mut world = world(DOWN);
        let plane = tool(
            &mut world,
            Shape::Plane,
            friction,
            Vec3::new(0.3, 0.0, 0.0),
            Quat::IDENTITY,
        );
        let mesh = Mesh::block([0.08, 0.04, 0.08], [8, 4, 8]).expect("a block");
        let block = tissue.put(&mut world, &moved(mesh, Vec3::Y * 0.025));
        for _ in 0..(3.0 / dt) as u32 {
            world.step(dt).expect("a step");
        }
        let (force, torque) = world.wrench(plane).expect("a tool");
        let weight = tissue.mass * GRAVITY;
        let case = format!("dt {dt}, friction {friction}: {force} of {weight}");
        assert!((force + Vec3::Y * weight).length() < 0.01 * weight, "{case}");
        // The weight acts at the center of the block; the torque is about the plane's position.
        let arm = centre(body(&world, block)) - DVec3::new(0.3, 0.0, 0.0);
        let expected = arm.cross(DVec3::NEG_Y * f64::from(weight));
        let error = torque.as_dvec3().distance(expected);
        assert!(
            error < 0.01 * expected.length(),
            "{case}: torque {torque} of {expected}"
        );
        assert!(kinetic(&world, block) < 1e-9, "{case}: J {}", kinetic(&world, block));
        let deepest = penetration_of(&world, block, Shape::Plane, plane);
        assert!(deepest < 1e-6, "{case}: {deepest} m deep");
    }
}

/// Creates a cloth that lies on a plane inclined by `angle`.
fn on_a_slope(angle: f32, friction: f32, height: f32) -> (World, sinew::BodyId, sinew::ToolId, Quat) {
    let lean = Quat::from_axis_angle(Vec3::new(0.6, 0.0, 0.8), angle);
    let mut mesh = square(0.2, 8);
    for position in &mut mesh.positions {
        *position = lean * (*position + Vec3::Y * height);
    }
    let mut world = world(DOWN);
    let plane = tool(&mut world, Shape::Plane, friction, Vec3::ZERO, lean);
    let cloth = Tissue::VISCOUS.put(&mut world, &mesh);
    (world, cloth, plane, lean)
}

#[test]
fn friction_above_the_slope_holds_the_cloth() {
    for dt in [0.001, 1.0 / 60.0] {
        let (mut world, cloth, plane, _) = on_a_slope(0.4, 1.05 * 0.4_f32.tan(), 0.0);
        let before = centre(body(&world, cloth));
        let force = mean_force(&mut world, plane, dt, (1.0 / dt) as u32);
        let slid = centre(body(&world, cloth)).distance(before);
        assert!(slid < 1e-5, "dt {dt}: slid {slid} m");
        let weight = f64::from(Tissue::VISCOUS.mass * GRAVITY);
        assert!((force + DVec3::Y * weight).length() < 0.01 * weight, "dt {dt}: {force}");
    }
}

#[test]
fn friction_below_the_slope_lets_the_cloth_slide() {
    for dt in [0.001, 1.0 / 60.0] {
        for (angle, friction) in [(0.4_f32, 0.0), (0.4, 0.2), (0.7, 0.5)] {
            let (mut world, cloth, plane, lean) = on_a_slope(angle, friction, 0.0);
            let start = centre(body(&world, cloth));
            let steps = (0.5 / dt) as u32;
            let force = mean_force(&mut world, plane, dt, steps);
            let seconds = f64::from(steps) * f64::from(dt);
            let slid = centre(body(&world, cloth)) - start;
            let acceleration = f64::from(GRAVITY * (angle.sin() - friction * angle.cos()));
            let expected = 0.5 * acceleration * seconds * seconds;
            let case = format!("dt {dt}, angle {angle}, friction {friction}");
            assert!(
                (slid.length() / expected - 1.0).abs() < 0.01,
                "{case}: slid {slid}, {expected} m"
            );
            let normal = lean.as_dquat() * DVec3::Y;
            assert!(slid.dot(normal).abs() < 1e-5, "{case}: left the plane, {slid}");
            let press = -force.dot(normal);
            let pressed = f64::from(Tissue::VISCOUS.mass * GRAVITY * angle.cos());
            assert!(
                (press / pressed - 1.0).abs() < 0.01,
                "{case}: pressed by {press}, {pressed} N"
            );
            let drag = (force + normal * press).length();
            assert!(
                (drag - f64::from(friction) * press).abs() < 0.01 * pressed,
                "{case}: dragged by {drag} N"
            );
        }
    }
}

#[test]
fn single_nodes_rest_in_grooves_and_corners() {
    // Two planes at right angles form a groove, three a corner. Each carries its share of a node without a surface.
    for (count, directions) in [
        (2, [Vec3::new(1.0, 1.0, 0.0), Vec3::new(-1.0, 1.0, 0.0), Vec3::ZERO]),
        (
            3,
            [
                Vec3::new(1.0, 1.0, 1.0),
                Vec3::new(-2.0, 1.0, 1.0),
                Vec3::new(1.0, 1.0, -2.0),
            ],
        ),
    ] {
        let mut world = world(DOWN);
        let planes: Vec<_> = directions[..count]
            .iter()
            .map(|direction| {
                let lean = Quat::from_rotation_arc(Vec3::Y, direction.normalize());
                tool(&mut world, Shape::Plane, 0.0, Vec3::ZERO, lean)
            })
            .collect();
        let node = world
            .create_body(&BodyDefinition {
                positions: &[Vec3::Y * 0.002],
                masses: Values::Uniform(0.01),
                ..Default::default()
            })
            .expect("a body");
        for step in 0..200 {
            world.step(0.005).expect("a step");
            for &plane in &planes {
                let deepest = penetration_of(&world, node, Shape::Plane, plane);
                assert!(deepest < 1e-5, "{count} planes, step {step}: {deepest} m deep");
            }
        }
        let force: Vec3 = planes.iter().map(|&plane| world.wrench(plane).expect("a tool").0).sum();
        let weight = 0.01 * GRAVITY;
        assert!(
            (force + Vec3::Y * weight).length() < 0.01 * weight,
            "{count} planes: {force}"
        );
        assert!(
            kinetic(&world, node) < 1e-9,
            "{count} planes: {}",
            kinetic(&world, node)
        );
    }
}

#[test]
fn a_thrown_body_stops_at_a_plane() {
    // At 100 m/s against planes at rest and planes that move towards the body, in one or in many substeps.
    for substeps in [0, 1, 7] {
        for (dt, towards) in [(0.001, 0.0), (1.0 / 60.0, 0.0), (1.0 / 30.0, 0.01), (1.0 / 60.0, 0.3)] {
            let mut world = World::new(WorldDefinition {
                gravity: Vec3::ZERO,
                substeps,
                ..Default::default()
            })
            .expect("a world");
            let plane = tool(&mut world, Shape::Plane, 0.3, Vec3::ZERO, Quat::IDENTITY);
            let soft = Tissue {
                stiffness: 0.5,
                ..Tissue::SOFT
            };
            let mesh = moved(square(0.2, 6), Vec3::Y * 1.0);
            let cloth = soft.put(&mut world, &mesh);
            let fast = vec![Vec3::new(20.0, -100.0, 5.0); mesh.positions.len()];
            world
                .body_mut(cloth)
                .expect("a body")
                .set_velocities(&fast)
                .expect("velocities");
            for step in 0..(0.1 / dt) as u32 {
                if step < 3 {
                    let pose = world.pose(plane).expect("a tool");
                    world
                        .set_pose(plane, pose.position + Vec3::Y * towards, None)
                        .expect("a pose");
                }
                world.step(dt).expect("a step");
                let deepest = penetration_of(&world, cloth, Shape::Plane, plane);
                assert!(
                    deepest < 1e-5,
                    "{substeps} substeps, dt {dt}, step {step}: {deepest} m deep"
                );
            }
        }
    }
}

/// Three layers of four blocks lie askew on each other, edges across edges. None trembles by more than a tenth of the
/// velocity that gravity adds in a substep: 10 mm/s.
#[test]
fn blocks_stacked_edge_across_edge_do_not_tremble() {
    const TREMBLE: f32 = 1e-3;
    let mesh = Mesh::block([0.04; 3], [2; 3]).expect("a block");
    let mut world = world(DOWN);
    tool(&mut world, Shape::Plane, 0.5, Vec3::ZERO, Quat::IDENTITY);
    let mut blocks: Vec<BodyId> = Vec::new();
    for layer in 0..3 {
        let offset = if layer % 2 == 0 { 0.008 } else { -0.008 };
        for (x, z) in [(-0.025, -0.025), (-0.025, 0.025), (0.025, -0.025), (0.025, 0.025)] {
            let position = Vec3::new(x + offset, 0.022 + 0.042 * layer as f32, z - offset);
            let mesh = moved(mesh.clone(), position);
            let definition = BodyDefinition {
                node_dampings: Values::Uniform(4e-2),
                contact: BodyContact {
                    thickness: 1e-3,
                    friction: 0.5,
                    with_bodies: true,
                    ..BodyContact::NOTHING
                },
                ..of_elements(&mesh, [2e4, 0.3, 1000.0])
            };
            blocks.push(world.create_body(&definition).expect("a body"));
        }
    }
    let mut fastest = 0.0_f32;
    for step in 0..105 {
        world.step(1.0 / 60.0).expect("a step");
        if step >= 90 {
            let fastest_node = |&id: &BodyId| {
                body(&world, id)
                    .velocities()
                    .iter()
                    .map(|speed| speed.length())
                    .fold(0.0, f32::max)
            };
            fastest = fastest.max(blocks.iter().map(fastest_node).sum::<f32>() / blocks.len() as f32);
        }
    }
    assert!(fastest < TREMBLE, "{fastest} m/s");
}
