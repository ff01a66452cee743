//! What a ray meets and what is nearest to a point, over the bodies of a world.

use glam::{DVec3, Vec3};
use sinew::cutting::Sweep;
use sinew::mesh::Mesh;
use sinew::{BodyDefinition, BodyId, SurfaceHit, World, WorldDefinition};

use crate::support::tissue::Random;

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

#[test]
fn a_ray_finds_a_body_where_it_is_drawn_however_fast_it_moves() {
    let mesh = Mesh::lattice(0.05, [2; 3]).expect("a lattice");
    for speed in [0.1, 1.0, 2.0, 4.0, 10.0] {
        let mut world = World::new(WorldDefinition {
            gravity: Vec3::ZERO,
            ..WorldDefinition::default()
        })
        .expect("a world");
        let id = add(&mut world, &mesh, Vec3::ZERO);
        let velocities = vec![Vec3::NEG_Y * speed; mesh.positions.len()];
        let body = world.body_mut(id).expect("a body");
        body.set_velocities(&velocities).expect("velocities");
        for step in 0..100 {
            world.step(1.0 / 60.0).expect("a step");
            let places = world.body(id).expect("a body").positions();
            let lowest = places.iter().fold(f32::INFINITY, |lowest, place| lowest.min(place.y));
            let from = places[0].with_y(lowest - 1e-3) + Vec3::new(0.013, 0.0, 0.017);
            let ray = world.cast_ray(from, Vec3::Y, 1.0).expect("a ray");
            let near = world.nearest_point(from, 0.05).expect("a point");
            for told in [ray, near] {
                let told = told.unwrap_or_else(|| panic!("nothing at {speed} m/s, step {step}"));
                assert!((told.distance - 1e-3).abs() < 1e-5, "{told:?}");
            }
        }
    }
}

/// All triangles of the bodies, in f64.
fn triangles<'a>(world: &'a World, ids: &'a [BodyId]) -> impl Iterator<Item = [DVec3; 3]> + 'a {
    ids.iter().flat_map(|&id| {
        let body = world.body(id).expect("a body");
        let corners = |nodes: &[u32; 3]| nodes.map(|node| body.positions()[node as usize].as_dvec3());
        body.surface().iter().map(corners)
    })
}

/// How far along a ray the first triangle is, by looking at each (Moeller, Trumbore 1997).
fn first_of_each(world: &World, ids: &[BodyId], from: Vec3, along: Vec3) -> f64 {
    let (from, way) = (from.as_dvec3(), along.as_dvec3().normalize());
    let hit = |[a, b, c]: [DVec3; 3]| {
        let across = way.cross(c - a);
        let determinant = (b - a).dot(across);
        let u = (from - a).dot(across) / determinant;
        let other = (from - a).cross(b - a);
        let v = way.dot(other) / determinant;
        let distance = (c - a).dot(other) / determinant;
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance >= 0.0).then_some(distance)
    };
    triangles(world, ids).filter_map(hit).fold(f64::INFINITY, f64::min)
}

/// How far the nearest triangle is, by looking at each: above its face, or beside one of its edges.
fn nearest_of_each(world: &World, ids: &[BodyId], point: Vec3) -> f64 {
    let point = point.as_dvec3();
    let distance = |corners: [DVec3; 3]| {
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let sides = [0, 1, 2].map(|side| [corners[side], corners[(side + 1) % 3]]);
        let is_above = sides
            .iter()
            .all(|[p, q]| normal.dot((*q - *p).cross(point - *p)) >= 0.0);
        let beside = sides.map(|[p, q]| {
            let along = (point - p).dot(q - p) / (q - p).length_squared();
            point.distance(p.lerp(q, along.clamp(0.0, 1.0)))
        });
        let beside = beside.into_iter().fold(f64::INFINITY, f64::min);
        if is_above && normal != DVec3::ZERO {
            beside.min(normal.dot(point - a).abs())
        } else {
            beside
        }
    };
    triangles(world, ids).map(distance).fold(f64::INFINITY, f64::min)
}

/// Asks about these places: all answers are those of looking at each triangle, on any number of threads at once.
fn check_queries(world: &World, ids: &[BodyId], random: &mut Random, when: &str) {
    let centre = triangles(world, ids).map(|[a, ..]| a).sum::<DVec3>() / triangles(world, ids).count() as f64;
    let asked: Vec<(Vec3, Vec3)> = (0..60)
        .map(|_| {
            let from = centre.as_vec3() + 0.3 * random.vector();
            let target = centre.as_vec3() + 0.1 * random.vector();
            (from, target - from)
        })
        .collect();
    let answers = |world: &World| -> Vec<[Option<SurfaceHit>; 2]> {
        let answer = |&(from, along): &(Vec3, Vec3)| {
            [
                world.cast_ray(from, along, 1.0).expect("a ray"),
                world.nearest_point(from, 1.0).expect("a point"),
            ]
        };
        asked.iter().map(answer).collect()
    };
    let told = std::thread::scope(|scope| {
        let threads = [0; 3].map(|_| scope.spawn(|| answers(world)));
        threads.map(|thread| thread.join().expect("answers"))
    });
    assert!(told[0] == told[1] && told[0] == told[2], "threads differ {when}");
    let mut hits = 0;
    for (&(from, along), [ray, near]) in asked.iter().zip(&told[0]) {
        for (told, expected) in [
            (ray, first_of_each(world, ids, from, along)),
            (near, nearest_of_each(world, ids, from)),
        ] {
            match told {
                Some(told) => {
                    check(world, told);
                    assert!(
                        (f64::from(told.distance) - expected).abs() < 1e-6,
                        "{when}: {told:?}, not {expected} m"
                    );
                }
                None => assert!(expected > 1.0 - 1e-6, "{when}: nothing, not {expected} m"),
            }
        }
        hits += usize::from(ray.is_some());
    }
    assert!(hits > 10, "{hits} rays hit {when}");
}

#[test]
fn queries_answer_as_if_each_triangle_was_looked_at() {
    let mut world = World::new(WorldDefinition::default()).expect("a world");
    let cloth = Mesh::cloth([0.2, 0.2], [24, 24]).expect("a cloth");
    let sheet = BodyDefinition {
        masses: sinew::Values::Uniform(1e-4),
        stiffnesses: sinew::Values::Uniform(20.0),
        node_dampings: sinew::Values::Uniform(1e-4),
        spare_nodes: 2000,
        ..BodyDefinition::of(&cloth)
    };
    let sheet = world.create_body(&sheet).expect("a body");
    let corners = [0, 24, 24 * 25, 25 * 25 - 1];
    for corner in corners {
        world.body_mut(sheet).and_then(|body| body.pin(corner)).expect("a node");
    }
    let block = Mesh::block([0.08; 3], [4; 3]).expect("a block");
    let places: Vec<Vec3> = block.positions.iter().map(|place| *place + 0.09 * Vec3::Y).collect();
    let block = BodyDefinition {
        positions: &places,
        tetrahedra: &block.tetrahedra,
        masses: sinew::Values::Uniform(1e-3),
        stiffnesses: sinew::Values::Uniform(50.0),
        spare_nodes: 2000,
        ..BodyDefinition::default()
    };
    let block = world.create_body(&block).expect("a body");
    let ids = [sheet, block];
    let mut random = Random::new(5);
    for step in 0..24 {
        world.step(5e-3).expect("a step");
        if step % 6 == 2 {
            let x = 0.03 * (step as f32 / 12.0 - 1.0);
            for id in ids {
                let places = world.body(id).expect("a body").positions();
                let middle = places.iter().sum::<Vec3>() / places.len() as f32;
                let edge = |z: f32| [-0.05, 0.05].map(|y| middle + Vec3::new(x, y, z));
                let sweep = Sweep {
                    start: edge(-0.06),
                    end: edge(0.015),
                };
                let report = world.cut(id, &sweep).expect("a cut");
                assert!(report.new_triangles > 0, "{report:?}");
            }
            check_queries(&world, &ids, &mut random, "after a cut");
        }
        if step == 15 {
            let places: Vec<Vec3> = world.body(block).expect("a body").positions().to_vec();
            let moved: Vec<Vec3> = places.iter().map(|place| *place + 0.02 * Vec3::Z).collect();
            world
                .body_mut(block)
                .and_then(|body| body.set_positions(&moved))
                .expect("places");
        }
        if step % 3 == 0 {
            check_queries(&world, &ids, &mut random, "in motion");
        }
    }
    let again = World::load(&world.save().expect("bytes"), 1, None).expect("a world");
    check_queries(&again, &ids, &mut random, "from bytes");
}

#[test]
fn of_what_is_as_near_the_lowest_triangle_is_told() {
    let (world, ids) = boxes();
    for id in ids {
        let body = world.body(id).expect("a body");
        let middle = body.positions().iter().sum::<Vec3>() / body.node_count() as f32;
        for (node, &place) in (0..).zip(body.positions()) {
            let from = place - middle;
            if from.abs().min_element() < 0.049 {
                continue;
            }
            // Beyond a corner of the box, all triangles about it are as far.
            let first = body.surface().iter().position(|corners| corners.contains(&node));
            let told = world
                .nearest_point(place + 0.2 * from, 1.0)
                .expect("a point")
                .expect("a body");
            assert_eq!((told.body, Some(told.triangle as usize)), (id, first));
        }
    }
}
