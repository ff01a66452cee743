//! What contact is told and asked: ranges, what is refused, and what a step that a body could not take leaves to be read.

use crate::support::solid::cuboid;
use crate::support::tissue::*;
use glam::{Quat, Vec3};
use sinew::{
    BodyContact, BodyDefinition, BodyId, CollisionFilter, Detection, Error, Pose, Result, Shape, ToolDefinition,
    ToolId, Values, World,
};

/// The furthest and the largest that tools and what keeps them off may be, m.
const FURTHEST: f32 = 1e9;

/// What refuses, with the argument's name and its value; nothing has changed.
fn assert_refused<T>(world: &mut World, ask: impl FnOnce(&mut World) -> Result<T>, says: &[&str]) {
    let before = world.state_hash();
    match ask(world).map(|_| ()) {
        Err(Error::InvalidArgument(words)) => {
            for part in says {
                assert!(words.contains(part), "{words:?} says nothing of {part}");
            }
        }
        other => panic!("{says:?}: {other:?}"),
    }
    assert_eq!(world.state_hash(), before, "{says:?}");
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
fn nothing_is_further_or_larger_than_can_be_told_apart() {
    let mut world = world(Vec3::ZERO);
    cloth_of(&mut world, BodyContact::NOTHING).expect("a cloth");
    let ball = sphere(&mut world, 0.01, Vec3::Y);
    let beyond = FURTHEST.next_up();
    for far in [beyond, 1e20, f32::MAX, f32::INFINITY] {
        let value = far.to_string();
        for place in [Vec3::X * far, Vec3::Y * -far, Vec3::new(0.0, 1.0, far)] {
            assert_refused(
                &mut world,
                |world| put(world, Shape::Plane, place),
                &["position", &value],
            );
            assert_refused(
                &mut world,
                |world| world.set_pose(ball, place, None),
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
    // What lies on the border is there.
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
fn the_state_hash_knows_what_is_asked_of_contact() {
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
fn a_body_that_is_put_back_touches_nothing_anew() {
    let mut world = world_of(Vec3::ZERO, 1);
    let ball = sphere(&mut world, 0.01, Vec3::Y * 0.0105);
    let cloth = cloth_of(&mut world, BodyContact::NOTHING).expect("a cloth");
    pin_all(&mut world, cloth, &rim(5));
    world.set_pose(ball, Vec3::Y * 0.009, None).expect("a pose");
    let told = |world: &World| {
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
    let (changes, count) = told(&world);
    assert_eq!(changes, [true]);
    assert!(count > 0);
    // It is as it was, and so is what it touches; contacts of a step that was not taken press nothing.
    for _ in 0..2 {
        step(&mut world, true);
        assert_eq!(told(&world), (vec![], 0));
        assert_eq!(world.wrench(ball).expect("a tool").0, Vec3::ZERO);
    }
    // It goes on as if nothing had been tried.
    world.set_pose(ball, Vec3::Y * 0.005, None).expect("a pose");
    step(&mut world, false);
    let (changes, count) = told(&world);
    assert_eq!(changes, []);
    assert!(count > 0);
    world.set_pose(ball, Vec3::Y, None).expect("a pose");
    step(&mut world, false);
    assert_eq!(told(&world), (vec![false], 0));
}

#[test]
fn what_an_image_cannot_show_is_refused_by_its_name() {
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
        let says = ["half_length", value.as_str(), "10000 times the radius"];
        assert_refused(&mut world, |world| world.create_tool(&definition), &says);
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
fn what_is_too_coarse_for_a_mesh_is_refused() {
    let mut world = world(Vec3::ZERO);
    cloth_of(&mut world, BodyContact::NOTHING).expect("a cloth");
    let cube = cuboid(Vec3::splat(-0.02), Vec3::splat(0.02));
    // Two at opposite corners, with nothing in the middle.
    let mut pair = cuboid(Vec3::splat(-0.05), Vec3::splat(-0.03));
    let (more, others) = cuboid(Vec3::splat(0.03), Vec3::splat(0.05));
    pair.0.extend(more);
    pair.1
        .extend(others.iter().map(|triangle| triangle.map(|node| node + 8)));
    for (solid, detection, resolution, says) in [
        (&cube, Detection::DistanceField, 0.045, "sample"),
        (&cube, Detection::DistanceField, 1.0, "sample"),
        (&cube, Detection::DistanceField, f32::MAX, "sample"),
        (&pair, Detection::ImageSpace, 0.11, "ray"),
        (&pair, Detection::ImageSpace, 1e10, "ray"),
        (&cube, Detection::ImageSpace, 1e30, "ray"),
    ] {
        let value = format!("resolution is {resolution} m");
        let says = [value.as_str(), says, "least extent is 0.", "a quarter"];
        let way = (detection, resolution);
        assert_refused(&mut world, |world| mesh_tool(world, solid, way, Vec3::Y), &says);
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
fn thin_tools_are_there_as_it_comes() {
    for half in [Vec3::new(0.1, 0.00025, 0.005), Vec3::new(0.1, 0.0002, 0.0002)] {
        let mut world = world(Vec3::ZERO);
        let cloth = Tissue::CALM.put(&mut world, &square(0.1, 5));
        pin_all(&mut world, cloth, &rim(5));
        let at = |depth: f32| Vec3::new(0.0013, half.y - depth, 0.0017);
        let way = (Detection::DistanceField, 0.0);
        let tool = mesh_tool(&mut world, &cuboid(-half, half), way, at(0.0)).expect("a tool");
        let mut push = 0.0;
        for step in 1..=10 {
            world.set_pose(tool, at(2e-4 * step as f32), None).expect("a pose");
            world.step(1e-3).expect("a step");
            push += world.wrench(tool).expect("a tool").0.y;
        }
        let lowest = body(&world, cloth).positions().iter().map(|place| place.y);
        let lowest = lowest.fold(0.0, f32::min);
        assert!(push > 0.0 && lowest < -1e-3, "{half}: {push} N, {lowest} m");
    }
    // Cells as fine as that would be too many.
    let mut world = world(Vec3::ZERO);
    let half = Vec3::new(0.1, 0.00025, 0.1);
    let plate = cuboid(-half, half);
    let way = (Detection::DistanceField, 0.0);
    let says = ["resolution is 0 m", "samples", "least extent is 0.0005 m"];
    assert_refused(&mut world, |world| mesh_tool(world, &plate, way, Vec3::Y), &says);
    for detection in [Detection::Exact, Detection::ImageSpace] {
        mesh_tool(&mut world, &plate, (detection, 0.0), Vec3::Y).expect("a plate");
    }
}
