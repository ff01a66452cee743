//! Debug drawing shows each object at its position, and only requested objects.

use glam::{Quat, Vec3};
use sinew::mesh::Mesh;
use sinew::{
    Body, BodyDefinition, BodyId, DebugCanvas, DebugDrawDefinition, Error, Pose, Rgba, Shape, Sleep, ToolDefinition,
    Values, World, WorldDefinition,
};

const NOTHING: DebugDrawDefinition = DebugDrawDefinition {
    contacts: false,
    normals: false,
    pins: false,
    attachments: false,
    springs: false,
    sleeping: false,
    bounds: false,
    normal_length: 0.01,
    force_scale: 0.01,
    full_strain: 0.1,
};

/// Stores the drawn primitives.
#[derive(Debug, Default, PartialEq)]
struct Drawing {
    lines: Vec<([Vec3; 2], Rgba)>,
    points: Vec<(Vec3, Rgba)>,
    triangles: Vec<([Vec3; 3], Rgba)>,
}

impl DebugCanvas for Drawing {
    fn line(&mut self, ends: [Vec3; 2], color: Rgba) {
        self.lines.push((ends, color));
    }

    fn point(&mut self, position: Vec3, color: Rgba) {
        self.points.push((position, color));
    }

    fn triangle(&mut self, corners: [Vec3; 3], color: Rgba) {
        self.triangles.push((corners, color));
    }
}

fn drawn(world: &World, definition: DebugDrawDefinition) -> Drawing {
    let mut drawing = Drawing::default();
    world.debug_draw(&definition, &mut drawing).expect("a drawing");
    drawing
}

fn weightless() -> World {
    World::new(WorldDefinition {
        gravity: Vec3::ZERO,
        ..WorldDefinition::default()
    })
    .expect("a world")
}

fn block(world: &mut World, sleep: Sleep) -> (BodyId, Mesh) {
    let mesh = Mesh::block([0.1, 0.02, 0.1], [8, 2, 8]).expect("a block");
    let body = world
        .create_body(&BodyDefinition {
            masses: Values::Uniform(1e-4),
            stiffnesses: Values::Uniform(50.0),
            node_dampings: Values::Uniform(1e-3),
            sleep,
            ..BodyDefinition::of(&mesh)
        })
        .expect("a body");
    (body, mesh)
}

const AWAKE: Sleep = Sleep { speed: 0.0, time: 0.1 };

#[test]
fn springs_are_lines_whose_color_is_that_of_their_strain() {
    let mut world = weightless();
    // At rest, compressed to half, stretched far, and stretched slightly.
    let positions = [0.0, 1.0, 1.5, 4.5, 5.55].map(|x| Vec3::X * x);
    let body = world
        .create_body(&BodyDefinition {
            positions: &positions,
            masses: Values::Uniform(1.0),
            springs: Some(&[[0, 1], [1, 2], [2, 3], [3, 4]]),
            rest_lengths: Some(&[1.0; 4]),
            stiffnesses: Values::Uniform(1.0),
            ..BodyDefinition::default()
        })
        .expect("a chain");
    let Drawing {
        lines,
        points,
        triangles,
    } = drawn(
        &world,
        DebugDrawDefinition {
            springs: true,
            ..NOTHING
        },
    );
    assert!(points.is_empty() && triangles.is_empty());
    assert_eq!(
        lines.len(),
        world.body(body).and_then(Body::spring_pairs).expect("pairs").len()
    );
    let color_of = |first: usize| {
        let ends = [positions[first], positions[first + 1]];
        let mut found = lines.iter().filter(|(line, _)| *line == ends);
        let color = found.next().expect("a line for each spring").1;
        assert!(found.next().is_none(), "each once");
        color.to_be_bytes()
    };
    let [rest, compressed, stretched, little] = [0, 1, 2, 3].map(color_of);
    assert!(rest[0] == rest[1] && rest[1] == rest[2], "{rest:?}");
    assert!(compressed[2] > compressed[0], "blue: {compressed:?}");
    assert!(stretched[0] > stretched[2], "red: {stretched:?}");
    // Half of the scale gives half of the color, within the rounding of a byte.
    for channel in 0..3 {
        let middle = (f32::from(rest[channel]) + f32::from(stretched[channel])) / 2.0;
        assert!((f32::from(little[channel]) - middle).abs() <= 1.0, "{little:?}");
    }
    assert!(
        [rest, compressed, stretched, little]
            .iter()
            .all(|color| color[3] == 255)
    );
}

#[test]
fn contacts_are_drawn_where_the_world_reports_them() {
    let mut world = weightless();
    let (_, mesh) = block(&mut world, AWAKE);
    let high = mesh.positions.iter().fold(f32::MIN, |high, place| high.max(place.y));
    let ball = world
        .create_tool(&ToolDefinition {
            pose: Pose {
                position: Vec3::Y * (high + 0.011),
                orientation: Quat::IDENTITY,
            },
            ..ToolDefinition::new(Shape::Sphere { radius: 0.01 })
        })
        .expect("a tool");
    let (mut step, mut contacts) = (0, Vec::new());
    while contacts.is_empty() && step < 50 {
        step += 1;
        world
            .set_pose(ball, Vec3::Y * (high + 0.011 - 2e-4 * step as f32), None)
            .expect("a pose");
        world.step(1e-3).expect("a step");
        contacts = world.contacts(ball).expect("a tool").collect();
    }
    assert!(!contacts.is_empty());
    let forces = drawn(
        &world,
        DebugDrawDefinition {
            contacts: true,
            ..NOTHING
        },
    );
    let normals = drawn(
        &world,
        DebugDrawDefinition {
            normals: true,
            ..NOTHING
        },
    );
    assert_eq!(forces.points.len(), contacts.len());
    assert!(normals.points.is_empty());
    for (index, contact) in contacts.iter().enumerate() {
        assert_eq!(forces.points[index].0, contact.point);
        assert_eq!(forces.lines[index].0[1], contact.point + contact.force * 0.01);
        let [from, to] = normals.lines[index].0;
        assert_eq!(from, contact.point);
        assert!(((to - from).length() - 0.01).abs() < 1e-6);
        assert!((to - from).dot(contact.normal) > 0.0);
    }
}

#[test]
fn pins_attachments_and_boxes_are_drawn_at_their_positions() {
    let mut world = weightless();
    let (body, mesh) = block(&mut world, AWAKE);
    let it = world.body_mut(body).expect("a body");
    it.pin(3).expect("a pin");
    it.pin_axes(5, [true, false, true]).expect("a slider");
    let pins = drawn(&world, DebugDrawDefinition { pins: true, ..NOTHING });
    let mut positions: Vec<Vec3> = pins.points.iter().map(|point| point.0).collect();
    positions.sort_by(|a, b| a.to_array().partial_cmp(&b.to_array()).expect("finite"));
    let mut expected = [mesh.positions[3], mesh.positions[5]];
    expected.sort_by(|a, b| a.to_array().partial_cmp(&b.to_array()).expect("finite"));
    assert_eq!(positions, expected);
    assert_ne!(pins.points[0].1, pins.points[1].1, "a slider has a color of its own");

    let tool = world
        .create_tool(&ToolDefinition {
            pose: Pose {
                position: Vec3::new(0.3, 0.2, 0.1),
                orientation: Quat::IDENTITY,
            },
            ..ToolDefinition::new(Shape::Sphere { radius: 0.01 })
        })
        .expect("a tool");
    world.attach_node(body, 40, tool, 0.0).expect("an attachment");
    let held = drawn(
        &world,
        DebugDrawDefinition {
            attachments: true,
            ..NOTHING
        },
    );
    assert_eq!(held.lines.len(), 1);
    assert_eq!(held.lines[0].0, [Vec3::new(0.3, 0.2, 0.1), mesh.positions[40]]);

    let boxes = drawn(
        &world,
        DebugDrawDefinition {
            bounds: true,
            ..NOTHING
        },
    );
    let [low, high] = world.body(body).expect("a body").bounds();
    assert_eq!(boxes.lines.len(), 12);
    let around: f32 = boxes.lines.iter().map(|([from, to], _)| from.distance(*to)).sum();
    assert!((around - 4.0 * (high - low).element_sum()).abs() < 1e-5);
    assert_eq!(drawn(&world, NOTHING), Drawing::default());
}

#[test]
fn sleeping_tissue_is_shown_until_it_wakes() {
    let mut world = weightless();
    let (body, _) = block(
        &mut world,
        Sleep {
            speed: 1e-3,
            time: 0.01,
        },
    );
    let sleeping = DebugDrawDefinition {
        sleeping: true,
        ..NOTHING
    };
    assert!(drawn(&world, sleeping).triangles.is_empty());
    for _ in 0..20 {
        world.step(2e-3).expect("a step");
    }
    let it = world.body(body).expect("a body");
    assert_eq!(it.awake_share(), 0.0);
    assert_eq!(drawn(&world, sleeping).triangles.len(), it.surface().len());
    world.body_mut(body).expect("a body").wake();
    assert!(drawn(&world, sleeping).triangles.is_empty());
}

#[test]
fn invalid_lengths_are_refused_and_nothing_is_drawn() {
    let mut world = weightless();
    block(&mut world, AWAKE);
    let good = DebugDrawDefinition::default();
    for (name, definition) in [
        (
            "normal_length",
            DebugDrawDefinition {
                normal_length: -1.0,
                ..good
            },
        ),
        (
            "force_scale",
            DebugDrawDefinition {
                force_scale: f32::NAN,
                ..good
            },
        ),
        (
            "full_strain",
            DebugDrawDefinition {
                full_strain: 0.0,
                ..good
            },
        ),
    ] {
        let mut drawing = Drawing::default();
        match world.debug_draw(&definition, &mut drawing) {
            Err(Error::InvalidArgument(message)) => assert!(message.contains(name), "{message}"),
            other => panic!("{other:?}"),
        }
        assert_eq!(drawing, Drawing::default());
    }
}
