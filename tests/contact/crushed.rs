//! Soft solids that crush each other until they fold.

use glam::{DVec3, EulerRot, Quat, Vec3};
use sinew::mesh::Mesh;
use sinew::{BodyContact, BodyDefinition, Material, Model, Shape, ToolDefinition, Values, World, WorldDefinition};

use crate::support::bodies::Random;
use crate::support::crossings::crossings;

/// Six blocks, each askew, fall onto each other nearly as fast as sound goes in them: their corners fold through themselves, and pass no other.
#[test]
fn what_is_crushed_passes_nothing() {
    nothing_passes(1.5, 3);
}

#[test]
#[ignore = "long"]
fn what_is_crushed_passes_nothing_in_the_other_cases() {
    for (speed, seed) in [(0.7, 4), (1.0, 1), (1.5, 2), (1.5, 9), (1.5, 16), (2.0, 3), (2.0, 14)] {
        nothing_passes(speed, seed);
    }
}

fn nothing_passes(speed: f32, seed: u64) {
    let mut random = Random::new(seed);
    let mut world = World::new(WorldDefinition::default()).expect("a world");
    let ground = ToolDefinition {
        friction: 0.3,
        ..ToolDefinition::new(Shape::Plane)
    };
    world.create_tool(&ground).expect("the ground");
    let block = Mesh::block([0.06; 3], [3; 3]).expect("a block");
    for place in 0..6 {
        let mut angle = || 3.0 * random.signed();
        let turn = Quat::from_euler(EulerRot::XYZ, angle(), angle(), angle());
        let mut aside = || 0.01 * random.signed();
        let middle = Vec3::new(aside(), 0.12 + 0.13 * place as f32, aside());
        let positions: Vec<Vec3> = block.positions.iter().map(|&at| middle + turn * at).collect();
        let definition = BodyDefinition {
            positions: &positions,
            material: Some(Material {
                model: Model::Tetrahedra,
                young_modulus: 1e4,
                poisson_ratio: 0.3,
                density: 1000.0,
                ..Material::default()
            }),
            node_dampings: Values::Uniform(1e-3),
            contact: BodyContact {
                with_bodies: true,
                thickness: 5e-4,
                friction: 0.3,
                ..BodyContact::NOTHING
            },
            ..BodyDefinition::of(&block)
        };
        let body = world.create_body(&definition).expect("a block");
        let velocities = vec![-speed * Vec3::Y; positions.len()];
        let body_mut = world.body_mut(body).expect("the block");
        body_mut.set_velocities(&velocities).expect("velocities");
    }
    let mut most_pressed = 1.0_f64;
    for frame in 0..20 {
        let report = world.step(1.0 / 60.0).expect("a step");
        let (mut places, mut surfaces): (Vec<DVec3>, Vec<Vec<[u32; 3]>>) = Default::default();
        for body in world.bodies() {
            let first = places.len() as u32;
            places.extend(body.positions().iter().map(|place| place.as_dvec3()));
            surfaces.push(
                body.surface()
                    .iter()
                    .map(|corners| corners.map(|node| first + node))
                    .collect(),
            );
        }
        let volume = |surface: &[[u32; 3]]| {
            let of = |&[a, b, c]: &[u32; 3]| places[a as usize].dot(places[b as usize].cross(places[c as usize]));
            surface.iter().map(of).sum::<f64>() / 6.0
        };
        let what = format!("{speed} m/s, {seed}, frame {frame}");
        for (number, own) in surfaces.iter().enumerate() {
            most_pressed = most_pressed.min(volume(own) / 0.06_f64.powi(3));
            for (_, other) in surfaces.iter().enumerate().filter(|(other, _)| *other != number) {
                assert_eq!(crossings(&places, own, other), 0, "{what}");
            }
        }
        assert_eq!(report.crossings, 0, "{what}");
    }
    assert!(most_pressed < 0.9, "they were not crushed: {most_pressed}");
}

/// Two cubes of a few nodes, thrown at each other: what their contacts give in a substep bends faces by far more than keeps them apart.
#[test]
fn cubes_without_a_thickness_pass_nothing() {
    let cube = Mesh::block([0.36; 3], [3; 3]).expect("a cube");
    for (young_modulus, speed) in [(2e4, 3.0), (2e4, 5.0), (2e4, 10.0), (5e4, 7.0), (5e4, 10.0), (2e3, 3.0)] {
        let mut world = World::new(WorldDefinition {
            gravity: Vec3::ZERO,
            ..WorldDefinition::default()
        })
        .expect("a world");
        for side in [-1.0_f32, 1.0] {
            let beside = side * Vec3::new(0.25, 0.01, 0.0065);
            let positions: Vec<Vec3> = cube.positions.iter().map(|&at| at + beside).collect();
            let definition = BodyDefinition {
                positions: &positions,
                material: Some(Material {
                    model: Model::Tetrahedra,
                    young_modulus,
                    poisson_ratio: 0.3,
                    density: 125.0,
                    ..Material::default()
                }),
                contact: BodyContact {
                    with_bodies: true,
                    friction: 0.5,
                    ..BodyContact::NOTHING
                },
                ..BodyDefinition::of(&cube)
            };
            let body = world.create_body(&definition).expect("a cube");
            let velocities = vec![-side * speed * Vec3::X; positions.len()];
            let body_mut = world.body_mut(body).expect("the cube");
            body_mut.set_velocities(&velocities).expect("velocities");
        }
        let mut closest = f32::INFINITY;
        for frame in 0..60 {
            let report = world.step(1.0 / 60.0).expect("a step");
            assert_eq!(report.crossings, 0, "{young_modulus} Pa, {speed} m/s, frame {frame}");
            let middles: Vec<f32> = world
                .bodies()
                .map(|body| body.positions().iter().map(|at| at.x).sum())
                .collect();
            closest = closest.min((middles[1] - middles[0]) / cube.positions.len() as f32);
        }
        assert!(closest < 0.36, "they did not meet: {closest}");
    }
}
