//! What a ray meets and what is nearest to a point, over the bodies of a world.

use glam::Vec3;
use sinew::mesh::Mesh;
use sinew::{BodyDefinition, BodyId, World, WorldDefinition};

fn add(world: &mut World, mesh: &Mesh, by: Vec3) -> BodyId {
    let positions: Vec<Vec3> = mesh.positions.iter().map(|place| *place + by).collect();
    let masses = vec![0.001; positions.len()];
    let surface = mesh.surface().expect("a surface");
    let definition = BodyDefinition {
        positions: &positions,
        masses: sinew::Values::Each(&masses),
        triangles: &surface,
        ..BodyDefinition::default()
    };
    world.create_body(&definition).expect("a body")
}

/// Two boxes of 0.1 m, the first about the origin, the second 0.3 m further along x.
fn boxes() -> (World, [BodyId; 2]) {
    let mesh = Mesh::lattice(0.025, [4; 3]).expect("a lattice");
    let least = mesh.positions.iter().copied().reduce(Vec3::min).expect("nodes");
    let to_middle = -least - 0.05;
    let mut world = World::new(WorldDefinition::default()).expect("a world");
    let ids = [0.0, 0.3].map(|x| add(&mut world, &mesh, to_middle + Vec3::X * x));
    (world, ids)
}

/// What is told of a point agrees with itself.
fn check(world: &World, told: &sinew::SurfaceHit) {
    let body = world.body(told.body).expect("a body");
    let nodes = body.surface()[told.triangle as usize];
    let corners = nodes.map(|node| body.positions()[node as usize]);
    let place: Vec3 = corners
        .iter()
        .zip(told.weights)
        .map(|(corner, weight)| *corner * weight)
        .sum();
    assert!(place.distance(told.position) < 1e-6, "{told:?}");
    assert!(told.weights.iter().all(|&weight| weight >= 0.0));
    assert!((told.weights.iter().sum::<f32>() - 1.0).abs() < 1e-6);
}

#[test]
fn rays_meet_the_first_body() {
    let (world, [near, far]) = boxes();
    for y in [-0.03, 0.0, 0.0125, 0.025] {
        for z in [-0.025, 0.0, 0.011] {
            let from = Vec3::new(-1.0, y, z);
            let told = world
                .cast_ray(from, Vec3::X * 7.0, f32::INFINITY)
                .expect("a ray")
                .expect("a hit");
            check(&world, &told);
            assert_eq!(told.body, near);
            assert!(
                (told.distance - 0.95).abs() < 1e-6 && told.normal.distance(Vec3::NEG_X) < 1e-6,
                "{told:?}"
            );
            assert!(told.position.distance(Vec3::new(-0.05, y, z)) < 1e-6);
            // Backwards the other is first; from between them each is met; too short, or past them, nothing.
            let told = world
                .cast_ray(Vec3::new(1.0, y, z), Vec3::NEG_X, 2.0)
                .expect("a ray")
                .expect("a hit");
            assert_eq!(told.body, far);
            assert!((told.distance - 0.65).abs() < 1e-6);
            assert_eq!(world.cast_ray(from, Vec3::X, 0.9499).expect("a ray"), None);
            assert_eq!(world.cast_ray(from, Vec3::NEG_X, f32::INFINITY).expect("a ray"), None);
            assert_eq!(
                world
                    .cast_ray(from + Vec3::Y * 0.2, Vec3::X, f32::INFINITY)
                    .expect("a ray"),
                None
            );
        }
    }
    // From inside the back of the surface is met.
    let told = world
        .cast_ray(Vec3::new(0.31, 0.01, 0.0), Vec3::Y, 1.0)
        .expect("a ray")
        .expect("a hit");
    assert!(told.body == far && (told.distance - 0.04).abs() < 1e-6 && told.normal.distance(Vec3::Y) < 1e-6);
}

#[test]
fn points_find_the_nearest_body() {
    let (mut world, [near, far]) = boxes();
    for (point, body, distance, position) in [
        (Vec3::new(-0.25, 0.01, 0.02), near, 0.2, Vec3::new(-0.05, 0.01, 0.02)),
        (Vec3::new(0.149, 0.0, 0.0), near, 0.099, Vec3::new(0.05, 0.0, 0.0)),
        (Vec3::new(0.151, 0.0, 0.0), far, 0.099, Vec3::new(0.25, 0.0, 0.0)),
        (Vec3::new(0.38, 0.09, 0.05), far, 0.05, Vec3::new(0.35, 0.05, 0.05)),
        (Vec3::new(0.3, 0.02, -0.01), far, 0.03, Vec3::new(0.3, 0.05, -0.01)),
    ] {
        let told = world
            .nearest_point(point, f32::INFINITY)
            .expect("a point")
            .expect("a body");
        check(&world, &told);
        assert_eq!(told.body, body);
        assert!(
            (told.distance - distance).abs() < 1e-6 && told.position.distance(position) < 1e-6,
            "{told:?}"
        );
        assert!(world.nearest_point(point, distance * 0.999).expect("a point").is_none());
    }
    // Where nodes were put is where they are asked for, and what is destroyed is not found.
    let moved: Vec<Vec3> = world
        .body(near)
        .expect("a body")
        .positions()
        .iter()
        .map(|place| *place + Vec3::Y)
        .collect();
    world
        .body_mut(near)
        .expect("a body")
        .set_positions(&moved)
        .expect("places");
    let told = world
        .nearest_point(Vec3::Y * 2.0, 1.0)
        .expect("a point")
        .expect("a body");
    assert!(told.body == near && (told.distance - 0.95).abs() < 1e-6);
    world.destroy_body(near).expect("a body");
    let told = world
        .nearest_point(Vec3::Y * 2.0, f32::INFINITY)
        .expect("a point")
        .expect("a body");
    assert_eq!(told.body, far);
}

#[test]
fn what_is_asked_wrongly_is_refused() {
    let (world, _) = boxes();
    let ray = |origin, direction, limit| {
        world
            .cast_ray(origin, direction, limit)
            .expect_err("refused")
            .to_string()
    };
    assert!(ray(Vec3::NAN, Vec3::X, 1.0).contains("origin"));
    assert!(ray(Vec3::ZERO, Vec3::INFINITY, 1.0).contains("direction"));
    assert!(ray(Vec3::ZERO, Vec3::ZERO, 1.0).contains("direction is 0"));
    assert!(ray(Vec3::ZERO, Vec3::X, -1.0).contains("max_distance is -1"));
    assert!(ray(Vec3::ZERO, Vec3::X, f32::NAN).contains("max_distance is NaN"));
    let point = |point, limit| world.nearest_point(point, limit).expect_err("refused").to_string();
    assert!(point(Vec3::NAN, 1.0).contains("point"));
    assert!(point(Vec3::ZERO, -1.0).contains("max_distance is -1"));
    let empty = World::new(WorldDefinition::default()).expect("a world");
    assert_eq!(empty.nearest_point(Vec3::ZERO, f32::INFINITY).expect("a point"), None);
}

#[test]
fn what_is_just_as_far_as_is_asked_for_is_found() {
    let mesh = Mesh::block([2.0; 3], [2; 3]).expect("a block");
    let mut world = World::new(WorldDefinition::default()).expect("a world");
    add(&mut world, &mesh, Vec3::ZERO);
    let (x, y) = (mesh.positions.iter()).fold((0.0_f32, 0.0_f32), |most, node| {
        (most.0.max(node.x), most.1.max(node.y))
    });
    let place = Vec3::new(x + 1.0, y - 0.7, 0.3);
    for limit in [1.0, 1.5, 2.0] {
        let ray = world
            .cast_ray(place, Vec3::NEG_X, limit)
            .expect("a ray")
            .expect("a hit");
        assert_eq!(ray.distance, 1.0);
        let near = world.nearest_point(place, limit).expect("a point").expect("a body");
        assert_eq!(near.distance, 1.0);
    }
    let short = 1.0_f32.next_down();
    assert_eq!(world.cast_ray(place, Vec3::NEG_X, short).expect("a ray"), None);
    assert_eq!(world.nearest_point(place, short).expect("a point"), None);
}
