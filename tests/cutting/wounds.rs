//! Many cuts in a hanging and swinging sheet.

use glam::{Vec2, Vec3, vec2};
use sinew::cutting::Sweep;
use sinew::{BodyDefinition, Solver, Storage, Values, World, WorldDefinition};

use super::sheet::unstructured;
use crate::support::random::Random;

/// A sheet of `n` x `n` cells that hangs by its upper side.
fn hanging(n: usize, threads: u32, storage: Storage, solver: Solver) -> (World, sinew::BodyId) {
    let (rest, cells) = unstructured(n, 9);
    let positions: Vec<Vec3> = rest.iter().map(|position| 0.01 * *position).collect();
    let mut world = World::new(WorldDefinition {
        thread_count: threads,
        ..Default::default()
    })
    .unwrap();
    let body = world
        .create_body(&BodyDefinition {
            positions: &positions,
            masses: Values::Uniform(1e-4),
            node_dampings: Values::Uniform(1e-3),
            spring_dampings: Values::Uniform(2e-3),
            triangles: &cells,
            stiffnesses: Values::Uniform(50.0),
            springs_per_node: if storage == Storage::FastLink { 40 } else { 0 },
            spare_nodes: 40_000,
            storage,
            solver,
            ..Default::default()
        })
        .unwrap();
    for node in (0..positions.len()).filter(|&node| rest[node].y == n as f32) {
        world.body_mut(body).unwrap().pin(node as u32).unwrap();
    }
    (world, body)
}

/// Returns a blade across the sheet at a point of its rest shape.
fn blade(at: Vec2) -> [Vec3; 2] {
    [-1.0, 1.0].map(|z| at.extend(z))
}

#[test]
fn three_hundred_cuts_of_a_swinging_sheet() {
    cuts_of_a_swinging_sheet(300);
}

#[test]
#[ignore = "long"]
fn a_thousand_cuts_of_a_swinging_sheet() {
    cuts_of_a_swinging_sheet(1000);
}

fn cuts_of_a_swinging_sheet(cuts: usize) {
    let (mut world, body) = hanging(100, 2, Storage::Packed, Solver::Verlet);
    let mut random = Random(7);
    let count = world.body(body).unwrap().node_count();
    let first = world.step(2e-3).unwrap().stable_substep;
    let (mut parted, mut last) = (0, first);
    for cut in 0..cuts {
        let from = vec2(random.between(-0.05, 1.05), random.between(-0.6, 1.0));
        let angle = random.between(0.0, std::f32::consts::TAU);
        let to = from + random.between(0.01, 0.08) * Vec2::from_angle(angle);
        let sweep = Sweep {
            start: blade(from),
            end: blade(to),
        };
        parted += world.cut(body, &sweep).unwrap().pieces_parted;
        if cut % 10 == 0 {
            let report = world.step(2e-3).unwrap();
            assert_eq!(report.bodies_restored, 0);
            last = report.stable_substep;
        }
    }
    let it = world.body(body).unwrap();
    assert!(it.positions().iter().all(|position| position.is_finite()));
    assert_eq!(it.pieces().unwrap().count, 1 + parted);
    assert!(last > 0.5 * first, "the stable substep was {first}, and is {last} s");
    let added = it.node_count() - count;
    assert!((cuts..40 * cuts).contains(&added), "{added} nodes came");
    // Each new node is reported with its sources.
    let changes = it.changes_since(0).unwrap();
    assert_eq!(changes.nodes.len(), added);
    for (new, node) in changes.nodes.iter().zip(count as u32..) {
        assert_eq!(new.node, node);
        assert!(new.sources.iter().all(|&source| source < node));
        assert!((new.weights.iter().sum::<f32>() - 1.0).abs() < 1e-6);
    }
}

#[test]
fn cuts_are_the_same_for_any_number_of_threads() {
    cuts_are_the_same_for_any_number_of_threads_of(Solver::Verlet);
}

#[test]
#[ignore = "long"]
fn cuts_are_the_same_for_any_number_of_threads_with_implicit() {
    cuts_are_the_same_for_any_number_of_threads_of(Solver::Implicit);
}

fn cuts_are_the_same_for_any_number_of_threads_of(solver: Solver) {
    let mut hashes = Vec::new();
    for threads in [1, 2] {
        let (mut world, body) = hanging(100, threads, Storage::Packed, solver);
        for step in 0..6 {
            let x = 0.1 * step as f32;
            let sweep = Sweep {
                start: blade(vec2(x, 0.5)),
                end: blade(vec2(x + 0.1, 0.5 + 0.03 * step as f32)),
            };
            assert!(world.cut(body, &sweep).unwrap().length > 0.08);
            world.step(2e-3).unwrap();
        }
        hashes.push(world.state_hash());
    }
    assert_eq!(hashes[0], hashes[1], "{solver:?}");
}

#[test]
fn cuts_are_the_same_in_any_storage() {
    let mut ends = Vec::new();
    for storage in [
        Storage::Packed,
        Storage::Efficient,
        Storage::FastLink,
        Storage::DynamicBulk,
    ] {
        let (mut world, body) = hanging(20, 1, storage, Solver::Verlet);
        let sweep = Sweep {
            start: blade(vec2(-0.02, 0.113)),
            end: blade(vec2(0.11, 0.094)),
        };
        world.cut(body, &sweep).unwrap();
        // Again across the same springs, which have a part of their damping left.
        for (from, to) in [((0.03, 0.12), (0.09, 0.085)), ((0.02, 0.09), (0.1, 0.118))] {
            let sweep = Sweep {
                start: blade(from.into()),
                end: blade(to.into()),
            };
            world.cut(body, &sweep).unwrap();
        }
        for _ in 0..100 {
            world.step(2e-3).unwrap();
        }
        ends.push(world.body(body).unwrap().positions().to_vec());
    }
    assert!(ends[0].iter().all(|position| position.is_finite()));
    for end in &ends[1..] {
        for (node, (a, b)) in ends[0].iter().zip(end).enumerate() {
            assert!(a.distance(*b) < 2e-5, "node {node}: {a} and {b}");
        }
    }
}

#[test]
fn a_renderer_that_follows_change_lists_has_the_surface() {
    let (mut world, body) = hanging(20, 1, Storage::Packed, Solver::Verlet);
    let mut random = Random(2);
    let it = world.body(body).unwrap();
    // The renderer's data: a rest position for each node, and the triangles.
    let mut textures: Vec<Vec3> = it.positions().to_vec();
    let mut triangles = it.surface().to_vec();
    let area = |textures: &[Vec3], triangles: &[[u32; 3]]| -> f64 {
        let triangle_area = |&[a, b, c]: &[u32; 3]| {
            let [a, b, c] = [a, b, c].map(|node| textures[node as usize].as_dvec3());
            0.5 * (b - a).cross(c - a).length()
        };
        triangles.iter().map(triangle_area).sum()
    };
    let whole = area(&textures, &triangles);
    let mut version = 0;
    for cut in 0..60 {
        let from = vec2(random.between(-0.01, 0.21), random.between(-0.01, 0.21));
        let to = vec2(random.between(-0.01, 0.21), random.between(-0.01, 0.21));
        let sweep = Sweep {
            start: blade(from),
            end: blade(to),
        };
        world.cut(body, &sweep).unwrap();
        world.step(1e-3).unwrap();
        if cut % 3 == 2 {
            let it = world.body(body).unwrap();
            let changes = it.changes_since(version).unwrap();
            for new in changes.nodes {
                assert_eq!(new.node as usize, textures.len());
                let position = (0..3).map(|k| new.weights[k] * textures[new.sources[k] as usize]);
                textures.push(position.sum());
            }
            triangles.resize(it.surface().len(), [0; 3]);
            for &triangle in changes.triangles {
                triangles[triangle as usize] = it.surface()[triangle as usize];
            }
            version = changes.version;
            assert_eq!(triangles, it.surface());
            assert_eq!(textures.len(), it.node_count());
            let now = area(&textures, &triangles);
            assert!(
                (now / whole - 1.0).abs() < 1e-5,
                "drawn with {now} of {whole} m² of the texture"
            );
            // Removed springs no longer exist.
            let pairs = it.spring_pairs().unwrap();
            let is_there = |spring: &&[u32; 2]| {
                pairs
                    .binary_search(&[spring[0].min(spring[1]), spring[0].max(spring[1])])
                    .is_ok()
            };
            assert_eq!(changes.removed_springs.iter().filter(is_there).count(), 0);
        }
    }
    assert!(version > 20);
    assert!(world.body(body).unwrap().changes_since(version + 1).is_err());
}
