//! Arguments of contact: valid ranges, refused values, and contact data after a body was rolled back.

use crate::support::solid::cuboid;
use crate::support::tissue::*;
use glam::{Quat, Vec3};
use sinew::{
    BodyContact, BodyDefinition, BodyId, CollisionFilter, Detection, Error, Pose, Result, Shape, ToolDefinition,
    ToolId, Values, World,
};

/// The largest allowed coordinate, tool size and contact thickness (m).
const FURTHEST: f32 = 1e9;

/// Checks that a call is refused with a message that contains `says`, and changes nothing.
fn assert_refused<T>(world: &mut World, call: impl FnOnce(&mut World) -> Result<T>, expected: &[&str]) {
    let before = world.state_hash();
    match call(world).map(|_| ()) {
        Err(Error::InvalidArgument(message)) => {
            for part in expected {
                assert!(message.contains(part), "{message:?} does not mention {part}");
            }
        }
        other => panic!("{expected:?}: {other:?}"),
    }
    assert_eq!(world.state_hash(), before, "{expected:?}");
}

fn put(world: &mut World, shape: Shape, position: Vec3) -> Result<ToolId> {
    world.create_tool(&ToolDefinition {
        pose: Pose {
            position,
            orientation: Quat::IDENTITY,
        },
        ..ToolDefinition::new(shape)
    })
}

fn cloth_of(world: &mut World, contact: BodyContact) -> Result<BodyId> {
    let mesh = square(0.1, 5);
    world.create_body(&BodyDefinition {
        masses: Values::Uniform(1e-3),
        stiffnesses: Values::Uniform(30.0),
        contact,
        ..BodyDefinition::of(&mesh)
    })
}

#[test]
fn coordinates_and_sizes_beyond_the_limit_are_refused() {
    let mut world = world(Vec3::ZERO);
    cloth_of(&mut world, BodyContact::NOTHING).expect("a cloth");
    let ball = sphere(&mut world, 0.01, Vec3::Y);
    let beyond = FURTHEST.next_up();
    for far in [beyond, 1e20, f32::MAX, f32::INFINITY] {
        let value = far.to_string();
        for position in [Vec3::X * far, Vec3::Y * -far, Vec3::new(0.0, 1.0, far)] {
            assert_refused(
                &mut world,
                |world| put(world, Shape::Plane, position),
                &["position", &value],
            );
            assert_refused(
                &mut world,
                |world| world.set_pose(ball, position, None),
                &["position", &value],
            );
        }
        let capsule = |radius, half_length| Shape::Capsule { radius, half_length };
        for (shape, name) in [
            (Shape::Sphere { radius: far }, "radius"),
            (capsule(far, 0.1), "radius"),
            (capsule(0.1, far), "half_length"),
        ] {
            for detection in [Detection::Exact, Detection::ImageSpace] {
                let definition = ToolDefinition {
                    detection,
                    ..ToolDefinition::new(shape)
                };
                assert_refused(&mut world, |world| world.create_tool(&definition), &[name, &value]);
            }
        }
        let contact = BodyContact {
            thickness: far,
            ..BodyContact::NOTHING
        };
        assert_refused(
            &mut world,
            |world| cloth_of(world, contact),
            &["contact_thickness", &value],
        );
    }
    // Values at the limit are accepted.
    world.set_pose(ball, Vec3::splat(FURTHEST), None).expect("a pose");
    put(&mut world, Shape::Plane, Vec3::Y * -FURTHEST).expect("a plane");
    for detection in [Detection::Exact, Detection::ImageSpace] {
        let definition = ToolDefinition {
            detection,
            ..ToolDefinition::new(Shape::Capsule {
                radius: 0.5 * FURTHEST,
                half_length: 0.5 * FURTHEST,
            })
        };
        let id = world.create_tool(&definition).expect("a capsule");
        world.destroy_tool(id).expect("a tool");
    }
    let contact = BodyContact {
        thickness: FURTHEST,
        ..BodyContact::NOTHING
    };
    cloth_of(&mut world, contact).expect("a cloth");
}

#[test]
fn the_state_hash_covers_contact_settings() {
    let hash = |contact: BodyContact| {
        let mut world = world(Vec3::ZERO);
        cloth_of(&mut world, contact).expect("a cloth");
        world.state_hash()
    };
    let plain = BodyContact::NOTHING;
    let all = [
        plain,
        BodyContact {
            thickness: 1e-3,
            ..plain
        },
        BodyContact { friction: 0.3, ..plain },
        BodyContact {
            with_bodies: true,
            ..plain
        },
        BodyContact {
            with_itself: true,
            ..plain
        },
        BodyContact {
            filter: CollisionFilter {
                category: 2,
                mask: u32::MAX,
            },
            ..plain
        },
        BodyContact {
            filter: CollisionFilter { category: 1, mask: 5 },
            ..plain
        },
    ];
    for (index, contact) in all.iter().enumerate() {
        assert_eq!(hash(*contact), hash(*contact));
        for other in &all[..index] {
            assert_ne!(hash(*contact), hash(*other), "{contact:?}, {other:?}");
        }
    }
}

#[test]
fn a_rolled_back_body_reports_no_new_contact() {
    let mut world = world_of(Vec3::ZERO, 1);
    let ball = sphere(&mut world, 0.01, Vec3::Y * 0.0105);
    let cloth = cloth_of(&mut world, BodyContact::NOTHING).expect("a cloth");
    pin_all(&mut world, cloth, &rim(5));
    world.set_pose(ball, Vec3::Y * 0.009, None).expect("a pose");
    let changes_and_count = |world: &World| {
        let changes: Vec<bool> = world.contact_changes().map(|change| change.has_begun).collect();
        (changes, world.contacts(ball).expect("a tool").count())
    };
    let step = |world: &mut World, breaks: bool| {
        if breaks {
            let body = world.body_mut(cloth).expect("a body");
            body.apply_force(14, Vec3::splat(3e38)).expect("a force");
        }
        let report = world.step(1e-3).expect("a step");
        assert_eq!(report.bodies_restored, u32::from(breaks));
    };
    step(&mut world, false);
    let (changes, count) = changes_and_count(&world);
    assert_eq!(changes, [true]);
    assert!(count > 0);
    // The body and its contacts are as before. Contacts of a rolled-back step exert no force.
    for _ in 0..2 {
        step(&mut world, true);
        assert_eq!(changes_and_count(&world), (vec![], 0));
        assert_eq!(world.wrench(ball).expect("a tool").0, Vec3::ZERO);
    }
    // Stepping continues as if the failed steps had never happened.
    world.set_pose(ball, Vec3::Y * 0.005, None).expect("a pose");
    step(&mut world, false);
    let (changes, count) = changes_and_count(&world);
    assert_eq!(changes, []);
    assert!(count > 0);
    world.set_pose(ball, Vec3::Y, None).expect("a pose");
    step(&mut world, false);
    assert_eq!(changes_and_count(&world), (vec![false], 0));
}

#[test]
fn capsules_too_long_for_an_image_are_refused_by_name() {
    let mut world = world(Vec3::ZERO);
    for half_length in [1e3, 1e6, 0.9 * FURTHEST] {
        let definition = ToolDefinition {
            detection: Detection::ImageSpace,
            ..ToolDefinition::new(Shape::Capsule {
                radius: 0.01,
                half_length,
            })
        };
        let value = half_length.to_string();
        let expected = ["half_length", value.as_str(), "10000 times the radius"];
        assert_refused(&mut world, |world| world.create_tool(&definition), &expected);
    }
}

fn mesh_tool(
    world: &mut World,
    (positions, triangles): &(Vec<Vec3>, Vec<[u32; 3]>),
    (detection, resolution): (Detection, f32),
    position: Vec3,
) -> Result<ToolId> {
    world.create_tool(&ToolDefinition {
        detection,
        resolution,
        pose: Pose {
            position,
            ..Pose::IDENTITY
        },
        ..ToolDefinition::new(Shape::Mesh { positions, triangles })
    })
}

#[test]
fn a_resolution_too_coarse_for_a_mesh_is_refused() {
    let mut world = world(Vec3::ZERO);
    cloth_of(&mut world, BodyContact::NOTHING).expect("a cloth");
    let cube = cuboid(Vec3::splat(-0.02), Vec3::splat(0.02));
    // Two cubes at opposite corners, with nothing in the middle.
    let mut pair = cuboid(Vec3::splat(-0.05), Vec3::splat(-0.03));
    let (more, others) = cuboid(Vec3::splat(0.03), Vec3::splat(0.05));
    pair.0.extend(more);
    pair.1
        .extend(others.iter().map(|triangle| triangle.map(|node| node + 8)));
    for (solid, detection, resolution, expected) in [
        (&cube, Detection::DistanceField, 0.045, "sample"),
        (&cube, Detection::DistanceField, 1.0, "sample"),
        (&cube, Detection::DistanceField, f32::MAX, "sample"),
        (&pair, Detection::ImageSpace, 0.11, "ray"),
        (&pair, Detection::ImageSpace, 1e10, "ray"),
        (&cube, Detection::ImageSpace, 1e30, "ray"),
    ] {
        let value = format!("resolution is {resolution} m");
        let expected = [value.as_str(), expected, "least extent is 0.", "a quarter"];
        let detection_settings = (detection, resolution);
        assert_refused(
            &mut world,
            |world| mesh_tool(world, solid, detection_settings, Vec3::Y),
            &expected,
        );
    }
    for (solid, detection, resolution) in [
        (&cube, Detection::DistanceField, 0.03),
        (&cube, Detection::ImageSpace, 0.03),
        (&cube, Detection::ImageSpace, 1.0),
        (&pair, Detection::ImageSpace, 0.01),
    ] {
        mesh_tool(&mut world, solid, (detection, resolution), Vec3::Y).expect("a tool");
    }
}

#[test]
fn thin_tools_work_at_the_default_resolution() {
    for half in [Vec3::new(0.1, 0.00025, 0.005), Vec3::new(0.1, 0.0002, 0.0002)] {
        let mut world = world(Vec3::ZERO);
        let cloth = Tissue::CALM.put(&mut world, &square(0.1, 5));
        pin_all(&mut world, cloth, &rim(5));
        let position_at = |depth: f32| Vec3::new(0.0013, half.y - depth, 0.0017);
        let detection_settings = (Detection::DistanceField, 0.0);
        let tool = mesh_tool(&mut world, &cuboid(-half, half), detection_settings, position_at(0.0)).expect("a tool");
        let mut push = 0.0;
        for step in 1..=10 {
            world
                .set_pose(tool, position_at(2e-4 * step as f32), None)
                .expect("a pose");
            world.step(1e-3).expect("a step");
            push += world.wrench(tool).expect("a tool").0.y;
        }
        let lowest = body(&world, cloth).positions().iter().map(|position| position.y);
        let lowest = lowest.fold(0.0, f32::min);
        assert!(push > 0.0 && lowest < -1e-3, "{half}: {push} N, {lowest} m");
    }
    // A distance field with cells that fine would need too many samples.
    let mut world = world(Vec3::ZERO);
    let half = Vec3::new(0.1, 0.00025, 0.1);
    let plate = cuboid(-half, half);
    let detection_settings = (Detection::DistanceField, 0.0);
    let expected = ["resolution is 0 m", "samples", "least extent is 0.0005 m"];
    assert_refused(
        &mut world,
        |world| mesh_tool(world, &plate, detection_settings, Vec3::Y),
        &expected,
    );
    for detection in [Detection::Exact, Detection::ImageSpace] {
        mesh_tool(&mut world, &plate, (detection, 0.0), Vec3::Y).expect("a plate");
    }
}
