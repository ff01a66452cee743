//! Ray casts and nearest-point queries over the bodies of a world.

use glam::{DVec3, Vec3};
use sinew::cutting::Sweep;
use sinew::mesh::Mesh;
use sinew::{BodyDefinition, BodyId, SurfaceHit, World, WorldDefinition};

use crate::support::tissue::Random;

fn add(world: &mut World, mesh: &Mesh, by: Vec3) -> BodyId {
    let positions: Vec<Vec3> = mesh.positions.iter().map(|position| *position + by).collect();
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

/// Creates two boxes of 0.1 m, the first about the origin, the second 0.3 m further along x.
fn boxes() -> (World, [BodyId; 2]) {
    let mesh = Mesh::lattice(0.025, [4; 3]).expect("a lattice");
    let least = mesh.positions.iter().copied().reduce(Vec3::min).expect("nodes");
    let to_middle = -least - 0.05;
    let mut world = World::new(WorldDefinition::default()).expect("a world");
    let ids = [0.0, 0.3].map(|x| add(&mut world, &mesh, to_middle + Vec3::X * x));
    (world, ids)
}

/// Checks that the fields of a hit are consistent.
fn check(world: &World, hit: &sinew::SurfaceHit) {
    let body = world.body(hit.body).expect("a body");
    let nodes = body.surface()[hit.triangle as usize];
    let corners = nodes.map(|node| body.positions()[node as usize]);
    let position: Vec3 = corners
        .iter()
        .zip(hit.weights)
        .map(|(corner, weight)| *corner * weight)
        .sum();
    assert!(position.distance(hit.position) < 1e-6, "{hit:?}");
    assert!(hit.weights.iter().all(|&weight| weight >= 0.0));
    assert!((hit.weights.iter().sum::<f32>() - 1.0).abs() < 1e-6);
}

#[test]
fn rays_hit_the_first_body() {
    let (world, [near, far]) = boxes();
    for y in [-0.03, 0.0, 0.0125, 0.025] {
        for z in [-0.025, 0.0, 0.011] {
            let from = Vec3::new(-1.0, y, z);
            let hit = world
                .cast_ray(from, Vec3::X * 7.0, f32::INFINITY)
                .expect("a ray")
                .expect("a hit");
            check(&world, &hit);
            assert_eq!(hit.body, near);
            assert!(
                (hit.distance - 0.95).abs() < 1e-6 && hit.normal.distance(Vec3::NEG_X) < 1e-6,
                "{hit:?}"
            );
            assert!(hit.position.distance(Vec3::new(-0.05, y, z)) < 1e-6);
            // Backward, the other box is hit first. Rays that are too short or pass beside the boxes hit nothing.
            let hit = world
                .cast_ray(Vec3::new(1.0, y, z), Vec3::NEG_X, 2.0)
                .expect("a ray")
                .expect("a hit");
            assert_eq!(hit.body, far);
            assert!((hit.distance - 0.65).abs() < 1e-6);
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
    // From inside, the back of the surface is hit.
    let hit = world
        .cast_ray(Vec3::new(0.31, 0.01, 0.0), Vec3::Y, 1.0)
        .expect("a ray")
        .expect("a hit");
    assert!(hit.body == far && (hit.distance - 0.04).abs() < 1e-6 && hit.normal.distance(Vec3::Y) < 1e-6);
}

#[test]
fn nearest_point_queries_return_the_nearest_body() {
    let (mut world, [near, far]) = boxes();
    for (point, body, distance, position) in [
        (Vec3::new(-0.25, 0.01, 0.02), near, 0.2, Vec3::new(-0.05, 0.01, 0.02)),
        (Vec3::new(0.149, 0.0, 0.0), near, 0.099, Vec3::new(0.05, 0.0, 0.0)),
        (Vec3::new(0.151, 0.0, 0.0), far, 0.099, Vec3::new(0.25, 0.0, 0.0)),
        (Vec3::new(0.38, 0.09, 0.05), far, 0.05, Vec3::new(0.35, 0.05, 0.05)),
        (Vec3::new(0.3, 0.02, -0.01), far, 0.03, Vec3::new(0.3, 0.05, -0.01)),
    ] {
        let hit = world
            .nearest_point(point, f32::INFINITY)
            .expect("a point")
            .expect("a body");
        check(&world, &hit);
        assert_eq!(hit.body, body);
        assert!(
            (hit.distance - distance).abs() < 1e-6 && hit.position.distance(position) < 1e-6,
            "{hit:?}"
        );
        assert!(world.nearest_point(point, distance * 0.999).expect("a point").is_none());
    }
    // Queries use positions that were set, and do not return destroyed bodies.
    let moved: Vec<Vec3> = world
        .body(near)
        .expect("a body")
        .positions()
        .iter()
        .map(|node| *node + Vec3::Y)
        .collect();
    world
        .body_mut(near)
        .expect("a body")
        .set_positions(&moved)
        .expect("places");
    let hit = world
        .nearest_point(Vec3::Y * 2.0, 1.0)
        .expect("a point")
        .expect("a body");
    assert!(hit.body == near && (hit.distance - 0.95).abs() < 1e-6);
    world.destroy_body(near).expect("a body");
    let hit = world
        .nearest_point(Vec3::Y * 2.0, f32::INFINITY)
        .expect("a point")
        .expect("a body");
    assert_eq!(hit.body, far);
}

#[test]
fn invalid_queries_are_refused() {
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
fn hits_exactly_at_the_maximum_distance_are_returned() {
    let mesh = Mesh::block([2.0; 3], [2; 3]).expect("a block");
    let mut world = World::new(WorldDefinition::default()).expect("a world");
    add(&mut world, &mesh, Vec3::ZERO);
    let (x, y) = (mesh.positions.iter()).fold((0.0_f32, 0.0_f32), |largest, node| {
        (largest.0.max(node.x), largest.1.max(node.y))
    });
    let position = Vec3::new(x + 1.0, y - 0.7, 0.3);
    for limit in [1.0, 1.5, 2.0] {
        let ray = world
            .cast_ray(position, Vec3::NEG_X, limit)
            .expect("a ray")
            .expect("a hit");
        assert_eq!(ray.distance, 1.0);
        let near = world.nearest_point(position, limit).expect("a point").expect("a body");
        assert_eq!(near.distance, 1.0);
    }
    let short = 1.0_f32.next_down();
    assert_eq!(world.cast_ray(position, Vec3::NEG_X, short).expect("a ray"), None);
    assert_eq!(world.nearest_point(position, short).expect("a point"), None);
}

#[test]
fn a_ray_hits_a_fast_body_at_its_current_positions() {
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
            let positions = world.body(id).expect("a body").positions();
            let lowest = positions
                .iter()
                .fold(f32::INFINITY, |lowest, position| lowest.min(position.y));
            let from = positions[0].with_y(lowest - 1e-3) + Vec3::new(0.013, 0.0, 0.017);
            let ray = world.cast_ray(from, Vec3::Y, 1.0).expect("a ray");
            let near = world.nearest_point(from, 0.05).expect("a point");
            for hit in [ray, near] {
                let hit = hit.unwrap_or_else(|| panic!("nothing at {speed} m/s, step {step}"));
                assert!((hit.distance - 1e-3).abs() < 1e-5, "{hit:?}");
            }
        }
    }
}

/// Returns all triangles of the bodies, in f64.
fn triangles<'a>(world: &'a World, ids: &'a [BodyId]) -> impl Iterator<Item = [DVec3; 3]> + 'a {
    ids.iter().flat_map(|&id| {
        let body = world.body(id).expect("a body");
        let corners = |nodes: &[u32; 3]| nodes.map(|node| body.positions()[node as usize].as_dvec3());
        body.surface().iter().map(corners)
    })
}

/// Returns the distance to the first triangle along a ray, tested one by one (Moeller, Trumbore 1997).
fn first_hit_brute_force(world: &World, ids: &[BodyId], from: Vec3, along: Vec3) -> f64 {
    let (from, direction) = (from.as_dvec3(), along.as_dvec3().normalize());
    let hit = |[a, b, c]: [DVec3; 3]| {
        let normal = direction.cross(c - a);
        let determinant = (b - a).dot(normal);
        let u = (from - a).dot(normal) / determinant;
        let other = (from - a).cross(b - a);
        let v = direction.dot(other) / determinant;
        let distance = (c - a).dot(other) / determinant;
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance >= 0.0).then_some(distance)
    };
    triangles(world, ids).filter_map(hit).fold(f64::INFINITY, f64::min)
}

/// Returns the distance to the nearest triangle, tested one by one: above its face, or to one of its edges.
fn nearest_distance_brute_force(world: &World, ids: &[BodyId], point: Vec3) -> f64 {
    let point = point.as_dvec3();
    let distance = |corners: [DVec3; 3]| {
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let sides = [0, 1, 2].map(|side| [corners[side], corners[(side + 1) % 3]]);
        let is_above = sides
            .iter()
            .all(|[p, q]| normal.dot((*q - *p).cross(point - *p)) >= 0.0);
        let to_edges = sides.map(|[p, q]| {
            let along = (point - p).dot(q - p) / (q - p).length_squared();
            point.distance(p.lerp(q, along.clamp(0.0, 1.0)))
        });
        let to_edges = to_edges.into_iter().fold(f64::INFINITY, f64::min);
        if is_above && normal != DVec3::ZERO {
            to_edges.min(normal.dot(point - a).abs())
        } else {
            to_edges
        }
    };
    triangles(world, ids).map(distance).fold(f64::INFINITY, f64::min)
}

/// Checks random queries against brute force, on several threads at once.
fn check_queries(world: &World, ids: &[BodyId], random: &mut Random, context: &str) {
    let centre = triangles(world, ids).map(|[a, ..]| a).sum::<DVec3>() / triangles(world, ids).count() as f64;
    let queries: Vec<(Vec3, Vec3)> = (0..60)
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
        queries.iter().map(answer).collect()
    };
    let thread_answers = std::thread::scope(|scope| {
        let threads = [0; 3].map(|_| scope.spawn(|| answers(world)));
        threads.map(|thread| thread.join().expect("answers"))
    });
    assert!(
        thread_answers[0] == thread_answers[1] && thread_answers[0] == thread_answers[2],
        "threads differ {context}"
    );
    let mut hits = 0;
    for (&(from, along), [ray, near]) in queries.iter().zip(&thread_answers[0]) {
        for (hit, expected) in [
            (ray, first_hit_brute_force(world, ids, from, along)),
            (near, nearest_distance_brute_force(world, ids, from)),
        ] {
            match hit {
                Some(hit) => {
                    check(world, hit);
                    assert!(
                        (f64::from(hit.distance) - expected).abs() < 1e-6,
                        "{context}: {hit:?}, not {expected} m"
                    );
                }
                None => assert!(expected > 1.0 - 1e-6, "{context}: nothing, not {expected} m"),
            }
        }
        hits += usize::from(ray.is_some());
    }
    assert!(hits > 10, "{hits} rays hit {context}");
}

#[test]
fn queries_match_brute_force() {
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
    let block_positions: Vec<Vec3> = block
        .positions
        .iter()
        .map(|position| *position + 0.09 * Vec3::Y)
        .collect();
    let block = BodyDefinition {
        positions: &block_positions,
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
                let nodes = world.body(id).expect("a body").positions();
                let middle = nodes.iter().sum::<Vec3>() / nodes.len() as f32;
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
            let old_positions: Vec<Vec3> = world.body(block).expect("a body").positions().to_vec();
            let moved: Vec<Vec3> = old_positions
                .iter()
                .map(|position| *position + 0.02 * Vec3::Z)
                .collect();
            world
                .body_mut(block)
                .and_then(|body| body.set_positions(&moved))
                .expect("places");
        }
        if step % 3 == 0 {
            check_queries(&world, &ids, &mut random, "in motion");
        }
    }
    let loaded = World::load(&world.save().expect("bytes"), 1, None).expect("a world");
    check_queries(&loaded, &ids, &mut random, "from bytes");
}

#[test]
fn equally_near_triangles_resolve_to_the_lowest_index() {
    let (world, ids) = boxes();
    for id in ids {
        let body = world.body(id).expect("a body");
        let middle = body.positions().iter().sum::<Vec3>() / body.node_count() as f32;
        for (node, &position) in (0..).zip(body.positions()) {
            let from = position - middle;
            if from.abs().min_element() < 0.049 {
                continue;
            }
            // All triangles around a corner of the box are equally far from a point beyond that corner.
            let first = body.surface().iter().position(|corners| corners.contains(&node));
            let hit = world
                .nearest_point(position + 0.2 * from, 1.0)
                .expect("a point")
                .expect("a body");
            assert_eq!((hit.body, Some(hit.triangle as usize)), (id, first));
        }
    }
}
